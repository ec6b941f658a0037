"""What a study recommends: the fastest setting that suffices, by times within their spread."""

from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from tests.work_precision.made import errors_of, made_row, made_study


def row(
    backend: str,
    error: float | None,
    seconds: float,
    evaluations: int = 6,
    spread: float | None = None,
) -> Any:
    errors = {} if error is None else {"angle": error, "energy": 0.0}
    return made_row(backend, errors, seconds, evaluations, spread)


def recommended(rows: list[Any]) -> list[str | None]:
    """Return the methods for 1 %, 0.1 % and 0.01 %; None where no setting reaches that."""
    told = made_study(rows).to_json()["recommendations"]
    assert [advice["wanted"] for advice in told] == [1e-2, 1e-3, 1e-4]
    return [advice["backend"] for advice in told]


def test_the_fastest_sufficient_setting_is_recommended() -> None:
    rows = [
        row("slow", 1e-9, 3.0),
        row("rough", 5e-3, 0.1),
        row("good", 5e-4, 1.0),
        row("bad", 2.0, 0.01),
        row("broken", None, 0.001),
    ]
    assert recommended(rows) == ["rough", "good", "slow"]
    sentences = made_study(rows).recommendations
    assert sentences[1] == "for 0.1 %: good with rtol 1, 1 s, error 5.0e-04"
    assert made_study(rows[1:2]).recommendations[1] == "for 0.1 %: no setting reached it"
    assert recommended([]) == [None, None, None]


def test_equal_times_prefer_the_first_setting() -> None:
    rows = [row("default", 1e-9, 1.05), row("same", 1e-9, 1.0), row("other", 1e-9, 1.2)]
    assert set(recommended(rows)) == {"default"}


def test_times_within_their_spread_are_ranked_by_evaluations() -> None:
    rows = [row("fast", 1e-9, 1.0, 90, 0.02), row("few", 1e-9, 1.3, 40, 0.4)]
    assert recommended(rows)[0] == "few"
    sentence = made_study(rows).recommendations[0]
    assert sentence.endswith("; of 2 as fast, the fewest evaluations")
    # They differ by more than the spread of both.
    apart = [row("fast", 1e-9, 1.0, 90, 0.02), row("few", 1e-9, 1.3, 40, 0.2)]
    assert recommended(apart)[0] == "fast"
    # Of a single run the spread is not known: 10 %.
    single = [row("fast", 1e-9, 1.0, 90), row("few", 1e-9, 1.05, 40), row("slow", 1e-9, 1.2, 1)]
    assert recommended(single)[0] == "few"


@given(
    st.lists(
        st.tuples(st.floats(0.1, 2.0), st.integers(1, 5), st.none() | st.floats(0.0, 1.0)),
        min_size=1,
    )
)
def test_nothing_beats_what_is_recommended(drawn: list[tuple[float, int, float | None]]) -> None:
    rows = [row(str(i), 1e-9, *values) for i, values in enumerate(drawn)]
    found = recommended(rows)[0]
    assert found is not None
    best = rows[int(found)]
    for other in rows:
        least = 0.1 * max(other.wall_seconds, best.wall_seconds)
        spread = max(other.wall_spread or 0.0, best.wall_spread or 0.0, least)
        if other.wall_seconds < best.wall_seconds - spread:
            # Then another one, as fast as both, has times with a larger spread.
            assert best.rhs_evaluations <= other.rhs_evaluations


def test_nothing_is_recommended_below_the_reference_uncertainty() -> None:
    study = made_study([row("events", 1e-6, 1.0)], {"angle": 2e-3})
    found = [advice["backend"] for advice in study.to_json()["recommendations"]]
    assert found == ["events", None, None]
    wanted = "for 0.01 %: unknown, the reference uncertainty is 2.0e-03"
    assert study.recommendations[2] == wanted


def test_errors_below_the_reference_uncertainty_are_marked(tmp_path: Path) -> None:
    rows = [row("a", 2e-6, 1.0), row("b", 5e-7, 1.0), row("c", None, 1.0)]
    rows[0].errors.update(errors_of({"energy": 5e-10}))
    rows[1].errors.update(errors_of({"energy": 5e-9}))
    study = made_study(rows, {"angle": 1e-6, "energy": 1e-9})
    wanted = [["energy"], ["error", "angle"], []]
    assert [line["below_uncertainty"] for line in study.to_json()["settings"]] == wanted
    assert [text.split() for text in study.dataset["below_uncertainty"].values] == wanted
    cells = [line.split() for line in study.summary().splitlines() if "rtol 1 " in line]
    assert [cells[0][3:6], cells[1][3:6]] == [
        ["2.0e-06", "2.0e-06", "5.0e-10*"],
        ["5.0e-07*", "5.0e-07*", "5.0e-09"],
    ]
    for name in ("a.csv", "a.h5"):
        study.save(tmp_path / name)
        page = fs.report(tmp_path / name, tmp_path / "a.html").read_text(encoding="utf-8")
        # Two stars of the second row, one of the first, and one that explains them.
        assert page.count("5.0e\N{MINUS SIGN}07*") == 2
        assert page.count("5.0e\N{MINUS SIGN}10*") == 1
        assert page.count("5.0e\N{MINUS SIGN}09*") == 0
        assert "* below the reference uncertainty" in page
    other = made_study(rows, {})
    assert [line["below_uncertainty"] for line in other.to_json()["settings"]] == [[], [], []]

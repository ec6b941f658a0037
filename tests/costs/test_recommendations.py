"""What a study recommends: the cheapest setting that suffices."""

import random
import re
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.costs.made import made_row, made_table, said_of
from tests.support.scenarios import ROOT, pulley

PERCENT = (1.0, 0.1, 0.01)
BY_WORK = "; the fewest evaluations of 2 settings whose times differ by chance"
ONCE = "that are so accurate (each was timed once: times are not compared)"


def one_by_one(sentences: list[str]) -> list[str]:
    """Return a sentence for each error."""
    pairs = (sentence.removeprefix("for ").split(": ", 1) for sentence in sentences)
    return [f"for {goal}: {text}" for goals, text in pairs for goal in re.split(", | and ", goals)]


def recommended(path: Path, rows: list[dict[str, Any]], uncertainty: Any = None) -> list[str]:
    """Return the methods for 1 %, 0.1 % and 0.01 %; else why there is none."""
    said = one_by_one(said_of(made_table(path / "a.csv", rows, uncertainty)))
    goals, methods = zip(*(sentence.split(": ", 1) for sentence in said), strict=True)
    assert goals == tuple(f"for {percent:g} %" for percent in PERCENT)
    return [text.split(" with ")[0] for text in methods]


def test_the_fastest_sufficient_setting_is_recommended(tmp_path: Path) -> None:
    rows = [
        made_row("slow", 1e-9, 3.0),
        made_row("rough", 5e-3, 0.1, evaluations=900),
        made_row("good", 5e-4, 1.0),
        made_row("bad", 2.0, 0.01),
        made_row("broken", None, 0.001),
    ]
    assert recommended(tmp_path, rows) == ["rough", "good", "slow"]
    said = said_of(made_table(tmp_path / "b.csv", rows))
    assert said[1] == "for 0.1 %: good with rtol 1, 1 s, error 5.0e-04"
    none = "no setting reached it"
    assert recommended(tmp_path, rows[1:2]) == ["rough", none, none]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_beats_what_is_recommended(seed: int, tmp_path: Path) -> None:
    drawn = random.Random(seed)
    rows = [
        made_row(str(i), 10.0 ** drawn.uniform(-5, 0), drawn.uniform(0.1, 2.0), repeats=2 + i % 2)
        for i in range(30)
    ]
    for percent, found in zip(PERCENT, recommended(tmp_path, rows), strict=True):
        enough = [row for row in rows if row["error [1]"] <= percent / 100.0]
        assert rows[int(found)] == min(enough, key=lambda row: row["wall_seconds [s]"])


def test_short_runs_that_were_timed_once_are_compared_by_evaluations(tmp_path: Path) -> None:
    rows = [made_row("fast", 1e-9, 0.1, 90, repeats=1), made_row("few", 1e-9, 0.2, 40, repeats=1)]
    sentence = said_of(made_table(tmp_path / "a.csv", rows))[0]
    assert sentence.startswith("for 1 %, 0.1 % and 0.01 %: few with rtol 1, 0.2 s")
    assert sentence.endswith(f"; the fewest evaluations of 2 settings {ONCE}")
    # There is nothing to compare a single one with.
    assert said_of(made_table(tmp_path / "b.csv", rows[:1]))[0].endswith("error 1.0e-09")
    # A run of more than a second is never repeated; its time is known well enough.
    long = [made_row("fast", 1e-9, 1.1, 90, repeats=1), made_row("few", 1e-9, 2.0, 40, repeats=1)]
    assert recommended(tmp_path, long)[0] == "fast"


@pytest.mark.parametrize("errors", [(1e-9,) * 3, (2e-3, 1e-9, 5e-4), (1e-9, 2e-4, 5e-3)])
def test_one_sentence_says_which_setting_suffices_for_several_errors(
    errors: tuple[float, float, float], tmp_path: Path
) -> None:
    """Of settings that were timed once times are not compared, from 2 ms to 1.5 s."""
    work = [100 * (error > 1e-8) + 40 for error in errors]
    rows = [
        made_row(str(i), errors[i], (0.002, 0.1, 1.47)[i], work[i] + i, repeats=1) for i in range(3)
    ]
    best = work.index(40)
    counts = [sum(error <= percent / 100 for error in errors) for percent in PERCENT]
    (sentence,) = said_of(made_table(tmp_path / "a.csv", rows))
    assert sentence.startswith(f"for 1 %, 0.1 % and 0.01 %: {best} with rtol 1, ")
    shown = " and ".join(map(str, dict.fromkeys(counts))).replace(" and ", ", ", len({*counts}) - 2)
    assert sentence.endswith(f"; the fewest evaluations of {shown} settings {ONCE}")


@pytest.mark.parametrize(
    ("spreads", "said"), [((0.2, 0.01), 1), ((0.01, 0.2), 1), ((0.05,) * 2, 0)]
)
def test_times_that_differ_by_less_than_their_spread_do_not_decide(
    spreads: tuple[float, float], said: int, tmp_path: Path
) -> None:
    """The times are 0.1 s apart; a third setting takes ten times as long."""
    known = [("fast", 1.0, 90), ("few", 1.1, 40), ("slow", 10.0, 1)]
    rows = [
        made_row(name, 1e-9, seconds, evaluations, **{"wall_spread [s]": spread})
        for (name, seconds, evaluations), spread in zip(known, (*spreads, 0.0), strict=True)
    ]
    (told,) = said_of(made_table(tmp_path / "a.csv", rows))
    sentence = told.removeprefix("for 1 %, 0.1 % and 0.01 %: ")
    expected = ("fast with rtol 1, 1 s", "few with rtol 1, 1.1 s")[said]
    assert sentence == f"{expected}, error 1.0e-09{BY_WORK * said}"


def test_a_study_of_single_runs_goes_by_evaluations() -> None:
    study = fs.cost(pulley(), {"solver.duration": 1.0}, backends=["events", "lsoda"], repeats=1)
    told = study.to_json()
    for advice in told["recommendations"]:
        enough = [s for s in told["settings"] if s["error"] <= advice["wanted"]]
        best = min(enough, key=lambda setting: setting["rhs_evaluations"])
        found = [advice[name] for name in ("law", "backend", "setting", "overrides")]
        assert found == [best[name] for name in ("law", "backend", "setting", "overrides")]
        assert "fewest evaluations" in advice["sentence"]
        assert ONCE in advice["sentence"]
        method = advice["sentence"].partition(": ")[2].partition(";")[0]
        (line,) = (line for line in study.recommendations if method in line)
        assert f"{100 * advice['wanted']:g} %" in line


def test_nothing_is_recommended_below_the_reference_uncertainty(tmp_path: Path) -> None:
    unknown = "unknown, the reference uncertainty is 2.0e-03"
    rows = [made_row("events", 1e-6, 1.0)]
    found = recommended(tmp_path, rows, {"angle": 2e-3, "energy": 1e-5})
    assert found == ["events", unknown, unknown]


def test_a_study_with_loose_references_knows_no_setting_for_small_errors() -> None:
    """Its references, at rtol 5e-3 and 1e-2, differ by 0.8 %."""
    study = fs.cost("pulley_return", backends="events", tolerances=0.1, repeats=1)
    told = study.to_json()
    floor = max(error["relative"] for error in told["floor"].values())
    assert 1e-3 < floor < 1e-2
    for advice in told["recommendations"]:
        is_known = advice["wanted"] >= floor
        assert ("unknown" not in advice["sentence"]) == is_known
        assert (advice["backend"] is not None) == is_known
        assert (advice["overrides"] is not None) == is_known


def test_a_mesh_on_which_errors_cancel_is_not_recommended(tmp_path: Path) -> None:
    def row(model: str, bodies: int, error: float, seconds: float) -> dict[str, Any]:
        return made_row("moreau", error, seconds, mesh=(model, bodies))

    rows = [row("string", 60, 1e-3, 0.1), row("string", 150, 0.05, 1.0)]
    rows += [row("string", 600, 5e-3, 9.0), row("polygon", 30, 0.5, 0.1)]
    said = said_of(made_table(tmp_path / "a.csv", rows))
    assert said[0] == "for 1 %: moreau, string with 600 bodies, rtol 1, 9 s, error 5.0e-03"
    assert said[1] == "for 0.1 % and 0.01 %: no setting reached it"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pulley", ["events, set-valued with rtol 1e-3, 0.00118 s"] * 3),
        ("pulley_return", ["events, set-valued with rtol 1e-3, 0.00254 s"] * 3),
        ("marble_machine", ["rkf45, set-valued with rtol 1e-3, 0.0117 s"] * 3),
        (
            "epicyclic",
            [f"events, set-valued with rtol {x}" for x in ("1e-3", "1e-3", "1e-5, 0.00717 s")],
        ),
        ("belt_verification", ["rkf45, set-valued with rtol 2e-6, 1.18 s", *["no setting"] * 2]),
        ("belt_drive", ["no setting"] * 3),
    ],
)
def test_shipped_tables_recommend_what_they_did(name: str, said: list[str], tmp_path: Path) -> None:
    copy = tmp_path / "a.csv"
    copy.write_bytes((ROOT / "results" / f"{name}_cost.csv").read_bytes())
    found = one_by_one(said_of(copy))
    assert len(found) == 3
    for sentence, percent, words in zip(found, PERCENT, said, strict=True):
        assert sentence.startswith(f"for {percent:g} %: {words}")

"""What a study recommends: the fastest setting that suffices."""

import re
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.costs.made import made_row, made_table, said_of

PERCENT = (1.0, 0.1, 0.01)
NONE = "no setting reached it"


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


def on_mesh(bodies: int, error: float, seconds: float) -> dict[str, Any]:
    return made_row("moreau", error, seconds, mesh=("string", bodies))


UNKNOWN = "unknown, the reference uncertainty is 2.0e-03"
OF_METHODS = [
    made_row("slow", 1e-9, 3.0),
    made_row("rough", 5e-3, 0.1, evaluations=900),
    made_row("good", 5e-4, 1.0),
    made_row("bad", 2.0, 0.01),
    made_row("broken", None, 0.001),
]


@pytest.mark.parametrize(
    ("rows", "uncertainty", "found"),
    [
        (OF_METHODS, None, ["rough", "good", "slow"]),
        (OF_METHODS[1:2], None, ["rough", NONE, NONE]),
        ([made_row("a", 1e-6, 1.0)], {"angle": 2e-3, "energy": 1e-5}, ["a", UNKNOWN, UNKNOWN]),
        # Errors of one mesh that cancel, which those of finer ones do not.
        ([on_mesh(60, 1e-3, 0.1), on_mesh(150, 0.05, 1.0)], None, [NONE] * 3),
        (
            [on_mesh(60, 1e-3, 0.1), on_mesh(150, 0.05, 1.0), on_mesh(600, 5e-3, 9.0)],
            None,
            ["moreau, string", NONE, NONE],
        ),
    ],
)
def test_the_fastest_sufficient_setting_is_recommended(
    rows: list[dict[str, Any]], uncertainty: Any, found: list[str], tmp_path: Path
) -> None:
    assert recommended(tmp_path, rows, uncertainty) == found


def test_one_sentence_says_which_setting_suffices_for_several_errors(tmp_path: Path) -> None:
    rows = [made_row("rough", 5e-3, 0.1), made_row("good", 1e-9, 1.0)]
    assert said_of(made_table(tmp_path / "a.csv", rows)) == [
        "for 1 %: rough with rtol 1, 0.1 s, error 5.0e-03",
        "for 0.1 % and 0.01 %: good with rtol 1, 1 s, error 1.0e-09",
    ]


def test_a_study_with_loose_references_knows_no_setting_for_small_errors() -> None:
    """Its references, at rtol 5e-3 and 1e-2, differ by 0.8 %."""
    study = fs.cost("pulley_return", backends="events", tolerances=0.1, repeats=1)
    told = study.to_json()
    floor = max(error["relative"] for error in told["floor"].values())
    assert 1e-3 < floor < 1e-2
    for advice in told["recommendations"]:
        is_known = advice["wanted"] >= floor
        assert ("unknown" not in advice["sentence"]) == is_known
        assert (advice["backend"] is not None) == (advice["overrides"] is not None) == is_known

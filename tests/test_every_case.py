"""What the program promises of every run, asked of each case of `cases.py`.

`pytest --update-golden -m '' -k golden tests/test_every_case.py` rewrites the golden results; say
in the commit why they changed.
"""

import signal
from collections.abc import Callable
from fnmatch import fnmatch
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from PIL import Image

import frictionsim as fs
from frictionsim.errors import Interrupted
from tests.cases import CASES, Allowed, Case, SolvedCase
from tests.support.mirrors import Mirror
from tests.support.scenarios import GOLDEN, SCENARIOS

Solved = Callable[[Case], SolvedCase]
SHIPPED = sorted(path.stem for path in SCENARIOS.glob("*.toml"))


def of(cases: list[Case]) -> Any:
    return pytest.mark.parametrize("case", [case.parameter for case in cases])


every_case = of(CASES)


def test_each_case_has_its_own_name() -> None:
    assert len({str(case) for case in CASES}) == len(CASES)


@every_case
def test_it_passes_its_audit(case: Case, solved: Solved) -> None:
    done = solved(case).result
    assert (done.status, done.failure) == ("done", "")
    assert {name for name, check in done.audit.items() if not check.ok} == set(case.fails_audit)


# --- golden results -------------------------------------------------------------------------------


@of([case for case in CASES if isinstance(case.golden, Allowed)])
def test_it_gives_its_golden_result(
    case: Case, solved: Solved, request: pytest.FixtureRequest
) -> None:
    done, golden, allowed = solved(case).result, GOLDEN / f"{case.scenario}.h5", case.golden
    assert isinstance(allowed, Allowed)
    if request.config.getoption("--update-golden"):
        done.save(golden)
    comparison = fs.compare(
        done, golden, rtol=allowed.rtol, atol=allowed.atol, time_atol=1e-8, ignore=allowed.ignore
    )
    assert [row for row in comparison.rows if not row.ok] == []


def test_there_is_a_golden_result_for_each_shipped_scenario_and_no_other() -> None:
    assert sorted(path.stem for path in GOLDEN.glob("*.h5")) == SHIPPED
    assert sorted(c.scenario for c in CASES if isinstance(c.golden, Allowed)) == SHIPPED


# --- resuming -------------------------------------------------------------------------------------


def place_in(case: Case, whole: SolvedCase, number: int = 0) -> Callable[[float], None]:
    """Return a function that interrupts a run at a place that is drawn from the name of a case.

    Between any two steps, and between a step and its samples or its change of mode.
    """
    calls = iter(range(Random(f"{case} {number}").randrange(whole.calls)))

    def progress(t: float) -> None:
        if next(calls, None) is None:
            raise Interrupted(signal.SIGINT, t)

    return progress


resumed = of([case for case in CASES if not case.not_resumed])


@resumed
def test_it_is_resumed_to_the_same_bytes(case: Case, solved: Solved, tmp_path: Path) -> None:
    whole, path = solved(case), tmp_path / "a.h5"
    part = fs.solve(case.load(), output=path, progress=place_in(case, whole))
    assert (part.status, part.path) == ("interrupted", tmp_path / "a.partial.h5")
    assert fs.resume(path).status == "done"
    assert [found.name for found in tmp_path.iterdir()] == ["a.h5"]
    assert path.read_bytes() == whole.bytes


@pytest.mark.slow
@pytest.mark.parametrize("number", [1, 2, 3])
@resumed
def test_it_is_resumed_again_and_again_to_the_same_bytes(
    case: Case, number: int, solved: Solved, tmp_path: Path
) -> None:
    """Interrupted, then at its limit of steps, with a step or a few more of them."""
    whole, path = solved(case), tmp_path / "a.h5"
    part = fs.solve(case.load(), output=path, progress=place_in(case, whole, number))
    assert part.status == "interrupted"
    for steps in (1, number, 2 * number):
        part = fs.resume(path, max_steps=steps)
        if part.status == "done":
            break
        assert part.failure == "budget_exceeded"
    if part.status != "done":
        assert fs.resume(path).status == "done"
    assert path.read_bytes() == whole.bytes


@of([case for case in CASES if case.not_resumed])
def test_one_that_leaves_no_state_is_not_resumed(
    case: Case, solved: Solved, tmp_path: Path
) -> None:
    fs.solve(case.load(), output=tmp_path / "a.h5", progress=place_in(case, solved(case)))
    with pytest.raises(fs.InputError, match="cannot resume this run"):
        fs.resume(tmp_path / "a.h5")


# --- samples and mirrors --------------------------------------------------------------------------

FINER = 0.37  # of the interval: few of the samples are at the same times


@every_case
def test_its_samples_do_not_change_it(case: Case, solved: Solved) -> None:
    done = solved(case).result
    interval = case.load().output.interval or np.max(np.diff(done.record.time))
    finer = fs.solve(case.load(case.data(output__interval=FINER * float(interval))))
    assert finer.statistics.steps == done.statistics.steps
    assert finer.statistics.rejected == done.statistics.rejected
    for name, values in done.record.channels.items():
        assert np.array_equal(values[-1], finer.record.channels[name][-1]), name
    if done.kind == "belt_drive":  # which takes samples, and finds transitions, of its states
        assert finer.statistics.rhs_evaluations == done.statistics.rhs_evaluations
    else:
        assert finer.transitions == done.transitions
    kept = [name for name in done.quantities if not any(fnmatch(name, p) for p in case.sampled)]
    assert {name: str(finer.quantities[name]) for name in kept} == {
        name: str(done.quantities[name]) for name in kept
    }


@of([case for case in CASES if isinstance(case.mirror, Mirror)])
def test_it_moves_as_its_mirror_image(case: Case, solved: Solved) -> None:
    mirror, done = case.mirror, solved(case).result
    assert isinstance(mirror, Mirror)
    other = fs.solve(case.load(mirror.scenario(case.data())))
    assert other.status == done.status
    assert [event[1:4] for event in other.transitions] == [
        mirror.event(*event[1:4]) for event in done.transitions
    ]
    image = mirror.image(done.record.channels)
    assert len(image) > 3
    for name, expected in image.items():
        close = case.close * max(np.max(np.abs(expected)), 1e-3)
        assert np.max(np.abs(other.record.channels[name] - expected)) <= close, name


# --- pictures and reports -------------------------------------------------------------------------


# One model of each kind: `tests/plots` draws the views of them all.
DRAWN = ("lift", "stops", "gear", "machine", "string")


def drawn(case: Case) -> Any:
    marks = [] if case.model in DRAWN else [pytest.mark.slow]
    return pytest.param(case, id=str(case), marks=marks)


@pytest.mark.parametrize("case", [drawn(case) for case in CASES])
def test_its_views_its_motion_and_its_report_are_made(
    case: Case, solved: Solved, tmp_path: Path
) -> None:
    done = solved(case).result
    assert done.path is not None
    picture = tmp_path / "a.svg"
    drawing = ["plot", str(done.path), "--view", "all", "-o", str(picture)]
    assert fs.run_command_line(drawing) == 0
    pictures = [path.read_text(encoding="utf-8") for path in tmp_path.glob("a-*.svg")]
    assert pictures
    assert all(text.endswith("</svg>\n") for text in pictures)
    # A few frames of the whole run.
    end = float(done.record.time[-1])
    with Image.open(fs.animate(done, tmp_path / "a.gif", fps=2, speed=end)) as motion:
        assert motion.n_frames > 2
    page = fs.report(done, tmp_path / "a.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert [name for name in (done.title, *done.quantities) if name not in page] == []

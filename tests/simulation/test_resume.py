"""Checkpoints and resuming, beside that each case of `cases.py` is resumed to the same bytes."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from time import sleep
from typing import Any

import h5py
import numpy as np
import pytest
import tomli_w

import frictionsim as fs
from tests.support.scenarios import SCENARIOS, pulley
from tests.support.stopped_runs import interrupted_at

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}
PULLEY = SCENARIOS / "pulley.toml"
SLOWLY = 0.02  # s, of a call


def test_run_time_is_summed_over_all_parts() -> None:
    """Each of three parts takes ten calls and more, and what all took before it counts."""

    def slowly(until: float) -> Callable[[float], None]:
        stop, calls = interrupted_at(until), iter(range(10))

        def progress(t: float) -> None:
            if next(calls, None) is not None:
                sleep(SLOWLY)
            stop(t)

        return progress

    part = fs.solve(PULLEY, progress=slowly(0.8))
    for number, until in enumerate([1.6, 10.0], 2):
        assert part.status == "interrupted"
        part = fs.resume(part, progress=slowly(until))
        assert part.statistics.wall_seconds > number * 10 * SLOWLY
    assert part.status == "done"


def test_runs_resume_from_periodic_checkpoints(tmp_path: Path) -> None:
    """Each checkpoint is a valid file, and resuming from it gives identical bytes."""
    data = pulley(drive__force=SINE, output__checkpoint=1e-3, solver__duration=1.0)
    whole, unfinished = tmp_path / "whole.h5", tmp_path / "whole.partial.h5"
    kept: list[Path] = []
    sizes: set[tuple[int, int]] = set()

    def keep(t: float) -> None:
        if unfinished.exists():
            found = unfinished.stat()
            if (found.st_ino, found.st_mtime_ns) not in sizes:
                sizes.add((found.st_ino, found.st_mtime_ns))
                kept.append(tmp_path / f"{len(kept)}.h5")
                shutil.copy(unfinished, kept[-1])

    slowed = iter(range(200))

    def slowly(t: float) -> None:  # so that there is time for some: a twentieth of the run's
        keep(t)
        if next(slowed, None) is not None:
            sleep(0.005)

    fs.solve(fs.load(data), output=whole, progress=slowly)
    assert kept
    for path in kept:
        part = fs.open(path)
        assert part.status == "interrupted"
        assert part.reason.startswith("checkpoint at t = ")
    again = tmp_path / "again.h5"
    assert fs.resume(kept[len(kept) // 2], output=again).status == "done"
    assert again.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(
    ("changes", "times"),
    [
        ({"drive.force": SINE}, 1.2),
        ({"drive.force": SINE, "output.interval": "at an event"}, 3.0),
        ({"output.channels": ["angle"]}, 1.2),
        ({"output.at_events": False}, 1.2),
    ],
)
def test_an_unfinished_file_has_the_samples_once(
    changes: dict[str, Any], times: float, tmp_path: Path
) -> None:
    """But for what it has at events, and of a run with one at the time of a sample."""
    settings: dict[str, Any] = {"output.interval": 1e-4, "solver.duration": 1.0, **changes}
    if settings["output.interval"] != 1e-4:
        first = fs.solve(fs.load(pulley(), settings | {"output.interval": 0.1})).record.transitions[
            0
        ]
        settings["output.interval"] = first.time / 2**11
    scenario = fs.load(pulley(), settings)
    whole = fs.solve(scenario, output=tmp_path / "whole.h5")
    part = fs.solve(scenario, progress=interrupted_at(0.7))
    path, again = part.save(tmp_path / "part.h5"), tmp_path / "again.h5"
    state = part.record.checkpoint
    samples = sum(v.nbytes for n, v in state.items() if n.startswith("samples."))
    assert samples > 5000 * 8 * 10
    assert path.stat().st_size < times * samples + 10**5
    assert fs.resume(path, output=again).status == "done"
    assert again.read_bytes() == (tmp_path / "whole.h5").read_bytes()
    assert whole.status == "done"


def test_resume_replaces_the_result_in_place(told: Any) -> None:
    told("solve", PULLEY, "-q", "-o", "whole.h5")
    # The limit is reached at the first step, so the resumed run needs another limit.
    _, said = told("solve", PULLEY, "-q", "-o", "a.h5", "--max-wall", "1e-9", code=5)
    assert "wall-time limit of 1e-09 s reached at t = 0 s of 3 s; resume the run" in said
    assert "'frictionsim resume a.partial.h5' continues the run" in said
    assert fs.open("a.partial.h5").failure == "budget_exceeded"
    summary = json.loads(told("resume", "a.h5", "--json")[0])
    assert (summary["status"], summary["failure"], summary["output"]) == ("done", "", "a.h5")
    assert Path("a.h5").read_bytes() == Path("whole.h5").read_bytes()


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    path = fs.solve(PULLEY, output=tmp_path / "a.h5", progress=interrupted_at(1.0)).path
    assert path is not None
    return path


def with_a_bit_changed(file: Any) -> None:
    state = file["checkpoint/step.y"]
    state[0] = np.nextafter(state[0], 1e9)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda f: f.attrs.modify("status", "done"), "cannot resume this run: it is done"),
        (
            lambda f: f.attrs.modify("frictionsim_version", "0.0.1"),
            "it was written by version 0.0.1, this is",
        ),
        (lambda f: f.attrs.modify("scenario", 'kind = "pulley"'), "its checkpoint is damaged"),
        (lambda f: f.pop("checkpoint"), "it has no checkpoint (interrupted: by SIGINT at t = "),
        (lambda f: f["checkpoint"].pop("step.y"), "its checkpoint is damaged"),
        (with_a_bit_changed, "its checkpoint is damaged"),
        (
            lambda f: f.attrs.modify("format_version", 7),
            "its format version is 7, this program reads version 2",
        ),
    ],
)
def test_resume_refuses_a_result_without_valid_checkpoint(
    damage: Callable[[Any], None], message: str, stopped: Path, told: Any
) -> None:
    with h5py.File(stopped, "r+") as file:
        damage(file)
    before = stopped.read_bytes()
    assert message in told("resume", stopped, code=2)[1]
    assert stopped.read_bytes() == before


def test_resume_needs_neither_scenario_nor_csv_file(tmp_path: Path) -> None:
    """Signals from CSV are in the result file."""
    (tmp_path / "force.csv").write_text("0, 1832.6\n0.8, 3113.75\n")
    scenario, target = tmp_path / "s.toml", tmp_path / "a.h5"
    scenario.write_text(tomli_w.dumps(pulley(drive__force={"csv": "force.csv"})))
    fs.solve(scenario, output=target, progress=interrupted_at(1.0))
    (tmp_path / "force.csv").unlink()
    scenario.unlink()
    assert fs.resume(target).status == "done"

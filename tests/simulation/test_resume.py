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
    """Each of two parts takes ten calls and more."""

    def slowly(until: float) -> Callable[[float], None]:
        stop, calls = interrupted_at(until), iter(range(10))

        def progress(t: float) -> None:
            if next(calls, None) is not None:
                sleep(SLOWLY)
            stop(t)

        return progress

    part = fs.solve(PULLEY, progress=slowly(0.8))
    done = fs.resume(part, progress=slowly(10.0))
    assert done.status == "done"
    assert done.statistics.wall_seconds > 2 * 10 * SLOWLY


def test_runs_resume_from_periodic_checkpoints(tmp_path: Path) -> None:
    """Each checkpoint is a valid file, and resuming from it gives identical bytes."""
    data = pulley(drive__force=SINE, output__checkpoint=1e-3, solver__duration=1.0)
    whole, unfinished = tmp_path / "whole.h5", tmp_path / "whole.partial.h5"
    kept: dict[int, Path] = {}
    slowed = iter(range(100))

    def slowly(t: float) -> None:  # so that there is time for some: a twentieth of the run's
        if unfinished.exists() and (changed := unfinished.stat().st_mtime_ns) not in kept:
            kept[changed] = shutil.copy(unfinished, tmp_path / f"{len(kept)}.h5")
        if next(slowed, None) is not None:
            sleep(0.005)

    fs.solve(data, output=whole, progress=slowly)
    assert kept
    for path in kept.values():
        part = fs.open(path)
        assert part.status == "interrupted"
        assert part.reason.startswith("checkpoint at t = ")
    again = tmp_path / "again.h5"
    assert fs.resume([*kept.values()][len(kept) // 2], output=again).status == "done"
    assert again.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(
    "changes",
    [
        {"output.interval": "at an event"},
        {"output.channels": ["angle"]},
        {"output.at_events": False},
    ],
)
def test_an_unfinished_file_has_the_samples_once(changes: dict[str, Any], tmp_path: Path) -> None:
    settings: dict[str, Any] = {"output.interval": 4e-4, "drive.force": SINE, **changes}
    if settings["output.interval"] != 4e-4:
        first = fs.solve(pulley(), {"drive.force": SINE}).transitions[0]
        settings["output.interval"] = first.time / 2**9
    scenario = fs.load(pulley(), settings | {"solver.duration": 1.0})
    fs.solve(scenario, output=tmp_path / "whole.h5")
    part = fs.solve(scenario, progress=interrupted_at(0.7))
    path, again = part.save(tmp_path / "part.h5"), tmp_path / "again.h5"
    state = part.record.checkpoint
    samples = sum(v.nbytes for n, v in state.items() if n.startswith("samples."))
    assert samples > 1000 * 8 * 10
    assert path.stat().st_size < 1.2 * samples + 10**5
    assert fs.resume(path, output=again).status == "done"
    assert again.read_bytes() == (tmp_path / "whole.h5").read_bytes()


def test_resume_replaces_the_result_in_place(told: Any) -> None:
    told("solve", PULLEY, "-q", "-o", "whole.h5")
    # The limit is reached at the first step, so the resumed run needs another limit.
    _, said = told("solve", PULLEY, "-q", "-o", "a.h5", "--max-wall", "1e-9", code=5)
    assert "wall-time limit of 1e-09 s reached at t = 0 s of 3 s; resume the run" in said
    assert "'frictionsim resume a.partial.h5' continues the run" in said
    part = fs.open("a.partial.h5")
    assert part.failure == "budget_exceeded"
    whole = fs.open("whole.h5").record.attributes
    for name in ("scenario", "overrides", "command"):  # a limit is not recorded
        assert part.record.attributes[name] == whole[name]
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

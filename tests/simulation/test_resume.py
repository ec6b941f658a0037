"""Checkpoints and resuming: a resumed run is bit-identical to an uninterrupted one."""

import gzip
import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import pytest
import tomli_w

from frictionsim.errors import InputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.results import Record
from frictionsim.scenario.loading import load, scenario_from_result, validate
from frictionsim.simulation.simulate import run
from frictionsim.simulation.single_dof import SingleDofSimulation
from tests.support.cases import slow
from tests.support.scenarios import ROOT, SCENARIOS, Scenario, pulley, simulate
from tests.support.stopped_runs import stopping

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}
PULLEY = SCENARIOS / "pulley.toml"


def calls_of(data: Scenario) -> int:
    times: list[float] = []
    run(validate(data, SCENARIOS), times.append)
    return len(times)


def resumed(path: Path, on_step: Callable[[float], Any] = lambda t: None) -> Record:
    attributes, state = hdf5_reader.read_checkpoint(path)
    return run(scenario_from_result(path, attributes), on_step, checkpoint=state)


def assert_same_when_interrupted(data: Scenario, folder: Path, *stops: list[int]) -> None:
    """Stop a run after each number of calls; its last file must equal that of a whole run."""
    whole, part = folder / "whole.h5", folder / "part.h5"
    hdf5_writer.write(simulate(data), whole)
    for places in stops:
        result = run(validate(data, SCENARIOS), stopping(places[0]))
        for place in [*places[1:], None]:
            assert (result.status, result.failure) == ("failed", "budget_exceeded")
            hdf5_writer.write(result, part)
            result = resumed(part, stopping(place) if place is not None else lambda t: None)
            if result.status == "done":
                break
        hdf5_writer.write(result, part)
        assert part.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(("backend", "first"), [("events", 0), slow("rkf45", 1)])
def test_interruption_at_any_step_gives_identical_bytes(
    backend: str, first: int, tmp_path: Path
) -> None:
    """Including steps between a step and its samples, and at the changes of mode.

    Every seventh one: all of them take a minute, and neighbours are alike.
    """
    data = pulley(
        drive__force=SINE,
        solver={"backend": backend, "duration": 1.5, "rtol": 1e-4, "atol": 1e-6},
        output__interval=0.05,
    )
    stops = ([place] for place in range(first, calls_of(data), 7))
    assert_same_when_interrupted(data, tmp_path, *stops)


def test_run_time_is_summed_over_all_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = itertools.count()
    monkeypatch.setattr("frictionsim.simulation.simulate.perf_counter", lambda: float(next(ticks)))
    monkeypatch.setattr(SingleDofSimulation, "prepare", lambda self, on_step: 2.5)
    path = tmp_path / "a.h5"
    result = run(validate(pulley(), SCENARIOS), stopping(5))
    for part in range(1, 4):
        # Each part reads the clock twice, at its start and end.
        seconds = result.statistics.wall_seconds, result.statistics.compile_seconds
        assert seconds == (1.0 * part, 2.5 * part)
        hdf5_writer.write(result, path)
        result = resumed(path, stopping(5))


def test_run_time_excludes_writing_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = 0.0

    def on_step(t: float) -> None:
        nonlocal clock
        clock += 1.0

    def keep(part: Record) -> None:
        nonlocal clock
        kept.append(part.statistics.wall_seconds)
        clock += 100.0

    kept: list[float] = []
    monkeypatch.setattr("frictionsim.simulation.simulate.perf_counter", lambda: clock)
    data = pulley(output__checkpoint=10.0)
    calls = calls_of(data)
    clock = 0.0
    result = run(validate(data, SCENARIOS), on_step, keep)
    assert result.statistics.wall_seconds == calls
    assert kept == [10.0 * number for number in range(1, calls // 10 + 1)]


def test_runs_resume_from_periodic_checkpoints(tmp_path: Path) -> None:
    """Each checkpoint is a valid file, and resuming from it gives identical bytes."""
    data = pulley(drive__force=SINE, output__checkpoint=1e-3, output__interval=0.01)
    scenario = validate(data, SCENARIOS)
    kept: list[Path] = []

    def keep(part: Record) -> None:
        kept.append(tmp_path / f"{len(kept)}.h5")
        hdf5_writer.write(part, kept[-1])

    whole = tmp_path / "whole.h5"
    hdf5_writer.write(run(scenario, lambda t: None, keep), whole)
    assert kept
    for path in kept:
        attributes = hdf5_reader.read(path).attributes
        assert attributes["status"] == "interrupted"
        assert attributes["reason"].startswith("checkpoint at t = ")
    hdf5_writer.write(resumed(kept[len(kept) // 2]), tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == whole.read_bytes()


def test_resume_replaces_the_result_in_place(told: Any) -> None:
    told("solve", PULLEY, "-q", "-o", "whole.h5")
    # The limit is reached at the first step, so the resumed run needs another limit.
    _, said = told("solve", PULLEY, "-q", "-o", "a.h5", "--max-wall", "1e-9", code=5)
    assert "wall-time limit of 1e-09 s reached at t = 0 s of 3 s; resume the run" in said
    assert "'frictionsim resume a.partial.h5' continues the run" in said
    assert hdf5_reader.read(Path("a.partial.h5")).attributes["failure"] == "budget_exceeded"
    summary = json.loads(told("resume", "a.h5", "--json")[0])
    assert (summary["status"], summary["failure"], summary["output"]) == ("done", "", "a.h5")
    assert Path("a.h5").read_bytes() == Path("whole.h5").read_bytes()


@pytest.fixture
def stopped(tmp_path: Path) -> Path:
    path = tmp_path / "a.h5"
    hdf5_writer.write(run(validate(pulley(), SCENARIOS), stopping(30)), path)
    return path


def with_a_bit_changed(file: Any) -> None:
    file["checkpoint/stepper.y"][0] += 1e-16


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda f: f.attrs.modify("status", "done"), "cannot resume this run: it is done"),
        (
            lambda f: f.attrs.modify("frictionsim_version", "0.0.1"),
            "it was written by version 0.0.1, this is",
        ),
        (lambda f: f.attrs.modify("scenario", 'kind = "pulley"'), "its checkpoint is damaged"),
        (lambda f: f.pop("checkpoint"), "it has no checkpoint (failed: stopped at t = "),
        (lambda f: f["checkpoint"].pop("stepper.y"), "its checkpoint is damaged"),
        (with_a_bit_changed, "its checkpoint is damaged"),
        (
            lambda f: f.attrs.modify("format_version", 7),
            "its format version is 7, this program reads versions 1 to 3",
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


def test_resume_refuses_an_invalid_scenario(stopped: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    checkpoint = hdf5_reader.read_checkpoint(stopped)
    text = checkpoint.attributes["scenario"].replace("inertia", "inertial")
    changed_file = checkpoint._replace(attributes={**checkpoint.attributes, "scenario": text})
    monkeypatch.setattr(hdf5_reader, "read_checkpoint", lambda path: changed_file)
    with pytest.raises(InputError, match=r"a\.h5: its scenario is not valid: mechanism\.inertia"):
        resumed(stopped)


CHECKPOINTS = sorted((ROOT / "tests" / "data" / "checkpoints").iterdir())


@pytest.mark.parametrize("path", CHECKPOINTS, ids=lambda path: path.name)
def test_checkpoints_of_earlier_sources_of_this_version_are_resumed(
    path: Path, tmp_path: Path
) -> None:
    """To the bytes of a whole run of these sources, but for the number of evaluations.

    Where there are several contacts, earlier sources counted others.
    """
    part, whole_path = tmp_path / "part.h5", tmp_path / "whole.h5"
    part.write_bytes(gzip.decompress(path.read_bytes()))
    scenario = scenario_from_result(part, hdf5_reader.read(part).attributes)
    whole, result = run(scenario, lambda t: None), resumed(part)
    assert whole.statistics is not None
    assert result.statistics is not None
    assert result.statistics[:2] == whole.statistics[:2]
    hdf5_writer.write(whole, whole_path)
    hdf5_writer.write(result._replace(statistics=whole.statistics), part)
    assert part.read_bytes() == whole_path.read_bytes()


def test_resume_needs_neither_scenario_nor_csv_file(tmp_path: Path) -> None:
    """Signals from CSV are in the result file."""
    (tmp_path / "force.csv").write_text("0, 1832.6\n0.8, 3113.75\n")
    scenario = tmp_path / "s.toml"
    scenario.write_text(tomli_w.dumps(pulley(drive__force={"csv": "force.csv"})))
    target = tmp_path / "a.h5"
    hdf5_writer.write(run(load(scenario), stopping(20)), target)
    (tmp_path / "force.csv").unlink()
    scenario.unlink()
    assert resumed(target).status == "done"

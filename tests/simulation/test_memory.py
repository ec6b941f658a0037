"""Runs that do not fit into the memory: refused before they start, or stopped with a checkpoint."""

import sys
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.io import result_writer
from frictionsim.simulation import coordinates, memory
from tests.support.scenarios import SCENARIOS, python

MANY = {"output.interval": 1e-6, "solver.duration": 8.0}  # 8e6 samples of a pulley


@pytest.mark.parametrize("workers", [1, 4])
def test_what_does_not_fit_is_refused_before_the_run(
    workers: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    steps: list[float] = []
    monkeypatch.setattr(memory, "available_memory", lambda: 5 * 10**9)
    monkeypatch.setattr(memory, "processes", workers)
    with pytest.raises(fs.InputError) as refused:
        fs.solve("pulley", MANY, output=tmp_path / "a.h5", progress=steps.append)
    share = ", divided by 4 workers" if workers > 1 else ""
    assert str(refused.value) == (
        "cannot start this run: 8000001 samples of all recorded channels take 1.51 GB before"
        f" compression; it would need 6.48 GB of memory, and 5 GB are available{share}; give a"
        " longer output.interval"
    )
    assert (steps, list(tmp_path.iterdir())) == ([], [])


def test_fewer_channels_of_a_belt_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 5 * 10**9)
    scenario = fs.load("belt_string", {"output.interval": 1e-6, "solver.duration": 1.0})
    with pytest.raises(fs.InputError, match=r"interval or fewer output\.chan"):
        memory.check_memory(scenario, _simulation(scenario), {})
    fewer = scenario.replace(['output.channels=["tension"]'])
    memory.check_memory(fewer, _simulation(fewer), {})


def test_the_samples_of_a_resumed_run_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = fs.load("pulley", MANY)
    simulation = _simulation(scenario)
    monkeypatch.setattr(memory, "available_memory", lambda: 6 * 10**9)
    with pytest.raises(fs.InputError, match=r"it would need 6\.48 GB"):
        memory.check_memory(scenario, simulation, {})
    memory.check_memory(scenario, simulation, {"samples": np.empty(10**8)})


def _simulation(scenario: fs.Scenario) -> object:
    from frictionsim.scenario.kinds import mechanism_module

    return mechanism_module(scenario.kind).simulation(scenario)


@pytest.mark.parametrize("name", ["pulley", "lift"])
def test_a_run_that_uses_it_up_leaves_a_checkpoint(
    name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    fs.solve(name, output=tmp_path / "whole.h5")
    with monkeypatch.context() as patched:
        patched.setattr(memory, "SECONDS_BETWEEN_LOOKS", 0.0)
        patched.setattr(memory, "available_memory", lambda: 10**7)
        stopped = fs.solve(name, output=tmp_path / "a.h5")
    assert (stopped.failure, stopped.exit_code) == ("budget_exceeded", 5)
    assert "the memory is used up at t = " in stopped.reason
    fs.resume(tmp_path / "a.h5")
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()


def test_the_smallest_limit_of_a_control_group_counts(tmp_path: Path) -> None:
    """As the kernel writes them: what it keeps of files can be given up."""
    for name, text in (
        ("memory.max", "3000\n"),
        ("memory.current", "2500\n"),
        ("memory.stat", "anon 1\ninactive_file 700\n"),
    ):
        (tmp_path / name).write_text(text)
    assert memory._free_in_group(tmp_path, memory.FILES_OF_GROUP[""]) == 1200


# Keeps samples of a belt as a run does, and writes them as its checkpoint; prints the largest size
# of the process (which Linux can be told to measure anew) and that of the file, over the samples.
CHECKPOINT = """
import sys
import numpy as np
import frictionsim as fs
from frictionsim.io.result_writer import write
from frictionsim.simulation.memory import resident_memory
from frictionsim.simulation.sample_store import SampleStore
from pathlib import Path

short = fs.solve("belt_string", {"solver.duration": 1e-3, "output.interval": 1e-3})
record, before = short.record, resident_memory()
Path("/proc/self/clear_refs").write_text("5")
rows = {name: values[-1] for name, values in record.channels.items()}
store, size = SampleStore(), 8 * sum(np.size(row) for row in rows.values())
for number in range(int(float(sys.argv[1])) // size):
    store.append(rows | {"time": float(number)})
channels = {name: store.channel(name, len(store)) for name in rows}
write(record._replace(channels=channels, checkpoint=store.state()), Path("a.partial.h5"))
(line,) = [s for s in Path("/proc/self/status").read_text().splitlines() if s.startswith("VmHWM")]
peak = 1024 * int(line.split()[1]) - before
print(peak / (size * len(store)), Path("a.partial.h5").stat().st_size / (size * len(store)))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux measures a peak anew")
@pytest.mark.parametrize("size", [6e7, pytest.param(3e8, marks=pytest.mark.slow)])
def test_a_checkpoint_takes_half_the_samples_more_at_most(size: float, tmp_path: Path) -> None:
    done = python("-c", CHECKPOINT, size, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    memory_share, disk_share = map(float, done.stdout.split())
    assert memory_share <= 1.5
    assert disk_share <= 1.1  # each sample once
    with_channels = fs.open(tmp_path / "a.partial.h5").record.channels
    assert np.array_equal(with_channels["time"], np.arange(len(with_channels["time"])))


# Stops a long run near its end, and prints the largest size of the process over the samples, of
# 16 numbers each.
STOPPED = """
import frictionsim as fs
from frictionsim.simulation.memory import resident_memory
from pathlib import Path

fs.solve("pulley", output="small.h5")
before = resident_memory()
Path("/proc/self/clear_refs").write_text("5")
many = {"output.interval": 1e-5}
run = fs.solve("pulley", many, output="a.h5", max_steps=120)
(line,) = [s for s in Path("/proc/self/status").read_text().splitlines() if s.startswith("VmHWM")]
print((1024 * int(line.split()[1]) - before) / (16 * 8 * len(run.record.time)))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux measures a peak anew")
def test_so_does_a_checkpoint_of_one_coordinate(tmp_path: Path) -> None:
    done = python("-c", STOPPED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    # 1.5, 9 bytes of channels that follow from the 16 numbers, and 3 MB of what any run needs.
    assert float(done.stdout) <= 1.7
    fs.resume(tmp_path / "a.partial.h5")
    resumed = (tmp_path / "a.h5").read_bytes()
    fs.solve("pulley", {"output.interval": 1e-5}, output=tmp_path / "a.h5")
    assert (tmp_path / "a.h5").read_bytes() == resumed


@pytest.mark.parametrize("name", ["pulley", "lift"])
def test_a_large_run_has_the_same_file(
    name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Whose columns are copied one by one, and whose file is not made in memory."""
    fs.solve(name, output=tmp_path / "small.h5")
    monkeypatch.setattr(coordinates, "LARGE", 0)
    monkeypatch.setattr(result_writer, "LARGE", 0)
    seen = fs.solve(name, output=tmp_path / "large.h5")
    assert (tmp_path / "large.h5").read_bytes() == (tmp_path / "small.h5").read_bytes()
    assert fs.compare(seen, tmp_path / "small.h5", rtol=0.0, atol=0.0).same


def test_a_long_pulley_warns_of_its_size(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(memory, "available_memory", lambda: 10**12)
    scenario = fs.load(SCENARIOS / "pulley.toml", MANY)
    memory.check_memory(scenario, _simulation(scenario), {})
    assert "8000001 samples of all recorded channels take 1.51 GB" in caplog.text

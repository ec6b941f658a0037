"""Runs that do not fit into the memory are refused before they start; what a checkpoint takes."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import python

MANY = {"output.interval": 1e-6, "solver.duration": 8.0}  # 8e6 samples of a pulley
System = Callable[..., None]


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> System:
    """Return a function that has the files of the system tell of so many GB of free memory."""
    told: dict[str, str] = {}
    read = Path.read_text
    monkeypatch.setattr(
        Path,
        "read_text",
        lambda path, *how, **more: told.get(str(path)) or read(path, *how, **more),
    )

    def tell(gigabytes: float, **others: str) -> None:
        told["/proc/meminfo"] = f"MemAvailable: {gigabytes * 1e9 / 1024:.0f} kB\n"
        told["/proc/self/cgroup"] = "0::/own\n"
        told.update({f"/sys/fs/cgroup/own/memory.{name}": text for name, text in others.items()})

    return tell


class Started(Exception):
    """The run has begun, and need not go on."""


def begin(*run: Any) -> None:
    def stop(t: float) -> None:
        raise Started

    fs.solve(*run, progress=stop)


def test_what_does_not_fit_is_refused_before_the_run(system: System, tmp_path: Path) -> None:
    system(5.0)
    steps: list[float] = []
    with pytest.raises(fs.InputError) as refused:
        fs.solve("pulley", MANY, output=tmp_path / "a.h5", progress=steps.append)
    assert str(refused.value) == (
        "cannot start this run: 8000001 samples of all recorded channels take 1.51 GB before"
        " compression; it would need 6.48 GB of memory, and 5 GB are available; give a"
        " longer output.interval"
    )
    assert (steps, list(tmp_path.iterdir())) == ([], [])


IN_WORKERS = """
from pathlib import Path
import frictionsim as fs

read = Path.read_text
told = {"/proc/meminfo": "MemAvailable: 9765625 kB", "/proc/self/cgroup": "0::/own"}
Path.read_text = lambda path, *how, **more: told.get(str(path)) or read(path, *how, **more)
many = {"output.interval": 1e-6, "solver.duration": 8.0}
vary = {"mechanism.load": [2e3, 2.1e3]}
swept = fs.sweep("pulley", vary, many, workers=2, keep_series=True, output="s.h5")
print(*swept.table.texts["reason"].values(), sep="\\n")
"""


def test_workers_share_the_memory(tmp_path: Path) -> None:
    """In a process of its own: only one without threads has workers that are copies of it."""
    lines = python("-c", IN_WORKERS, cwd=tmp_path).stdout.splitlines()
    assert len(lines) == 2
    assert all("10 GB are available, divided by 2 workers; give" in line for line in lines)


def test_the_smallest_limit_of_a_control_group_counts(system: System) -> None:
    """As the kernel writes them: what it keeps of files can be given up."""
    of_files = "anon 1\ninactive_file 700000000\n"
    system(5.0, max="3000000000\n", current="2500000000\n", stat=of_files)
    with pytest.raises(fs.InputError, match=r"and 1\.2 GB are available"):
        begin("pulley", MANY)


def test_fewer_channels_of_a_belt_fit(system: System) -> None:
    system(5.0)
    many: dict[str, Any] = {"output.interval": 1e-6, "solver.duration": 1.0}
    with pytest.raises(fs.InputError, match=r"interval or fewer output\.chan"):
        begin("belt_string", many)
    few = {**many, "output.channels": ["tension"]}
    begun = fs.solve("belt_string", few, max_wall=1e-9)  # which ends before kernels are compiled
    assert begun.failure == "budget_exceeded"


def test_a_long_pulley_warns_of_its_size(system: System, caplog: pytest.LogCaptureFixture) -> None:
    system(1000.0)
    with pytest.raises(Started):
        begin("pulley", MANY)
    assert "8000001 samples of all recorded channels take 1.51 GB" in caplog.text


# Stops a long run near its end, and prints the largest size of the process (which Linux can be told
# to measure anew) and of the file over the samples, of 16 numbers each.
STOPPED = """
import frictionsim as fs
from mmap import PAGESIZE
from pathlib import Path

fs.solve("pulley", output="small.h5")
before = int(Path("/proc/self/statm").read_text().split()[1]) * PAGESIZE
Path("/proc/self/clear_refs").write_text("5")
run = fs.solve("pulley", {"output.interval": 1e-5}, output="a.h5", max_steps=120)
(line,) = [s for s in Path("/proc/self/status").read_text().splitlines() if s.startswith("VmHWM")]
size = 16 * 8 * len(run.record.time)
print((1024 * int(line.split()[1]) - before) / size, run.path.stat().st_size / size)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux measures a peak anew")
def test_a_checkpoint_takes_half_the_samples_more_at_most(tmp_path: Path) -> None:
    done = python("-c", STOPPED, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    memory_share, disk_share = map(float, done.stdout.split())
    # Found were 1.45 to 1.46 of 27 MB; another quarter of the samples in memory makes it 1.70.
    assert memory_share <= 1.6
    assert disk_share <= 1.1  # each sample once, and those channels


def test_samples_of_a_belt_are_kept_as_their_arrays_grow() -> None:
    few = {"solver.backend": "moreau", "solver.duration": 4e-3, "output.channels": []}
    times = fs.solve("belt_string", few | {"output.interval": 4e-6}).record.time
    assert times == pytest.approx(4e-6 * np.arange(1001), rel=1e-12)


def test_a_large_run_has_the_same_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Which is not made in memory."""
    fs.solve("pulley", output=tmp_path / "small.h5")
    monkeypatch.setattr("frictionsim.io.result_writer.LARGE", 0)
    fs.solve("pulley", output=tmp_path / "large.h5")
    assert (tmp_path / "large.h5").read_bytes() == (tmp_path / "small.h5").read_bytes()

"""Results that are written to the disk while HDF5 has them open, and disks that are full."""

import os
import resource
from collections import namedtuple
from pathlib import Path

import pytest

from frictionsim.errors import OutputError
from frictionsim.io import hdf5_on_disk, hdf5_writer
from tests.support.scenarios import pulley, simulate
from tests.support.stopped_runs import stopped_at


def test_hdf5_survives_a_file_that_it_cannot_write(here: Path) -> None:
    # More samples than one segment has; a limit of the size of files stands for a full disk.
    run, path = simulate(pulley(output__interval=4e-5)), Path("old.h5")
    hdf5_writer.write(run, path)
    before = path.read_bytes()

    def refusals() -> int:
        found = []
        for limit in (1_000_000, 2_000_001, 4_000_000):
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
            try:
                hdf5_writer.write(run, path)
            except OutputError as error:
                found.append(str(error))
        return found.count("old.h5: cannot write the result: File too large")

    assert stopped_at(0, refusals, here) == 3
    assert (path.read_bytes(), os.listdir()) == (before, ["old.h5"])


def test_a_disk_without_room_is_noticed_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = namedtuple("usage", "free")
    monkeypatch.setattr(hdf5_on_disk, "disk_usage", lambda path: usage(1_000_000))
    monkeypatch.setattr(hdf5_writer, "is_long", lambda channels: True)
    run = simulate(pulley(output__interval=1e-3))
    path = tmp_path / "a.h5"
    hdf5_writer.write(run, path)
    monkeypatch.setattr(hdf5_on_disk, "disk_usage", lambda path: usage(100_000))
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"a\.h5: cannot write the result: No space left"):
        hdf5_writer.write(run, path)
    assert path.read_bytes() == before

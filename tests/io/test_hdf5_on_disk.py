"""Results that are written to the disk while HDF5 has them open, and disks that are full."""

import subprocess
import sys
from collections import namedtuple
from pathlib import Path

import pytest

from frictionsim.errors import OutputError
from frictionsim.io import hdf5_on_disk, hdf5_writer
from tests.support.scenarios import ROOT, pulley, simulate

# More samples than one segment has; a limit of the size of files stands for a full disk.
LIMITED = """
import resource, signal
from pathlib import Path
from frictionsim.errors import OutputError
from frictionsim.io import hdf5_on_disk, hdf5_writer
from tests.support.scenarios import pulley, simulate
run = simulate(pulley(output__interval=4e-5))
hdf5_writer.write(run, Path("old.h5"))
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
for limit in (1_000_000, 2_000_001, 4_000_000):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        hdf5_writer.write(run, Path("old.h5"))
    except OutputError as error:
        print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
def test_hdf5_survives_a_file_that_it_cannot_write(tmp_path: Path) -> None:
    environment = {"PYTHONPATH": str(ROOT), "PATH": ""}
    command = [sys.executable, "-c", LIMITED]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == 3 * "old.h5: cannot write the result: File too large\n"
    assert [path.name for path in tmp_path.iterdir()] == ["old.h5"]


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

"""Atomic writing: a part next to the target, owned by one process and then renamed."""

import errno
import os
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.errors import OutputError
from tests.support.cases import slow
from tests.support.old_results import old_result
from tests.support.scenarios import ROOT, pulley, run_anew
from tests.support.stopped_runs import stopped_at

pytestmark = pytest.mark.usefixtures("here")
CANNOT = "a.h5: cannot write the result: "


def contents() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Path().iterdir()}


@cache
def result(title: str = "new") -> fs.Result:
    """Return the result of a short run, whose file is `old_result(title)`."""
    return fs.Result(run_anew(pulley(title=title, solver__duration=0.01)))


def refused(path: str = "a.h5", title: str = "new") -> str:
    with pytest.raises(OutputError) as caught:
        result(title).save(path)
    return str(caught.value)


def refused_before_the_run(path: str | Path) -> str:
    """Return why no run is begun that would write to a path."""
    steps: list[float] = []
    with pytest.raises(OutputError) as caught:
        fs.solve(pulley(), output=path, progress=steps.append)
    assert steps == []
    return str(caught.value)


def test_the_part_of_a_killed_process_is_emptied_by_the_next_writer() -> None:
    def work() -> int:
        os.fsync = lambda descriptor: os.kill(os.getpid(), signal.SIGKILL)  # before it is renamed
        result().save("a.h5")
        return 0

    assert stopped_at(0, work, Path()) == -signal.SIGKILL
    assert contents() == {".a.h5.part": old_result("new")}
    Path(".a.h5.part").write_bytes(b"longer than what is written" * 10_000)
    result().save("a.h5")
    assert contents() == {"a.h5": old_result("new")}


def test_a_signal_that_comes_while_a_part_is_discarded_discards_it_without_an_error(
    here: Path,
) -> None:
    """The handler, which ends the process, runs between any two steps: here after `close`."""

    def work() -> int:
        close = os.close

        def signalled(descriptor: int) -> None:
            is_discarded = os.fstat(descriptor).st_nlink == 0
            close(descriptor)
            if is_discarded:
                os.kill(os.getpid(), signal.SIGTERM)

        os.close = signalled
        return fs.run_command_line(["solve", "pulley", "-q", "-o", "a.h5"])

    assert stopped_at(0, work, here) == -signal.SIGTERM
    assert contents() == {}


# Tries to write a long result a second time when HDF5 has written it, which has closed the file by
# then; only a new process reads the environment anew.
TWO_WRITERS = """
import os
import frictionsim as fs
from tests.support.belt_results import belt_run
sync = os.fsync
def synced(descriptor):
    os.fsync = sync
    try:
        fs.solve("pulley", output="a.h5")
    except fs.OutputError as error:
        print(error)
    sync(descriptor)
os.fsync = synced
fs.Result(belt_run(bodies=400, samples=2001)).save("a.h5")
"""


@pytest.mark.parametrize("locking", [None, slow("FALSE"), slow("TRUE"), slow("BEST_EFFORT")])
def test_a_second_writer_of_a_long_result_is_told_whatever_hdf5_locks(locking: str | None) -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    environment.pop("HDF5_USE_FILE_LOCKING", None)
    if locking is not None:
        environment["HDF5_USE_FILE_LOCKING"] = locking
    command = [sys.executable, "-c", TWO_WRITERS]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True)
    busy = "another process is writing it now; wait for its end, or give another name"
    assert (ended.stdout, ended.stderr) == (f"{CANNOT}{busy}\n", "")
    assert list(contents()) == ["a.h5"]


def test_a_part_of_another_process_is_neither_renamed_nor_removed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where a file system has no locks, it may take the name."""

    def replaced(*_: object) -> None:  # when the new content is complete
        Path(".a.h5.part").unlink()
        Path(".a.h5.part").write_bytes(b"half")

    monkeypatch.setattr(os, "fchmod", replaced)
    Path("a.h5").write_bytes(old_result())
    assert "another process has replaced the new content" in refused()
    assert contents() == {"a.h5": old_result(), ".a.h5.part": b"half"}


@pytest.mark.parametrize("what", ["symlink", "hard link", "pipe", "folder"])
def test_what_others_put_in_the_place_of_a_part_is_not_written_to(what: str) -> None:
    Path("precious").write_bytes(b"precious")
    part = Path(".a.h5.part")
    if what == "symlink":
        part.symlink_to("precious")
    elif what == "hard link":
        part.hardlink_to("precious")
    elif what == "pipe":
        os.mkfifo(part)
    else:
        part.mkdir()
    assert refused().startswith(CANNOT)
    assert Path("precious").read_bytes() == b"precious"
    assert os.path.lexists(part)
    assert not Path("a.h5").exists()


def test_a_part_that_its_writer_has_renamed_since_is_made_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Path(".a.h5.part").write_bytes(b"first")
    is_first, lstat = [True], Path.lstat

    def renamed_before(self: Path) -> os.stat_result:
        if self.name == ".a.h5.part" and is_first:
            is_first.clear()
            self.rename("b.h5")
        return lstat(self)

    monkeypatch.setattr(Path, "lstat", renamed_before)
    result().save("a.h5")
    assert contents() == {"a.h5": old_result("new"), "b.h5": b"first"}


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755])
def test_the_mode_of_a_replaced_file_is_kept(mode: int) -> None:
    path, meanwhile = Path("a.h5"), set[int]()
    path.touch()
    path.chmod(mode)

    def seen(t: float) -> None:
        meanwhile.update(part.stat().st_mode & 0o777 for part in Path().glob(".a.h5.part"))

    fs.solve(pulley(), output=path, progress=seen)
    assert meanwhile == {0o600}
    assert path.stat().st_mode & 0o7777 == mode


def test_a_new_file_has_the_mode_of_the_umask() -> None:
    before = os.umask(0o027)
    try:
        result().save("a.h5")
    finally:
        os.umask(before)
    assert Path("a.h5").stat().st_mode & 0o777 == 0o640


@pytest.mark.root
def test_the_owner_of_a_replaced_file_and_the_part_of_another_user_stay() -> None:
    Path("a.h5").touch()
    os.chown("a.h5", 2001, 2003)
    result().save("a.h5")
    status = Path("a.h5").stat()
    assert (status.st_uid, status.st_gid) == (2001, 2003)
    Path(".a.h5.part").write_bytes(b"theirs")
    os.chown(".a.h5.part", 12345, 12345)
    assert refused() == f"{CANNOT}'.a.h5.part' beside it is not of this program; remove it"
    assert contents() == {"a.h5": old_result("new"), ".a.h5.part": b"theirs"}


def test_another_group_has_no_rights_of_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    path = Path("a.h5")
    path.touch(0o644)
    path.chmod(0o664)
    kept = path.stat()
    stat = Path.stat

    def of_others(self: Path, **options: Any) -> os.stat_result:
        status = stat(self, **options)
        same = status.st_ino == kept.st_ino
        return os.stat_result((*status[:5], status.st_gid + same, *status[6:10]))

    def forbidden(*_: int) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "stat", of_others)
        patched.setattr(os, "fchown", forbidden)
        result().save(path)
    assert path.stat().st_mode & 0o777 == 0o604


def test_a_sticky_folder_is_seen_before_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path("shared")
    folder.mkdir()
    folder.chmod(0o1777)
    (folder / "a.h5").touch()
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    told = refused_before_the_run(folder / "a.h5")
    assert "belongs to another user, and its folder lets nobody" in told


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("a" * 248 + ".h5", "File name too long"),
        ("loop.h5", "this is a link that leads to itself; give a file name"),
        ("dangling.h5", "there is no folder '{here}/none'"),
        ("fifo.h5", "this is a device; give a file name"),
        ("/dev/null", "this is a device; give a file name"),
    ],
)
def test_what_cannot_be_written_is_seen_before_the_run(path: str, reason: str, here: Path) -> None:
    Path("loop.h5").symlink_to("loop.h5")
    Path("dangling.h5").symlink_to("none/a.h5")
    os.mkfifo("fifo.h5")
    told = refused_before_the_run(path)
    assert told == f"{path}: cannot write the result: {reason.format(here=here)}"


HELD = (
    "{0}: cannot replace the file: Access is denied. The new result is in {1}: rename it, after"
    " closing programs that have the file open"
)


@pytest.fixture
def reader(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have files of one name open, as Windows refuses it."""
    replace = Path.replace

    def refusing(path: Path, target: Path) -> Path:
        if target.name == "a.h5":
            raise PermissionError(13, "Access is denied")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", refusing)


@pytest.mark.usefixtures("reader")
def test_what_a_reader_keeps_out_is_kept_beside_the_file() -> None:
    old, new = old_result(), old_result("new")
    Path("a.h5").write_bytes(old)
    assert refused() == HELD.format("a.h5", "a.new.h5")
    assert contents() == {"a.h5": old, "a.new.h5": new}
    # What was kept may have become somebody's own: it stays.
    assert refused(title="newer") == HELD.format("a.h5", "a.new2.h5")
    assert contents() == {"a.h5": old, "a.new.h5": new, "a.new2.h5": old_result("newer")}


@pytest.mark.usefixtures("reader")
def test_the_place_is_named_where_the_path_is_a_link(here: Path) -> None:
    (here / "disk").mkdir()
    Path("disk/a.h5").write_bytes(old_result())
    Path("b.h5").symlink_to("disk/a.h5")
    assert refused("b.h5") == HELD.format("b.h5", here / "disk" / "a.new.h5")
    assert (here / "disk" / "a.new.h5").read_bytes() == old_result("new")

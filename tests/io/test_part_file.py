"""Parts of files: beside their target, under a short name, and removed if they are left over."""

import errno
import os
import resource
import signal
from pathlib import Path
from typing import Any

import pytest

from frictionsim.errors import OutputError
from frictionsim.io import part_file
from frictionsim.io.atomic_write import check_place, replaced_atomically, write_atomically
from frictionsim.io.part_file import part_of
from tests.support.stopped_runs import stopped_at

LONG_NAME = "a" * 252 + ".h5"
pytestmark = pytest.mark.usefixtures("here")


def names() -> list[str]:
    return sorted(os.listdir())


def killed_while_writing(name: str) -> None:
    """Have a process killed in the middle of a file."""

    def work() -> int:
        with replaced_atomically(Path(name)) as part:
            part.write_text("half")
            os.kill(os.getpid(), signal.SIGKILL)
        return 0

    assert stopped_at(0, work, Path()) == -signal.SIGKILL


@pytest.mark.parametrize("name", ["a.h5", LONG_NAME])
def test_the_part_of_a_killed_process_is_removed_at_the_next_write(name: str) -> None:
    killed_while_writing(name)
    (part,) = names()
    assert len(part) == 51
    write_atomically(b"other", Path("b.h5"))
    assert part in names()
    write_atomically(b"whole", Path(name))
    assert names() == sorted([name, "b.h5"])
    killed_while_writing(name)
    check_place(Path(name))  # before a run too
    assert names() == sorted([name, "b.h5"])


def test_a_part_that_is_being_written_stays() -> None:
    with replaced_atomically(Path("a.h5")) as part:
        part.write_bytes(b"first")
        write_atomically(b"second", Path("a.h5"))  # by its own lock as another process would
        check_place(Path("a.h5"))
        assert part.read_bytes() == b"first"
    assert Path("a.h5").read_bytes() == b"first"
    assert names() == ["a.h5"]


def test_nothing_but_parts_of_the_target_is_removed() -> None:
    start = part_file._start(Path("a.h5"))
    Path("there").mkdir()
    Path(f"{start}0.part").symlink_to("there")
    Path(f"{start}1.part").mkdir()
    os.mkfifo(f"{start}2.part")
    Path(f"{start}3.note").touch()
    Path(f"{start}4.part").touch()  # left over
    before = names()
    write_atomically(b"whole", Path("a.h5"))
    assert names() == sorted({*before, "a.h5"} - {f"{start}4.part"})


def test_a_part_that_another_process_took_for_left_over_is_made_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    is_locked, seen = part_file._is_locked, []

    def removed_first(descriptor: int) -> bool:
        if not seen:
            for name in names():
                part_file._remove_unlocked(Path(name))
        seen.append(descriptor)
        return is_locked(descriptor)

    monkeypatch.setattr(part_file, "_is_locked", removed_first)
    write_atomically(b"whole", Path("a.h5"))
    assert (len(seen), names()) == (2, ["a.h5"])


def test_a_link_that_lies_there_is_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("precious").write_text("precious")
    digits = iter([b"\0" * 8, b"\1" * 8])
    monkeypatch.setattr(os, "urandom", lambda _: next(digits))
    Path(f"{part_file._start(Path('a.h5'))}{'00' * 8}.part").symlink_to("precious")
    with pytest.raises(OutputError, match=r"a\.h5: cannot write the result: File exists"):
        write_atomically(b"whole", Path("a.h5"))
    assert Path("precious").read_text() == "precious"


@pytest.mark.parametrize("locking", ["1", "true", "BEST_EFFORT"])
def test_hdf5_may_lock_all_that_it_writes(locking: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the environment has it lock, no part is locked, and none is taken for left over."""
    monkeypatch.setenv("HDF5_USE_FILE_LOCKING", locking)
    with part_of(Path("a.h5").absolute(), 0o666) as part:
        part_file.remove_left_over(Path("a.h5").absolute())
        assert part.path.exists()


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755])
def test_the_mode_of_a_replaced_file_is_kept(mode: int) -> None:
    path = Path("a.h5")
    path.touch()
    path.chmod(mode)
    with replaced_atomically(path) as part:
        assert part.stat().st_mode & 0o777 == 0o600
    assert path.stat().st_mode & 0o7777 == mode


def test_a_new_file_has_the_mode_of_the_umask() -> None:
    before = os.umask(0o027)
    try:
        write_atomically(b"", Path("a.h5"))
    finally:
        os.umask(before)
    assert Path("a.h5").stat().st_mode & 0o777 == 0o640


@pytest.mark.root
def test_the_owner_of_a_replaced_file_and_what_another_user_left_stay() -> None:
    Path("a.h5").touch()
    os.chown("a.h5", 2001, 2003)
    write_atomically(b"new", Path("a.h5"))
    found = Path("a.h5").stat()
    assert (found.st_uid, found.st_gid) == (2001, 2003)
    killed_while_writing("a.h5")
    (part,) = set(names()) - {"a.h5"}
    os.chown(part, 12345, 12345)
    write_atomically(b"whole", Path("a.h5"))
    assert names() == sorted([part, "a.h5"])


def test_another_group_has_no_rights_of_the_one_before(monkeypatch: pytest.MonkeyPatch) -> None:
    path = Path("a.h5")
    path.touch(0o644)
    path.chmod(0o664)
    kept = path.stat()
    stat = Path.stat

    def of_others(self: Path, **options: Any) -> os.stat_result:
        found = stat(self, **options)
        same = found.st_ino == kept.st_ino
        return os.stat_result((*found[:5], found.st_gid + same, *found[6:10]))

    def refused(*_: int) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "stat", of_others)
        patched.setattr(os, "fchown", refused)
        write_atomically(b"new", path)
    assert path.stat().st_mode & 0o777 == 0o604


def test_a_sticky_folder_is_seen_before_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    folder = Path("shared")
    folder.mkdir()
    folder.chmod(0o1777)
    (folder / "a.h5").touch()
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    with pytest.raises(OutputError, match="belongs to another user, and its folder lets nobody"):
        check_place(folder / "a.h5")


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("a" * 253 + ".h5", "File name too long"),
        ("loop.h5", "this is a link that leads to itself; give a file name"),
        ("dangling.h5", "there is no folder '{here}/none'"),
        ("fifo.h5", "this is a device; give a file name"),
    ],
)
def test_what_cannot_be_written_is_seen_before_the_run(path: str, reason: str, here: Path) -> None:
    Path("loop.h5").symlink_to("loop.h5")
    Path("dangling.h5").symlink_to("none/a.h5")
    os.mkfifo("fifo.h5")
    with pytest.raises(OutputError) as refused:
        check_place(Path(path))
    assert str(refused.value) == f"{path}: cannot write the result: {reason.format(here=here)}"


def test_a_full_disk_is_seen_before_the_run() -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, limits[1]))
    try:
        with pytest.raises(OutputError, match=r"a\.h5: cannot write the result: File too large"):
            check_place(Path("a.h5"))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert names() == []


def test_a_file_that_cannot_be_renamed_to_is_kept_beside(monkeypatch: pytest.MonkeyPatch) -> None:
    replace = Path.replace

    def busy(self: Path, target: Path) -> Path:
        if target.name == LONG_NAME:
            raise OSError(errno.EBUSY, "Device or resource busy")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", busy)
    kept = "a" * 248 + ".new.h5"
    with pytest.raises(OutputError) as refused:
        write_atomically(b"whole", Path(LONG_NAME))
    assert str(refused.value) == (
        f"{LONG_NAME}: cannot replace the file: Device or resource busy. The new result is in"
        f" {kept}: rename it"
    )
    assert names() == [kept]

"""The folder of compiled kernels: nobody but the user can have put anything into it."""

import os
import stat
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from frictionsim.mechanisms.belt_drive.compilation import usable_folder

NAME, OLD, OTHER = "kernels-0123", "kernels-0123456789abcdef", "kernels-fedcba9876543210"
WEEK = 7 * 24 * 3600.0


@pytest.fixture
def ours(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The program's folder in the user's cache, which is not there yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    return tmp_path / "home" / "frictionsim"


def used(folder: Path, seconds_ago: float = 0.0) -> Path:
    """Make a folder with a kernel that was used some time ago; return the kernel."""
    folder.mkdir(parents=True)
    kernel = folder / "kernel.nbi"
    kernel.write_text("compiled")
    os.utime(folder, (time.time() - seconds_ago,) * 2)
    return kernel


def test_it_is_the_users_alone_and_is_taken_again(ours: Path) -> None:
    assert usable_folder(NAME) == ours / NAME
    assert [stat.S_IMODE(folder.stat().st_mode) for folder in (ours, ours / NAME)] == [0o700] * 2
    (ours / NAME / "kernel.nbi").write_text("compiled")
    assert usable_folder(NAME) == ours / NAME
    assert (ours / NAME / "kernel.nbi").exists()


def replaced_by_link(folder: Path) -> None:
    folder.rename(folder.parent / "elsewhere")
    folder.symlink_to(folder.parent / "elsewhere")


SPOILT: dict[str, tuple[Callable[[Path], None], str]] = {
    "others write": (lambda folder: folder.chmod(0o1777), "others can write to '{}'"),
    "the group writes": (lambda folder: folder.chmod(0o770), "others can write to '{}'"),
    "a link": (replaced_by_link, "'{}' is a link or a file, not a folder"),
}


@pytest.mark.parametrize("of_build", [False, True])
@pytest.mark.parametrize("name", SPOILT)
def test_what_others_may_have_written_is_not_taken(
    name: str, of_build: bool, ours: Path, caplog: pytest.LogCaptureFixture
) -> None:
    used(ours / NAME)
    spoil, reason = SPOILT[name]
    spoilt = ours / NAME if of_build else ours
    spoil(spoilt)
    assert usable_folder(NAME) is None
    said = caplog.messages[-1]
    assert said.startswith("there is no private folder to keep compiled kernels in (")
    assert reason.format(spoilt) in said


@pytest.mark.root
@pytest.mark.parametrize("which", ["..", "."])
def test_the_folder_of_another_user_is_not_taken(which: str, ours: Path) -> None:
    used(ours / NAME)
    os.chown(ours / NAME / which, 12345, 12345)
    assert usable_folder(NAME) is None


def test_a_relative_place_is_not_taken(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would be in the folder the user is in, which may be that of another."""
    monkeypatch.setenv("HOME", str(here.parent / "user"))
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    own = here.parent / "user" / ".cache" / "frictionsim" / NAME  # as platformdirs has it by now
    assert usable_folder(NAME) in (None, own)
    assert list(here.iterdir()) == []


def test_a_new_folder_replaces_those_that_nobody_used_for_a_week(ours: Path) -> None:
    """But nothing that is no folder of a build, and nothing behind a link."""
    old, recent = used(ours / OLD, WEEK + 60.0), used(ours / OTHER, WEEK - 60.0)
    others = [used(ours / name, 2 * WEEK) for name in ("kernels-0123", f"old-{OLD}", "results")]
    precious, link = used(ours / "precious", 2 * WEEK), ours / OLD.replace("0", "f")
    link.symlink_to(precious.parent)
    os.utime(link, (time.time() - 2 * WEEK,) * 2, follow_symlinks=False)
    usable_folder("kernels-00")
    assert not old.exists()
    assert all(kernel.exists() for kernel in (recent, precious, link / "kernel.nbi", *others))


def test_a_folder_that_is_there_removes_nothing_and_is_used_from_now(ours: Path) -> None:
    old, known = used(ours / OLD, 2 * WEEK), used(ours / OTHER, 2 * WEEK).parent
    assert usable_folder(OTHER) == known
    assert old.exists()
    assert time.time() - known.stat().st_mtime < 60.0

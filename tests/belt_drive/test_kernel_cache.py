"""The folder of compiled kernels: nobody but the user can have put anything into it."""

import os
import stat
import time
from pathlib import Path

import pytest

from frictionsim.mechanisms.belt_drive.kernel_folder import usable_folder

NAME = "kernels-0123"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


@pytest.fixture
def kernel(home: Path) -> Path:
    """A compiled kernel in the folder of the build, from any origin."""
    return planted(home / "frictionsim" / NAME)


def planted(folder: Path) -> Path:
    kernel = folder / "kernels_0123" / "force.nbi"
    kernel.parent.mkdir(parents=True)
    folder.chmod(0o700)
    kernel.write_text("code")
    return kernel


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def test_it_is_in_the_users_cache(home: Path) -> None:
    assert usable_folder(NAME) == home / "frictionsim" / NAME
    assert list((home / "frictionsim" / NAME).iterdir()) == []


# --- what is in it --------------------------------------------------------------------------------


def test_an_existing_folder_of_the_user_is_taken_and_closed(kernel: Path, home: Path) -> None:
    ours = home / "frictionsim"
    ours.chmod(0o755)
    assert usable_folder(NAME) == ours / NAME
    assert kernel.exists()
    assert [mode(folder) for folder in (ours, ours / NAME)] == [0o700, 0o700]


def given_to_another(path: Path) -> None:
    os.chown(path, 12345, 12345, follow_symlinks=False)


@pytest.mark.parametrize("bits", [0o755, 0o775, 0o757, 0o1777])
def test_what_others_could_have_written_is_compiled_again(
    bits: int, kernel: Path, home: Path
) -> None:
    """Others enter the folder, and may write to what numba makes in it, with an umask of 002."""
    folder = home / "frictionsim" / NAME
    folder.chmod(bits)
    assert usable_folder(NAME) == folder
    assert not kernel.exists()
    assert mode(folder) == 0o700


def test_an_own_umask_does_not_cost_the_kernels(home: Path) -> None:
    """With umask 002 what numba makes is writable for the group, in a folder that is closed."""
    folder = usable_folder(NAME)
    assert folder is not None
    kernel = planted(folder)
    kernel.parent.chmod(0o775)
    kernel.chmod(0o664)
    assert usable_folder(NAME) == folder
    assert kernel.exists()


# --- where it is ----------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ["the link", "of a build"])
def test_no_link_is_followed(which: str, home: Path) -> None:
    elsewhere = home.parent / "elsewhere"
    kernel = planted(elsewhere)
    ours = home / "frictionsim"
    link = ours if which == "the link" else ours / NAME
    link.parent.mkdir(parents=True)
    link.symlink_to(elsewhere)
    assert usable_folder(NAME) is None
    assert kernel.read_text() == "code"


@pytest.mark.root
@pytest.mark.parametrize("which", [".", "frictionsim", f"frictionsim/{NAME}"])
def test_the_folder_of_another_user_is_not_taken(which: str, kernel: Path, home: Path) -> None:
    given_to_another(home / which)
    assert usable_folder(NAME) is None
    assert kernel.exists()


def test_a_folder_that_anyone_can_exchange_is_not_taken(kernel: Path, home: Path) -> None:
    home.chmod(0o777)
    assert usable_folder(NAME) is None
    assert kernel.exists()
    home.chmod(0o1777)  # sticky: nobody else can rename what is the user's
    assert usable_folder(NAME) == home / "frictionsim" / NAME


@pytest.mark.parametrize("place", ["cache", "~/.cache"])
def test_a_relative_place_is_not_taken(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would be in the folder the user is in, which may be that of another."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("HOME", str(tmp_path / "user"))
    monkeypatch.setenv("XDG_CACHE_HOME", place)
    own = tmp_path / "user" / ".cache" / "frictionsim" / NAME  # as platformdirs has it by now
    assert usable_folder(NAME) in (None, own)
    assert list(Path.cwd().iterdir()) == []


@pytest.mark.parametrize("which", [".", "frictionsim"])
def test_a_file_in_the_place_of_a_folder_is_said(
    which: str, home: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (home / which).parent.mkdir(parents=True, exist_ok=True)
    (home / which).write_text("no folder can be made here")
    assert usable_folder(NAME) is None
    assert caplog.messages[-1].startswith("there is no private folder to keep compiled kernels in")
    assert caplog.messages[-1].endswith("in 10 to 30 s: set XDG_CACHE_HOME to a folder of your own")
    assert str(home / which) in caplog.messages[-1]


# --- old ones -------------------------------------------------------------------------------------

OLD, OTHER = "kernels-0123456789abcdef", "kernels-fedcba9876543210"
WEEK = 7 * 24 * 3600.0


def folder_used(folder: Path, seconds_ago: float) -> Path:
    folder.mkdir(parents=True)
    (folder / "kernel.nbi").write_text("compiled")
    os.utime(folder, (time.time() - seconds_ago,) * 2)
    return folder


def test_a_new_folder_replaces_those_that_nobody_used_for_a_week(home: Path) -> None:
    ours = home / "frictionsim"
    old, recent = folder_used(ours / OLD, WEEK + 60.0), folder_used(ours / OTHER, WEEK - 60.0)
    assert usable_folder(NAME) == ours / NAME
    assert not old.exists()
    assert (recent / "kernel.nbi").exists()


def test_a_folder_that_is_there_removes_nothing_and_is_used_from_now(home: Path) -> None:
    ours = home / "frictionsim"
    old, known = folder_used(ours / OLD, 2 * WEEK), folder_used(ours / OTHER, 2 * WEEK)
    assert usable_folder(OTHER) == known
    assert old.exists()
    assert time.time() - known.stat().st_mtime < 60.0


@pytest.mark.parametrize(
    "name", ["kernels-0123", OLD + "0", "kernels-0123456789ABCDEF", "results", f"old-{OLD}"]
)
def test_what_is_no_folder_of_a_build_stays(name: str, home: Path) -> None:
    other = folder_used(home / "frictionsim" / name, 2 * WEEK)
    usable_folder(OTHER)
    assert (other / "kernel.nbi").exists()


def test_links_and_files_stay_and_nothing_behind_a_link_is_removed(home: Path) -> None:
    ours = home / "frictionsim"
    target = folder_used(home / "precious", 2 * WEEK)
    ours.mkdir()
    (ours / OLD).symlink_to(target)
    file = ours / "kernels-00000000000000ff"
    file.write_text("a file")
    for path in (ours / OLD, file):
        os.utime(path, (time.time() - 2 * WEEK,) * 2, follow_symlinks=False)
    usable_folder(OTHER)
    assert (target / "kernel.nbi").exists()
    assert (ours / OLD).is_symlink()
    assert file.exists()

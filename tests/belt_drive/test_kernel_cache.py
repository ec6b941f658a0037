"""The folder of compiled kernels: the user's cache, else a private one."""

import getpass
import os
import stat
import tempfile
import time
from pathlib import Path

import pytest

from frictionsim.mechanisms.belt_drive.kernels import cache
from frictionsim.mechanisms.belt_drive.kernels.cache import cache_folder, usable_folder

NAME = "kernels-0123"


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home"))
    return tmp_path / "home"


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    return tmp_path / "tmp"


def block(home: Path) -> None:
    home.write_text("no folder can be made here")


def mode(folder: Path) -> int:
    return stat.S_IMODE(folder.stat().st_mode)


def test_it_is_in_the_users_cache(home: Path, temporary: Path) -> None:
    assert cache_folder(NAME) == home / "frictionsim" / NAME
    assert usable_folder(NAME) == home / "frictionsim" / NAME
    assert list((home / "frictionsim" / NAME).iterdir()) == list(temporary.iterdir()) == []


def test_without_one_it_is_private_and_kept_for_the_next_process(
    home: Path, temporary: Path
) -> None:
    block(home)
    folder = usable_folder(NAME)
    assert folder == usable_folder(NAME)
    assert folder.relative_to(temporary).parts[1:] == (NAME,)
    assert mode(folder.parent) == 0o700


def test_a_user_without_a_name_has_one(
    home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown() -> str:
        raise KeyError("getpwuid(): uid not found: 12345")

    block(home)
    monkeypatch.setattr(getpass, "getuser", unknown)
    assert usable_folder(NAME) == temporary / "frictionsim-user" / NAME


def test_a_name_cannot_lead_elsewhere(
    home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block(home)
    monkeypatch.setattr(getpass, "getuser", lambda: "DOMAIN\\a/../b")
    assert usable_folder(NAME) == temporary / "frictionsim-DOMAIN_a____b" / NAME


def test_the_link_of_another_user_is_not_followed(
    home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block(home)
    monkeypatch.setattr(getpass, "getuser", lambda: "me")
    (home.parent / "elsewhere").mkdir()
    link = temporary / "frictionsim-me"
    link.symlink_to(home.parent / "elsewhere")
    lstat = Path.lstat

    def of_another(path: Path) -> os.stat_result:
        found = lstat(path)
        return os.stat_result((*found[:4], found.st_uid + 1, *found[5:10]))

    monkeypatch.setattr(Path, "lstat", of_another)
    folder = usable_folder(NAME)
    assert folder.parent == temporary
    assert folder.name.startswith("frictionsim-")
    assert folder != link
    assert mode(folder) == 0o700
    assert not list((home.parent / "elsewhere").iterdir())


def test_a_folder_that_cannot_be_written_to_is_not_taken(
    home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows, where `os.access` allows everything."""
    tried = cache.NamedTemporaryFile

    def refused(dir: Path) -> object:
        if dir.is_relative_to(home):
            raise PermissionError(13, "Access is denied")
        return tried(dir=dir)

    monkeypatch.setattr(cache, "NamedTemporaryFile", refused)
    assert usable_folder(NAME).parent.parent == temporary


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
    folder = usable_folder(NAME)
    assert not old.exists()
    assert (recent / "kernel.nbi").exists()
    assert folder.exists()


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
    os.utime(ours / OLD, (time.time() - 2 * WEEK,) * 2, follow_symlinks=False)
    file = ours / "kernels-00000000000000ff"
    file.write_text("a file")
    os.utime(file, (time.time() - 2 * WEEK,) * 2)
    usable_folder(OTHER)
    assert (target / "kernel.nbi").exists()
    assert (ours / OLD).is_symlink()
    assert file.exists()


def test_what_cannot_be_removed_is_no_obstacle(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder_used(home / "frictionsim" / OLD, 2 * WEEK)

    def vanished(path: Path) -> os.stat_result:
        raise FileNotFoundError(path)

    monkeypatch.setattr(Path, "lstat", vanished)
    assert usable_folder(OTHER).exists()

"""The folder of compiled kernels: the user's cache, else a private one."""

import getpass
import os
import stat
import tempfile
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

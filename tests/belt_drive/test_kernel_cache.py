"""The folder of compiled kernels: nobody but the user can have put anything into it."""

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
    assert folder is not None
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


def planted(folder: Path) -> Path:
    """Return the compiled kernel that another user has put into the folder of a build."""
    kernel = folder / "kernels_0123" / "force.nbi"
    kernel.parent.mkdir(parents=True)
    kernel.write_text("code of another user")
    return kernel


def given_to_another(path: Path) -> None:
    if os.geteuid() != 0:
        pytest.skip("only root can give files to another user")
    os.chown(path, 12345, 12345, follow_symlinks=False)


def test_an_existing_folder_of_the_user_is_taken_and_closed(home: Path) -> None:
    kernel = planted(home / "frictionsim" / NAME)
    for folder in (home / "frictionsim", home / "frictionsim" / NAME):
        folder.chmod(0o755)
    assert usable_folder(NAME) == home / "frictionsim" / NAME
    assert kernel.exists()
    assert mode(home / "frictionsim") == mode(home / "frictionsim" / NAME) == 0o700


@pytest.mark.parametrize("bits", [0o775, 0o757, 0o777, 0o1777])
def test_what_others_could_write_to_is_compiled_again(bits: int, home: Path) -> None:
    kernel = planted(home / "frictionsim" / NAME)
    (home / "frictionsim" / NAME).chmod(bits)
    assert usable_folder(NAME) == home / "frictionsim" / NAME
    assert not kernel.exists()
    assert mode(home / "frictionsim" / NAME) == 0o700


@pytest.mark.parametrize("which", ["file", "folder"])
def test_what_others_could_change_in_an_open_folder_is_compiled_again(
    which: str, home: Path
) -> None:
    kernel = planted(home / "frictionsim" / NAME)
    (home / "frictionsim" / NAME).chmod(0o755)
    (kernel if which == "file" else kernel.parent).chmod(0o777)
    usable_folder(NAME)
    assert not kernel.exists()


def test_an_own_umask_does_not_cost_the_kernels(home: Path) -> None:
    """With umask 002 what numba makes is writable for the group, in a folder that is closed."""
    folder = usable_folder(NAME)
    assert folder is not None
    kernel = planted(folder)
    kernel.chmod(0o664)
    kernel.parent.chmod(0o775)
    assert usable_folder(NAME) == folder
    assert kernel.exists()


@pytest.mark.parametrize("which", ["the link", "of a build", "a kernel"])
def test_no_link_is_followed(which: str, home: Path, temporary: Path) -> None:
    elsewhere = home.parent / "elsewhere"
    kernel = planted(elsewhere)
    ours = home / "frictionsim"
    link = {"the link": ours, "of a build": ours / NAME, "a kernel": ours / NAME / "k"}[which]
    link.parent.mkdir(parents=True)
    link.symlink_to(elsewhere)
    folder = usable_folder(NAME)
    assert folder is not None
    if which == "a kernel":
        assert (folder, list(folder.iterdir())) == (ours / NAME, [])
    else:
        assert folder.is_relative_to(temporary)
    assert kernel.read_text() == "code of another user"


@pytest.mark.parametrize("which", ["frictionsim", f"frictionsim/{NAME}"])
def test_a_file_in_the_place_of_a_folder_is_no_obstacle(
    which: str, home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(getpass, "getuser", lambda: "me")
    (home / which).parent.mkdir(parents=True)
    (home / which).write_text("")
    assert usable_folder(NAME) == temporary / "frictionsim-me" / NAME


@pytest.mark.parametrize("which", [".", "frictionsim", f"frictionsim/{NAME}"])
def test_the_folder_of_another_user_is_not_taken(
    which: str, home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = planted(home / "frictionsim" / NAME)
    given_to_another(home / which)
    folder = usable_folder(NAME)
    assert folder is not None
    assert folder.is_relative_to(temporary)
    assert kernel.exists()


@pytest.mark.parametrize("which", ["kernels_0123", "kernels_0123/force.nbi"])
def test_kernels_of_another_user_are_removed(which: str, home: Path) -> None:
    folder = home / "frictionsim" / NAME
    kernel = planted(folder)
    given_to_another(folder / which)
    assert usable_folder(NAME) == folder
    assert not kernel.exists()


def test_another_user_is_told_by_the_number(
    home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As the tests above, where they cannot give files to another user."""
    planted(home / "frictionsim" / NAME)
    if os.geteuid() == 0:
        given_to_another(home / "frictionsim" / NAME)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: home.stat().st_uid + 1)
    folder = usable_folder(NAME)
    assert folder is None or folder.is_relative_to(temporary)


def blocked(monkeypatch: pytest.MonkeyPatch, home: Path, temporary: Path) -> None:
    """Let a file lie where each of the folders would be."""
    monkeypatch.setattr(getpass, "getuser", lambda: "me")
    block(home)
    (temporary / "frictionsim-me").write_text("")


def test_without_a_private_folder_nothing_is_kept_which_is_said(
    home: Path,
    temporary: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    blocked(monkeypatch, home, temporary)
    assert usable_folder(NAME) is None
    assert caplog.messages[-1] == (
        f"there is no private folder to keep compiled kernels in ('{home}': File exists;"
        f" '{temporary}/frictionsim-me' is a link or a file, not a folder); every run of a belt"
        " compiles them anew, which takes 10 to 30 s: set XDG_CACHE_HOME to a folder of your own"
    )


def test_a_kernel_is_compiled_where_nothing_can_be_kept(
    home: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from frictionsim.mechanisms.belt_drive.kernels import jit

    blocked(monkeypatch, home, temporary)
    jit._folder.cache_clear()
    try:
        assert jit.kernel(doubled)(2.0) == 4.0
    finally:
        jit._folder.cache_clear()


def doubled(x: float) -> float:
    return 2.0 * x


def test_numba_is_told_the_folder_again_if_the_environment_changed_it(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from numba.core import config

    from frictionsim.mechanisms.belt_drive.kernels import jit

    jit._folder.cache_clear()
    try:
        jit.kernel(doubled).compiled  # noqa: B018
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "planted"))
        config.reload_config()  # as numba does before it compiles
        assert jit.kernel(doubled)(2.0) == 4.0
    finally:
        jit._folder.cache_clear()
    assert not (tmp_path / "planted").exists()
    assert list((home / "frictionsim").glob("kernels-*/*/*.nbi"))


@pytest.mark.parametrize("home_of_user", ["~/.cache", "cache"])
def test_a_relative_cache_is_not_taken(
    home_of_user: str, temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would be in the folder the user is in, which may be that of another."""
    monkeypatch.chdir(temporary.parent)
    monkeypatch.setattr(cache, "user_cache_path", lambda *_, **__: Path(home_of_user))
    folder = usable_folder(NAME)
    assert folder is not None
    assert folder.is_relative_to(temporary)
    assert [path.name for path in temporary.parent.iterdir()] == ["tmp"]


def test_a_user_without_a_home_is_no_obstacle(
    temporary: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unknown(*_: object, **__: object) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(cache, "user_cache_path", unknown)
    folder = usable_folder(NAME)
    assert folder is not None
    assert folder.is_relative_to(temporary)


def test_a_folder_that_anyone_can_exchange_is_not_taken(home: Path, temporary: Path) -> None:
    kernel = planted(home / "frictionsim" / NAME)
    home.chmod(0o777)
    folder = usable_folder(NAME)
    assert folder is not None
    assert folder.is_relative_to(temporary)
    assert kernel.exists()
    home.chmod(0o1777)  # sticky: nobody else can rename what is the user's
    assert usable_folder(NAME) == home / "frictionsim" / NAME


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
    folder = usable_folder(NAME)
    assert folder is not None
    assert folder.parent.parent == temporary


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
    os.utime(ours / OLD, (time.time() - 2 * WEEK,) * 2, follow_symlinks=False)
    file = ours / "kernels-00000000000000ff"
    file.write_text("a file")
    os.utime(file, (time.time() - 2 * WEEK,) * 2)
    usable_folder(OTHER)
    assert (target / "kernel.nbi").exists()
    assert (ours / OLD).is_symlink()
    assert file.exists()


def test_what_cannot_be_removed_is_no_obstacle(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = folder_used(home / "frictionsim" / OLD, 2 * WEEK)
    lstat = Path.lstat

    def vanished(path: Path) -> os.stat_result:
        if path == old:
            raise FileNotFoundError(path)
        return lstat(path)

    monkeypatch.setattr(Path, "lstat", vanished)
    assert usable_folder(OTHER) == home / "frictionsim" / OTHER

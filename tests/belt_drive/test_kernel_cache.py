"""The folder of compiled kernels: nobody but the user can have put anything into it."""

import os
import stat
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from frictionsim.mechanisms.belt_drive import kernel_folder as cache
from frictionsim.mechanisms.belt_drive import numba_kinds
from frictionsim.mechanisms.belt_drive.kernel_folder import usable_folder
from frictionsim.solvers.stepper import reduced_step

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


@pytest.mark.usefixtures("kernel")
def test_another_user_is_named_by_the_number(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the tests above, where they cannot give files to another user."""
    monkeypatch.setattr(os, "geteuid", lambda: home.stat().st_uid + 1)
    assert usable_folder(NAME) is None


def test_a_folder_that_anyone_can_exchange_is_not_taken(kernel: Path, home: Path) -> None:
    home.chmod(0o777)
    assert usable_folder(NAME) is None
    assert kernel.exists()
    home.chmod(0o1777)  # sticky: nobody else can rename what is the user's
    assert usable_folder(NAME) == home / "frictionsim" / NAME


def no_home(*_: object, **__: object) -> Path:
    raise RuntimeError("Could not determine home directory.")


@pytest.mark.parametrize(
    "place", [no_home, lambda *_, **__: Path("cache"), lambda *_, **__: Path("~/.cache")]
)
def test_no_home_and_a_relative_one_are_not_taken(
    place: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would be in the folder the user is in, which may be that of another."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cache, "user_cache_path", place)
    assert usable_folder(NAME) is None
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_to_is_not_taken(
    home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows, where `os.access` allows everything."""

    def refused(dir: Path) -> object:
        raise PermissionError(13, "Access is denied")

    monkeypatch.setattr(cache, "NamedTemporaryFile", refused)
    assert usable_folder(NAME) is None


# --- kernels --------------------------------------------------------------------------------------


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """No folder is known yet."""
    monkeypatch.setattr(numba_kinds, "folder_of_build", cache.folder_of_build.__wrapped__)


def doubled(x: float) -> float:
    return 2.0 * x


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize("which", [".", "frictionsim"])
def test_a_file_in_the_place_of_a_folder_is_said_and_kernels_are_compiled(
    which: str, home: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (home / which).parent.mkdir(parents=True, exist_ok=True)
    (home / which).write_text("no folder can be made here")
    assert numba_kinds.kernel(doubled)(2.0) == 4.0
    assert usable_folder(NAME) is None
    assert caplog.messages[-1].startswith("there is no private folder to keep compiled kernels in")
    assert caplog.messages[-1].endswith("in 10 to 30 s: set XDG_CACHE_HOME to a folder of your own")
    assert str(home / which) in caplog.messages[-1]


@pytest.mark.usefixtures("fresh")
def test_numba_gets_the_folder_again_if_the_environment_changed_it(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from numba.core import config

    kernel = numba_kinds.kernel(reduced_step)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "planted"))
    config.reload_config()  # as numba does before it compiles
    assert kernel(1.0, 32.0) == pytest.approx(0.45)
    assert not (tmp_path / "planted").exists()
    assert list((home / "frictionsim").glob("kernels-*/*/*.nbi"))


@pytest.mark.usefixtures("fresh")
def test_a_kernel_from_elsewhere_is_not_kept(home: Path) -> None:
    """The name of a build does not tell one source of it from another."""
    assert numba_kinds.kernel(doubled)(2.0) == 4.0
    assert not list(home.rglob("*.nbi"))
    assert numba_kinds.kernel(reduced_step)(1.0, 32.0) == pytest.approx(0.45)
    assert len(list(home.rglob("*.nbi"))) == 1


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


def test_what_cannot_be_removed_is_no_obstacle(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    old = folder_used(home / "frictionsim" / OLD, 2 * WEEK)
    lstat = Path.lstat

    def vanished(path: Path) -> os.stat_result:
        if path == old:
            raise FileNotFoundError(path)
        return lstat(path)

    monkeypatch.setattr(Path, "lstat", vanished)
    assert usable_folder(OTHER) == home / "frictionsim" / OTHER

"""Files are whole or not there: new content is a part beside its target, and is then renamed."""

import os
import signal
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import OutputError
from tests.support.old_results import old_result
from tests.support.scenarios import pulley, run_anew
from tests.support.stopped_runs import stopped_at

pytestmark = pytest.mark.usefixtures("here")


def contents() -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in Path().iterdir()}


@cache
def result(title: str = "new") -> fs.Result:
    """Return the result of a short run, whose file is `old_result(title)`."""
    return fs.Result(run_anew(pulley(title=title, solver__duration=0.01)))


def killed_while_writing() -> str:
    """Have a process killed before it renames its part; return the name of what it leaves."""

    def work() -> int:
        os.fsync = lambda descriptor: os.kill(os.getpid(), signal.SIGKILL)
        result().save("a.h5")
        return 0

    before = set(contents())
    assert stopped_at(0, work, Path()) == -signal.SIGKILL
    (left,) = set(contents()) - before
    return left


def test_the_part_of_a_killed_process_goes_with_the_next_write_of_its_name() -> None:
    left = killed_while_writing()
    host = os.uname().nodename
    assert left.startswith(f".a.h5.{host}.")
    assert left.endswith(".part")
    process = left.removeprefix(f".a.h5.{host}.").split(".")[0]
    others = {
        f".a.h5.{host}.{os.getpid()}.7.part",  # of a process that runs
        f".a.h5.elsewhere.{process}.0.part",  # of another host
        f".b.h5.{host}.{process}.0.part",  # of another file
    }
    for name in others:
        Path(name).write_bytes(b"theirs")
    result().save("a.h5")
    assert set(contents()) == {"a.h5", *others}
    assert Path("a.h5").read_bytes() == old_result("new")


def test_resume_removes_it_as_well() -> None:
    fs.solve(pulley(), output="a.h5", max_steps=20)
    killed_while_writing()
    fs.resume("a.partial.h5")
    assert set(contents()) == {"a.h5"}


@pytest.mark.parametrize("mode", [0o600, 0o664])
def test_the_mode_of_a_replaced_file_is_kept(mode: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its part is private until then."""
    Path("a.h5").touch()
    Path("a.h5").chmod(mode)
    modes, change = list[int](), Path.chmod

    def seen(part: Path, new: int) -> None:
        modes.append(part.stat().st_mode & 0o777)
        change(part, new)

    monkeypatch.setattr(Path, "chmod", seen)
    result().save("a.h5")
    assert modes == [0o600]
    assert Path("a.h5").stat().st_mode & 0o7777 == mode


def test_a_new_file_has_the_mode_of_the_umask() -> None:
    before = os.umask(0o027)
    try:
        result().save("a.h5")
    finally:
        os.umask(before)
    assert Path("a.h5").stat().st_mode & 0o777 == 0o640


DEVICE = "this is a device, or a link that leads to itself; give a file name"


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("a" * 260 + ".h5", "File name too long"),
        ("loop.h5", DEVICE),
        ("dangling.h5", "there is no folder '{here}/none'"),
        ("fifo.h5", DEVICE),
        ("/dev/null", DEVICE),
        ("old.h5", "the existing file is read-only"),
    ],
)
def test_what_cannot_be_written_is_seen_before_the_run(path: str, reason: str, here: Path) -> None:
    Path("loop.h5").symlink_to("loop.h5")
    Path("dangling.h5").symlink_to("none/a.h5")
    os.mkfifo("fifo.h5")
    Path("old.h5").touch(0o444)
    steps: list[float] = []
    with pytest.raises(OutputError) as caught:
        fs.solve(pulley(), output=path, progress=steps.append)
    assert steps == []
    assert str(caught.value) == f"{path}: cannot write the result: {reason.format(here=here)}"


def test_a_link_is_followed() -> None:
    Path("disk").mkdir()
    Path("a.h5").symlink_to("disk/b.h5")
    result().save("a.h5")
    assert Path("a.h5").is_symlink()
    assert Path("disk/b.h5").read_bytes() == old_result("new")


def test_threads_may_write_one_name() -> None:
    with ThreadPoolExecutor(3) as threads:
        paths = list(threads.map(result().save, ["a.h5"] * 12))
    assert paths == [Path("a.h5")] * 12
    assert contents() == {"a.h5": old_result("new")}

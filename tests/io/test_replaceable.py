"""Foreign files stay: a file replaces only one of its own kind."""

import errno
import itertools
import os
import tempfile
from pathlib import Path

import h5py
import pytest

import frictionsim as fs
from tests.support.cases import slow
from tests.support.file_sizes import limited_files
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
COST = ["cost", PULLEY, "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"]
CHANGED = ", or was changed by another program,"
GIVE = "and is not overwritten; give another name\n"
pytestmark = pytest.mark.usefixtures("here")


def solve(*options: str) -> int:
    return fs.run_command_line(["solve", PULLEY, "-q", *options])


def foreign(path: str, kind: str) -> bytes:
    """Write a file of the user; return its content."""
    if kind == "hdf5":
        with h5py.File(path, "w") as file:
            file["measured"] = [1.0, 2.0]
    else:
        content = {
            "text": b"<?xml?><html/>\n",
            "scenario": Path(PULLEY).read_bytes(),
            "PNG": b"\x89PNG ",
        }
        Path(path).write_bytes(content[kind])
    return Path(path).read_bytes()


@pytest.mark.parametrize("kind", ["text", "hdf5", "scenario", "PNG"])
def test_no_other_file_is_replaced(kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert solve("-o", "r.h5") == 0
    # Refused before the run, which would tell that it has no time.
    run = ["solve", PULLEY, "-q", "--max-wall", "1e-9", "-o"]
    for name, described, command in (
        ("a.h5", "result: the existing file is not a result", run),
        ("a.nc", "result: the existing file is not a result", run),
        ("a", "result: the existing file is not a result", run),
        ("a.csv", "table: the existing file is not a table of costs", [*COST, "--csv"]),
        ("b.png", "picture: the existing file is not a picture", ["plot", "r.h5", "-o"]),
    ):
        if kind == "PNG" and "picture" in described:
            continue
        before = foreign(name, kind)
        capsys.readouterr()
        assert fs.run_command_line([*command, name]) == 4
        described += CHANGED if command == run else ""
        expected = f"frictionsim: {name}: cannot write the {described} {GIVE}"
        assert capsys.readouterr().err == expected
        assert Path(name).read_bytes() == before


@pytest.mark.parametrize("damage", ["none", "flipped", "empty"])
def test_a_result_is_replaced_also_if_it_was_damaged(damage: str) -> None:
    assert solve("-o", "a.h5") == 0
    whole = Path("a.h5").read_bytes()
    flipped = whole[:2000] + bytes([whole[2000] ^ 1]) + whole[2001:]
    Path("a.h5").write_bytes({"none": whole, "flipped": flipped, "empty": b""}[damage])
    assert solve("-o", "a.h5") == 0
    assert Path("a.h5").read_bytes() == whole


def test_a_result_and_a_sweep_replace_only_their_like(
    capsys: pytest.CaptureFixture[str],
) -> None:
    vary = ["--vary", "mechanism.load=[2000, 2100]", "--workers", "1"]
    commands = {
        "result": ["solve", PULLEY, "-q", "-o"],
        "sweep": ["sweep", PULLEY, *vary, "-q", "-o"],
    }
    for kind, command in commands.items():
        assert fs.run_command_line([*command, f"{kind}.h5"]) == 0
    for (kind, command), other in itertools.product(commands.items(), commands):
        before = Path(f"{other}.h5").read_bytes()
        capsys.readouterr()
        assert fs.run_command_line([*command, f"{other}.h5"]) == (0 if other == kind else 4)
        if other != kind:
            said = f"the existing file is not a {kind}{CHANGED} {GIVE}"
            assert capsys.readouterr().err.endswith(said)
            assert Path(f"{other}.h5").read_bytes() == before


def test_a_link_to_the_other_file_of_a_command_is_that_file() -> None:
    Path("link").symlink_to("a.png")
    assert fs.run_command_line([*COST, "--plot", "a.png", "--csv", "link"]) == 2
    assert os.listdir() == ["link"]


BLOCK = 4096  # bytes, which are tried before a run


@pytest.mark.parametrize("suffix", [".png", slow(".svg"), slow(".pdf")])
def test_a_picture_is_whole_or_the_old_one(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert solve("-o", "r.h5") == 0
    old = {".png": b"\x89PNG\r\n\x1a\n", ".svg": b"<?xml?><svg", ".pdf": b"%PDF-"}[
        suffix
    ] + b"old" * 4000
    picture = Path(f"a{suffix}")
    picture.write_bytes(old)
    capsys.readouterr()
    with limited_files(BLOCK):
        assert fs.run_command_line(["plot", "r.h5", "-o", picture.name]) == 4
    message = f"frictionsim: {picture}: cannot write the picture: File too large\n"
    assert capsys.readouterr().err == message
    assert picture.read_bytes() == old
    assert sorted(os.listdir()) == sorted([picture.name, "r.h5"])


def test_tables_are_whole_or_the_old_ones(capsys: pytest.CaptureFixture[str]) -> None:
    """And what cannot be written keeps no other file from being written."""
    old = b"law,backend,setting," + b"old" * 4000
    Path("a.csv").write_bytes(old)
    # A table that is longer than what is tried before: the title is in each row.
    long = [*COST, "--set", f'title="{"t" * BLOCK}"']
    with limited_files(BLOCK):
        assert fs.run_command_line([*long, "--csv", "a.csv", "--plot", "a.png"]) == 4
    assert capsys.readouterr().err.splitlines() == [
        "frictionsim: a.csv: cannot write the table: File too large",
        "a.png: cannot write the picture: File too large",
    ]
    assert Path("a.csv").read_bytes() == old
    assert os.listdir() == ["a.csv"]


def refusing(monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    """Let nothing get a name in a folder, but checkpoints."""
    replace = Path.replace

    def refused(path: Path, target: Path) -> Path:
        if target.parent == folder and ".partial" not in target.name:
            raise OSError(errno.ENOSPC, "no room")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", refused)


def test_a_result_that_cannot_be_written_is_elsewhere_and_its_run_can_be_resumed(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    often = ["--set", "output.checkpoint=1e-9"]  # s, of wall time: from the first step
    assert solve("-o", "whole.h5", *often) == 0
    (here / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(here / "tmp"))
    capsys.readouterr()
    with monkeypatch.context() as patched:
        refusing(patched, here)
        assert solve("-o", "a.h5", *often) == 4
    (kept,) = (here / "tmp").glob("*/*")
    assert capsys.readouterr().err == (
        f"frictionsim: a.h5: cannot write the result: no room. The new result is in {kept}: move it"
        " from there. The last checkpoint is in a.partial.h5: 'frictionsim resume a.partial.h5'"
        " continues the run\n"
    )
    assert kept.read_bytes() == Path("whole.h5").read_bytes()
    assert fs.run_command_line(["resume", "a.partial.h5", "-q"]) == 0
    assert Path("a.h5").read_bytes() == kept.read_bytes()


def test_what_was_put_there_during_the_run_stays(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(here / "tmp"))
    with pytest.raises(fs.OutputError) as refused:
        fs.solve(PULLEY, output="a.h5", progress=lambda t: foreign("a.h5", "text"))
    (kept,) = (here / "tmp").glob("*/a.h5")
    assert str(refused.value) == (
        f"a.h5: cannot write the result: the existing file is not a result{CHANGED} and is not"
        f" overwritten; give another name. The new result is in {kept}: move it from there"
    )
    assert Path("a.h5").read_bytes() == b"<?xml?><html/>\n"
    assert fs.open(kept).status == "done"

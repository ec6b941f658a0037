"""Foreign files stay: a file replaces only one of its own kind."""

import itertools
import os
import tempfile
from pathlib import Path
from typing import Any

import h5py
import pytest

from frictionsim.cli.commands import run_command_line
from frictionsim.errors import OutputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.io.destination import Destination
from frictionsim.results import Column, Record
from frictionsim.work_precision import table
from tests.support.cases import slow
from tests.support.file_sizes import limited_files
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
COST = ["cost", PULLEY, "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"]
UNSEALED = "was changed or made by another program (it has no checksum)"
GIVE = "and is not overwritten; give another name\n"
pytestmark = pytest.mark.usefixtures("here")


def solve(*options: str) -> int:
    return run_command_line(["solve", PULLEY, "-q", *options])


def foreign(path: str, kind: str) -> bytes:
    """Write a file of the user; return its content."""
    if kind == "hdf5":
        with h5py.File(path, "w") as file:
            file["measured"] = [1.0, 2.0]
    else:
        content = {"text": b"precious\n", "scenario": Path(PULLEY).read_bytes(), "PNG": b"\x89PNG "}
        Path(path).write_bytes(content[kind])
    return Path(path).read_bytes()


@pytest.mark.parametrize("kind", ["text", "hdf5", "scenario", "PNG"])
def test_no_other_file_is_replaced(
    kind: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solve("-o", "r.h5") == 0
    # Refused before the run.
    monkeypatch.setattr("frictionsim.api.solving.run", None)
    monkeypatch.setattr("frictionsim.api.studies.cost_with", None)
    run = ["solve", PULLEY, "-q", "-o"]
    for name, described, command in (
        ("a.h5", "result: the existing file is not a result", run),
        ("a.nc", "result: the existing file is not a result", run),
        ("a", "result: the existing file is not a result", run),
        ("b.h5", "table: the existing file is not a table of costs", [*COST, "-o"]),
        ("a.csv", "table: the existing file is not a table of costs", [*COST, "--csv"]),
        ("a.png", "picture: the existing file is not a picture", [*COST, "--plot"]),
        ("b.png", "picture: the existing file is not a picture", ["plot", "r.h5", "-o"]),
        ("b.pdf", "picture: the existing file is not a picture", ["plot", "r.h5", "-o"]),
    ):
        if kind == "PNG" and "picture" in described:
            continue
        before = foreign(name, kind)
        capsys.readouterr()
        assert run_command_line([*command, name]) == 4
        if kind == "hdf5" and command in (run, [*COST, "-o"]):
            described = f"{described.split(':')[0]}: the existing file {UNSEALED}"
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


def test_a_result_a_sweep_and_a_table_of_costs_replace_only_their_like(
    capsys: pytest.CaptureFixture[str],
) -> None:
    vary = ["--vary", "mechanism.load=[2000, 2100]", "--workers", "1"]
    commands = {
        "result": ["solve", PULLEY, "-q", "-o"],
        "sweep": ["sweep", PULLEY, *vary, "-q", "-o"],
        "table of costs": [*COST, "-o"],
    }
    for kind, command in commands.items():
        assert run_command_line([*command, f"{kind}.h5"]) == 0
    for (kind, command), other in itertools.product(commands.items(), commands):
        before = Path(f"{other}.h5").read_bytes()
        capsys.readouterr()
        assert run_command_line([*command, f"{other}.h5"]) == (0 if other == kind else 4)
        if other != kind:
            said = f"the existing file is not a {kind} {GIVE}"
            assert capsys.readouterr().err.endswith(said)
            assert Path(f"{other}.h5").read_bytes() == before


def test_xml_that_is_no_picture_stays() -> None:
    assert solve("-o", "r.h5") == 0
    for name, text, code in (("a.svg", "<?xml?><html/>", 4), ("b.svg", "<?xml?><svg/>", 0)):
        Path(name).write_text(text)
        assert run_command_line(["plot", "r.h5", "-o", name]) == code
        assert (Path(name).read_bytes() == text.encode()) is bool(code)


def test_a_link_to_the_other_file_of_a_command_is_that_file() -> None:
    Path("link").symlink_to("a.h5")
    assert run_command_line([*COST, "-o", "a.h5", "--csv", "link"]) == 2
    assert os.listdir() == ["link"]


BLOCK = 4096  # bytes, which are tried before a run


@pytest.mark.parametrize("suffix", [".png", slow(".svg"), ".pdf"])
def test_a_picture_is_whole_or_the_old_one(suffix: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert solve("-o", "r.h5") == 0
    old = {".png": b"\x89PNG\r\n\x1a\n", ".svg": b"<svg", ".pdf": b"%PDF-"}[suffix] + b"old" * 4000
    picture = Path(f"a{suffix}")
    picture.write_bytes(old)
    capsys.readouterr()
    with limited_files(BLOCK):
        assert run_command_line(["plot", "r.h5", "-o", picture.name]) == 4
    message = f"frictionsim: {picture}: cannot write the picture: File too large\n"
    assert capsys.readouterr().err == message
    assert picture.read_bytes() == old
    assert sorted(os.listdir()) == sorted([picture.name, "r.h5"])


def test_tables_are_whole_or_the_old_ones(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what cannot be written keeps no other file from being written."""
    old = b"law,backend,setting," + b"old" * 4000
    Path("a.csv").write_bytes(old)
    columns_of = table._columns

    def of_many_rows(study: Any) -> list[Column]:
        return [column._replace(values=[*column.values] * 20) for column in columns_of(study)]

    monkeypatch.setattr(table, "_columns", of_many_rows)
    with limited_files(BLOCK):
        assert run_command_line([*COST, "--csv", "a.csv", "-o", "a.h5"]) == 4
    assert capsys.readouterr().err.splitlines() == [
        "frictionsim: a.h5: cannot write the table: File too large",
        "a.csv: cannot write the table: File too large",
    ]
    assert Path("a.csv").read_bytes() == old
    assert os.listdir() == ["a.csv"]
    assert run_command_line([*COST, "--csv", "a.csv"]) == 0
    assert Path("a.csv").read_bytes() != old


def refusing(monkeypatch: pytest.MonkeyPatch, *folders: Path) -> None:
    """Let nothing be written to folders, but checkpoints."""
    write = hdf5_writer.write

    def refused(run: Record, path: Path, part: Any = None) -> None:
        if run.status == "done" and path.absolute().parent in folders:
            raise OutputError(f"{path}: cannot write the result: no room")
        write(run, path, part)

    monkeypatch.setattr(hdf5_writer, "write", refused)


def test_a_result_that_cannot_be_written_is_elsewhere_and_its_run_can_be_resumed(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert solve("-o", "whole.h5", "--set", "output.checkpoint=1e-3") == 0
    (here / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(here / "tmp"))
    capsys.readouterr()
    with monkeypatch.context() as patched:
        refusing(patched, here)
        assert solve("-o", "a.h5", "--set", "output.checkpoint=1e-3") == 4
    (kept,) = (here / "tmp").glob("*/*")
    assert capsys.readouterr().err == (
        f"frictionsim: a.h5: cannot write the result: no room. The new result is in {kept}: move it"
        " from there. The last checkpoint is in a.partial.h5: 'frictionsim resume a.partial.h5'"
        " continues the run\n"
    )
    assert kept.read_bytes() == Path("whole.h5").read_bytes()
    assert run_command_line(["resume", "a.partial.h5", "-q"]) == 0
    assert Path("a.h5").read_bytes() == kept.read_bytes()


def test_what_was_put_there_during_the_run_stays(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_last = Destination.write_last

    def surprised(self: Destination, run: Record) -> object:
        foreign("a.h5", "text")
        return write_last(self, run)

    monkeypatch.setattr(Destination, "write_last", surprised)
    assert solve("-o", "a.h5") == 4
    assert capsys.readouterr().err == (
        "frictionsim: a.h5: cannot write the result: the existing file is not a result and is not"
        " overwritten; give another name. The new result is in a.new.h5: rename it\n"
    )
    assert Path("a.h5").read_bytes() == b"precious\n"
    assert hdf5_reader.read(Path("a.new.h5")).attributes["status"] == "done"

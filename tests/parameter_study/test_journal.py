"""The journal of a sweep, which may come from anyone: what is not whole is left out."""

import os
import sqlite3
from functools import partial
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.io import journal_content
from frictionsim.io.journal_content import checksum_of
from frictionsim.io.sweep_table import MAX_QUANTITIES
from frictionsim.parameter_study import journal
from frictionsim.parameter_study.block import AUDIT_FAILED, DONE, FAILED, RunOutcome, block_of
from frictionsim.parameter_study.journal import SweepJournal, journal_name
from frictionsim.results import Quantity
from tests.attacks.journals import repeat_pages

DIGEST = b"d" * 32
BLOCK = block_of(
    7,
    [
        (0, RunOutcome(DONE, {"a": Quantity(1.5, "m"), "b": Quantity(None, "s")})),
        (1, RunOutcome(FAILED, {"c": Quantity(-0.0, "1")}, "diverged", "it left", "one\ntwo")),
        (2, RunOutcome(AUDIT_FAILED, {"a": Quantity(2.5, "m")})),
    ],
)
RECORD = dict(
    zip(("first", "status", "units", "numbers", "texts"), journal._record(BLOCK), strict=True)
)


COUNTED = range(0, 60, 3)
FORMS = [
    RunOutcome(FAILED, {"b": Quantity(float(n), "s")}, "diverged", f"at {n}")
    if n % 2
    else RunOutcome(DONE, {"a": Quantity(float(n), "m"), "b": Quantity(0.5, "s")})
    for n in COUNTED
]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The name of a sweep's file, with a journal that has one block."""
    path = tmp_path / "s.h5"
    written = SweepJournal(path)
    written.start(DIGEST)
    written.append(BLOCK)
    written.close(remove=False)
    return path


def blocks(path: Path, digest: bytes = DIGEST) -> list[Any]:
    opened = SweepJournal(path)
    try:
        return list(opened.blocks(digest, 100))
    finally:
        opened.close(remove=False)


def crafted(path: Path, *statements: str, values: Any = ()) -> None:
    """Change a journal as another program would."""
    database = sqlite3.connect(journal_name(path), isolation_level=None)
    for statement in statements:
        database.execute(statement, values)
    database.close()


def test_a_block_comes_back(path: Path) -> None:
    (block,) = blocks(path)
    assert (block.first, block.units, block.texts) == (7, BLOCK.units, BLOCK.texts)
    assert list(block.units) == list(BLOCK.units)
    assert block.texts["failure"] == {8: "diverged"}
    assert np.array_equal(block.status, BLOCK.status)
    assert block.values.tobytes() == BLOCK.values.tobytes()
    assert blocks(path, b"e" * 32) == []


@pytest.mark.parametrize(
    "changed",
    [
        *({"status": value} for value in (b"", b"\1", b"\0\1\1", b"\7\1\1", "text", None, 1.5)),
        *({"numbers": value} for value in (b"", RECORD["numbers"] + b"\0", "x", None)),
        *(
            {"units": value}
            for value in (
                *("", "[" * 100_000, "{}", '[["a", "m"]]', '[["a", 1], ["b", 2], ["c", 3]]'),
                dumps([["a", "m"]] * 3),
                dumps([["a", "m" * 201], ["b", "s"], ["c", "1"]]),
                *(dumps([[name, "m"], ["b", "s"], ["c", "1"]]) for name in ("", ".", "a/b", "a\n")),
                dumps([["a", "m\n"], ["b", "s"], ["c", "1"]]),
                dumps([["a", "m"], ["b", "s"], ["c", "1"]]) + " " * 2**20,
            )
        ),
        *({"texts": dumps([["failure", *more]])} for more in ((6, "x"), (10, "x"), (8, 9), ())),
        *({"texts": dumps([["reason", 8, text]])} for text in ("\0", "\ud800", "x" * 65_537)),
        *({"texts": value} for value in ('[["elsewhere", 8, "x"]]', "5", "[[1]]", b"\xff", 5)),
    ],
)
def test_a_record_that_does_not_fit_is_left_out(path: Path, changed: dict[str, Any]) -> None:
    record = tuple({**RECORD, **changed}.values())
    try:
        checksum = checksum_of(record)
    except (TypeError, AttributeError):  # a column of another type has none
        checksum = 0
    crafted(path, "DELETE FROM blocks")
    crafted(
        path, "INSERT INTO blocks VALUES (?, ?, ?, ?, ?, ?)", values=(*record, checksum)
    )  # with a checksum that fits
    assert blocks(path) == []


def test_a_changed_bit_is_found(path: Path) -> None:
    content = bytearray(journal_name(path).read_bytes())
    place = content.index(RECORD["numbers"])
    content[place] ^= 1
    journal_name(path).write_bytes(content)
    assert blocks(path) == []


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE TABLE more (a)",
        "CREATE VIEW more AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n)"
        " SELECT * FROM n",
        "CREATE TRIGGER more INSERT ON blocks BEGIN DELETE FROM study; END",
        "ALTER TABLE blocks ADD COLUMN more INTEGER DEFAULT 1",
        "DROP TABLE study",
        "PRAGMA application_id = 7",
    ],
)
def test_a_database_with_something_else_is_not_touched(path: Path, statement: str) -> None:
    crafted(path, statement)
    before = journal_name(path).read_bytes()
    with pytest.raises(fs.OutputError, match="the file is not one of a sweep; move it"):
        SweepJournal(path)
    assert journal_name(path).read_bytes() == before


@pytest.mark.parametrize(
    "statements",
    [
        ["CREATE TABLE other (a)", "DROP TABLE other"],
        ["PRAGMA user_version = 7"],
        ["PRAGMA application_id = 7"],
    ],
)
def test_a_database_of_another_program_without_tables_is_not_touched(
    tmp_path: Path, statements: list[str]
) -> None:
    path = tmp_path / "s.h5"
    crafted(path, *statements)
    before = journal_name(path).read_bytes()
    with pytest.raises(fs.OutputError, match="the file is not one of a sweep; move it"):
        SweepJournal(path)
    assert journal_name(path).read_bytes() == before


def test_a_journal_of_a_process_killed_before_it_began_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    crafted(path, "PRAGMA journal_mode = WAL")  # writes the first page, as SweepJournal does
    assert journal_name(path).stat().st_size
    assert blocks(path) == []
    assert not journal_name(path).exists()


def test_damaged_pages_end_the_reading(path: Path) -> None:
    whole = journal_name(path).read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(200):
        content = bytearray(whole)
        for place in rng.integers(100, len(whole), 20):
            content[place] = int(rng.integers(256))
        journal_name(path).write_bytes(content[: int(rng.integers(50, len(whole) + 1))])
        try:
            read = blocks(path)
        except fs.OutputError:
            read = []
        assert [block.values.tobytes() for block in read] in ([], [BLOCK.values.tobytes()])
        for name in os.listdir(path.parent):
            (path.parent / name).unlink()


def test_the_reading_ends_where_records_do_not_ascend_whatever_their_checksums(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    repeat_pages(path, levels=2)
    tried: list[Any] = []

    def counted(record: Any) -> int:
        tried.append(record)
        assert len(tried) < 10
        return checksum_of(record)

    monkeypatch.setattr(journal_content, "checksum_of", counted)
    assert blocks(path) == []
    assert len(tried) == 1


@pytest.mark.parametrize("count", [MAX_QUANTITIES, MAX_QUANTITIES + 1])
def test_a_record_with_more_quantities_than_a_file_can_have_is_left_out(
    path: Path, count: int
) -> None:
    many = {f"q{number}": Quantity(1.0, "m") for number in range(count)}
    written = SweepJournal(path)
    written.start(DIGEST)
    written.append(block_of(0, [(0, RunOutcome(DONE, many))]))
    written.close(remove=False)
    shapes = [block.values.shape for block in blocks(path)]
    assert shapes == ([(MAX_QUANTITIES, 1)] if count == MAX_QUANTITIES else [])


def test_consecutive_runs_with_the_same_quantities_come_back_as_one_block(path: Path) -> None:
    written = SweepJournal(path)
    written.start(DIGEST)
    sizes = {0: 1, 1: 2, 3: 1, 5: 1, 6: 1}  # run 4 is missing
    for first, runs in sizes.items():
        written.append(block_of(first, [(run, FORMS[0]) for run in range(runs)]))
    for first in (7, 8):
        written.append(block_of(first, [(0, FORMS[first - 6])]))
    written.close(remove=False)
    read = blocks(path)
    assert [(b.first, b.runs, list(b.units)) for b in read] == [
        (0, 4, ["a", "b"]),
        (5, 2, ["a", "b"]),
        (7, 1, ["b"]),
        (8, 1, ["a", "b"]),
    ]
    assert read[0].values.tolist() == [[0.0] * 4, [0.5] * 4]
    assert read[2].texts["failure"] == {7: "diverged"}


def test_a_journal_is_read_in_parts(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = SweepJournal(path)
    written.start(DIGEST)
    # Of two forms, and with a gap after each.
    every = [block_of(first, [(0, outcome)]) for first, outcome in zip(COUNTED, FORMS, strict=True)]
    for block in every:
        written.append(block)
    written.close(remove=False)
    whole = blocks(path)
    assert [(b.first, b.units, b.texts) for b in whole] == [
        (b.first, b.units, b.texts) for b in every
    ]
    assert [b.values.tolist() for b in whole] == [b.values.tolist() for b in every]
    monkeypatch.setattr(journal_content, "PART_BYTES", 200)
    parts = blocks(path)
    assert [(b.first, b.units, b.texts) for b in parts] == [
        (b.first, b.units, b.texts) for b in every
    ]
    assert [b.values.tolist() for b in parts] == [b.values.tolist() for b in every]


@pytest.mark.parametrize("suffix", ["", "-wal", "-journal", "-shm"])
def test_no_link_is_followed(path: Path, suffix: str) -> None:
    other = path.parent / "other"
    other.write_text("precious")
    name = path.parent / (journal_name(path).name + suffix)
    name.unlink(missing_ok=True)
    name.symlink_to(other)
    with pytest.raises(fs.OutputError, match="the sweep needs this name, and it is no file"):
        SweepJournal(path)
    assert other.read_text() == "precious"


@pytest.mark.parametrize("suffix", ["-journal", "-shm"])
def test_files_that_sqlite_would_play_back_are_not_taken(path: Path, suffix: str) -> None:
    name = path.parent / (journal_name(path).name + suffix)
    name.write_bytes(b"from elsewhere")
    with pytest.raises(fs.OutputError, match=f"{suffix}: the sweep needs this name"):
        SweepJournal(path)
    assert name.read_bytes() == b"from elsewhere"


def test_a_journal_of_an_earlier_version_is_refused_with_the_way_out(path: Path) -> None:
    journal_name(path).write_bytes(b"frictionsim runs 1\n" + DIGEST + b"\0" * 100)
    with pytest.raises(fs.OutputError) as refused:
        SweepJournal(path)
    assert str(refused.value) == (
        f"{journal_name(path)}: this journal was written by an earlier version of frictionsim;"
        " resume the sweep with that version, or remove s.h5.runs: the runs in it are then run"
        " again"
    )


def test_a_kill_while_a_journal_is_made_leaves_no_other_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen, connect = set[str](), sqlite3.connect

    class Watched(sqlite3.Connection):
        def execute(self, *arguments: Any) -> sqlite3.Cursor:
            done = super().execute(*arguments)
            seen.update(os.listdir(tmp_path))
            return done

    monkeypatch.setattr(sqlite3, "connect", partial(connect, factory=Watched))
    SweepJournal(tmp_path / "s.h5").close(remove=True)
    assert seen == {"s.h5.runs"}

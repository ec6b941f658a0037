"""The journal of a sweep, which may come from anyone: what is not whole is left out."""

import os
import sqlite3
from collections.abc import Iterable
from functools import partial
from itertools import pairwise
from json import dumps
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.io import journal_content
from frictionsim.io.journal_content import PART_BYTES, checksum_of
from frictionsim.io.sweep_table import MAX_QUANTITIES
from frictionsim.parameter_study import journal
from frictionsim.parameter_study.block import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    RunBlock,
    RunOutcome,
    block_of,
)
from frictionsim.parameter_study.journal import SweepJournal, journal_name
from frictionsim.results import Quantity
from tests.support.crafted_journals import repeat_pages

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


FORMS = (
    RunOutcome(FAILED, {"b": Quantity(2.5, "s")}, "diverged", "it left"),
    RunOutcome(DONE, {"a": Quantity(1.5, "m"), "b": Quantity(0.5, "s")}),
    RunOutcome(AUDIT_FAILED, {"a": Quantity(0.1, "m"), "b": Quantity(None, "s")}, warnings="odd"),
)


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


def by_run(blocks: Iterable[RunBlock]) -> dict[int, Any]:
    """Return status, units, values and texts of each run."""
    return {
        block.first + i: (
            *(int(status), list(block.units.items()), block.values[:, i].tobytes()),
            {name: texts.get(block.first + i) for name, texts in block.texts.items()},
        )
        for block in blocks
        for i, status in enumerate(block.status)
    }


def crafted(path: Path, *statements: str, values: Any = ()) -> None:
    """Change a journal as another program would."""
    database = sqlite3.connect(journal_name(path), isolation_level=None)
    for statement in statements:
        database.execute(statement, values)
    database.close()


@pytest.mark.parametrize("part_bytes", [200, PART_BYTES])
@given(
    drawn=st.lists(
        st.tuples(st.integers(0, 1), st.lists(st.sampled_from(FORMS), min_size=1, max_size=3)),
        max_size=20,
    )
)
def test_blocks_come_back_and_those_that_continue_others_with_them(
    part_bytes: int, drawn: list[Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path, first = tmp_path_factory.mktemp("journal") / "s.h5", 0
    written, every = SweepJournal(path), []
    written.start(DIGEST)
    for left_out, outcomes in drawn:
        every.append(block_of(first + left_out, list(enumerate(outcomes))))
        written.append(every[-1])
        first = every[-1].first + every[-1].runs
    written.close(remove=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(journal_content, "PART_BYTES", part_bytes)
        read = blocks(path)
    assert by_run(read) == by_run(every)
    assert [block.first for block in read] == sorted(block.first for block in read)
    if part_bytes == PART_BYTES:  # consecutive runs with the same quantities are one block
        for one, other in pairwise(read):
            assert one.first + one.runs < other.first or list(one.units) != list(other.units)
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
    ("name", "statements"),
    [
        ("s.h5", ["CREATE TABLE more (a)"]),
        (
            "s.h5",
            [
                "CREATE VIEW more AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n)"
                " SELECT * FROM n"
            ],
        ),
        ("s.h5", ["CREATE TRIGGER more INSERT ON blocks BEGIN DELETE FROM study; END"]),
        ("s.h5", ["ALTER TABLE blocks ADD COLUMN more INTEGER DEFAULT 1"]),
        ("s.h5", ["DROP TABLE study"]),
        ("s.h5", ["PRAGMA application_id = 7"]),
        # New ones, without tables.
        ("other.h5", ["CREATE TABLE other (a)", "DROP TABLE other"]),
        ("other.h5", ["PRAGMA user_version = 7"]),
        ("other.h5", ["PRAGMA application_id = 7"]),
    ],
)
def test_a_database_of_another_program_is_not_touched(
    path: Path, name: str, statements: list[str]
) -> None:
    path = path.with_name(name)
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


def test_a_log_that_cannot_be_copied_is_refused_with_the_ways_out(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(SweepJournal, "_log_size", lambda self: 1)  # SQLite left it as it was
    with pytest.raises(fs.OutputError) as refused:
        SweepJournal(path)
    assert str(refused.value) == (
        f"{path}: cannot write the sweep: s.h5.runs-wal cannot be copied into s.h5.runs; make"
        " space, or if there is enough, remove the log, which is damaged: its runs are run again"
    )


@pytest.mark.parametrize(
    ("suffix", "said"),
    [
        *((suffix, "and it is no file") for suffix in ("", "-wal", "-journal", "-shm")),
        *((suffix, "and the file is not one of a sweep") for suffix in ("-journal", "-shm")),
    ],
)
def test_no_link_is_followed_and_no_file_played_back_by_sqlite(
    path: Path, suffix: str, said: str
) -> None:
    name, other = Path(f"{journal_name(path)}{suffix}"), path.parent / "other"
    other.write_text("precious")
    name.unlink(missing_ok=True)
    if said == "and it is no file":
        name.symlink_to(other)
    else:
        other.rename(name)
    with pytest.raises(fs.OutputError, match=f"{suffix}: the sweep needs this name, {said}"):
        SweepJournal(path)
    assert name.read_text() == "precious"


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

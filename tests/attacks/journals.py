"""Journals of sweeps that are damaged or crafted: a resumed sweep has the runs of a whole one."""

import random
import sqlite3
import struct
import tempfile
from collections.abc import Callable
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import frictionsim as fs
from frictionsim.io.hdf5_reader import read_sweep
from frictionsim.io.unfinished import partial_name
from frictionsim.parameter_study import dispatch
from frictionsim.parameter_study.block import DONE, RunOutcome, block_of
from frictionsim.parameter_study.journal import SweepJournal, journal_name
from frictionsim.parameter_study.sweep_files import digest_of
from frictionsim.results import Quantity
from tests.attacks.hdf5_bytes import damaged
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.sweep_files import LOAD, LOOSE, PULLEY

TARGET, PART, RUNS, LOG = "sweep.h5", "sweep.partial.h5", 8, "-wal"
# What another program can do to a database; the checksums of records do not fit any more.
STATEMENTS = [
    *("UPDATE blocks SET first = first + {n}", "UPDATE blocks SET first = -first - {n}"),
    *("UPDATE blocks SET status = x'0{n}'", "UPDATE blocks SET status = zeroblob({n}000000)"),
    *("UPDATE blocks SET numbers = zeroblob({n} * 8)", "UPDATE blocks SET numbers = NULL"),
    *('UPDATE blocks SET units = \'[["a", "m"]]\'', "UPDATE blocks SET texts = 5"),
    "UPDATE blocks SET units = replace(hex(zeroblob({n}0000)), '0', '[')",
    *("UPDATE blocks SET checksum = {n}", "DELETE FROM blocks WHERE first = {n}"),
    *("UPDATE study SET digest = x'00'", "DELETE FROM study", "DROP TABLE blocks"),
    *("PRAGMA application_id = {n}", "PRAGMA journal_mode = DELETE", "PRAGMA user_version = {n}"),
    "CREATE TABLE more (a)",
    "CREATE TRIGGER more INSERT ON blocks BEGIN DELETE FROM study; END",
    "ALTER TABLE blocks ADD COLUMN more DEFAULT 1",
    "DROP TABLE blocks; CREATE VIEW blocks AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i"
    " FROM n) SELECT i AS first, x'01' AS status, '' AS units, x'' AS numbers, '' AS texts, 0 AS"
    " checksum FROM n",
    "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET rootpage = {n}",
]


class Killed(NamedTuple):
    """The file, journal and log of a sweep that was killed, and the file of the whole sweep."""

    file: bytes
    journal: bytes
    log: bytes
    whole: bytes


@cache
def original() -> Killed:
    """Return a sweep that was killed after half of its runs."""
    contents: list[bytes] = []
    with tempfile.TemporaryDirectory() as name:
        target, often = Path(name) / TARGET, dispatch.SECONDS_BETWEEN_TICKS
        part = partial_name(target)
        files = part, journal_name(part), Path(f"{journal_name(part)}{LOG}")

        def copy(progress: Any) -> None:
            if progress.done == RUNS // 2:
                contents[:] = [path.read_bytes() for path in files]

        dispatch.SECONDS_BETWEEN_TICKS = 0.0
        try:
            vary = {LOAD: f"lin(2000, 2400, {RUNS})"}
            fs.sweep(PULLEY, vary, LOOSE, output=target, workers=1, progress=copy)
        finally:
            dispatch.SECONDS_BETWEEN_TICKS = often
        file, journal, log = contents
        return Killed(file, journal, log, target.read_bytes())


def attack(rng: random.Random, folder: Path) -> str:
    """Resume a sweep with a journal that is damaged or crafted."""
    target, part = folder / TARGET, folder / PART
    journal, log = journal_name(part), Path(f"{journal_name(part)}{LOG}")
    part.write_bytes(original().file)
    journal.write_bytes(original().journal)
    log.write_bytes(original().log)
    way = rng.choice([_bytes, _bytes, _statements, _files, _crafted])(rng, journal, log)
    said = outcome(["resume", rng.choice((TARGET, PART)), "-q", "-j", "1"], way)
    if said == "exit 0" and target.read_bytes() != original().whole:
        raise BrokenPromise(f"the resumed sweep has other runs than a whole one\n{way}")
    return said


def _bytes(rng: random.Random, journal: Path, log: Path) -> str:
    if rng.random() < 0.5:  # the records in the journal itself
        _checkpoint(journal)
    path = rng.choice([journal, log]) if log.exists() else journal
    content = bytearray(path.read_bytes())
    way = damaged(rng, content)
    path.write_bytes(content)
    return f"{path.name}: {way}"


def _checkpoint(journal: Path) -> None:
    SweepJournal(journal.with_name(PART)).close(remove=False)


def _statements(rng: random.Random, journal: Path, log: Path) -> str:
    done = []
    database = sqlite3.connect(journal, isolation_level=None)
    for _ in range(rng.randint(1, 3)):
        statement = rng.choice(STATEMENTS).format(n=rng.randrange(10))
        done.append(statement)
        try:
            database.executescript(statement)
        except sqlite3.Error as error:
            done.append(str(error))
    database.close()
    return "; ".join(done)


def _crafted(rng: random.Random, journal: Path, log: Path) -> str:
    name = rng.choice(list(CRAFTED))
    CRAFTED[name](journal.with_name(PART))
    return name


SCHEMA = "sqlite_schema"  # its root is the first page, after the header of the file
HEADER = 100  # bytes


def repeat_pages(part: Path, levels: int = 4, cells: int = 500, table: str = "blocks") -> None:
    """Have all cells of the root of a table of the journal refer to one page below, on some levels.

    In a whole record the ascending numbers show it; therefore their checksums are wrong.
    """
    _checkpoint(journal_name(part))
    with closing(sqlite3.connect(journal_name(part), isolation_level=None)) as database:
        database.execute("UPDATE blocks SET checksum = checksum + 1")
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        roots = dict(database.execute("SELECT name, rootpage FROM sqlite_schema"))
        (size,) = database.execute("PRAGMA page_size").fetchone()
    root = roots.get(table, 1)
    content = bytearray(journal_name(part).read_bytes())
    count, place = len(content) // size, slice((root - 1) * size, root * size)
    page, header = content[place], HEADER if root == 1 else 0
    (records,) = struct.unpack_from(">H", page, header + 5)  # where they start in the page
    content += page[header:records] + bytes(header) + page[records:]
    for child in range(count + 1, count + levels):
        content += _interior_page(child, size, cells)
    content[place] = _interior_page(count + levels, size, cells, page[:header])
    content[28:32] = struct.pack(">I", len(content) // size)
    journal_name(part).write_bytes(content)


def repeat_pages_of_schema(part: Path) -> None:
    """Do the same to the table of all tables, which SQLite reads before any other."""
    repeat_pages(part, table=SCHEMA)


def _interior_page(child: int, size: int, cells: int, header: bytes = b"") -> bytes:
    """Return an interior page of a table (SQLite file format, 1.6) with one child, many times."""
    page, start = bytearray(header.ljust(size, b"\0")), size - 5 * cells
    struct.pack_into(">BHHHBI", page, len(header), 5, 0, cells, start, 0, child)
    for cell in range(cells):
        struct.pack_into(">H", page, len(header) + 12 + 2 * cell, start + 5 * cell)
        struct.pack_into(">IB", page, start + 5 * cell, child, 0)
    return bytes(page)


def invent_quantities(part: Path, count: int = 3000) -> None:
    """Have the journal give a run many quantities, each of which takes a column of all runs."""
    digest, journal = digest_of(read_sweep(part)), SweepJournal(part)
    journal.start(digest)
    quantities = {f"q{number}": Quantity(1.0, "m") for number in range(count)}
    journal.append(block_of(0, [(0, RunOutcome(DONE, quantities))]))
    journal.close(remove=False)


CRAFTED: dict[str, Callable[[Path], None]] = {
    "repeated pages": repeat_pages,
    "repeated pages of the schema": repeat_pages_of_schema,
    "invented quantities": invent_quantities,
}


def _files(rng: random.Random, journal: Path, log: Path) -> str:
    suffix = rng.choice(["", LOG, "-journal", "-shm"])
    path = Path(f"{journal}{suffix}")
    path.unlink(missing_ok=True)
    way = rng.choice(["missing", "link", "folder", "other"])
    secret = journal.with_name("secret")
    if way == "link":
        secret.write_text("precious")
        path.symlink_to(secret)
    elif way == "folder":
        path.mkdir()
    elif way == "other":
        path.write_bytes(rng.choice([b"", b"frictionsim runs 1\n" + b"\0" * 99, rng.randbytes(99)]))
    return f"{path.name}: {way}"

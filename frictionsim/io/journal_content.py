"""Reading the journal of a sweep; `parameter_study.journal` documents it.

A journal may come from anyone. Pages of a crafted one refer to each other in circles, or many times
to one page: SQLite then repeats records without end. Therefore they must ascend, and may have no
more bytes in all than the file.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from frictionsim.io.sweep_table import MAX_QUANTITIES, TEXTS
from frictionsim.scenario.toml_data import json_value

MAX_TEXT, MAX_LABEL = 64 * 1024, 200  # characters
APPLICATION = int.from_bytes(b"fric", "big")
TABLES = (
    "CREATE TABLE study (digest BLOB)",
    "CREATE TABLE blocks (first INTEGER PRIMARY KEY,"
    " status BLOB, units TEXT, numbers BLOB, texts TEXT, checksum INTEGER)",
)
HEADER = (
    "SELECT application_id, user_version, page_count"
    " FROM pragma_application_id, pragma_user_version, pragma_page_count"
)
NEW = (0, 0, 1)  # of a process that was killed before it wrote the tables
DAMAGED = (sqlite3.Error, UnicodeError)  # the latter of a message about damaged names
SAFE = ("trusted_schema = OFF", "cell_size_check = ON", "mmap_size = 0")
MAX_RECORD = 64 * 2**20  # bytes; one of 4096 runs has less than 1 MB
PART_BYTES = 32 * 2**20  # of the records of an answer, or one larger record
NUMBERS = {name: number for number, name in enumerate(TEXTS)}
MAX_TEXTS = 32 * 2**20  # characters of JSON in a record
NO_TEXTS = "[]"  # as in most records
EMPTY, OURS, FOREIGN = "empty", "ours", "foreign"


class JournalPart(NamedTuple):
    """Blocks of runs of a journal, one after the other."""

    units: dict[str, str]  # of the quantities, by name
    words: list[str]  # the texts of runs, each once
    columns: list[list[int]]  # numbers in `units` of the quantities that blocks have
    blocks: Any  # (n, 4): first run, the one after the last, number in `columns`, number of texts
    texts: Any  # (m, 3): number in TEXTS, run, number in `words`
    status: Any  # of each block those of its runs
    values: Any  # of each block (quantities, runs)
    rest: tuple[int, int] | None  # `last` and `free` of the next part; None at the end


def checksum_of(record: Any) -> int:
    """Return the CRC-32 of the columns of a record."""
    first, status, units, numbers, texts = record
    return crc32(b"".join((b"%d" % first, status, units.encode(), numbers, texts.encode())))


def journal_origin(path: str) -> str:
    """Return whether a journal is EMPTY, OURS or FOREIGN."""
    with suppress(*DAMAGED), closing(_opened(path)) as database:
        tables = database.execute("SELECT sql FROM sqlite_schema").fetchmany(len(TABLES) + 1)
        header = database.execute(HEADER).fetchone()
        if not tables and header == NEW:
            return EMPTY
        if header[0] == APPLICATION and tables == [(sql,) for sql in TABLES]:
            return OURS
    return FOREIGN


def _opened(path: str) -> sqlite3.Connection:
    # The process that asks holds the lock, and has emptied the log.
    database = sqlite3.connect(f"{Path(path).absolute().as_uri()}?immutable=1", uri=True)
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD)
    for setting in SAFE:
        database.execute(f"PRAGMA {setting}")
    return database


def journal_part(
    path: str, digest: bytes, runs: int, statuses: bytes, last: int, free: int
) -> JournalPart:
    """Return undamaged blocks of a study, as many as an answer holds.

    Parameters
    ----------
    digest : bytes
        Of the study; there are no blocks of another one.
    runs : int
        Number of runs of the sweep.
    statuses : bytes
        Those that a run may have.
    last, free : int
        First run of the last record that was read, and the bytes that those left may have.
    """
    part = _BlockReader(runs, statuses)
    unread = free - PART_BYTES
    rest = None
    inconsistent = suppress(ValueError, TypeError, KeyError, AttributeError, OverflowError)
    with suppress(*DAMAGED), closing(_opened(path)) as database:  # damaged blocks are run again
        if database.execute("SELECT digest FROM study").fetchmany(2) == [(digest,)]:
            for left, record in _records(database, last, runs, free):
                with inconsistent:
                    part.add(*record)
                first = record[0]
                if left < unread:
                    rest = first, left
                    break
    return part.answer(rest)


def _records(
    database: sqlite3.Connection, last: int, runs: int, free: int
) -> Iterator[tuple[Any, ...]]:
    """Yield the number of bytes that are left after a record, and its columns."""
    for record in database.execute("SELECT * FROM blocks WHERE first > ? ORDER BY first", (last,)):
        first = record[0]
        free -= sum([len(column) for column in record if isinstance(column, bytes | str)])
        if not last < first < runs or free < 0:
            return
        last = first
        yield free, record


class _BlockReader:
    """Collects the undamaged blocks of records for an answer.

    Consecutive runs with the same quantities become one block, as slow runs have a record each.
    """

    def __init__(self, runs: int, statuses: bytes) -> None:
        self._runs, self._statuses = runs, statuses
        self._units: dict[str, str] = {}
        self._numbers: dict[str, int] = {}  # of the quantities
        self._columns: list[list[int]] = []
        self._forms: dict[str, int] = {}  # numbers in `columns`, by names and units in JSON
        self._words: dict[str, int] = {}
        self._blocks: list[list[int]] = []
        self._texts: list[int] = []
        self._status: list[bytes] = []
        self._values: list[list[Any]] = []  # of the records of each block

    def add(
        self, first: int, status: bytes, units: str, numbers: bytes, texts: str, checksum: int
    ) -> None:
        """Add the block of a record; raise an error if its columns are inconsistent."""
        if checksum != checksum_of((first, status, units, numbers, texts)):
            raise ValueError
        form = self._form_of(units)
        runs, stop = len(status), first + len(status)
        if not 0 < runs <= self._runs - first or status.translate(None, self._statuses):
            raise ValueError
        values = np.frombuffer(numbers, "<f8").reshape(len(self._columns[form]), runs)
        words: dict[tuple[int, int], str] = {}
        for name, run, text in json_value(texts, MAX_TEXTS) if texts != NO_TEXTS else ():
            if type(run) is not int or not first <= run < stop:
                raise ValueError
            words[NUMBERS[name], run] = _text(text)
        if not self._blocks or self._blocks[-1][1:3] != [first, form]:
            self._blocks.append([first, first, form, 0])
            self._values.append([])
        self._blocks[-1][1] = stop
        self._blocks[-1][3] += len(words)
        for (name, run), text in words.items():
            self._texts += name, run, self._words.setdefault(text, len(self._words))
        self._status.append(status)
        self._values[-1].append(values)

    def _form_of(self, units: str) -> int:
        """Return the number in `columns` of the names and units of a record."""
        if units in self._forms:
            return self._forms[units]
        pairs = json_value(units)
        if len(pairs) > MAX_QUANTITIES:
            raise ValueError  # at once: other records may have as many
        by_name = {_name(name): _label(unit) for name, unit in pairs}
        if len(by_name) != len(pairs):
            raise ValueError
        if len(by_name.keys() - self._units.keys()) + len(self._units) > MAX_QUANTITIES:
            raise ValueError
        for name, unit in by_name.items():
            self._units.setdefault(name, unit)
            self._numbers.setdefault(name, len(self._numbers))
        self._columns.append([self._numbers[name] for name in by_name])
        return self._forms.setdefault(units, len(self._forms))

    def answer(self, rest: tuple[int, int] | None) -> JournalPart:
        """Return them; `rest` is the position of the next part."""
        values = [np.concatenate(records, axis=1).ravel() for records in self._values]
        return JournalPart(
            units=self._units,
            columns=self._columns,
            words=list(self._words),
            blocks=np.array(self._blocks, np.int64).reshape(-1, 4),
            texts=np.array(self._texts, np.int64).reshape(-1, 3),
            status=np.frombuffer(b"".join(self._status), np.int8),
            values=np.concatenate([np.empty(0), *values]),
            rest=rest,
        )


def _text(value: Any) -> str:
    """Return a text that HDF5 can hold."""
    if not isinstance(value, str):
        raise TypeError
    if len(value.encode()) > MAX_TEXT or "\0" in value:  # no surrogates, which JSON may have
        raise ValueError
    return value


def _label(value: Any) -> str:
    if len(_text(value)) > MAX_LABEL or not value.isprintable():
        raise ValueError
    return str(value)


def _name(value: Any) -> str:
    """Return the name of a quantity, which becomes one in HDF5."""
    if not value or value == "." or "/" in _label(value):
        raise ValueError
    return str(value)

"""Reading the journal of a sweep, in a child process; `parameter_study.journal` documents it.

A journal may come from anyone. Pages of a crafted one refer to each other in circles, or many times
to one page: SQLite then repeats records without end. Therefore they must ascend, and may have no
more bytes in all than the file.
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.child_answer import JournalPart
from frictionsim.io.sweep_table import TEXTS
from frictionsim.scenario.toml_data import json_value

APPLICATION = int.from_bytes(b"fric", "big")
TABLES = (
    "CREATE TABLE study (digest BLOB)",
    "CREATE TABLE blocks (first INTEGER PRIMARY KEY,"
    " status BLOB, units TEXT, numbers BLOB, texts TEXT, checksum INTEGER)",
)
DAMAGED = (sqlite3.Error, UnicodeError)  # the latter of a message about damaged names
SAFE = ("trusted_schema = OFF", "cell_size_check = ON", "mmap_size = 0")
MAX_RECORD = 64 * 2**20  # bytes; one of 4096 runs has less than 1 MB
PART_BYTES = 32 * 2**20  # of the records of an answer, or one larger record
NUMBERS = {name: number for number, name in enumerate(TEXTS)}
MAX_TEXTS = 32 * 2**20  # characters of JSON in a record
EMPTY, OURS, FOREIGN = "empty", "ours", "foreign"


def checksum_of(record: Any) -> int:
    """Return the CRC-32 of the columns of a record."""
    first, status, units, numbers, texts = record
    checksum = 0
    for part in (b"%d" % first, status, units.encode(), numbers, texts.encode()):
        checksum = crc32(part, checksum)
    return checksum


def journal_origin(path: str) -> str:
    """Return whether a journal is EMPTY, OURS or FOREIGN."""
    with suppress(*DAMAGED), closing(_opened(path)) as database:
        tables = database.execute("SELECT sql FROM sqlite_schema").fetchmany(len(TABLES) + 1)
        (application,) = database.execute("PRAGMA application_id").fetchone()
        if not tables:
            return EMPTY
        if application == APPLICATION and tables == [(sql,) for sql in TABLES]:
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
    path: str, digest: str, runs: str, statuses: str, names: str, last: str, free: str
) -> JournalPart:
    """Return undamaged blocks of a study, as many as an answer holds.

    Parameters
    ----------
    digest : str
        Of the study, in hexadecimal digits; there are no blocks of another one.
    runs : str
        Number of runs of the sweep.
    statuses : str
        Those that a run may have, as bytes in hexadecimal digits.
    names : str
        Limit on the number of quantities.
    last, free : str
        First run of the last record that was read, and the bytes that those left may have.
    """
    part = _BlockReader(path, int(runs), bytes.fromhex(statuses), int(names))
    unread = int(free) - PART_BYTES
    rest = None
    with suppress(*DAMAGED), closing(_opened(path)) as database:  # damaged blocks are run again
        if database.execute("SELECT digest FROM study").fetchmany(2) == [(bytes.fromhex(digest),)]:
            for first, left, *record in _records(database, int(last), int(runs), int(free)):
                part.add(first, record)
                if left < unread:
                    rest = first, left
                    break
    return part.answer(rest)


def _records(
    database: sqlite3.Connection, last: int, runs: int, free: int
) -> Iterator[tuple[Any, ...]]:
    """Yield records: first run, number of bytes that are left, the other columns."""
    rows = database.execute("SELECT * FROM blocks WHERE first > ? ORDER BY first", (last,))
    for first, *record in rows:
        free -= sum(len(column) for column in record if isinstance(column, bytes | str))
        if not last < first < runs or free < 0:
            return
        last = first
        yield first, free, *record


class _BlockReader:
    """Collects the undamaged blocks of records for an answer."""

    def __init__(self, path: str, runs: int, statuses: bytes, names: int) -> None:
        self._path = path
        self._runs, self._statuses, self._max_names = runs, statuses, names
        self._units: dict[str, str] = {}
        self._numbers: dict[str, int] = {}  # of the quantities
        self._words: dict[str, int] = {}
        self._last_units, self._last_columns = "", list[int]()
        self._blocks: list[int] = []
        self._columns: list[int] = []
        self._texts: list[int] = []
        self._status: list[bytes] = []
        self._values: list[bytes] = []

    def add(self, first: int, record: list[Any]) -> None:
        """Add the block of a record unless it is damaged."""
        *columns, checksum = record
        with suppress(ValueError, TypeError, KeyError, AttributeError, OverflowError):
            if checksum == checksum_of((first, *columns)):
                self._add(first, *columns)

    def _add(self, first: int, status: bytes, units: str, numbers: bytes, texts: str) -> None:
        """Add a block; raise an error if its columns are inconsistent."""
        columns = self._columns_of(units)
        runs, stop = len(status), first + len(status)
        if (
            not 0 < runs <= self._runs - first
            or status.translate(None, self._statuses)
            or len(numbers) != 8 * len(columns) * runs
        ):
            raise ValueError
        words: dict[tuple[int, int], str] = {}
        for name, run, text in json_value(texts, MAX_TEXTS):
            if type(run) is not int or not first <= run < stop:
                raise ValueError
            words[NUMBERS[name], run] = _text(text)
        for (name, run), text in words.items():
            self._texts += name, run, self._words.setdefault(text, len(self._words))
        self._blocks += first, runs, len(columns), len(words)
        self._columns += columns
        self._status.append(status)
        self._values.append(numbers)

    def _columns_of(self, units: str) -> list[int]:
        """Return the numbers of the quantities of a record."""
        if units == self._last_units:  # as in most records
            return self._last_columns
        pairs = json_value(units)
        by_name = {_name(name): _label(unit) for name, unit in pairs}
        if len(by_name) != len(pairs):
            raise ValueError
        for name, unit in by_name.items():
            self._units.setdefault(name, unit)
            self._numbers.setdefault(name, len(self._numbers))
        if len(self._units) > self._max_names:
            raise InputError(
                f"{self._path}: cannot resume this sweep: its journal has more than the"
                f" {self._max_names} quantities that a sweep of {self._runs} runs may have"
            )
        self._last_units, self._last_columns = units, [self._numbers[name] for name in by_name]
        return self._last_columns

    def answer(self, rest: tuple[int, int] | None) -> JournalPart:
        """Return them; `rest` is the position of the next part."""
        return JournalPart(
            units=self._units,
            words=list(self._words),
            blocks=np.array(self._blocks, np.int64).reshape(-1, 4),
            columns=np.array(self._columns, np.int64),
            texts=np.array(self._texts, np.int64).reshape(-1, 3),
            status=np.frombuffer(b"".join(self._status), np.int8),
            values=np.frombuffer(b"".join(self._values), "<f8"),
            rest=rest,
        )


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _label(value: Any) -> str:
    if not _text(value).isprintable():
        raise ValueError
    return str(value)


def _name(value: Any) -> str:
    """Return the name of a quantity, which becomes one in HDF5."""
    if not value or value == "." or "/" in _label(value):
        raise ValueError
    return str(value)

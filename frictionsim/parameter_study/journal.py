"""The journal of a sweep: the outcomes of its runs, a record for each completed block.

An SQLite database in the folder of the sweep's file, as FILE.h5.runs, until the sweep is complete.
A killed process leaves it, with FILE.h5.runs-wal, which holds the records of the last second. The
process that writes the sweep holds a lock on it.

A record has plain numbers and texts: the number of the first run, the status of each run (bytes),
names and units of the quantities (JSON), their values (doubles), texts (JSON), and a CRC-32 of all.
"""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import suppress
from json import dumps
from pathlib import Path
from stat import S_ISREG
from time import monotonic
from typing import Any
from zlib import crc32

import numpy as np

from frictionsim.errors import OutputError
from frictionsim.io.sweep_table import TEXTS
from frictionsim.parameter_study.block import OUTCOMES, RunBlock
from frictionsim.scenario.toml_data import json_value

SUFFIX, LOG_SUFFIX = ".runs", "-wal"
FOREIGN_SUFFIXES = ("-journal", "-shm")  # SQLite would use such files with the journal
APPLICATION = int.from_bytes(b"fric", "big")
TABLES = (
    "CREATE TABLE study (digest BLOB)",
    "CREATE TABLE blocks (first INTEGER PRIMARY KEY,"
    " status BLOB, units TEXT, numbers BLOB, texts TEXT, checksum INTEGER)",
)
OLDER = b"frictionsim runs 1\n"
DAMAGED = (sqlite3.Error, UnicodeError)  # the latter of a message about damaged names
MAX_RECORD = 64 * 2**20  # bytes; one of 4096 runs has less than 1 MB
SECONDS_BETWEEN_SYNCS = 1.0
SETTINGS = (
    *("trusted_schema = OFF", "cell_size_check = ON", "mmap_size = 0"),
    # The lock makes an index of the log in shared memory unnecessary.
    *("locking_mode = EXCLUSIVE", "synchronous = NORMAL", "wal_autocheckpoint = 0"),
)


def journal_name(path: Path) -> Path:
    """Return the name of the journal of a file: a.h5.runs for a.h5."""
    return path.with_name(path.name + SUFFIX)


def remove_left_over(path: Path) -> None:
    """Remove the journal of a complete file, left by a process killed before removing it."""
    if journal_name(path).is_file():
        with suppress(OutputError):  # no journal, or locked by another process
            SweepJournal(path).close(remove=True)


class SweepJournal:
    """The open journal of the file of a sweep, locked by this process."""

    def __init__(self, path: Path) -> None:
        self.path, self._sweep = journal_name(path), path
        self._log = self.path.with_name(self.path.name + LOG_SUFFIX)
        self._synced, self._begun = monotonic(), False
        self._check_files()
        self._database: sqlite3.Connection | None = self._opened()

    def _check_files(self) -> None:
        """Check that SQLite opens no link, and no foreign file."""
        names = [self._log, *(self.path.with_name(self.path.name + s) for s in FOREIGN_SUFFIXES)]
        for path in (self.path, *names):
            with suppress(FileNotFoundError):
                if not S_ISREG(path.lstat().st_mode):
                    raise OutputError(
                        f"{path}: the sweep needs this name, and it is no file; remove it"
                    )
        for path in names:
            if os.path.lexists(path) and (path != self._log or not self.path.exists()):
                raise OutputError(
                    f"{path}: the sweep needs this name, and the file is not one of a sweep; move"
                    " it"
                )

    def _opened(self) -> sqlite3.Connection:
        while True:
            database = None
            try:
                database = sqlite3.connect(self.path, timeout=0.0, isolation_level=None)
                self._lock(database)
            except BaseException as error:
                if database is not None:
                    database.close()
                if not isinstance(error, DAMAGED):
                    raise
                raise self._refused(error) from None
            if self.path.exists():
                return database
            database.close()  # another process has finished the sweep and removed it

    def _lock(self, database: sqlite3.Connection) -> None:
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD)
        for setting in SETTINGS:
            database.execute(f"PRAGMA {setting}")
        tables = database.execute("SELECT sql FROM sqlite_schema").fetchmany(len(TABLES) + 1)
        (application,) = database.execute("PRAGMA application_id").fetchone()
        if tables and (application != APPLICATION or tables != [(sql,) for sql in TABLES]):
            raise self._not_ours()
        self._begun = bool(tables)
        if not tables:  # a kill at this point leaves no -journal
            database.execute("PRAGMA journal_mode = MEMORY")
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("BEGIN IMMEDIATE")
        database.execute("COMMIT")

    def start(self, digest: bytes) -> None:
        """Begin again, for a study."""
        self._begun = True
        self._execute("BEGIN")
        for table in ("study", "blocks"):
            self._execute(f"DROP TABLE IF EXISTS {table}")
        for sql in TABLES:
            self._execute(sql)
        self._execute(f"PRAGMA application_id = {APPLICATION}")
        self._execute("INSERT INTO study VALUES (?)", digest)
        self._execute("COMMIT")
        self._execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def append(self, block: RunBlock) -> None:
        """Append a block; it survives a kill of this process, and after a second a power cut."""
        record = _record(block)
        self._execute("INSERT INTO blocks VALUES (?, ?, ?, ?, ?, ?)", *record, _checksum(record))
        if monotonic() - self._synced > SECONDS_BETWEEN_SYNCS:
            self._execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._synced = monotonic()

    def _execute(self, sql: str, *values: Any) -> None:
        assert self._database is not None
        try:
            self._database.execute(sql, values)
        except sqlite3.Error as error:
            raise self._failed(error) from None

    def blocks(self, digest: bytes) -> Iterator[RunBlock]:
        """Yield the undamaged blocks of a study; none of another study."""
        if not self._begun or self._database is None:
            return
        with suppress(*DAMAGED):  # damaged blocks are run again
            if self._database.execute("SELECT digest FROM study").fetchmany(2) != [(digest,)]:
                return
            first = -1
            for *record, checksum in self._database.execute("SELECT * FROM blocks ORDER BY first"):
                block = _block(record, checksum)
                if block is None:
                    continue
                if block.first <= first:
                    return
                first = block.first
                yield block

    def close(self, remove: bool) -> None:
        """Release the lock, and remove the files if `remove` is set or they are empty."""
        database, self._database = self._database, None
        if database is None:
            return
        remove = remove or not self._begun
        if remove and os.name != "nt":  # another process may begin as soon as the lock is released
            self._remove()
        with suppress(sqlite3.Error):
            database.close()
        if remove and os.name == "nt":  # Windows does not remove open files
            self._remove()

    def _remove(self) -> None:
        for path in (self._log, self.path):
            with suppress(OSError):
                path.unlink()

    def _refused(self, error: Exception) -> OutputError:
        """Return the error of a journal that cannot be opened."""
        code = getattr(error, "sqlite_errorcode", 0) & 0xFF
        if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
            return OutputError(
                f"{self._sweep}: another process is running this sweep now; wait for its end, or"
                " stop it"
            )
        damaged = (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_ERROR)
        if code in damaged or isinstance(error, UnicodeError):
            return self._not_ours()
        return self._failed(error)

    def _not_ours(self) -> OutputError:
        with suppress(OSError), self.path.open("rb") as file:
            if file.read(len(OLDER)) == OLDER:
                return OutputError(
                    f"{self.path}: this journal was written by an earlier version of frictionsim;"
                    f" resume the sweep with that version, or remove {self.path.name}: the runs in"
                    " it are then run again"
                )
        return OutputError(
            f"{self.path}: the sweep needs this name, and the file is not one of a sweep; move it"
        )

    def _failed(self, error: Exception) -> OutputError:
        return OutputError(f"{self._sweep}: cannot write the sweep: {self.path.name}: {error}")


def _record(block: RunBlock) -> tuple[int, bytes, str, bytes, str]:
    texts = [
        [name, number, text]
        for name, by_run in block.texts.items()
        for number, text in by_run.items()
    ]
    numbers = np.ascontiguousarray(block.values, dtype="<f8").tobytes()
    units = dumps(list(block.units.items()))
    return block.first, block.status.tobytes(), units, numbers, dumps(texts)


def _checksum(record: Any) -> int:
    first, status, units, numbers, texts = record
    checksum = 0
    for part in (b"%d" % first, status, units.encode(), numbers, texts.encode()):
        checksum = crc32(part, checksum)
    return checksum


def _block(record: list[Any], checksum: Any) -> RunBlock | None:
    """Return the block of a record, which may come from anyone; None if it is damaged."""
    with suppress(ValueError, TypeError, KeyError, AttributeError, OverflowError):
        first, status, units, numbers, texts = record
        if checksum == _checksum(record):
            return _parsed(first, status, json_value(units), numbers, json_value(texts))
    return None


def _parsed(first: int, status: bytes, units: Any, numbers: bytes, texts: Any) -> RunBlock:
    """Return the block of the columns of a record; raise an error if they are inconsistent."""
    statuses = np.frombuffer(status, np.int8)
    names = {_text(name): _text(unit) for name, unit in units}
    if not statuses.size or len(names) != len(units) or not np.isin(statuses, OUTCOMES).all():
        raise ValueError
    values = np.frombuffer(numbers, "<f8").reshape(len(names), statuses.size)
    by_run: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    for name, number, text in texts:
        if type(number) is not int or not first <= number < first + statuses.size:
            raise ValueError
        by_run[name][number] = _text(text)
    return RunBlock(first, statuses, names, values.astype(np.float64, copy=False), by_run)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value

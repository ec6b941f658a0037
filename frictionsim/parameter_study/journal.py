"""The journal of a sweep: the outcomes of its runs, a record for each completed block.

An SQLite database in the folder of the sweep's file, as FILE.h5.runs, until the sweep is complete.
A killed process leaves it, with FILE.h5.runs-wal, which holds the records of the last second. The
process that writes the sweep holds a lock on it.

A record has plain numbers and texts: the number of the first run, the status of each run (bytes),
names and units of the quantities (JSON), their values (doubles), texts (JSON), and a CRC-32 of all.

`io.journal_content` reads it; no statement that needs the schema comes before it has told whose a
journal is.
"""

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, suppress
from json import dumps
from pathlib import Path
from stat import S_ISREG
from time import monotonic
from typing import Any

import numpy as np

from frictionsim.errors import OutputError
from frictionsim.io.journal_content import (
    APPLICATION,
    DAMAGED,
    FOREIGN,
    MAX_RECORD,
    OURS,
    SAFE,
    TABLES,
    JournalPart,
    checksum_of,
    journal_origin,
    journal_part,
)
from frictionsim.io.sweep_table import TEXTS
from frictionsim.parameter_study.block import OUTCOMES, RunBlock

SUFFIX, LOG_SUFFIX = ".runs", "-wal"
FOREIGN_SUFFIXES = ("-journal", "-shm")  # SQLite would use such files with the journal
OLDER = b"frictionsim runs 1\n"
SECONDS_BETWEEN_SYNCS = 1.0
# The lock makes an index of the log in shared memory unnecessary.
SETTINGS = (*SAFE, "locking_mode = EXCLUSIVE", "wal_autocheckpoint = 0")


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
        self._synced, self._begun, self._is_new = monotonic(), False, True
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
        database = self._locked()
        try:
            if self._log_size():
                database.close()  # this copies the log
                database = self._locked()
                if self._log_size():
                    raise OutputError(
                        f"{self._sweep}: cannot write the sweep: {self._log.name} cannot be copied"
                        f" into {self.path.name}; make space, or if there is enough, remove the"
                        " log, which is damaged: its runs are run again"
                    )
            self._set_up(database)
        except BaseException as error:
            database.close()
            if not isinstance(error, DAMAGED):
                raise
            raise self._refused(error) from None
        return database

    def _locked(self) -> sqlite3.Connection:
        """Return the database, locked; nothing in it is read that may lead to other pages."""
        while True:
            is_new = not self.path.exists() or not self.path.stat().st_size
            # A kill in the first transaction, which writes the first page, leaves no -journal.
            settings = (*SETTINGS, "journal_mode = MEMORY") if is_new else SETTINGS
            database = sqlite3.connect(self.path, timeout=0.0, isolation_level=None)
            try:
                database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_RECORD)
                for setting in settings:
                    database.execute(f"PRAGMA {setting}")
                database.execute("BEGIN EXCLUSIVE")
                database.execute("COMMIT")
                if is_new:  # only then: to count the pages, SQLite reads the schema
                    (pages,) = database.execute("PRAGMA page_count").fetchone()
                    is_new = pages <= 1  # no other process was faster
                self._is_new = is_new
            except DAMAGED as error:
                database.close()
                raise self._refused(error) from None
            if self.path.exists():
                return database
            database.close()  # another process has finished the sweep and removed it

    def _log_size(self) -> int:
        return self._log.stat().st_size if self._log.exists() else 0

    def _set_up(self, database: sqlite3.Connection) -> None:
        """Check the origin of the journal, and have it keep a log."""
        if not self._is_new:
            origin = journal_origin(str(self.path))
            if origin == FOREIGN:
                raise self._not_ours()
            self._begun = origin == OURS
        for setting in ("journal_mode = WAL", "synchronous = NORMAL"):
            database.execute(f"PRAGMA {setting}")

    def start(self, digest: bytes) -> None:
        """Begin again, for a study."""
        assert self._database is not None
        self._begun = True
        try:
            (page_size,) = self._database.execute("PRAGMA page_size").fetchone()
            with closing(sqlite3.connect(":memory:", isolation_level=None)) as new:
                settings = f"page_size = {page_size}", f"application_id = {APPLICATION}"
                for sql in (*(f"PRAGMA {setting}" for setting in settings), *TABLES):
                    new.execute(sql)
                new.execute("INSERT INTO study VALUES (?)", (digest,))
                # To drop the tables, SQLite would walk through them.
                new.backup(self._database)
        except sqlite3.Error as error:
            raise self._failed(error) from None
        self._execute("PRAGMA wal_checkpoint(TRUNCATE)")

    def append(self, block: RunBlock) -> None:
        """Append a block; it survives a kill of this process, and after a second a power cut."""
        record = _record(block)
        self._execute("INSERT INTO blocks VALUES (?, ?, ?, ?, ?, ?)", *record, checksum_of(record))
        if monotonic() - self._synced > SECONDS_BETWEEN_SYNCS:
            self._execute("PRAGMA wal_checkpoint(TRUNCATE)")
            self._synced = monotonic()

    def _execute(self, sql: str, *values: Any) -> None:
        assert self._database is not None
        try:
            self._database.execute(sql, values)
        except sqlite3.Error as error:
            raise self._failed(error) from None

    def blocks(self, digest: bytes, runs: int) -> Iterator[RunBlock]:
        """Yield the undamaged blocks of a study of some runs; none of another study."""
        rest = (-1, self.path.stat().st_size) if self._begun else None
        while rest is not None:
            part = journal_part(str(self.path), digest, runs, bytes(OUTCOMES), *rest)
            yield from _blocks_of(part)
            rest = part.rest

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


def _blocks_of(part: JournalPart) -> Iterator[RunBlock]:
    units, names = list(part.units.items()), list(TEXTS)
    run = value = text = 0
    for first, stop, number, texts in part.blocks.tolist():
        columns, runs = part.columns[number], stop - first
        count = len(columns) * runs
        values = part.values[value : value + count].reshape(len(columns), runs)
        by_run: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
        for name, of_run, word in part.texts[text : text + texts].tolist():
            by_run[names[name]][of_run] = part.words[word]
        status = part.status[run : run + runs]
        yield RunBlock(first, status, dict(units[i] for i in columns), values, by_run)
        run, value, text = run + runs, value + count, text + texts

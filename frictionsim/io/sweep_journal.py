"""The unfinished sweep, NAME.partial.runs: a journal of lines in JSON that only grows.

    {"sweep_version": 1, "output": ..., "folder": ..., "attributes": ..., "dimensions": ...,
     "coordinates": ...}
    {"first": 0, "status": [...], "units": ..., "values": ..., "texts": ...}
    {"stopped": "interrupted by SIGINT after 5 of 12 runs"}

The first line has what a sweep is before its runs: the name of the file that is written when all
are done, the folder of file names in the values, the attributes of `sweep_file` with the study, and
the values of the varied keys. Each further line is a block of runs that are done, with the values
of its quantities (quantities, runs) as doubles in base64; or it says why the sweep has stopped.
Each ends with its own CRC-32. Whatever kills the process, at most the last line is torn; the runs
of a line that is torn or damaged are run again. The process that runs a sweep has a lock on the
file.
"""

import os
from base64 import b64decode, b64encode
from contextlib import suppress
from json import dumps, loads
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.names import whole_name
from frictionsim.io.sweep_table import (
    VERSION,
    VERSION_NAME,
    Coordinate,
    RunBlock,
    SweepHeader,
    SweepTable,
    table_of,
)

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

SECONDS_BETWEEN_SYNCS = 1.0  # which a power cut may cost
CHECKSUM = b', "crc32": '  # before the last number of a line
KILLED = "killed, or still running"


class UnfinishedSweep(NamedTuple):
    """What a journal holds."""

    header: SweepHeader
    output: str  # name of the file of the whole sweep
    folder: Path  # of file names in the values of the varied keys
    blocks: list[RunBlock]
    reason: str  # why it stopped

    @property
    def table(self) -> SweepTable:
        """The sweep with the runs that are done."""
        outcome = {"status": "interrupted", "reason": self.reason}
        attributes = self.header.attributes | outcome
        return table_of(self.header._replace(attributes=attributes), self.blocks)

    def whole(self, path: Path) -> Path:
        """Return the file of the whole sweep of a journal at a path, which may be renamed."""
        return whole_name(path).with_suffix(Path(self.output).suffix)


class SweepJournal:
    """An open journal, locked by this process. OutputError is raised if it cannot be written."""

    def __init__(self, path: Path, is_new: bool = True) -> None:
        self.path, self._synced = path, monotonic()
        try:
            self._file = path.open("a+b" if is_new else "r+b")
        except OSError as error:
            raise self._failed(error) from None
        try:
            self._lock()
            content = path.read_bytes()
            if is_new and b"\n" in content:
                raise OutputError(
                    f"{path}: this is an interrupted sweep: 'frictionsim resume {path}' continues"
                    " it; give another name, or remove it"
                )
            self._file.truncate(content.rfind(b"\n") + 1)  # without a torn line
            self._file.seek(0, os.SEEK_END)
        except BaseException:
            self._file.close()
            raise

    def _lock(self) -> None:
        try:
            if fcntl is not None:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise OutputError(
                f"{self.path}: another process is running this sweep now; wait for its end, or stop"
                " it"
            ) from None
        except OSError:  # a file system without locks
            pass

    def begin(self, header: SweepHeader, output: str, folder: Path) -> None:
        """Write the first line."""
        coordinates = {
            key: c._asdict() | {"values": [*_plain(c.values)], "type": _type_of(c.values)}
            for key, c in header.coordinates.items()
        }
        names = {VERSION_NAME: VERSION, "output": output, "folder": str(folder)}
        self._write(names | header._asdict() | {"coordinates": coordinates})

    def append(self, block: RunBlock) -> None:
        """Append a block; it survives a kill of this process, and after a second a power cut."""
        values = b64encode(np.ascontiguousarray(block.values, "<f8").tobytes()).decode()
        texts = {name: list(by_run.items()) for name, by_run in block.texts.items()}
        changed = {"status": block.status.tolist(), "values": values, "texts": texts}
        self._write(block._asdict() | changed)

    def stop(self, reason: str) -> None:
        """Say why the sweep stops."""
        self._write({"stopped": reason})

    def _write(self, content: dict[str, Any]) -> None:
        text = dumps(content)[:-1].encode()
        try:
            self._file.write(text + CHECKSUM + b"%d}\n" % crc32(text))
            self._file.flush()
            if monotonic() - self._synced > SECONDS_BETWEEN_SYNCS:
                os.fsync(self._file.fileno())
                self._synced = monotonic()
        except OSError as error:
            raise self._failed(error) from None

    def _failed(self, error: OSError) -> OutputError:
        return OutputError(f"{self.path}: cannot write the sweep: {error.strerror}")

    def remove(self) -> None:
        """Remove the file, of which nothing is to be resumed."""
        self.close()
        self.path.unlink(missing_ok=True)

    def close(self) -> None:
        """Release the lock."""
        with suppress(OSError):  # what could not be written is still in its buffer
            self._file.close()


def _type_of(values: Any) -> str:
    return "text" if isinstance(values, list) else str(values.dtype)


def _plain(values: Any) -> Any:
    return values if isinstance(values, list) else values.tolist()


def read_unfinished(path: Path) -> UnfinishedSweep:
    """Read a journal.

    Raises
    ------
    InputError
        If it is not readable, or its first line is torn or damaged.
    """
    cannot = f"{path}: cannot read this sweep"
    try:
        first, *lines = path.read_bytes().split(b"\n")
        if not lines:
            raise InputError(
                f"{path}: this sweep was stopped before its first runs and holds none; remove the"
                " file and start the sweep again"
            )
        header = _sound(first)
        if header[VERSION_NAME] != VERSION:
            raise InputError(
                f"{cannot}: its format version is {header[VERSION_NAME]}, this program reads"
                f" version {VERSION}"
            )
        sound = [content for content in map(_sound, lines) if content]
        return UnfinishedSweep(
            SweepHeader(
                header["attributes"],
                header["dimensions"],
                {key: _coordinate(**given) for key, given in header["coordinates"].items()},
            ),
            header["output"],
            Path(header["folder"]),
            [_block(**content) for content in sound if "first" in content],
            sound[-1].get("stopped", KILLED) if sound else KILLED,
        )
    except OSError as error:
        raise InputError(f"{cannot}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{cannot}: it is damaged") from None


def _sound(line: bytes) -> dict[str, Any]:
    """Return the content of a line; nothing if it is torn or damaged."""
    text, _, checksum = line.rpartition(CHECKSUM)
    content: dict[str, Any] = loads(text + b"}") if checksum == b"%d}" % crc32(text) else {}
    return content


def _coordinate(values: Any, type: str, **others: str) -> Coordinate:
    return Coordinate(values=values if type == "text" else np.array(values, type), **others)


def _block(status: Any, values: Any, texts: Any, **others: Any) -> RunBlock:
    numbers = np.frombuffer(b64decode(values), "<f8").reshape(-1, len(status))
    by_name = {name: dict(map(tuple, by_run)) for name, by_run in texts.items()}
    return RunBlock(status=np.array(status, np.int8), values=numbers, texts=by_name, **others)

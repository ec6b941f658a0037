"""The unfinished sweep, NAME.partial.runs: a journal of lines in JSON that only grows.

    {"sweep_version": 1, "output": ..., "attributes": ..., "dimensions": ..., "coordinates": ...}
    {"first": 0, "status": [...], "units": ..., "values": ..., "texts": ...}
    {"stopped": "interrupted by SIGINT after 5 of 12 runs"}

The first line has what a sweep is before its runs: the name of the file that is written when all
are done, the attributes of `sweep_file` with the study, and the values of the varied keys. Each
further line is a block of runs that are done, with the values of its quantities (quantities, runs)
as doubles in base64; or it says why the sweep has stopped. Each ends with its own CRC-32. Whatever
kills the process, at most the last line is torn; the runs of a line that is torn or damaged are run
again. The process that runs a sweep has a lock on the file.
"""

import os
from base64 import b64decode, b64encode
from collections.abc import Iterator
from contextlib import suppress
from json import dumps, loads
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple, Self
from zlib import crc32

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.names import whole_name
from frictionsim.io.sweep_table import (
    NOT_RUN,
    STATUSES,
    TEXTS,
    VERSION,
    VERSION_NAME,
    Coordinate,
    RunBlock,
    SweepTable,
    with_blocks,
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

    planned: SweepTable  # without runs
    output: str  # name of the file of the whole sweep
    blocks: list[RunBlock]
    reason: str  # why it stopped

    @property
    def table(self) -> SweepTable:
        """The sweep with the runs that are done."""
        attributes = self.planned.attributes | {"status": "interrupted", "reason": self.reason}
        return with_blocks(self.planned, self.blocks)._replace(attributes=attributes)

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
            if not is_new:
                self._remove_torn_line()
            elif _begins(path):
                raise OutputError(
                    f"{path}: this is an interrupted sweep: 'frictionsim resume {path}' continues"
                    " it; give another name, or remove it"
                )
            else:
                self._file.truncate(0)  # of a process that was killed before there was a line
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

    def _remove_torn_line(self) -> None:
        self._file.truncate(self._file.read().rfind(b"\n") + 1)
        self._file.seek(0, os.SEEK_END)

    def begin(self, planned: SweepTable, output: str) -> None:
        """Write the first line."""
        coordinates = {
            key: {**c._asdict(), "values": _values(c.values), "type": _type_of(c.values)}
            for key, c in planned.coordinates.items()
        }
        self._write(
            {
                VERSION_NAME: VERSION,
                "output": output,
                "attributes": planned.attributes,
                "dimensions": planned.dimensions,
                "coordinates": coordinates,
            }
        )

    def append(self, block: RunBlock) -> None:
        """Append a block; it survives a kill of this process, and after a second a power cut."""
        self._write(
            {
                "first": block.first,
                "status": block.status.tolist(),
                "units": block.units,
                "values": b64encode(np.ascontiguousarray(block.values, "<f8").tobytes()).decode(),
                "texts": {name: list(by_run.items()) for name, by_run in block.texts.items()},
            }
        )

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

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _begins(path: Path) -> bool:
    """Return whether a journal has its first line, whole."""
    try:
        return next(_sound_lines(path.read_bytes()), None) is not None
    except ValueError:
        return False


def _type_of(values: Any) -> str:
    return "text" if isinstance(values, list) else str(values.dtype)


def _values(values: Any) -> list[Any]:
    return list(values) if isinstance(values, list) else list(values.tolist())


def read_unfinished(path: Path) -> UnfinishedSweep:
    """Read a journal.

    Raises
    ------
    InputError
        If it is not readable, or its first line is damaged.
    """
    try:
        first, *lines = list(_sound_lines(path.read_bytes()))
        planned, output = _planned(first), str(first["output"])
        version = int(first[VERSION_NAME])
    except OSError as error:
        raise InputError(f"{path}: cannot read this sweep: {error.strerror}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{path}: cannot read this sweep: it is damaged") from None
    if version != VERSION:
        raise InputError(
            f"{path}: cannot read this sweep: its format version is {version}, this program reads"
            f" version {VERSION}"
        )
    reason = lines[-1].get("stopped", KILLED) if lines else KILLED
    return UnfinishedSweep(
        planned, output, [_block(line) for line in lines if "first" in line], reason
    )


def _sound_lines(content: bytes) -> Iterator[dict[str, Any]]:
    """Yield the lines that are neither torn nor damaged; ValueError if the first one is."""
    for number, line in enumerate(content.split(b"\n")):
        text, _, checksum = line.rpartition(CHECKSUM)
        if checksum == b"%d}" % crc32(text):
            yield loads(text + b"}")
        elif not number:
            raise ValueError("the first line is damaged")


def _planned(line: dict[str, Any]) -> SweepTable:
    dimensions, coordinates = dict(line["dimensions"]), {}
    for key, given in line["coordinates"].items():
        values, kind = given["values"], given["type"]
        coordinates[key] = Coordinate(
            given["dimension"],
            values if kind == "text" else np.array(values, kind),
            given["unit"],
            given["long_name"],
        )
    return planned_table(line["attributes"], dimensions, coordinates)


def planned_table(
    attributes: dict[str, str], dimensions: dict[str, int], coordinates: dict[str, Coordinate]
) -> SweepTable:
    """Return a sweep of which no run is done."""
    status = np.full(int(np.prod(list(dimensions.values()))), NOT_RUN, dtype=np.int8)
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    return SweepTable(attributes, dimensions, coordinates, {}, {}, status, STATUSES, texts)


def _block(line: dict[str, Any]) -> RunBlock:
    status = np.array(line["status"], np.int8)
    values = np.frombuffer(b64decode(line["values"]), "<f8").reshape(-1, len(status))
    texts = {name: dict(map(tuple, by_run)) for name, by_run in line["texts"].items()}
    return RunBlock(line["first"], status, line["units"], values, texts)

"""The samples of a run: the latest ones in memory, the earlier ones in segments on the disk.

A run that has nowhere to put segments keeps all samples in memory. Else, whenever the recorded
channels of the latest samples fill SEGMENT_BYTES, these samples become a segment: a file that is
written once, whole or not at all, and never changed (`frictionsim.io.segments`). Recorded
channels with columns are then there alone; the few numbers of a sample that summary and audit need
stay in memory too. What the state of a run says of segments is how many there are, so that a
checkpoint takes the time of the samples since the last one, however long the run is. A run whose
samples would not fit does not start (`check_space`).
"""

import logging
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.results import Record, Segments, StoredSamples
from frictionsim.simulation.checkpoint import Arrays, require_array, require_names, require_values
from frictionsim.simulation.record import stored_type
from frictionsim.simulation.stored_channel import StoredChannel
from frictionsim.solvers.state_values import COUNT, TIME, Values, unfit

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation

LOG = logging.getLogger(__name__)

AsRecord = Callable[[dict[str, Any]], Record]

SEGMENT_BYTES = 32 * 2**20
MIN_ROW_BYTES = 512  # what only the summary needs of a sample takes memory as well
MIN_CAPACITY = 256  # samples that there is memory for from the start
GROWTH = 1.5
NO_SAMPLE = -1  # in the place of the number of one
ASCENDING = TIME._replace(ascending=True)
FLOAT_BYTES = 8
# Numbers of each sample that only summary and audit need: of a belt, and of each of its pulleys.
KEPT, KEPT_OF_PULLEY = 16, 8
SMALL = 256 * 2**20  # bytes that are there
LARGE = 10**9  # bytes of samples that a user should know of before
# While a segment is written it is in memory about so often: samples, chunks, file.
COPIES_OF_SEGMENT = 4


def rows_per_segment(row_bytes: int) -> int:
    """Return how many samples of a size become one segment: a power of two.

    Chunks of a file hold powers of two as well, so that those of a segment fit into the result.
    """
    return power_of_two(SEGMENT_BYTES // max(row_bytes, MIN_ROW_BYTES))


def power_of_two(number: int) -> int:
    """Return the largest power of two that is not above a number, 1 at least."""
    return 1 << (max(number, 1).bit_length() - 1)


class SampleStore:
    """The samples of a run, one row of each array for each of them.

    Parameters
    ----------
    types : mapping of str to numpy dtype
        The channels that a result file may hold, in the types that it holds. All other arrays,
        and `time`, are of float64.
    """

    def __init__(self, types: Mapping[str, Any]) -> None:
        self.segments: Segments | None = None
        self._as_record: AsRecord | None = None
        self._types = types
        self._earlier: dict[str, list[Any]] = {}  # of segments, what stays in memory
        self._latest: Arrays = {}  # rows since the last segment, with room for more
        self._first: Arrays = {}
        self._count = self._stored = 0  # rows in memory, and segments
        self._rows_of_segment = 1
        self._non_finite: int | None = None  # the first such sample in a segment

    def put_into(self, segments: "Segments", as_record: AsRecord) -> None:
        """Have samples that are too many become segments, as the records of some arrays."""
        self.segments, self._as_record = segments, as_record

    def __len__(self) -> int:
        return self._stored * self._rows_of_segment + self._count

    @property
    def stored(self) -> StoredSamples | None:
        """The segments; None if there are none."""
        if self.segments is None or not self._stored:
            return None
        return StoredSamples(self.segments, self._stored, self._rows_of_segment)

    @property
    def failure(self) -> Exception | None:
        """The error of a segment that could not be written: its samples stay in memory."""
        return None if self.segments is None else self.segments.failure

    def _fitting_rows(self) -> int:
        """Return how many samples of these arrays become one segment."""
        recorded = sum(
            self._type(name).itemsize * int(np.prod(values.shape[1:]))
            for name, values in self._latest.items()
            if name in self._types and name != "time"
        )
        return rows_per_segment(recorded)

    def _type(self, name: str) -> "np.dtype[Any]":
        return np.dtype(self._types.get(name, np.float64))

    def append(self, values: Mapping[str, Any]) -> None:
        """Add a sample."""
        if not self._latest:
            self._latest = {n: np.empty((MIN_CAPACITY, *np.shape(v))) for n, v in values.items()}
            self._rows_of_segment = self._fitting_rows()
        if not self._first:
            self._first = {name: np.array(v, dtype=np.float64) for name, v in values.items()}
        if self.segments is not None:
            while self._count >= self._rows_of_segment and self.failure is None:
                self._store()
        self._make_room()
        for name, value in values.items():
            self._latest[name][self._count] = value
        self._count += 1

    def _make_room(self) -> None:
        capacity = len(self._latest["time"])
        if self._count < capacity:
            return
        larger = int(GROWTH * capacity) + 1
        for name, before in self._latest.items():
            # One array after the other, so that two copies of all are never needed.
            self._latest[name] = np.empty((larger, *before.shape[1:]))
            self._latest[name][:capacity] = before

    def _store(self) -> None:
        """Make a segment of the first rows in memory."""
        assert self.segments is not None
        assert self._as_record is not None
        rows = self._rows_of_segment
        full = {name: values[:rows] for name, values in self._latest.items()}
        finite = _n_finite(full)
        if finite < rows and self._non_finite is None:
            self._non_finite = self._stored * rows + finite
        with np.errstate(invalid="ignore"):  # integers of what is not finite
            typed = {n: v.astype(self._type(n), copy=False) for n, v in full.items()}
        self.segments.write(self._stored, self._as_record(typed))
        if self.failure is not None:
            return
        self._remember(full)
        for values in self._latest.values():
            values[: self._count - rows] = values[rows : self._count].copy()
        self._stored += 1
        self._count -= rows

    def _remember(self, segment: Mapping[str, Any]) -> None:
        """Keep the part of a segment that stays in memory."""
        for name in self._small:
            self._earlier.setdefault(name, []).append(np.array(segment[name], dtype=np.float64))

    @property
    def _small(self) -> list[str]:
        """The names of the arrays that stay in memory."""
        columns = {n for n, v in self._latest.items() if n in self._types and v.ndim > 1}
        return [name for name in self._latest if name not in columns]

    def gain(self, name: str) -> float:
        """Return the last value of an array less its first."""
        return float(self._latest[name][self._count - 1] - self._first[name])

    def first(self, name: str) -> Any:
        """Return the first value of an array."""
        return self._first[name]

    def n_finite(self) -> int:
        """Return how many samples come before the first that is not finite."""
        if self._non_finite is not None:
            return self._non_finite
        tail = {name: values[: self._count] for name, values in self._latest.items()}
        return len(self) - self._count + (_n_finite(tail) if self._count else 0)

    def channel(self, name: str, count: int) -> Any:
        """Return the first samples of an array: in memory, or read when they are needed."""
        latest = self._latest[name]
        if not self._stored:
            return latest[:count]
        if name in self._earlier:
            return np.concatenate([*self._earlier[name], latest[: self._count]])[:count]
        return StoredChannel(self, name, (count, *latest.shape[1:]), np.float64)

    def arrays(self, names: list[str], count: int) -> "Arrays":
        """Return the first samples of some arrays."""
        return {name: self.channel(name, count) for name in names}

    @property
    def names(self) -> list[str]:
        """The names of the arrays."""
        return list(self._latest)

    def rows(self, name: str, start: int, stop: int) -> Any:
        """Return the values of samples start to stop - 1."""
        size, parts = self._rows_of_segment, []
        for number in range(start // size, min(self._stored, (stop - 1) // size + 1)):
            assert self.segments is not None
            a, b = max(start - number * size, 0), min(stop - number * size, size)
            parts.append(self.segments.rows(number, name, a, b))
        before = self._stored * size
        if stop > before:
            parts.append(self._latest[name][max(start - before, 0) : stop - before])
        return np.concatenate(parts) if len(parts) > 1 else parts[0]

    def state(self) -> Arrays:
        """Return the samples in memory, and the list of segments."""
        state: Arrays = {
            f"samples.{name}": values[: self._count].copy() for name, values in self._latest.items()
        }
        if self.segments is not None and self._stored:
            state |= {f"first.{name}": value for name, value in self._first.items()}
            none = NO_SAMPLE if self._non_finite is None else self._non_finite
            numbers = (self._stored, self._rows_of_segment, none, self.segments.checksum)
            state["stored"] = np.array(numbers, dtype=np.float64)
        return state

    def restore(self, state: Arrays, like: Mapping[str, Any], duration: float) -> None:
        """Take over the samples of another run of the same scenario.

        Parameters
        ----------
        state : dict of arrays
        like : mapping
            A sample, as `append` takes it.
        duration : float, s
            Of the run.
        """
        names = [n.removeprefix("samples.") for n in state if n.startswith("samples.")]
        if not names:
            return
        require_names(names, like, "samples.")
        count = len(require_array(state, "samples.time", np.float64, ndim=1))
        self._latest = {
            name: np.array(self._required(state, f"samples.{name}", (count, *np.shape(value))))
            for name, value in like.items()
        }
        require_values(self._latest["time"], "samples.time", ASCENDING, duration)
        self._count = count
        self._rows_of_segment = self._fitting_rows()
        if "stored" in state:
            self._restore_segments(state, like)
        else:
            # Copies: the rows in memory move when a segment is written.
            self._first = {n: np.array(v[0]) for n, v in self._latest.items() if count}

    def _required(self, state: Arrays, name: str, shape: tuple[int, ...]) -> Any:
        """Return an array of samples of a state; the integers among them fit their channel."""
        values = require_array(state, name, np.float64, ndim=len(shape))
        if values.shape != shape:
            raise unfit(name, "is of another type or shape")
        dtype = self._type(name.partition(".")[2])
        if dtype.kind == "i":
            limits = np.iinfo(dtype)
            whole = Values(limits.min, limits.max, whole=True, finite=False)
            require_values(values, name, whole, np.inf)
        return values

    def _restore_segments(self, state: Arrays, like: Mapping[str, Any]) -> None:
        numbers = require_array(state, "stored", np.float64, ndim=1)
        require_values(numbers, "stored", COUNT._replace(low=NO_SAMPLE), np.inf)
        if self.segments is None or len(numbers) != 4:
            raise unfit("stored")
        stored, rows, none, checksum = map(int, numbers.tolist())
        if rows != self._rows_of_segment or stored < 1 or checksum < 0 or none >= stored * rows:
            raise unfit("stored")
        self._first = {n: self._required(state, f"first.{n}", np.shape(like[n])) for n in like}
        if not self.segments.restore(stored, checksum):
            raise unfit("stored", "is of other segments")
        for segment in self.segments.channels(self._small, stored):
            for name in self._small:
                self._required(segment, name, (rows, *np.shape(like[name])))
            self._remember(segment)
        self._stored = stored
        self._non_finite = None if none == NO_SAMPLE else none


def _n_finite(samples: Arrays) -> int:
    """Return how many samples come before the first that is not finite."""
    sound = len(samples["time"])
    for values in samples.values():
        good = np.isfinite(values).reshape(len(values), -1).all(axis=1)
        sound = min(sound, int(np.argmin(good)) if not good.all() else len(values))
    return sound


class SampleBytes(NamedTuple):
    """The number of samples of a run, and their sizes in bytes."""

    samples: int
    recorded: int  # in a file before compression
    in_memory: int  # with the numbers that only the summary needs
    of_summary: int  # those numbers alone


def sample_bytes(scenario: "Scenario", simulation: "Simulation") -> SampleBytes:
    """Return the bytes of the samples of a run; those at events are not known before it."""
    samples = int(scenario.solver.duration / scenario.interval) + 1
    wanted, axes = scenario.output.channels, simulation.axes
    columns = [
        (stored_type(channel)(0).itemsize, len(axes[channel.axis]) if channel.axis else 1)
        for name, channel in simulation.channel_info.items()
        if wanted is None or name in wanted
    ]
    kept = KEPT + KEPT_OF_PULLEY * len(axes.get("pulley", ()))
    return SampleBytes(
        samples,
        samples * sum(size * count for size, count in columns),
        samples * FLOAT_BYTES * (kept + sum(count for _, count in columns)),
        samples * FLOAT_BYTES * (kept + sum(count == 1 for _, count in columns)),
    )


def check_space(
    scenario: "Scenario", simulation: "Simulation", segments: "Segments | None"
) -> None:
    """Check before a run that its segments can be written, and that memory and disk suffice.

    Parameters
    ----------
    scenario : Scenario
    simulation : Simulation
    segments : Segments or None
        Where samples can be put on the disk; None if the run has no file.
    """
    needed = sample_bytes(scenario, simulation)
    streams = simulation.samples is not None
    if segments is not None and streams:
        rows = rows_per_segment(needed.recorded // needed.samples)
        segments.check_places((needed.samples - 1) // rows)
    if needed.in_memory <= SMALL:
        return
    if segments is None or not streams:
        _check_memory(needed, needed.in_memory, streams)
        return
    segment = SEGMENT_BYTES
    _check_memory(needed, needed.of_summary + COPIES_OF_SEGMENT * segment, streams=False)
    # Samples are compressed, but twice there at the end: in segments and in the result.
    free = segments.free_bytes()
    if free < needed.recorded + needed.of_summary:
        raise OutputError(
            f"{segments.place}: cannot write the result: {_described(needed)}, and the disk has"
            f" {_gigabytes(free)} free; give a longer output.interval, fewer output.channels, or a"
            " file on another disk with -o"
        )
    if needed.recorded >= LARGE:
        LOG.warning(
            "%s; a longer output.interval or fewer output.channels reduce them",
            _described(needed),
        )


def _check_memory(needed: SampleBytes, size: int, streams: bool) -> None:
    available = available_memory()
    if available is None or size <= available:
        return
    file = "write the result to a file (output=), " if streams else ""
    raise InputError(
        f"cannot start this run: {_described(needed)}; it would need {_gigabytes(size)} of memory,"
        f" and {_gigabytes(available)} are available; {file}give a longer output.interval or fewer"
        " output.channels"
    )


def _described(needed: SampleBytes) -> str:
    return (
        f"{needed.samples} samples of all recorded channels take {_gigabytes(needed.recorded)}"
        " before compression"
    )


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"


def available_memory() -> int | None:
    """Return how many bytes of memory a process can have now; None where it is not known."""
    sizes = []
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                sizes.append(1024 * int(line.split()[1]))
    group = Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):  # of a container; "max" is no limit
        limit = int((group / "memory.max").read_text())
        sizes.append(max(limit - int((group / "memory.current").read_text()), 0))
    return min(sizes, default=None)

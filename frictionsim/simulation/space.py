"""What memory and disk a run needs for its samples: one that would not fit does not start."""

import logging
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.errors import InputError, OutputError
from frictionsim.simulation import sample_store
from frictionsim.simulation.record import stored_type

if TYPE_CHECKING:
    from frictionsim.results import Segments
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation

LOG = logging.getLogger(__name__)

FLOAT_BYTES = 8
# Numbers of each sample that only summary and audit need: of a belt, and of each of its pulleys.
KEPT, KEPT_OF_PULLEY = 16, 8
SMALL = 256 * 2**20  # bytes that are there
LARGE = 10**9  # bytes of samples that a user should know of before
# While a segment is written it is in memory about so often: samples, chunks, file.
COPIES_OF_SEGMENT = 4


class SampleBytes(NamedTuple):
    """What the samples of a run take.

    Attributes
    ----------
    samples : int
    recorded : int
        Bytes of the recorded channels, as in a file before compression.
    in_memory : int
        Bytes of all samples in memory, with what only the summary needs.
    of_summary : int
        Bytes of what only the summary needs.
    """

    samples: int
    recorded: int
    in_memory: int
    of_summary: int


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
        samples * FLOAT_BYTES * kept,
    )


def check_space(
    scenario: "Scenario", simulation: "Simulation", segments: "Segments | None"
) -> None:
    """Check before a run that memory and disk suffice for its samples.

    Parameters
    ----------
    scenario : Scenario
    simulation : Simulation
    segments : Segments or None
        Where samples can be put on the disk; None if the run has no file.
    """
    needed = sample_bytes(scenario, simulation)
    if needed.in_memory <= SMALL:
        return
    streams = getattr(simulation, "samples", None) is not None
    if segments is None or not streams:
        _check_memory(needed, needed.in_memory, streams)
        return
    segment = sample_store.SEGMENT_BYTES
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
            "%s; they go to %s while the run goes on. output.interval and output.channels"
            " make it less",
            _described(needed),
            segments.place,
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
    found = []
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                found.append(1024 * int(line.split()[1]))
    group = Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):  # of a container; "max" is no limit
        limit = int((group / "memory.max").read_text())
        found.append(max(limit - int((group / "memory.current").read_text()), 0))
    return min(found, default=None)

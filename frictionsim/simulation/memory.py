"""The memory that a run needs, and what this process may use."""

import logging
from collections.abc import Mapping
from contextlib import suppress
from mmap import PAGESIZE
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import BudgetExceeded, InputError
from frictionsim.simulation.record import stored_type

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation

LOG = logging.getLogger(__name__)

FLOAT_BYTES = 8
# Numbers of each sample that only summary and audit need: of a belt, and of each of its pulleys.
KEPT, KEPT_OF_PULLEY = 16, 8
SMALL = 256 * 2**20  # bytes that are there
LARGE = 10**9  # bytes of samples that a user should know of before
# The largest size of a run over that of its samples: their arrays grow, some become integers, and
# those of a belt are compressed. Measured of a guided string: 1.65, whose file has 0.2 of it, and
# might have 0.75 if nothing could be compressed; of a pulley 2.0.
PEAK = 2.3
# Of the size of the process, what a run that stops needs to write its checkpoint.
RESERVE, LEAST_RESERVE = 1.0, 64 * 2**20
SECONDS_BETWEEN_LOOKS = 1.0
CONTROL_GROUPS = Path("/sys/fs/cgroup")
# Limit and size, by the name of the controller; version 2 has one of all.
FILES_OF_GROUP = {
    "": ("memory.max", "memory.current"),
    "memory": ("memory.limit_in_bytes", "memory.usage_in_bytes"),
}

processes = 1  # that share the memory: the workers of a sweep


class SampleBytes(NamedTuple):
    """The number of samples of a run, and their sizes in bytes."""

    samples: int
    recorded: int  # in a file before compression
    in_memory: int  # with the numbers that only the summary needs


def sample_bytes(scenario: "Scenario", simulation: "Simulation") -> SampleBytes:
    """Return the bytes of the samples of a run; those at events are not known before it."""
    samples = int(scenario.solver.duration / scenario.interval) + 1
    axes = simulation.axes
    # Without axes all channels are computed, whatever is recorded.
    wanted = scenario.output.channels if axes else None
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
    )


def check_memory(
    scenario: "Scenario", simulation: "Simulation", checkpoint: Mapping[str, Any]
) -> None:
    """Check before a run that its samples, its checkpoints and its file fit into the memory.

    The run may be continued from a checkpoint, whose arrays are among those samples.

    Raises
    ------
    InputError
        If they do not; it says how much is needed, how much is there, and what helps.
    """
    needed = sample_bytes(scenario, simulation)
    size = PEAK * needed.in_memory
    size -= sum(values.nbytes for values in checkpoint.values())
    fewer = " or fewer output.channels" if simulation.axes else ""
    if size <= SMALL:
        return
    free = available_memory()
    share = f", divided by {processes} workers" if processes > 1 else ""
    if free is not None and size > free / processes:
        raise InputError(
            f"cannot start this run: {_described(needed)}; it would need {_gigabytes(size)} of"
            f" memory, and {_gigabytes(free)} are available{share}; give a longer"
            f" output.interval{fewer}"
        )
    if needed.recorded >= LARGE:
        LOG.warning("%s; a longer output.interval%s makes them less", _described(needed), fewer)


def _described(needed: SampleBytes) -> str:
    return (
        f"{needed.samples} samples of all recorded channels take {_gigabytes(needed.recorded)}"
        " before compression"
    )


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"


class MemoryWatch:
    """Stops a run whose samples at events outgrow the memory, as long as a checkpoint fits."""

    def __init__(self) -> None:
        self._next = monotonic() + SECONDS_BETWEEN_LOOKS

    def look(self, t: float) -> None:
        """Look at the memory now and then, at a time t of the run, s."""
        if monotonic() < self._next:
            return
        self._next = monotonic() + SECONDS_BETWEEN_LOOKS
        free, own = available_memory(), resident_memory()
        if free is None or own is None or free >= max(RESERVE * own, LEAST_RESERVE):
            return
        raise BudgetExceeded(
            f"the memory is used up at t = {t:.9g} s: {_gigabytes(own)} by this run,"
            f" {_gigabytes(free)} are free; resume it where there is more memory, or give a longer"
            " output.interval or output.at_events = false"
        )


def resident_memory() -> int | None:
    """Return how many bytes of memory this process has; None where it is not known."""
    with suppress(OSError, ValueError, IndexError):
        return int(Path("/proc/self/statm").read_text().split()[1]) * PAGESIZE
    return None


def available_memory() -> int | None:
    """Return how many bytes of memory a process can have now; None where it is not known."""
    sizes = []
    with suppress(OSError, ValueError, IndexError):
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                sizes.append(1024 * int(line.split()[1]))
    with suppress(OSError):
        for line in Path("/proc/self/cgroup").read_text().splitlines():
            _, controllers, group = line.split(":", 2)
            if controllers in ("", "memory"):  # version 2, or 1
                lowest = CONTROL_GROUPS / controllers / group.strip("/")
                for folder in (lowest, *lowest.parents):
                    with suppress(OSError, ValueError):  # "max" is no limit
                        sizes.append(_free_in_group(folder, FILES_OF_GROUP[controllers]))
    return min(sizes, default=None)


def _free_in_group(folder: Path, files: tuple[str, str]) -> int:
    """Return the bytes that a control group has left; what it keeps of files can be given up."""
    limit, used = (int((folder / name).read_text()) for name in files)
    for line in (folder / "memory.stat").read_text().splitlines():
        if line.startswith(("inactive_file ", "total_inactive_file ")):
            used -= int(line.split()[1])
    return max(limit - used, 0)

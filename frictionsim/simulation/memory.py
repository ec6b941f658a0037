"""The memory that a run needs, and what this process may use."""

import logging
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import InputError
from frictionsim.simulation.record import stored_type

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.mechanism import Simulation

LOG = logging.getLogger(__name__)

FLOAT_BYTES = 8
# Numbers of each sample that only summary and audit need: of a belt, and of each of its pulleys.
KEPT, KEPT_OF_PULLEY = 16, 8
SMALL = 256 * 2**20  # bytes that are there
LARGE = 10**9  # bytes of samples that a user should know of before
# The largest size of a run over that of its samples: their arrays grow, some become integers, and
# those of a belt are compressed. Measured of a guided string: 1.65, whose file has 0.2 of it, and
# might have 0.75 if nothing could be compressed; of a pulley below 1.
PEAK = 2.3
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

    def __str__(self) -> str:
        return (
            f"{self.samples} samples of all recorded channels take {_gigabytes(self.recorded)}"
            " before compression"
        )


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
    numbers = KEPT + KEPT_OF_PULLEY * len(axes.get("pulley", ()))
    numbers += sum(count for _, count in columns)
    recorded = sum(size * count for size, count in columns)
    return SampleBytes(samples, samples * recorded, samples * FLOAT_BYTES * numbers)


def check_memory(
    scenario: "Scenario", simulation: "Simulation", checkpoint: Mapping[str, Any]
) -> None:
    """Refuse a run whose samples, checkpoints and file do not fit into the memory.

    The arrays of a checkpoint, from which it may be continued, are among those samples.

    Raises
    ------
    InputError
        It says how much is needed, how much is there, and what helps.
    """
    needed = sample_bytes(scenario, simulation)
    size = PEAK * needed.in_memory - sum(values.nbytes for values in checkpoint.values())
    if size <= SMALL:
        return
    fewer = " or fewer output.channels" if simulation.axes else ""
    free = available_memory()
    if free is not None and size > free / processes:
        share = f", divided by {processes} workers" if processes > 1 else ""
        raise InputError(
            f"cannot start this run: {needed}; it would need {_gigabytes(size)} of memory, and"
            f" {_gigabytes(free)} are available{share}; give a longer output.interval{fewer}"
        )
    if needed.recorded >= LARGE:
        LOG.warning("%s; a longer output.interval%s makes them less", needed, fewer)


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"


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

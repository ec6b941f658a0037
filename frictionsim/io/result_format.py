"""Definitions shared by the writer and the reader of result files."""

from typing import Any, NamedTuple

FORMAT_VERSION = 2
SEGMENTED_VERSION = 3  # of an unfinished result whose first samples are in segments
READABLE_VERSIONS = (1, 2, 3)
SEGMENTS = "segments"  # the attribute that lists them
STATUSES = ("done", "failed", "interrupted")
CONVENTIONS = "CF-1.11"
MAX_TEXT = 64 * 1024  # characters of an attribute, a name or a text of a run
MAX_LABEL = 200  # of a unit or description
ANSWER_BYTES = 64 * 2**20  # of segments read together; a larger one is read alone
# The datasets of /solver.
COUNTS = {
    "steps": "accepted steps",
    "rejected": "rejected steps",
    "rhs_evaluations": "evaluations of the right-hand side",
    "states": "length of the state vector",
}


class Checkpoint(NamedTuple):
    """The data to resume a run: the attributes of its file and the state of its solver."""

    attributes: dict[str, str]
    state: dict[str, Any]


class LongChannel(NamedTuple):
    """A channel that is read by rows."""

    shape: tuple[int, ...]
    dtype: str


def state_digest(attributes: dict[str, Any], state: dict[str, Any]) -> str:
    """Return the SHA-256 of a checkpoint and of the attributes that it depends on.

    These are the root attributes `scenario`, `kind` and `frictionsim_version`.
    """
    from hashlib import sha256

    digest = sha256()
    for key in ("scenario", "kind", "frictionsim_version"):
        digest.update(repr(str(attributes[key])).encode())
    for name in sorted(state):
        values = state[name]
        digest.update(repr((name, values.dtype.str, values.shape)).encode())
        digest.update(values.data if values.flags.c_contiguous else values.tobytes())
    return digest.hexdigest()


def is_numbered(axis: str, members: tuple[str, ...]) -> bool:
    """Return whether the members of an axis are numbered; pulleys always have names."""
    return axis != "pulley" and members == numbered_members(len(members))


def numbered_members(count: int) -> tuple[str, ...]:
    """Return the default names of the members of an axis: their numbers."""
    return tuple(map(str, range(count)))

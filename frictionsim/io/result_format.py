"""Definitions shared by the writer and the reader of result files."""

from typing import Any, NamedTuple

FORMAT_VERSION = 2
STATUSES = ("done", "failed", "interrupted")
CONVENTIONS = "CF-1.11"
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


def state_digest(attributes: dict[str, Any], state: dict[str, Any]) -> str:
    """Return the SHA-256 of the arrays of a checkpoint and of the attributes that it depends on.

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

"""What the writer and the reader of result files agree on."""

from typing import Any

FORMAT_VERSION = 1


def state_digest(attributes: dict[str, Any], state: dict[str, Any]) -> str:
    """Return a sum that changes with any bit of a state or of the scenario that it belongs to."""
    from hashlib import sha256

    digest = sha256()
    for key in ("scenario", "kind", "frictionsim_version"):
        digest.update(repr(str(attributes[key])).encode())
    for name in sorted(state):
        values = state[name]
        digest.update(repr((name, values.dtype.str, values.shape)).encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def numbered_members(count: int) -> tuple[str, ...]:
    """Return the names of members that have none."""
    return tuple(map(str, range(count)))

"""Results with chosen channels, for motions."""

from typing import Any

import numpy as np
import tomli_w

from frictionsim.motion import motion_of
from frictionsim.motion.parts import Body, Motion, moment_of, place_of
from frictionsim.results import Record
from tests.support.scenarios import shipped


def record_of(
    kind: str, channels: dict[str, Any], data: dict[str, Any] | None = None, events: Any = ()
) -> Record:
    """Return a result with given channels, of the shipped scenario of its kind."""
    text = tomli_w.dumps(shipped(kind) if data is None else data)
    units = dict.fromkeys(channels, "1") | {"angle": "rad", "drive_force": "N"}
    return Record(
        attributes={"kind": kind, "scenario": text, "title": "", "status": "done", "reason": ""},
        channels=channels,
        units=units,
        long_names=dict.fromkeys(channels, ""),
        axes=dict.fromkeys(channels, ""),
        members={},
        events={"time": np.asarray(events, dtype=float)},
        contacts=[],
    )


def motion(record: Record) -> Motion:
    animation = motion_of(record)
    assert animation is not None
    return animation


def body(animation: Motion, name: str) -> Body:
    return next(part for part in animation.parts if isinstance(part, Body) and part.name == name)


def point_of(animation: Motion, name: str, time: float, x: float, y: float) -> complex:
    """Return where a point of a body is at a time, as a complex number."""
    moment = moment_of(animation.time, time)
    at_x, at_y, angle = place_of(body(animation, name), moment)
    return complex(at_x, at_y) + complex(x, y) * np.exp(1j * angle)

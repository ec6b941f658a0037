"""Mechanisms in motion: results with chosen channels, and the parts of their drawings.

A motion has no public way: this module is the one of the tests that names where it is made.
"""

from typing import Any

import numpy as np
import tomli_w

from frictionsim.motion import motion_of
from frictionsim.motion.parts import Arrow as Arrow
from frictionsim.motion.parts import Body as Body
from frictionsim.motion.parts import Disc as Disc
from frictionsim.motion.parts import Line as Line
from frictionsim.motion.parts import Motion as Motion
from frictionsim.results import Record
from tests.support.scenarios import shipped


def record_of(
    kind: str, channels: dict[str, Any], data: dict[str, Any] | None = None, events: Any = ()
) -> Record:
    """Return a result with given channels, of the shipped scenario of its kind."""
    text = tomli_w.dumps(shipped(kind) if data is None else data)
    units = dict.fromkeys(channels, "1") | {"angle": "rad", "drive_force": "N"}
    return Record(
        attributes={"kind": kind, "scenario": text, "backend": "events", "status": "done"}
        | dict.fromkeys(("title", "reason"), ""),
        channels=channels,
        units=units,
        long_names=dict.fromkeys(channels, ""),
        axes=dict.fromkeys(channels, ""),
        members={},
        events={"time": np.asarray(events, dtype=float)},
        contacts=[],
    )


def motion(record: Record, sample: int | None = None) -> Motion:
    """Return the motion of a result, or what a picture of one sample draws."""
    animation = motion_of(record, sample)
    assert animation is not None
    return animation


def body(animation: Motion, name: str) -> Body:
    """Return a body by its name, without what the name says of a scale."""
    bodies = (part for part in animation.parts if isinstance(part, Body))
    return next(part for part in bodies if part.name.split(" (")[0] == name)


def arrow(animation: Motion, name: str) -> Arrow:
    return next(part for part in animation.parts if isinstance(part, Arrow) and part.name == name)


def lines(animation: Motion, name: str) -> list[Line]:
    return [part for part in animation.parts if isinstance(part, Line) and part.name == name]


def number(animation: Motion, name: str) -> Any:
    return next(each.value for each in animation.readouts if each.name == name)


def point_of(of: Body, frame: int, x: float, y: float) -> complex:
    """Return where a point of a body is at a frame, as a complex number."""
    place = complex(of.x[frame], of.y[frame])
    return place + complex(x, y) * complex(np.exp(1j * of.angle[frame]))

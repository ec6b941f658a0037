"""Mechanisms in motion: results with chosen channels, and the parts of their drawings.

A motion has no public way: this module is the one of the tests that names where it is made.
"""

from typing import Any

import numpy as np
import tomli_w

from frictionsim.motion import motion_of
from frictionsim.motion.parts import (
    FORCE_ROLES,
    Arrow,
    Band,
    Body,
    Disc,
    Motion,
    Trail,
    is_visible,
    line_of,
    moment_of,
    path_until,
    place_of,
    shown_value,
    shown_word,
    state_word,
)
from frictionsim.results import Record
from tests.support.scenarios import shipped

__all__ = [
    "FORCE_ROLES",
    "Arrow",
    "Band",
    "Body",
    "Disc",
    "Motion",
    "Trail",
    "body",
    "is_visible",
    "line_of",
    "moment_of",
    "motion",
    "path_until",
    "place_of",
    "point_of",
    "record_of",
    "shown_value",
    "shown_word",
    "state_word",
]


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

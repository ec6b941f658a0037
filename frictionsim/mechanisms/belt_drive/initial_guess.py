"""A first guess of where the bodies of a belt rest: tangents on circles somewhat smaller."""

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import Array
from frictionsim.mechanisms.belt_drive.effects.contact import depth_under
from frictionsim.mechanisms.belt_drive.energy import Belt, Configuration
from frictionsim.mechanisms.belt_drive.geometry import Path, PathError, belt_path


class NoEquilibrium(ValueError):
    """The belt does not rest on its pulleys, or its rest position was not found."""


class DiscreteLayout(NamedTuple):
    """Bodies as tangents on the circles that their centres are pressed to."""

    path: Path
    pitch: float
    breakpoints: Array  # of the path, in lengths of bodies laid


def discrete_layout(belt: Belt, tension: float) -> DiscreteLayout:
    """Return how bodies lie on the pulleys at a tension, N, and how far apart they are."""
    pitch = belt.scale
    for _ in range(10):
        normal = tension * 2.0 * np.sin(np.arctan(0.5 * pitch / belt.radii))
        depth = depth_under(belt.contact, normal)
        radii = belt.radii - depth
        path = _compressed_path(belt, tension, depth)
        # A body takes less of an arc than its own length.
        half = 0.5 * pitch / radii
        lengths = np.diff(path.breakpoints)
        lengths[1::2] *= np.roll(half / np.arctan(half), -1)
        breakpoints = np.concatenate([[0.0], np.cumsum(lengths)])
        pitch = float(breakpoints[-1]) / belt.bodies
    return DiscreteLayout(path, pitch, breakpoints)


def _compressed_path(belt: Belt, tension: float, depth: Array) -> Path:
    """Return the path round circles that are smaller by the depth of the contact."""
    deepest = int(np.argmax(depth / belt.radii))
    if depth[deepest] >= belt.radii[deepest]:
        raise NoEquilibrium(
            f"a tension of {tension:.6g} N presses the belt {depth[deepest]:.4g} m deep into "
            f"pulley {belt.pulleys[deepest].name}, more than its radius of "
            f"{belt.radii[deepest]:.6g} m: raise the stiffness of the contact"
        )
    smaller = [
        pulley._replace(radius=pulley.radius - float(p))
        for pulley, p in zip(belt.pulleys, depth, strict=True)
    ]
    # A pulley that the belt barely touches may be lost so, though not in the end.
    with suppress(PathError):
        return belt_path(smaller)
    return belt.path


def initial_guess(belt: Belt, tension: float, phase: float) -> Configuration:
    """Return bodies at a tension, N; `phase` is from the middle of the first arc to a centre."""
    path, pitch, breakpoints = discrete_layout(belt, tension)
    middle = 0.5 * (breakpoints[-2] + breakpoints[-1])
    places = (middle + phase * pitch) % pitch + pitch * np.arange(belt.bodies)
    line = path.at(np.interp(places, breakpoints, path.breakpoints))
    return Configuration(line.position, line.angle, pitch / (1.0 + tension / belt.axial_rigidity))

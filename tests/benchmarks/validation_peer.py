"""The belt of `belt_verification.toml` by Exudyn and by ours: the difference taken apart.

`peer_exudyn.py` has run the peer; its results are read from `results/belt_peer.json`.
"""

import json
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from tests.benchmarks.results_common import RESULTS
from tests.benchmarks.validation_models import CORRECTED, POLYGON, STRING, Model, run
from tests.support.belt_waves import Array

HEADING = (
    *("program", "case", "mean after the load, rad/s", "vibration, Hz"),
    *("rms off ours of 480 bodies, rad/s", "rms off the peer, rad/s"),
)
STANDARD = "standard"
LOADED, END = 0.3, 0.6  # s
OF_BOTH = ("mechanism.belt.pretension=256.0", "effects.axial_damping.basis=section")
MESHES = {CORRECTED: (60, 120, 240, 480), POLYGON: (480,), STRING: (480,)}
VARIANTS = {  # of ours: what else is changed
    "240 bodies, contact 16 times stiffer": ("effects.contact.c2=8e7",),
    "240 bodies, damping=0": ("effects.axial_damping.coefficient=1e-6",),
}


def peer() -> list[tuple[Any, ...]]:
    """Compare the speed of the driven pulley in all cases of both."""
    ours = _ours()
    theirs = json.loads((RESULTS / "belt_peer.json").read_text(encoding="utf-8"))["cases"]
    curves = {name: np.array(case["driven_speed"]) for name, case in theirs.items()}
    best, standard = ours["corrected, 480 bodies"], curves[STANDARD]
    rows = [_row("ours", name, curve, best, standard) for name, curve in ours.items()]
    return rows + [_row("peer", name, curve, best, standard) for name, curve in curves.items()]


def _ours() -> dict[str, Array]:
    found: dict[str, Array] = {}
    for model, meshes in MESHES.items():
        for bodies in meshes:
            _add(found, f"{model.name}, {bodies} bodies", model, bodies, ())
    for name, overrides in VARIANTS.items():
        _add(found, name, CORRECTED, 240, overrides)
    return found


def _add(
    found: dict[str, Array],
    name: str,
    model: Model,
    bodies: int,
    overrides: tuple[str, ...],
) -> None:
    channels = "output.channels=['pulley_speed']"
    done = run(model, bodies, *OF_BOTH, *overrides, channels, base="belt_verification")
    if done is not None:
        found[name] = done.channels["pulley_speed"][:, 1]


def _row(program: str, name: str, curve: Array, best: Array, standard: Array) -> tuple[Any, ...]:
    off = [float(np.sqrt(np.mean((curve - other) ** 2))) for other in (best, standard)]
    return (program, name, *_vibration(curve), *off)


def _vibration(curve: Array) -> tuple[float, float]:
    """Return mean and frequency of the speed once the load is on, rad/s and Hz."""
    time = np.linspace(0.0, END, len(curve))
    late = time > LOADED + 0.01
    t, y = time[late] - LOADED, curve[late]

    def missing(p: Array) -> Array:
        angle = 2.0 * np.pi * p[4] * t
        return np.asarray(
            p[0] + np.exp(-p[1] * t) * (p[2] * np.cos(angle) + p[3] * np.sin(angle)) - y
        )

    found = least_squares(missing, [-12.0, 3.0, 3.0, 1.0, 22.5]).x
    return float(found[0]), float(found[4])

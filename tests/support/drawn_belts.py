"""Belt drives drawn at random, without motion across the belt."""

from math import cos, pi, sin
from typing import Any

import numpy as np

from tests.support.scenarios import Scenario, changed


def drawn(seed: int, **changes: Any) -> Scenario:
    """Return a belt on 2 to 6 pulleys on a circle, one of them perhaps on its back."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 7))
    turned, mirrored = rng.uniform(0.0, 2.0 * pi), rng.choice([-1.0, 1.0])
    pulleys: list[dict[str, Any]] = []
    for j in range(count):
        angle = turned + mirrored * 2.0 * pi * (j + rng.uniform(-0.1, 0.1)) / count
        pulleys.append(
            {
                "name": f"p{j}",
                "center": [0.4 * cos(angle), 0.4 * sin(angle)],
                "radius": float(rng.uniform(0.05, 0.12)),
                "inertia": float(rng.uniform(1e-3, 5e-3)),
            }
        )
    if count > 2 and rng.random() < 0.7:
        a, b = (np.array(pulleys[k]["center"]) for k in (0, 1))
        middle = 0.5 * (a + b)
        out = middle / np.hypot(*middle)
        roller = {"name": "back", "radius": 0.05, "inertia": 1e-3, "side": "outside"}
        outside = 0.5 * (pulleys[0]["radius"] + pulleys[1]["radius"]) + 0.05
        # It presses the span in by 3 cm.
        pulleys.insert(1, {**roller, "center": list(middle + (outside - 0.03) * out)})
    friction = float(rng.uniform(0.2, 0.8))
    data: Scenario = {
        "kind": "belt_drive",
        "mechanism": {
            "belt": {
                "bodies": 90,
                "mass_per_length": 0.4,
                "axial_rigidity": 2e4,
                "pretension": float(rng.uniform(150.0, 300.0)),
            },
            "pulleys": pulleys,
        },
        "drive": {
            "p0": {"torque": {"time": [0.0, 0.03], "value": [0.0, float(rng.uniform(-15, 15))]}},
            f"p{count - 1}": {"torque": {"speed": [-50.0, 50.0], "value": [20.0, -20.0]}},
        },
        "effects": {
            "belt_friction": {
                "mu_s": friction,
                "mu_k": friction,
                "pulleys": {"p0": {"mu_s": 0.5, "mu_k": 0.5}},
            },
            "axial_damping": {"coefficient": 5.0},
        },
        "solver": {"duration": 0.05, "rtol": 1e-6},
        "output": {"interval": 1e-3},
    }
    return changed(data, **changes)

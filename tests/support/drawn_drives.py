"""Drives of two unlike pulleys drawn at random, and what they do in the steady state.

On each pulley the belt sticks at the tension of the span that it comes from, then slides with a
tension that is exponential (Euler, Reynolds). Of a guided string with the velocity V where it is
not stretched, v = V (1 + T/EA) elsewhere, what presses it on a rim is P = T - rho V v:

    M/R = P1 - P2,    beta = ln(P1/P2)/mu,    creep = (T1 - T2)/(EA + T1)
"""

from math import acos, exp, log, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from tests.support.scenarios import Scenario


class DrawnDrive(NamedTuple):
    """Two pulleys and a belt round them; the first one drives.

    Radii, m; distance of the axes, m; EA, N; mass, kg/m; tension at rest, N; mu of each pulley; the
    torque that the driven one takes, N m; the speed of the driver, rad/s, of either sign.
    """

    radii: tuple[float, float]
    distance: float
    axial: float
    mass: float
    pretension: float
    mu: tuple[float, float]
    torque: float
    speed: float

    @property
    def wraps(self) -> tuple[float, float]:
        half = acos((self.radii[0] - self.radii[1]) / self.distance)
        return 2.0 * (pi - half), 2.0 * half

    @property
    def span(self) -> float:
        return self.distance * sin(0.5 * self.wraps[1])

    @property
    def length(self) -> float:
        return 2.0 * self.span + sum(r * a for r, a in zip(self.radii, self.wraps, strict=True))


class Steady(NamedTuple):
    """Tensions, N; creep, the slip of the rims; adhesion arcs of driver and driven, rad."""

    tight: float
    slack: float
    creep: float
    adhesion: tuple[float, float]


def drawn_drive(seed: int) -> DrawnDrive:
    """Return a drive that carries its load: 10 to 90 % of what the weaker pulley could at rest.

    A tenth of each arc is left to stick.
    """
    rng = np.random.default_rng(seed)
    radii = tuple(float(r) for r in np.exp(rng.uniform(np.log(0.02), np.log(0.12), 2)))
    distance = float(rng.uniform(1.4, 6.0) * sum(radii))
    axial, strain = float(np.exp(rng.uniform(np.log(1e4), np.log(2e5)))), rng.uniform(1e-3, 2e-2)
    pretension, mass = float(strain * axial), float(rng.uniform(0.02, 0.3))
    mu = tuple(float(m) for m in rng.uniform(0.25, 1.0, 2))
    drive = DrawnDrive(radii, distance, axial, mass, pretension, mu, 0.0, 0.0)
    ratio = exp(min(m * wrap for m, wrap in zip(mu, drive.wraps, strict=True)))
    force = rng.uniform(0.1, 0.9) * 2.0 * pretension * (ratio - 1.0) / (ratio + 1.0)
    # The belt goes round four times a second at least, and its momentum takes 5 % of the tension.
    speed = max(4.0 * drive.length, sqrt(rng.uniform(0.0, 0.05) * pretension / mass))
    sign = float(rng.choice([-1.0, 1.0]))
    drive = drive._replace(torque=float(force * radii[1]), speed=sign * speed / radii[0])
    while min(np.divide(steady(drive).adhesion, drive.wraps)) < 0.1:
        drive = drive._replace(torque=0.9 * drive.torque)
    return drive


def steady(drive: DrawnDrive) -> Steady:
    """Return the steady state, in which the belt has the unstretched length that it has at rest."""
    force, rim = drive.torque / drive.radii[1], abs(drive.speed) * drive.radii[0]

    def state(slack: float) -> tuple[float, float, float, list[float]]:
        """Return T1, V^2 rho, P2 and the sliding arcs."""
        tight = slack + force
        for _ in range(50):  # P1 - P2 is the force; V hardly depends on T1
            flow = drive.mass * (rim / (1.0 + tight / drive.axial)) ** 2
            tight = slack + force / (1.0 - flow / drive.axial)
        low = slack - flow * (1.0 + slack / drive.axial)
        return tight, flow, low, [log((low + force) / low) / mu for mu in drive.mu]

    def missing(slack: float) -> float:
        tight, flow, low, sliding = state(slack)
        stretched = drive.span * sum(1.0 / (1.0 + t / drive.axial) for t in (tight, slack))
        for j, held in enumerate((tight, slack)):

            def unstretched(angle: float, mu: float = drive.mu[j]) -> float:
                tension = (low * exp(mu * angle) + flow) / (1.0 - flow / drive.axial)
                return 1.0 / (1.0 + tension / drive.axial)

            stuck = (drive.wraps[j] - sliding[j]) / (1.0 + held / drive.axial)
            stretched += drive.radii[j] * (stuck + quad(unstretched, 0.0, sliding[j])[0])
        return stretched - drive.length / (1.0 + drive.pretension / drive.axial)

    least = drive.mass * rim**2 + 1e-3 * force
    slack = float(brentq(missing, least, drive.pretension + force, xtol=1e-12, rtol=1e-14))
    tight, _, _, sliding = state(slack)
    arcs = tuple(wrap - beta for wrap, beta in zip(drive.wraps, sliding, strict=True))
    return Steady(tight, slack, (tight - slack) / (drive.axial + tight), (arcs[0], arcs[1]))


def scenario_of_drive(drive: DrawnDrive, points: int, **changes: Any) -> Scenario:
    """Return a guided belt on the drive as data, run for six rounds of the belt at least."""
    names, places = ("driver", "driven"), (0.0, drive.distance)
    inertia = 0.1 * drive.mass * drive.length * min(drive.radii) ** 2
    pulleys = [
        {"name": name, "center": [x, 0.0], "radius": r, "inertia": inertia}
        for name, x, r in zip(names, places, drive.radii, strict=True)
    ]
    first, second = ({"mu_s": mu, "mu_k": mu} for mu in drive.mu)
    belt = {
        "bodies": points,
        "mass_per_length": drive.mass,
        "axial_rigidity": drive.axial,
        "pretension": drive.pretension,
    }
    sign = 1.0 if drive.speed > 0.0 else -1.0
    ramp = {"start": 0.0, "stop": 0.2}
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": belt, "pulleys": pulleys},
        "drive": {
            "driver": {"speed": {"smooth_step": {"from": 0.0, "to": drive.speed, **ramp}}},
            "driven": {
                "torque": {"smooth_step": {"from": 0.0, "to": -sign * drive.torque, **ramp}}
            },
        },
        "effects": {
            "belt_friction": {**first, "pulleys": {"driven": second}},
            # As in the shipped drive: a share of what is critical that no mesh changes.
            "axial_damping": {"coefficient": 0.17 * sqrt(drive.axial * drive.mass)},
        },
        "solver": {"backend": "moreau", "duration": 2.0},
        "output": {"interval": 1e-3, "channels": []},
    } | changes

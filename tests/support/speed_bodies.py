"""Pulley, marble machine and gear with friction over the speed, for the loop of `shaft_reference`.

A pulley is a body with two cords on a shaft, and is handed over as that. The others are bodies of
their own, from the laws of Newton and Euler: those of a marble machine's gear and pinion hold the
tooth force and the friction of the shaft together, which Newton's method solves.
"""

from cmath import rect
from math import ceil, cos, hypot, pi, radians, sin
from typing import Any

from tests.support.friction_curves import corners, curve
from tests.support.shaft_reference import Body, Table, size_of


def pulley(scenario: Table) -> Body:
    """Return a pulley as a body with two cords."""
    mechanism, drive = scenario["mechanism"], scenario["drive"]
    r = mechanism["cord_radius"]
    vertical = drive.get("direction", "vertical") == "vertical"
    down, left = [0.0, -1.0], [-1.0, 0.0]
    return Body(
        {
            "mechanism": {"inertia": mechanism["inertia"]},
            "effects": scenario["effects"],
            "forces": [
                {"size": mechanism["load"], "direction": down, "cord_radius": -r},
                {"size": drive["force"], "direction": down if vertical else left, "cord_radius": r},
            ],
        }
    )


class MarbleMachine:
    """Marbles on the rising half of a gear, each with its weight; the teeth press on it."""

    def __init__(self, scenario: Table) -> None:
        m, effects = scenario["mechanism"], scenario["effects"]
        self.k, self.g = m["gear_ratio"], effects["gravity"]["g"]
        self.count, self.pitch = m["slots"] // 2, 2.0 * pi / m["slots"]
        self.marble, self.circle, self.gear = (
            m[key] for key in ("marble_mass", "marble_circle_radius", "gear_mass")
        )
        self.own = m["gear_inertia"] + self.count * self.marble * self.circle**2
        self.motor = effects.get("motor_inertia", {"inertia": 0.0})["inertia"]
        self.damping = effects.get("viscous_damping", {"coefficient": 0.0})["coefficient"]
        # The pitch radius of the gear is k times that of the pinion: the force times its arm about
        # the gear is k times the torque on the pinion.
        alpha = radians(m["pressure_angle_deg"])
        line = radians(m["mesh_azimuth_deg"]) + 0.5 * pi + alpha
        self.tooth = rect(1.0 / (m["pinion_radius"] * cos(alpha)), line)
        self.torque = size_of(scenario["drive"]["torque"])
        journal = effects["shaft_friction"]
        self.r, mu_s = journal["shaft_radius"], journal["mu_s"]
        self.r_s = self.r * mu_s / hypot(1.0, mu_s)
        self.mu_k = curve(journal["mu_k"], mu_s)
        self.corners = [speed / self.r for speed in corners(journal["mu_k"])]
        self.r_k = self.r_s  # not zero: the load may reverse
        self.sizes = [self.torque]
        far = ceil(40.0 / self.pitch)
        self.angles = [n * self.pitch for n in range(-far, far + 1)]

    def load(self, q: float) -> float:
        first = q % self.pitch
        return sum(
            self.marble * self.g * self.circle * sin(first + self.pitch * j)
            for j in range(self.count)
        )

    def reaction(self, torque: Any) -> Any:
        return torque * self.tooth - 1j * (self.gear + self.count * self.marble) * self.g

    def acceleration(self, t: float, q: float, w: float, s: int) -> tuple[float, complex]:
        mu = self.mu_k(self.r * w)
        r_k, given = self.r * mu / hypot(1.0, mu), self.torque.value(t)
        rest = -self.load(q) - self.damping * w
        a = (self.k * given + rest) / (self.own + self.k**2 * self.motor)
        for _ in range(60):
            torque = given - self.motor * self.k * a
            force = self.reaction(torque)
            left = self.own * a - self.k * torque - rest + s * r_k * abs(force)
            along = (force.conjugate() * self.tooth).real / abs(force)
            slope = self.own + self.k**2 * self.motor - s * r_k * along * self.motor * self.k
            a -= left / slope
            if abs(left / slope) <= 4e-16 * abs(a) or not self.motor:
                break
        if not self.motor:
            force = self.reaction(given)
            a = (self.k * given + rest - s * r_k * abs(force)) / self.own
        return a, force

    def margin(self, t: Any, q: float, s: int) -> Any:
        torque = self.torque.value(t)
        return s * (self.k * torque - self.load(q)) - self.r_s * abs(self.reaction(torque))

    def scale(self, q: float, t: Any) -> Any:
        return self.k * abs(self.torque.value(t)) + abs(self.load(q))


class Gear:
    """A crank with a planet on a sun: couple of the hinge, and rolling friction of the mesh."""

    def __init__(self, scenario: Table) -> None:
        m, effects = scenario["mechanism"], scenario["effects"]
        sun, planet = m["sun_radius"], m["planet_radius"]
        self.length, self.mass = sun + planet, m["planet_mass"]
        self.turns, self.relative = self.length / planet, sun / planet
        rod = m["crank_mass"] * self.length**2 / 3.0
        disc = self.mass * (self.length**2 + 0.5 * (planet * self.turns) ** 2)
        self.inertia, self.g = rod + disc, effects.get("gravity", {"g": 0.0})["g"]
        self.weight = (0.5 * m["crank_mass"] + self.mass) * self.g * self.length
        none = {"torque_static": 0.0, "torque_kinetic": 0.0}
        hinge = effects.get("hinge_friction", none)
        self.static = hinge["torque_static"]
        self.couple = curve(hinge["torque_kinetic"], self.static)
        mesh = effects.get("rolling_friction", {"arm": 0.0})
        rolling = mesh.get("arm_kinetic", mesh["arm"])
        self.arm_s, self.arm = mesh["arm"], curve(rolling, mesh["arm"])
        self.radial = mesh.get("normal_load") == "radial"
        self.corners = [speed / self.relative for speed in corners(hinge["torque_kinetic"])]
        self.corners += [speed / self.turns for speed in corners(rolling)]
        self.torque = size_of(scenario["drive"]["torque"])
        self.sizes, self.r_k = [self.torque], 1.0

    def load(self, q: float, w: float) -> float:
        centripetal = self.mass * self.length * w * w if self.radial else 0.0
        return self.mass * self.g * sin(q) - centripetal

    def acceleration(self, t: float, q: float, w: float, s: int) -> tuple[float, complex]:
        load = self.load(q, w)
        opposed = self.couple(self.relative * w) * self.relative
        opposed += self.arm(self.turns * w) * self.turns * abs(load)
        moment = self.torque.value(t) - self.weight * cos(q) - s * opposed
        return moment / self.inertia, complex(load, 0.0)  # where that is zero friction has a kink

    def margin(self, t: Any, q: float, s: int) -> Any:
        limit = self.static * self.relative + self.arm_s * self.turns * abs(self.load(q, 0.0))
        return s * (self.torque.value(t) - self.weight * cos(q)) - limit

    def scale(self, q: float, t: Any) -> Any:
        return abs(self.torque.value(t)) + self.weight

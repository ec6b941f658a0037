"""Independent evaluation of the epicyclic gear, see `second_way`."""

from math import cos, pi, radians

import numpy as np

from tests.support.second_way import (
    ROUNDING,
    Array,
    Recorded,
    Seen,
    Table,
    closed,
    integral,
    of_any_motion,
    of_stick_and_slip,
    signal,
)

# The load of the mesh has a kink where it changes sign: the error of trapezoids over a turn in
# PARTS parts is about (2 pi/PARTS)^2/8 of it.
PARTS = 100_000
CORNERS = 1e-8


class Gear:
    def __init__(self, scenario: Table, formulation: str = "") -> None:
        geometry, effects = scenario["mechanism"], scenario["effects"]
        self.published = (formulation or geometry["formulation"]) == "published"
        self.sun, self.planet = geometry["sun_radius"], geometry["planet_radius"]
        # A planet in a ring turns the other way: its radius is a negative one.
        self.inside = geometry.get("mesh") == "internal"
        self.length = self.sun + (-self.planet if self.inside else self.planet)
        self.crank_mass, self.planet_mass = geometry["crank_mass"], geometry["planet_mass"]
        self.g = effects.get("gravity", {"g": 0.0})["g"]
        hinge = effects.get("hinge_friction", {"torque_static": 0.0, "torque_kinetic": 0.0})
        self.static, self.kinetic = hinge["torque_static"], hinge["torque_kinetic"]
        rolling = effects.get("rolling_friction", {"arm": 0.0, "normal_load": "weight"})
        self.arm, self.radial = rolling["arm"], rolling["normal_load"] == "radial"
        # Rotations of the planet per turn of the crank: absolute, and relative to the crank.
        self.turns = self.length / self.planet
        self.relative = self.turns + (1.0 if self.inside else -1.0)
        # A rod about its end, and a rolling disc on the crank.
        rod = self.crank_mass * self.length**2 / 3.0
        disc = self.planet_mass * (self.length**2 + 0.5 * (self.planet * self.turns) ** 2)
        self.inertia = rod + disc

    def gravity_moment(self) -> float:
        """Return the torque of the weights about the sun's axis for a horizontal crank, N m."""
        crank = self.crank_mass * self.g * 0.5 * self.length
        return crank + self.planet_mass * self.g * self.length

    def weights(self) -> float:
        """Return the torque in the equation; eq 26 as published counts the planet twice."""
        again = self.planet_mass * self.g * self.length if self.published else 0.0
        return self.gravity_moment() + again

    def load(self, angle: Array, speed: Array | float) -> Array:
        """Return the load of the rolling friction, N; as published it has the sign of the sine."""
        weight = self.planet_mass * self.g * np.sin(angle)
        if self.published:
            return weight
        centripetal = self.planet_mass * self.length * np.square(speed) if self.radial else 0.0
        return np.abs(weight - centripetal)

    def resistance(self, angle: Array, speed: Array | float) -> Array:
        """Return the friction torque on the crank in forward motion, N m."""
        couple = self.kinetic * (self.turns if self.published else self.relative)
        return couple + self.arm * self.load(angle, speed) * self.turns

    def uniform_mean(self, speed: float) -> Seen:
        """Return the mean torque of uniform forward rotation over a turn, numerically, N m."""
        angle = np.linspace(0.0, 2.0 * pi, PARTS, endpoint=False)
        torque = self.weights() * np.cos(angle) + self.resistance(angle, speed)
        size = self.weights() + float(np.mean(np.abs(torque)))
        return Seen(float(np.mean(torque)), CORNERS * size)

    def uniform(self, start: float) -> dict[str, Seen]:
        """Return the torques of slow uniform forward rotation, the extremes by sampling, N m."""

        def torque(angle: Array) -> Array:
            return self.weights() * np.cos(angle) + self.resistance(angle, 0.0)

        at_start = float(torque(np.array([start]))[0])
        size = self.weights() + float(self.resistance(np.array([0.5 * pi]), 0.0)[0])
        seen = {
            "uniform_torque_mean": self.uniform_mean(0.0),
            "uniform_torque_at_start": Seen(at_start, ROUNDING * size),
        }
        for name, sign in (("max", 1.0), ("min", -1.0)):
            low, high = 0.0, 2.0 * pi if self.published else pi  # of two equal maxima the first
            for _ in range(2):
                angle = np.linspace(low, high, PARTS)
                step, best = angle[1] - angle[0], float(angle[np.argmax(sign * torque(angle))])
                low, high = max(best - step, low), min(best + step, high)
            value = float(torque(np.array([best]))[0])
            seen[f"uniform_torque_{name}"] = Seen(value, ROUNDING * size)
            # Where it is level to roundoff; without weights that is everywhere.
            level = np.sqrt(ROUNDING * size / self.weights()) if self.weights() > 0.0 else np.inf
            seen[f"uniform_torque_{name}_angle"] = Seen(best, level)
        return seen

    def position(self, angle: Array, point: Table) -> tuple[Array, Array]:
        own = radians(point["angle_deg"]) + (-self.turns if self.inside else self.turns) * angle
        x = self.length * np.cos(angle) + point["radius"] * np.cos(own)
        return x, self.length * np.sin(angle) + point["radius"] * np.sin(own)


def gear_statics(scenario: Table) -> dict[str, Seen]:
    gear, angle = Gear(scenario), radians(scenario["mechanism"]["initial_angle_deg"])
    balance = gear.weights() * cos(angle)
    at = np.array([angle])
    if gear.published:  # it cannot stick
        resistance = float(gear.resistance(at, 0.0)[0])
        forward = backward = balance + resistance
    else:
        holds = gear.static * gear.relative + gear.arm * float(gear.load(at, 0.0)[0]) * gear.turns
        forward, backward = balance + holds, balance - holds
        resistance = holds
    size = gear.weights() + abs(resistance)
    starts = gear.uniform(angle)
    if not gear.published:
        starts |= {
            "torque_to_start_forward": Seen(forward, ROUNDING * size),
            "torque_to_start_backward": Seen(backward, ROUNDING * size),
        }
    if scenario["effects"].get("tracer_point"):
        starts |= _geometry(gear, scenario["effects"]["tracer_point"])
    ratio = -gear.turns if gear.inside else gear.turns
    other = "consistent" if gear.published else "published"
    inertia, level = gear.inertia, gear.weights()
    return {
        **starts,
        "planet_speed_ratio": Seen(ratio, ROUNDING * abs(ratio)),
        f"uniform_torque_mean_{other}": Gear(scenario, other).uniform_mean(0.0),
        "gravity_moment": Seen(level, ROUNDING * level),
        "inertia": Seen(inertia, ROUNDING * inertia),
    }


def epicyclic(record: Recorded) -> dict[str, Seen]:
    scenario, time, channels = record.scenario, record.time, record.channels
    gear, effects, drive = Gear(scenario), scenario["effects"], scenario["drive"]
    angle, velocity = channels["angle"], channels["angular_velocity"]
    torque = channels["drive_torque"] if "speed" in drive else signal(drive["torque"], time)
    seen = of_any_motion(record)
    seen |= gear.uniform(radians(scenario["mechanism"]["initial_angle_deg"]))
    if gear.radial:
        seen["uniform_torque_mean_at_final_speed"] = gear.uniform_mean(float(velocity[-1]))
    seen["energy_input"] = integral(time, torque * velocity)
    seen["energy_kinetic"] = closed(0.5 * gear.inertia * float(velocity[-1]) ** 2)
    if "gravity" in effects:
        seen["energy_potential"] = closed(gear.weights() * float(np.sin(angle[-1])))
    # Without a load the mesh has no friction.
    has_friction = "rolling_friction" in effects and (
        gear.radial or gear.planet_mass * gear.g > 0.0
    )
    if "hinge_friction" in effects or has_friction:
        resistance = gear.resistance(angle, velocity)
        if gear.published:
            seen["energy_friction"] = integral(time, resistance * velocity)
        else:
            seen["energy_friction"] = integral(time, resistance * np.abs(velocity))
            seen |= of_stick_and_slip(record)
    if "tracer_point" in effects:
        seen["tracer_cusps"] = _cusps(gear, effects["tracer_point"], angle)
        seen["tracer_dwell_time"] = _dwell(gear, effects["tracer_point"], record)
        seen |= _geometry(gear, effects["tracer_point"])
    return seen


def _geometry(gear: Gear, point: Table) -> dict[str, Seen]:
    """Return swing and dwell angle from a fine path about the place where the crank is level."""
    level = radians(0.0 if gear.inside else 180.0)
    path = {**point, "angle_deg": np.degrees(level)}
    half = _half_of_a_passage(gear, path, 0.0)
    dwells = point["radius"] > 0.0 and half < np.inf
    seen = {"tracer_dwell_angle": Seen(2.0 * half if dwells else None, 4e-5)}
    away = np.linspace(0.0, 2.0 * pi, 400_001)
    _, y = gear.position(away, path)
    turns = np.flatnonzero(np.diff(y) > 0.0)
    swing = 2.0 * abs(float(y[turns[0]])) if turns.size else None
    back = point["radius"] > gear.planet
    return seen | {"tracer_swing": Seen(swing if back else 0.0, 1e-9 if back else 0.0)}


def _cusps(gear: Gear, point: Table, angle: Array) -> Seen:
    """Count the contacts of a rim point with the sun over the range of the crank angle."""
    if point["radius"] != gear.planet:
        return Seen(None)
    low, high = float(np.min(angle)), float(np.max(angle))
    # There are more than a thousand of these positions between two cusps.
    fine = np.linspace(low, high, 1000 + int(3000 * (high - low) * gear.relative))
    distance = np.abs(np.hypot(*gear.position(fine, point)) - gear.sun)
    padded = np.concatenate([[np.inf], distance, [np.inf]])
    lowest = (distance <= padded[:-2]) & (distance < padded[2:])
    # From a contact, the distance from the sun or ring grows by L rho/r1 (1 - cos) of the angle
    # that the point has turned: two of those steps, or a rounding at the ends of the range.
    step = gear.relative * float(fine[1] - fine[0]) if high > low else 0.0
    near = gear.length * gear.planet / gear.sun * step * step + ROUNDING * gear.sun
    touches = lowest & (distance <= near)
    for end in (0, -1):
        touches[end] &= bool(distance[end] <= ROUNDING * gear.sun)
    x, y = gear.position(fine, point)
    closed = touches[0] and touches[-1] and np.hypot(x[-1] - x[0], y[-1] - y[0]) < 1e-9 * gear.sun
    if high - low > pi and closed:  # the last cusp is the first
        touches[-1] = False
    return Seen(float(np.count_nonzero(touches)))


def _dwell(gear: Gear, point: Table, record: Recorded) -> Seen:
    """Return the longest passage of a place nearest to the sun, from the samples.

    Times are linear between samples: each end of a passage is an interval off at most.
    """
    time, angle = record.time, record.channels["angle"]
    # What the angle of the planet on its crank is at such a place, apart from 2 pi k.
    near = radians(point["angle_deg"]) if gear.inside else pi - radians(point["angle_deg"])
    half = _half_of_a_passage(gear, point, near / gear.relative)
    passages = []
    for way in (1.0, -1.0):
        grows = np.concatenate([[False], np.diff(way * angle) > 0.0, [False]])
        edges = np.flatnonzero(grows[1:] != grows[:-1])
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            run, when = way * angle[first : last + 1], time[first : last + 1]
            low, high = sorted((way * run[0], way * run[-1]))
            number = np.array([low, high]) * gear.relative - near
            k = np.arange(np.floor(number[0] / (2.0 * pi)), np.ceil(number[1] / (2.0 * pi)) + 1.0)
            for place in (near + 2.0 * pi * k) / gear.relative:
                start, stop = way * place - half, way * place + half
                if run[0] <= start and stop <= run[-1]:
                    passages.append(float(np.diff(np.interp([start, stop], run, when))[0]))
    if point["radius"] == 0.0 or not passages:
        return Seen(None)
    return Seen(max(passages), 3.0 * float(np.max(np.diff(time))))


def _half_of_a_passage(gear: Gear, point: Table, place: float) -> float:
    """Return how far the crank turns from a place until its point is beyond the distance, rad.

    It is as far on both sides, and from all places: the paths are the same, turned and mirrored.
    """
    away = np.linspace(0.0, 2.0 * pi, 400_001)
    x, y = gear.position(place, point)
    path = gear.position(place + away, point)
    outside = np.hypot(path[0] - x, path[1] - y) > point["dwell_distance"]
    return float(away[int(np.argmax(outside))]) if outside.any() else np.inf

"""Independent evaluation of a body on a shaft, see `second_way`."""

from typing import Any, NamedTuple

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
from tests.support.second_way_shafts import pressing, shaft_of

SCANNED = 40_001
# A root that is so many times as large as most of the others but zeros is beside a pole.
POLE = 1e3
HUGE = 1e300
# Torques and reactions are sums of few terms; what is left of them has the rounding of the terms.
SUM = 1e-11


class Motion(NamedTuple):
    """Where a body is: times, angles, velocities and accelerations."""

    time: Array
    angle: Array
    velocity: Array
    acceleration: Array


class Loads(NamedTuple):
    """Moment, components of the resultant, and the sum of the magnitudes of the moment's terms."""

    moment: Array
    across: Array
    up: Array
    terms: Array


def at_rest(time: float, angle: Any) -> Motion:
    zero = 0.0 * np.atleast_1d(angle)
    return Motion(zero + time, zero + angle, zero, zero)


def size_at(table: Any, at: Motion) -> Array:
    if isinstance(table, dict) and "speed" in table:
        return np.interp(at.velocity, table["speed"], table["value"])
    if isinstance(table, dict) and "angle_deg" in table:
        return np.interp(np.degrees(at.angle), table["angle_deg"], table["value"])
    return signal(table, at.time)


def rotated(vector: Any, angle: Array, turns: bool) -> tuple[Array, Array]:
    turn = np.exp(1j * angle) if turns else np.ones(angle.shape, dtype=complex)
    vector_turned = complex(*vector) * turn
    return vector_turned.real, vector_turned.imag


def moment_of(force: Table, at: Motion) -> tuple[Array, Array, Array, Array]:
    """Return the moment and the components of a force, and the magnitude of the moment's terms."""
    size = size_at(force["size"], at)
    x, y = rotated(force["direction"], at.angle, force["direction_turns"])
    x, y = (size * part / np.hypot(*force["direction"]) for part in (x, y))
    if "cord_radius" in force:
        moment = size * force["cord_radius"]
        return moment, x, y, abs(moment)
    p, q = rotated(force["point"], at.angle, force["point_turns"])
    return p * y - q * x, x, y, abs(p * y) + abs(q * x)


def applied(scenario: Table, at: Motion) -> Loads:
    terms = [moment_of(force, at) for force in scenario.get("forces", ())]
    nothing = 0.0 * at.angle
    sizes = [size_at(couple["size"], at) for couple in scenario.get("couples", ())]
    terms += [(size, nothing, nothing, abs(size)) for size in sizes]
    columns = [sum(column, nothing) for column in zip(*terms, strict=True)] or [nothing] * 4
    return Loads(*columns)


def all_loads(scenario: Table, at: Motion) -> Loads:
    """Return the sum of all loads on the body but damping and dry friction."""
    moment, across, up, terms = applied(scenario, at)
    effects = scenario["effects"]
    if "gravity" in effects:
        g, eccentric = effects["gravity"]["g"], eccentric_of(scenario)
        lever = np.real(eccentric[1] * np.exp(1j * at.angle))
        up = up - g * (scenario["mechanism"]["mass"] + eccentric[0])
        moment, terms = moment - g * eccentric[0] * lever, terms + g * eccentric[0] * abs(lever)
    if "torsion_spring" in effects:
        spring = effects["torsion_spring"]
        torque = -spring["stiffness"] * (at.angle - np.radians(spring["free_angle_deg"]))
        moment, terms = moment + torque, terms + abs(torque)
    return Loads(moment, across, up, terms)


def eccentric_of(scenario: Table) -> tuple[float, complex]:
    """Return the eccentric mass and its place at the angle 0; zeros without one."""
    table = scenario["effects"].get("eccentric_mass")
    if table is None:
        return 0.0, 0j
    return table["mass"], table["radius"] * np.exp(1j * np.radians(table["azimuth_deg"]))


def reaction(scenario: Table, at: Motion) -> Array:
    """Return the force of the shaft: the resultant less what accelerates an eccentric mass."""
    loads, (mass, place) = all_loads(scenario, at), eccentric_of(scenario)
    arm = place * np.exp(1j * at.angle)
    acceleration = (1j * at.acceleration - at.velocity**2) * arm
    return np.asarray(abs(loads.across + 1j * loads.up - mass * acceleration))


# --- statics --------------------------------------------------------------------------------------


def place(scenario: Table) -> tuple[float, float]:
    """Return time and angle of the statics, s and deg."""
    asked = scenario.get("statics", {})
    return asked.get("time", 0.0), asked.get(
        "angle_deg", scenario["mechanism"]["initial_angle_deg"]
    )


def with_size(scenario: Table, size: float) -> Table:
    table, name, _ = scenario["statics"]["unknown"].split(".")
    rows = [row | {"size": size} if row["name"] == name else row for row in scenario[table]]
    return scenario | {table: rows}


def roots(scenario: Table, angle: Any, sliding: bool = False) -> dict[int, Array]:
    """Return both roots for the size of a load, (2, n), by direction; nan where there is none.

    Of r_s, or of the radius of a body that slides.
    """
    time, _ = place(scenario)
    r, at = shaft_of(scenario)[int(sliding)], at_rest(time, angle)
    none, one = (all_loads(with_size(scenario, size), at) for size in (0.0, 1.0))
    if np.any(load := pressing(scenario, 0.0 * none.moment)):
        none, one = (of._replace(across=load, up=0.0 * load) for of in (none, one))
    a = [y - x for x, y in zip(none[:3], one[:3], strict=True)]
    square = a[0] ** 2 - r**2 * (a[1] ** 2 + a[2] ** 2)
    cross = none[0] * a[0] - r**2 * (none[1] * a[1] + none[2] * a[2])
    rest = none[0] ** 2 - r**2 * (none[1] ** 2 + none[2] ** 2)
    by_direction = {}
    inside = cross**2 - square * rest
    double = abs(inside) <= 1e-15 * (cross**2 + abs(square * rest))  # but for rounding
    with np.errstate(all="ignore"):
        surd = np.sqrt(np.where(double, 0.0, inside))
        values = np.array([(-cross - surd) / square, (-cross + surd) / square])
        moments = none[0] + a[0] * values
    values[1, double] = np.nan
    for s in (1, -1):  # where moment and friction vanish together, both
        by_direction[s] = np.sort(np.where((s * moments >= 0.0) | double, values, np.nan), axis=0)
    if r == 0.0:
        with np.errstate(all="ignore"):
            root = -none[0] / a[0]
        by_direction = dict.fromkeys((1, -1), np.array([root, np.full_like(root, np.nan)]))
    return by_direction


def breakaway(scenario: Table, sliding: bool = False) -> dict[str, Seen]:
    """Return the sizes of impending motion at the angle of the statics; or of steady motion."""
    if "statics" not in scenario:
        return {}
    label = scenario["statics"]["unknown"].split(".")[1]
    time, degrees = place(scenario)
    by_direction = roots(scenario, np.radians(degrees), sliding)
    at = at_rest(time, np.radians(degrees))
    sizes = [abs(x) for values in by_direction.values() for x in values[:, 0] if np.isfinite(x)]
    none, one = (all_loads(with_size(scenario, size), at) for size in (0.0, 1.0))
    arm = abs(float((one.moment - none.moment)[0]))
    # Of the root, and of the moment without the unknown, which may be what its terms leave.
    rounding = 1e-8 * max(sizes, default=0.0) + (SUM * float(none.terms[0]) / arm if arm else 0.0)
    seen = {}
    for s, direction in ((1, "counter_clockwise"), (-1, "clockwise")):
        for value, ending in zip(by_direction[s][:, 0], ("", "_second"), strict=True):
            if np.isfinite(value) or not ending:
                finite = float(value) if np.isfinite(value) else None
                keep = "keep_" if sliding else ""
                seen[f"{label}_{keep}{direction}{ending}"] = Seen(finite, rounding)
    return seen


def worst(scenario: Table) -> dict[str, Seen]:
    """Return the extreme sizes over a turn, from a dense scan."""
    if "statics" not in scenario:
        return {}
    label, middle = scenario["statics"]["unknown"].split(".")[1], np.radians(place(scenario)[1])
    angles = middle + np.linspace(-np.pi, np.pi, SCANNED)
    by_direction, seen = roots(scenario, angles), {}
    for s, direction in ((1, "counter_clockwise"), (-1, "clockwise")):
        for sign, side in ((-1, "smallest"), (1, "largest")):
            name = f"{label}_{direction}_{side}"
            seen[name], seen[f"{name}_angle"] = _extreme(sign * by_direction[s], sign, angles)
    return seen


def _extreme(values: Array, sign: int, angles: Array) -> tuple[Seen, Seen]:
    if np.all(np.isnan(values)):
        return Seen(None), Seen(None)
    values = np.clip(values, -HUGE, HUGE)  # at a pole itself the root is infinite
    row, i = np.unravel_index(np.nanargmax(values), values.shape)
    best = float(values[row, i])
    # Beside it, the curve is off by less than to the neighbours: they are of a smooth extremum.
    beside = values[:, max(i - 1, 0) : i + 2]
    drop = best - float(np.nanmin(np.where(abs(beside - best) < abs(best) + 1.0, beside, np.nan)))
    others = abs(values[~np.isnan(values) & (values != 0.0)])
    pole = POLE * float(np.median(others)) if others.size else np.inf
    # One of several poles is as good as another, however near to it the scan comes.
    enough = best - 4.0 * drop - 1e-9 * (1.0 + abs(best)) if best <= pole else 0.03 * pole
    off = np.abs(angles[np.fmax(*values) >= enough] - angles[i])
    angle = Seen(float(angles[i]), float(np.max(off)) + 1e-3)
    if best > pole:
        return Seen(None), angle
    return Seen(sign * best, 4.0 * drop + 1e-8 * (1.0 + abs(best))), angle


def body_statics(scenario: Table) -> dict[str, Seen]:
    time, degrees = place(scenario)
    r_s, r_k = shaft_of(scenario)
    loads = all_loads(scenario, at_rest(time, np.radians(degrees)))
    moment, across, up, terms = (float(x[0]) for x in loads)
    force = float(np.hypot(across, up))
    limit = r_s * pressing(scenario, force)
    margin = limit - abs(moment)
    rounding = SUM * (terms + limit + r_s * force)
    seen = {
        "angle": closed(float(np.radians(degrees))),
        "applied_torque": Seen(moment, rounding),
        "shaft_reaction": Seen(force, SUM * _forces(scenario, time, degrees)),
        "force_x": Seen(across, SUM * _forces(scenario, time, degrees)),
        "force_y": Seen(up, SUM * _forces(scenario, time, degrees)),
        "lever_arm": Seen(moment / force, rounding / force + ROUNDING) if force else Seen(None),
        "static_limit": Seen(limit, rounding),
        "static_margin": Seen(margin, rounding),
        "breakaway_direction": Seen(0.0 if margin >= -rounding else float(np.sign(moment))),
        "friction_radius_static": closed(r_s),
        "friction_radius_kinetic": closed(r_k),
    }
    return seen | breakaway(scenario) | breakaway(scenario, sliding=True) | worst(scenario)


def _forces(scenario: Table, time: float, degrees: float) -> float:
    at = at_rest(time, np.radians(degrees))
    total = sum(float(abs(size_at(f["size"], at)[0])) for f in scenario.get("forces", ()))
    g = scenario["effects"].get("gravity", {"g": 0.0})["g"]
    return total + g * (scenario["mechanism"]["mass"] + eccentric_of(scenario)[0])


# --- summary --------------------------------------------------------------------------------------


def body(record: Recorded) -> dict[str, Seen]:
    scenario, channels = record.scenario, record.channels
    names = ("angle", "angular_velocity", "angular_acceleration")
    at = Motion(record.time, *(channels[name] for name in names))
    effects, (mass, arm) = scenario["effects"], eccentric_of(scenario)
    inertia = scenario["mechanism"]["inertia"] + mass * abs(arm) ** 2
    force = reaction(scenario, at)
    peak = float(np.max(force))
    seen = of_any_motion(record) | breakaway(scenario)
    seen["shaft_reaction_peak"] = Seen(peak, 1e-9 * (1.0 + peak))
    seen["energy_input"] = integral(record.time, applied(scenario, at).moment * at.velocity)
    seen["energy_kinetic"] = closed(0.5 * inertia * float(at.velocity[-1]) ** 2)
    if "viscous_damping" in effects:
        b = effects["viscous_damping"]["coefficient"]
        seen["energy_damping"] = integral(record.time, b * at.velocity**2)
    height = spring = None
    if "gravity" in effects and "eccentric_mass" in effects:
        height = float(np.imag(arm * np.exp(1j * at.angle[-1])))
    if "torsion_spring" in effects:
        spring = effects["torsion_spring"]
    if height is not None or spring is not None:
        weight = mass * effects.get("gravity", {"g": 0.0})["g"]
        stored = [weight * (height or 0.0)]
        if spring is not None:
            twist = float(at.angle[-1]) - np.radians(spring["free_angle_deg"])
            stored.append(0.5 * spring["stiffness"] * twist**2)
        rounding = ROUNDING * (weight * abs(arm) + sum(map(abs, stored)))
        seen["energy_potential"] = Seen(sum(stored), rounding)
    if "shaft_friction" in effects or "end_stops" in effects:
        seen |= of_stick_and_slip(record)
    if "shaft_friction" in effects:
        r_k = shaft_of(scenario)[1]
        power = r_k * pressing(scenario, force) * np.abs(at.velocity)
        seen["energy_friction"] = integral(record.time, power)
    return seen

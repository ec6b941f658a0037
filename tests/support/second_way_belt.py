"""An independent reader of belt drives, see `second_way`."""

from typing import NamedTuple

import numpy as np

from tests.support.second_way import Array, Recorded, Seen, integral

SHARE = 0.2  # of the run, at its end: means are over it
# Of a span's mean tension: the last fifth may begin a sample earlier or later.
TENSION = 1e-3
# Places are recorded, velocities are not: what their differences miss of the belt's energy of
# motion and of the heat of its dampers. The fixed steps are as long as the fastest waves take for a
# radian, and what these lose is not to be seen in the samples.
MOTION, DAMPERS, DAMPERS_OF_LONG_STEPS = 0.005, 0.02, 0.2
HEAT = 0.02  # of a friction whose bodies come to rest and break loose between two samples


class Drive(NamedTuple):
    """The pulleys of a scenario; sense is +1 where the belt passes counter-clockwise."""

    names: list[str]
    radius: Array
    inertia: Array
    sense: Array


def drive_of(record: Recorded) -> Drive:
    """Return the pulleys; which way round the belt goes is seen from the area within its bodies."""
    tables = record.scenario["mechanism"]["pulleys"]
    x, y = record.channels["x"][0], record.channels["y"][0]
    round_ = np.sign(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    return Drive(
        [table["name"] for table in tables],
        np.array([table["radius"] for table in tables]),
        np.array([table["inertia"] for table in tables]),
        round_ * np.array([1.0 if table["side"] == "inside" else -1.0 for table in tables]),
    )


def last(record: Recorded) -> Recorded:
    """Return the part of a record that means are taken over."""
    time = record.time
    # A sample that rounding put beside the beginning of this part belongs to it.
    begin = time[-1] - SHARE * (time[-1] - time[0]) - 1e-9 * time[-1]
    part = time >= begin
    channels = {k: v[part] for k, v in record.channels.items() if len(v) == len(time)}
    return record._replace(time=time[part], channels=channels)


def mean(time: Array, values: Array) -> Array:
    h = np.diff(time).reshape(-1, *(1,) * (values.ndim - 1))
    return np.sum(0.5 * h * (values[1:] + values[:-1]), axis=0) / (time[-1] - time[0])


def smoothly_averaged(time: Array, values: Array) -> Seen:
    """Return a mean with the weights of Hann's window; which sample is the first is left open."""
    weight = 0.5 * (1.0 - np.cos(2.0 * np.pi * (time - time[0]) / np.ptp(time)))
    value = float(mean(time, weight * values) / mean(time, weight))
    return Seen(value, 2.0 * float(np.ptp(values)) / len(values) + 1e-12)


def averaged(time: Array, values: Array) -> Seen:
    """Return a mean over samples; whether their ends count in half is left open."""
    return Seen(float(mean(time, values)), 2.0 * float(np.ptp(values)) / len(values) + 1e-12)


# --- tensions -------------------------------------------------------------------------------------


def touching(record: Recorded) -> Array:
    """Return the pulley that each body touches at each sample, -1 for none."""
    pressed = record.channels["normal_force"] > 0.0
    return np.where(pressed, record.channels["pulley_index"], -1.0).astype(int)


def spans(pulley: Array, count: int) -> list[Array]:
    """Return the joints of the span from each pulley to the next, of one sample.

    Joint k is between the bodies k - 1 and k. A span begins behind the last body on a pulley and
    ends with the first on another one; a pulley that is not touched in between is passed by, and
    the spans beside it are one.
    """
    on = np.flatnonzero(pulley >= 0)
    joints_of_spans = [np.arange(len(pulley))] * count
    for body, after in zip(on, np.roll(on, -1), strict=True):
        here, there = int(pulley[body]), int(pulley[after])
        if here == there and len(set(pulley[on])) > 1:
            continue  # the same arc
        joints = body + 1 + np.arange((after - body - 1) % len(pulley) + 1)
        for k in range((there - here - 1) % count + 1):
            joints_of_spans[(here + k) % count] = joints % len(pulley)
    return joints_of_spans


def walked(tension: Array, pulley: Array, count: int) -> list[float]:
    return [float(np.mean(tension[joints])) for joints in spans(pulley, count)]


def span_tensions(record: Recorded) -> Array:
    count = len(record.scenario["mechanism"]["pulleys"])
    samples = zip(record.channels["tension"], touching(record), strict=True)
    return np.array([walked(*sample, count) for sample in samples])


def torque_residuals(record: Recorded) -> Array:
    """Return by how much T1 - T2 is off (M - I alpha)/R in the mean, over the largest, by pulley.

    The belt from the middle of one span to that of the next is accelerated, too.
    """
    drive, part, length = drive_of(record), last(record), body_length(record)
    tension = mean(part.time, span_tensions(part))
    speed = part.channels["pulley_speed"]
    alpha = (speed[-1] - speed[0]) / np.ptp(part.time)
    statistics = np.array([len(j) for j in spans(touching(part)[-1], len(drive.names))])
    on = np.array([np.sum(touching(part)[-1] == j) for j in range(len(drive.names))])
    bodies = on + 0.5 * (statistics + np.roll(statistics, 1))
    mass = record.scenario["mechanism"]["belt"]["mass_per_length"] * length * bodies
    torque = mean(part.time, part.channels["pulley_torque"])
    expected = drive.sense * (torque - drive.inertia * alpha) / drive.radius
    expected -= mass * (belt_speed(part, -1) - belt_speed(part, 1)) / np.ptp(part.time)
    torques = np.roll(tension, 1) - tension
    return np.abs(torques - expected) / np.max(np.abs(torque / drive.radius))


def power_residual(record: Recorded) -> float:
    """Return by how much the work in is off what is stored and lost, over what goes through.

    In the part of the run that means are taken over; the stores and heats are the recorded ones.
    """
    part = last(record)
    power = part.channels["pulley_torque"] * part.channels["pulley_speed"]
    work = mean(part.time, np.sum(power, axis=1)) * np.ptp(part.time)
    energies = (v for k, v in part.channels.items() if k.startswith("energy") and "input" not in k)
    gained = sum(float(energy[-1] - energy[0]) for energy in energies)
    through = mean(part.time, np.sum(np.clip(power, 0.0, None), axis=1)) * np.ptp(part.time)
    return float(abs(work - gained) / through)


def belt_speed(record: Recorded, i: int) -> float:
    """Return the mean speed of the bodies along the belt up to a sample, from their places, m/s."""
    moved = [record.channels[name][i] - record.channels[name][i - 1] for name in ("x", "y")]
    angle = record.channels["angle"][i]
    along = moved[0] * np.cos(angle) + moved[1] * np.sin(angle)
    return float(np.mean(along) / (record.time[i] - record.time[i - 1]))


# --- energies -------------------------------------------------------------------------------------


def body_length(record: Recorded) -> float:
    """Return the unstretched length of a body, for which the first sample's joints pull as told.

    The stretch of a joint is what lies between the ends of its two bodies, T = EA/l |d|.
    """
    rigidity = record.scenario["mechanism"]["belt"]["axial_rigidity"]
    places = [record.channels[name][0] for name in ("x", "y", "angle")]
    tension = float(np.mean(record.channels["tension"][0]))
    low = 0.5 * float(np.mean(np.hypot(*(np.diff(places[0]), np.diff(places[1])))))
    high = 2.0 * low
    for _ in range(100):
        middle = 0.5 * (low + high)
        pull = rigidity / middle * float(np.mean(_stretch(*places, middle)))
        low, high = (middle, high) if pull > tension else (low, middle)
    return 0.5 * (low + high)


def _stretch(x: Array, y: Array, angle: Array, length: float) -> Array:
    """Return the distances between the ends of neighbours, m; negative where they overlap."""
    along_x, along_y = np.cos(angle), np.sin(angle)
    mid_x, mid_y = (0.5 * (c + np.roll(c, 1)) for c in (along_x, along_y))
    gap_x, gap_y = x - np.roll(x, 1) - length * mid_x, y - np.roll(y, 1) - length * mid_y
    return np.copysign(np.hypot(gap_x, gap_y), gap_x * mid_x + gap_y * mid_y)


def potential(record: Recorded, i: int, length: float) -> float:
    """Return the energy of springs, bends, contacts and weight in a sample, J."""
    belt, effects = record.scenario["mechanism"]["belt"], record.scenario["effects"]
    x, y, angle = (record.channels[name][i] for name in ("x", "y", "angle"))
    energy = 0.5 * belt["axial_rigidity"] / length * np.sum(_stretch(x, y, angle, length) ** 2)
    if "bending" in effects:
        turned = np.diff(angle, append=angle[0])
        turned -= 2.0 * np.pi * np.round(turned / (2.0 * np.pi))  # once round is no bend
        energy += 0.5 * effects["bending"]["rigidity"] / length * np.sum(turned**2)
    if "gravity" in effects:
        weight = belt["mass_per_length"] * length * effects["gravity"]["g"]
        energy += weight * np.sum(y)
    contact = effects["contact"]
    share = contact.get("reference_bodies", belt["bodies"]) / belt["bodies"]
    for pulley in record.scenario["mechanism"]["pulleys"]:
        far = np.hypot(x - pulley["center"][0], y - pulley["center"][1])
        depth = np.maximum(pulley["radius"] - far, 0.0)
        energy += share * np.sum(contact["c1"] * depth**3 / 3.0 + contact["c2"] * depth**2 / 2.0)
    return float(energy)


def kinetic(record: Recorded, length: float) -> Seen:
    belt, drive = record.scenario["mechanism"]["belt"], drive_of(record)
    mass = belt["mass_per_length"] * length
    # The weights of the last places in the slope of the cubic through them.
    ages = record.time[-4:] - record.time[-1]
    weights = np.linalg.solve(np.vander(ages, increasing=True).T, [0.0, 1.0, 0.0, 0.0])
    rates = {name: weights @ record.channels[name][-4:] for name in ("x", "y", "angle")}
    energy = 0.5 * mass * np.sum(rates["x"] ** 2 + rates["y"] ** 2)
    energy += mass * length**2 / 24.0 * np.sum(rates["angle"] ** 2)
    turning = 0.5 * np.sum(drive.inertia * record.channels["pulley_speed"][-1] ** 2)
    return Seen(float(energy + turning), MOTION * float(energy) + 1e-9 * float(turning))


def damped(record: Recorded, length: float, every: int = 1) -> float:
    """Return the heat of the dampers, J, from the differences of places at every so many samples.

    Each takes b d'^2 of the rate at which it is stretched, bent or pressed.
    """
    effects, belt = record.scenario["effects"], record.scenario["mechanism"]["belt"]
    time = record.time[::every]
    x, y, angle = (record.channels[name][::every] for name in ("x", "y", "angle"))
    heat = 0.0
    if "axial_damping" in effects:
        axial = effects["axial_damping"]
        b = axial["coefficient"] / (length if axial["basis"] == "section" else 1.0)
        stretch = np.array([_stretch(*p, length) for p in zip(x, y, angle, strict=True)])
        heat += b * _squares(time, stretch)
    if effects.get("bending", {"damping": 0.0})["damping"] > 0.0:
        b = effects["bending"]["damping"] / length
        heat += b * _squares(time, angle - np.roll(angle, 1, axis=1))
    contact = effects["contact"]
    share = contact.get("reference_bodies", belt["bodies"]) / belt["bodies"]
    for pulley in record.scenario["mechanism"]["pulleys"]:
        far = np.hypot(x - pulley["center"][0], y - pulley["center"][1])
        depth = np.clip((pulley["radius"] - far) / contact["p_max"], 0.0, 1.0)
        part = depth**2 * (3.0 - 2.0 * depth)  # the damper comes on with the depth
        heat += share * contact["damping"] * _squares(time, far, 0.5 * (part[1:] + part[:-1]))
    return heat


def _squares(time: Array, values: Array, weight: Array | float = 1.0) -> float:
    return float(np.sum(weight * np.diff(values, axis=0) ** 2 / np.diff(time)[:, None]))


def energies(record: Recorded, length: float) -> dict[str, Seen]:
    time, channels, effects = record.time, record.channels, record.scenario["effects"]
    first, end = potential(record, 0, length), potential(record, -1, length)
    seen = {
        "initial_energy": Seen(float(channels["energy_kinetic"][0]) + first, 1e-6 * abs(first)),
        "energy_input": integral(
            time, np.sum(channels["pulley_torque"] * channels["pulley_speed"], axis=1)
        ),
        "energy_kinetic": kinetic(record, length),
        "energy_potential": Seen(end, 1e-6 * abs(first)),
    }
    if "belt_friction" in effects:
        power = channels["friction_force"] * channels["slip_velocity"]
        # One that sticks has what the tolerance leaves it of a slip, of either sign.
        power = np.where(channels["sticking"] == 1.0, power, np.abs(power))
        heat = integral(time, np.sum(power, axis=1))
        seen["energy_friction"] = Seen(heat.value, heat.uncertainty + HEAT * abs(heat.value or 0.0))
    bends = effects.get("bending", {"damping": 0.0})["damping"] > 0.0
    if "axial_damping" in effects or effects["contact"]["damping"] > 0.0 or bends:
        # Of a wave, differences over h miss (w h)^2/12: over twice that, four times as much.
        fine, coarse = damped(record, length), damped(record, length, 2)
        missed = (fine - coarse) / 3.0
        long_steps = record.scenario["solver"]["backend"] == "moreau"
        share = DAMPERS_OF_LONG_STEPS if long_steps else DAMPERS
        seen["energy_damping"] = Seen(fine + missed, abs(missed) + share * fine)
    return seen


# --- the summary ----------------------------------------------------------------------------------


def belt_drive(record: Recorded) -> dict[str, Seen]:
    """Return the quantities of the summary of a belt drive; means are over the last fifth."""
    drive, part, length = drive_of(record), last(record), body_length(record)
    tension = float(np.mean(record.channels["tension"][0]))
    levels = mean(part.time, span_tensions(part))
    seen = {
        "pretension": Seen(tension, 1e-9 * tension),
        "tension_tight": _span(max(levels)),
        "tension_slack": _span(min(levels)),
    }
    for j, name in enumerate(drive.names):
        after = drive.names[(j + 1) % len(drive.names)]
        seen[f"tension_{name}_to_{after}"] = _span(levels[j])
    seen["final_time"] = Seen(record.scenario["solver"]["duration"])
    return seen | _motion(part, drive) | _contact(part, drive, length) | energies(record, length)


def _span(value: float) -> Seen:
    return Seen(float(value), TENSION * abs(float(value)))


def _motion(part: Recorded, drive: Drive) -> dict[str, Seen]:
    time, speeds = part.time, part.channels["pulley_speed"]
    torque = part.channels["pulley_torque"]
    power = mean(time, torque * speeds)
    acts = np.any(torque != 0.0, axis=0)  # a free pulley does not drive
    first = int(np.argmax(np.where(acts, power, -np.inf)))
    other = min((j for j in range(len(power)) if j != first), key=lambda j: float(power[j]))
    driving, driven = (smoothly_averaged(time, speeds[:, j]) for j in (first, other))
    assert driving.value
    assert driven.value is not None
    rims = [drive.radius[j] * s.value for j, s in ((first, driving), (other, driven))]
    ratio = abs(rims[1] / rims[0])
    doubt = driving.uncertainty / abs(driving.value)
    doubt += driven.uncertainty / abs(driven.value) if driven.value else 0.0
    return {
        "drive_speed": driving,
        "driven_speed": driven,
        "slip_percent": Seen(100.0 * (1.0 - ratio), 100.0 * ratio * doubt + 1e-9),
        "efficiency": _efficiency(part, power),
    }


def _efficiency(part: Recorded, power: Array) -> Seen:
    """Return the work taken out over that and the heats of the same time.

    While residual slip relaxes, the heat of friction may decrease a little: its change has a sign.
    """
    names = [n for n in ("energy_friction", "energy_damping") if n in part.channels]
    lost = sum(float(part.channels[n][-1] - part.channels[n][0]) for n in names)
    out = -float(np.sum(power[power < 0.0])) * float(np.ptp(part.time))
    return Seen(out / (out + lost), 1e-9)


def _contact(part: Recorded, drive: Drive, length: float) -> dict[str, Seen]:
    """Return how much of the pulleys is touched, and how much of that does not slide.

    The friction of what slides is all that there can be: its share of that is the part that slides.
    """
    on = touching(part)
    still = part.channels.get("sticking")
    seen, arcs, held = {}, [], []
    for j, name in enumerate(drive.names):
        arcs.append(np.sum(on == j, axis=1).astype(float))
        seen[f"contact_arc_{name}"] = _arc(part.time, arcs[j], length / drive.radius[j])
        if still is not None:
            limit = _coefficients(part, name, length, still) * part.channels["normal_force"]
            some = (on == j) & (limit > 0.0)
            share = np.where(
                some, part.channels["friction_force"] / np.where(some, limit, 1.0), 0.0
            )
            sliding = np.abs(np.sum(np.clip(share, -1.0, 1.0), axis=1))
            held.append((arcs[j] - sliding) * np.any((on == j) & (still == 1.0), axis=1))
            seen[f"adhesion_arc_{name}"] = _arc(part.time, held[j], length / drive.radius[j])
    if still is not None:
        stick, touch = averaged(part.time, sum(held)), averaged(part.time, sum(arcs))
        assert stick.value is not None
        assert touch.value
        doubt = (stick.uncertainty + touch.uncertainty) / touch.value
        seen["stick_fraction"] = Seen(stick.value / touch.value, doubt)
    return seen


def _coefficients(part: Recorded, pulley: str, length: float, still: Array) -> Array:
    """Return the coefficient of friction of each body at a pulley, static where it sticks."""
    effects = part.scenario["effects"]
    friction, patch = effects["belt_friction"], effects.get("patch")
    own = (friction.get("pulleys") or {}).get(pulley, friction)
    mu = np.where(still == 1.0, own["mu_s"], own["mu_k"])
    if patch is None:
        return mu
    middle = length * (np.arange(still.shape[1]) + 0.5)
    inside = (middle >= patch["from"]) & (middle < patch["to"])
    return np.where(inside, np.where(still == 1.0, patch["mu_s"], patch["mu_k"]), mu)


def _arc(time: Array, count: Array, angle: float) -> Seen:
    bodies = averaged(time, count)
    assert bodies.value is not None
    return Seen(bodies.value * angle, bodies.uncertainty * angle + 1e-6 * bodies.value * angle)

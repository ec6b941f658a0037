"""An independent reader of belt drives, see `second_way`."""

from typing import Any

import numpy as np

import frictionsim as fs
from frictionsim.results import Record
from tests.support.second_way import Array, Recorded, Seen

SHARE = 0.2  # of the run, at its end: means are over it
# Of a span's mean tension: the last fifth may begin a sample earlier or later.
TENSION = 1e-3


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


def upper_and_lower(done: Record, which: Any) -> tuple[float, float]:
    """Return the mean tensions of the upper and of the lower span of two equal pulleys, N.

    They stand side by side; a joint is in a span if neither body beside it touches a pulley.
    """
    channels = done.channels
    free = channels["pulley_index"][which] < 0.0
    free &= np.roll(free, 1, axis=1)
    above, tension = channels["y"][which] > 0.0, channels["tension"][which]
    return float(np.mean(tension[free & above])), float(np.mean(tension[free & ~above]))


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


# --- the summary ----------------------------------------------------------------------------------


def belt_drive(record: Recorded) -> dict[str, Seen]:
    """Return the quantities of the summary of a belt drive; means are over the last fifth."""
    part, channels, names = last(record), record.channels, names_of(record)
    length = fs.static(record.scenario)["body_length"].value
    tension = float(np.mean(channels["tension"][0]))
    levels = mean(part.time, span_tensions(part))
    first = channels["energy_kinetic"][0] + channels["energy_potential"][0]
    seen = {
        "pretension": Seen(tension, 1e-9 * tension),
        "tension_tight": _span(max(levels)),
        "tension_slack": _span(min(levels)),
        "final_time": Seen(record.scenario["solver"]["duration"]),
        "initial_energy": Seen(float(first), 1e-9 * abs(float(first))),
    }
    for j, name in enumerate(names):
        seen[f"tension_{name}_to_{names[(j + 1) % len(names)]}"] = _span(levels[j])
    energies = (name for name in channels if name.startswith("energy"))
    seen |= {name: Seen(float(channels[name][-1])) for name in energies}
    radii = np.array([pulley["radius"] for pulley in record.scenario["mechanism"]["pulleys"]])
    return seen | _motion(part, radii) | _contact(part, names, length / radii, length)


def names_of(record: Recorded) -> list[str]:
    return [pulley["name"] for pulley in record.scenario["mechanism"]["pulleys"]]


def _span(value: float) -> Seen:
    return Seen(float(value), TENSION * abs(float(value)))


def _motion(part: Recorded, radii: Array) -> dict[str, Seen]:
    time, speeds = part.time, part.channels["pulley_speed"]
    torque = part.channels["pulley_torque"]
    power = mean(time, torque * speeds)
    acts = np.any(torque != 0.0, axis=0)  # a free pulley does not drive
    first = int(np.argmax(np.where(acts, power, -np.inf)))
    other = min((j for j in range(len(power)) if j != first), key=lambda j: float(power[j]))
    driving, driven = (smoothly_averaged(time, speeds[:, j]) for j in (first, other))
    assert driving.value
    assert driven.value is not None
    rims = [radii[j] * s.value for j, s in ((first, driving), (other, driven))]
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


def _contact(part: Recorded, names: list[str], angles: Array, length: float) -> dict[str, Seen]:
    """Return how much of the pulleys is touched, and how much of that does not slide.

    The friction of what slides is all that there can be: its share of that is the part that slides.
    """
    on = touching(part)
    still = part.channels.get("sticking")
    seen, arcs, held = {}, [], []
    for j, name in enumerate(names):
        arcs.append(np.sum(on == j, axis=1).astype(float))
        seen[f"contact_arc_{name}"] = _arc(part.time, arcs[j], angles[j])
        if still is not None:
            limit = _coefficients(part, name, length, still) * part.channels["normal_force"]
            some = (on == j) & (limit > 0.0)
            share = np.where(
                some, part.channels["friction_force"] / np.where(some, limit, 1.0), 0.0
            )
            sliding = np.abs(np.sum(np.clip(share, -1.0, 1.0), axis=1))
            held.append((arcs[j] - sliding) * np.any((on == j) & (still == 1.0), axis=1))
            seen[f"adhesion_arc_{name}"] = _arc(part.time, held[j], angles[j])
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

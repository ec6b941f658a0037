"""The pulley with hanging masses against its closed form, and what every lift must obey.

Events, states, energies and impacts of `tests/data/lift_cases.json`. In `pushed` a rope is slack
for some ms. In `loose` shaft and cord could each be the one to slip: the one does whose limit is
exceeded. Impacts are summed from small pulls in `test_rope_impact`.
"""

from math import hypot

import numpy as np
import pytest

from frictionsim.results import SLACK
from tests.support.friction_curves import curve
from tests.support.lifts import LIFTS, Scenario, assert_events, drawn, gap_rates
from tests.support.scenarios import changed, shipped, simulate, sound

TIME, ANGLE = 1e-9, 1e-8  # s and rad, at rtol 1e-11
# Of each regime one, which have every transition of every contact.
OFTEN = [f"gripped_{n}" for n in (7, 10)] + [f"thrown_{n}" for n in (14, 22)]
OFTEN += ["jammed_13", "loose_637", "massless_10", "pushed_17", "taut_13", "car_alone_0.5"]
NAMES = [name for name, case in LIFTS.items() if "scenario" in case]
ALL = [pytest.param(n, marks=[] if n in OFTEN else pytest.mark.slow) for n in NAMES]


def test_the_cases_have_every_transition() -> None:
    seen = {tuple(event[1:4]) for name in OFTEN for event in LIFTS[name]["events"]}
    turns = {(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a != b}
    assert seen >= {("shaft", *both) for both in turns}
    assert seen >= {("cord", *both) for both in turns}
    ropes = ("car_rope", "counterweight_rope")
    assert seen >= {(rope, a, 7 - a) for rope in ropes for a in (3, 4)}


@pytest.mark.parametrize("name", ALL)
def test_a_lift_moves_as_in_closed_form(name: str) -> None:
    case, data = LIFTS[name], drawn(name, output__interval=0.125)
    done, masses = sound(data), data["effects"]["hanging_masses"]
    assert_events(done, name, TIME, ANGLE)
    r = data["mechanism"]["cord_radius"]
    weight = 9.81 * (masses["car"] + masses["counterweight"] + masses.get("rope", 0.0))
    for t, *numbers in case["samples"]:
        i = int(np.argmin(abs(done.time - t)))
        speed = ANGLE * max(1.0, abs(numbers[1]))
        near = {"angle": ANGLE, "angular_velocity": speed}
        for body in ("car", "counterweight"):
            near |= {f"{body}_position": ANGLE * r, f"{body}_velocity": r * speed}
        near |= {"rope_tension_car": 1e-7 * weight, "rope_tension_counterweight": 1e-7 * weight}
        for (channel, tolerance), exact in zip(near.items(), numbers, strict=True):
            assert done.channels[channel][i] == pytest.approx(exact, abs=tolerance), (t, channel)
    size = max(map(abs, case["energies"].values()))
    for energy, exact in case["energies"].items():
        values = done.channels.get(energy, np.zeros(1))
        # Potential energy counts from the angle zero.
        first = values[0] if energy == "energy_potential" else 0.0
        assert values[-1] - first == pytest.approx(exact, abs=1e-8 * size), energy
    rates = gap_rates(done, r, "before")
    hits = [(i, e) for i, e in enumerate(done.transitions) if e.mode_from == SLACK]
    speeds = [-float(rates[e.contact][i]) for i, e in hits]
    assert speeds == pytest.approx([speed for _, _, speed, _ in case["impacts"]], rel=1e-6)


@pytest.mark.parametrize("name", ["lift", "hard/lift_slack_rope"])
def test_quantities_of_a_lift_are_of_its_samples(name: str) -> None:
    done = sound(shipped(name))
    of, first = done.channels, {(e.contact, e.mode_to): e.time for e in done.transitions[::-1]}
    wanted = {"car_acceleration_max": abs(of["car_acceleration"]).max()}
    wanted |= {"car_travel": of["car_position"][-1]}
    for side in ("car", "counterweight"):
        tension = of[f"rope_tension_{side}"]
        wanted[f"rope_tension_{side}_max"] = tension.max()
        wanted[f"rope_tension_{side}_min"] = tension.min()
    if name == "lift":
        wanted["cord_slip_max"] = abs(of["cord_slip"]).max()
        wanted["cord_slip_time"] = min(t for (c, to), t in first.items() if c == "cord" and to)
    else:
        wanted["slack_time"] = min(t for (_, to), t in first.items() if to == SLACK)
    assert {name: done.quantities[name].value for name in wanted} == wanted


@pytest.mark.parametrize("over_speed", [False, True])
@pytest.mark.parametrize("seed", [2, 8, 14, 22])
def test_a_shock_obeys_euler_with_the_friction_of_its_own_reaction(
    seed: int, over_speed: bool
) -> None:
    """I dw = r (J2 - J1) - s r_k (J1 + J2), of the impulses of both ropes on their bodies.

    Friction over the speed is that at the speed before.
    """
    data = drawn(f"thrown_{seed}")
    shaft, masses = data["effects"]["shaft_friction"], data["effects"]["hanging_masses"]
    if over_speed:  # up to some fifty radians a second
        speeds = [0.0, 50.0 * shaft["shaft_radius"]]
        shaft["mu_k"] = {"speed": speeds, "value": [shaft["mu_s"], 0.1 * shaft["mu_s"]]}
    done, r, mu_k = sound(data), data["mechanism"]["cord_radius"], curve(shaft["mu_k"], 0.0)
    m1, m2 = (masses[name] + masses["rope"] / 2 for name in ("car", "counterweight"))
    shocks = [i for i, e in enumerate(done.transitions)
              if (e.contact, e.mode_from) == ("car_rope", SLACK)]  # fmt: skip
    assert shocks
    for i in shocks:
        bodies = ("angular_velocity", "car_velocity", "counterweight_velocity")
        before, after = (
            [float(done.events[f"{name}_{side}"][i]) for name in bodies]
            for side in ("before", "after")
        )
        dw, dv_1, dv_2 = (b - a for a, b in zip(before, after, strict=True))
        is_taut = done.events["slack_before"][i] == 1  # a slack rope has no part in it
        pull, far = m1 * dv_1, m2 * dv_2 if is_taut else 0.0
        assert is_taut or dv_2 == pytest.approx(0.0, abs=1e-12)
        w, then = before[0], after[0]
        mu = mu_k(shaft["shaft_radius"] * w)
        friction = data["mechanism"]["inertia"] * dw - r * (far - pull)
        limit = shaft["shaft_radius"] * mu / hypot(1.0, mu) * (pull + far)
        if w <= 0.0 or then >= 0.0:  # in one direction
            assert friction == pytest.approx(limit if w <= 0.0 else -limit, rel=1e-8)
            e = masses["restitution"]
            rate, end = before[1] - r * w, after[1] - r * then
            e = 0.0 if -rate < masses["capture_speed"] else e
            assert end == pytest.approx(-e * rate, abs=1e-10 * (abs(before[1]) + abs(rate)))
        else:
            assert abs(friction) < limit


def test_a_cord_that_sticks_does_not_creep_by_a_bit() -> None:
    data = shipped("lift")
    done, r = simulate(data), data["mechanism"]["cord_radius"]
    start, stop = (e.time for e in done.transitions if e.contact == "cord")
    before, after = done.time < start, done.time > stop
    assert np.unique(done.channels["cord_slip"][before]).tolist() == [0.0]
    assert np.unique(done.channels["cord_slip"][after]).size == 1
    rim = r * done.channels["angular_velocity"][before]
    assert np.array_equal(done.channels["car_velocity"][before], rim)
    resting = (done.channels["mode"] == 0) & (done.channels["cord_mode"] == 0) & (done.time > 10.0)
    assert np.count_nonzero(resting) > 20
    for name in ("angle", "angular_velocity", "car_position", "counterweight_position"):
        assert np.unique(done.channels[name][resting]).size == 1, name


def force_to_lift(data: Scenario) -> float:
    """Return the force of impending motion with the car upwards, at rest."""
    masses, shaft = data["effects"]["hanging_masses"], data["effects"]["shaft_friction"]
    first, second = (
        masses["g"] * (masses[name] + masses["rope"] / 2) for name in ("car", "counterweight")
    )
    r, mu = data["mechanism"]["cord_radius"], shaft["mu_s"]
    r_s = shaft["shaft_radius"] * mu / hypot(1.0, mu)
    # (P + W2 - W1) r = r_s (P + W1 + W2)
    return (first * (r + r_s) - second * (r - r_s)) / (r - r_s)


def test_breakaway_is_where_static_friction_ends() -> None:
    """The time does not depend on inertia, kinetic friction and damping."""
    data = drawn("taut_16", solver__duration=0.8)
    force, mu_s = force_to_lift(data), data["effects"]["shaft_friction"]["mu_s"]
    data["drive"] = {"force": {"time": [0.0, 1.0], "value": [0.8 * force, 1.2 * force]}}
    for inertia, share in ((1e-3, 1.0), (1e3, 0.3)):
        other = changed(data, mechanism__inertia=inertia)
        other["effects"]["shaft_friction"]["mu_k"] = share * mu_s
        (first, *_) = (e for e in simulate(other).transitions if e.contact == "shaft")
        assert (first.mode_from, first.mode_to) == (0, 1)
        assert first.time == pytest.approx(0.5, abs=1e-11)

"""Pulleys with masses on their cords, as data, for tests."""

from typing import Any

import pytest

from frictionsim.results import Record
from tests.support.problems import cases
from tests.support.scenarios import Scenario, changed, run_anew

GRAVITY = 9.81


def lift(**changes: Any) -> Scenario:
    """Return a pulley with car and counterweight, driven by a torque; keys as `a__b=value`."""
    data: Scenario = {
        "kind": "pulley",
        "mechanism": {"cord_radius": 0.25, "inertia": 2.0},
        "drive": {"torque": 0.0},
        "effects": {"hanging_masses": {"car": 100.0, "counterweight": 80.0, "g": GRAVITY}},
        "solver": {"duration": 2.0, "rtol": 1e-11, "atol": 1e-14},
        "output": {"interval": 0.1},
    }
    return changed(data, **changes)


SHAFT = {"shaft_radius": 0.05, "mu_s": 0.3, "mu_k": 0.2}
CORD = {"mu_s": 0.12, "mu_k": 0.1, "wrap_deg": 180.0}


def grips(car: float, torque: Any, mirrored: bool = False) -> Scenario:
    """Return a lift whose cord holds where its shaft breaks away, at no acceleration: mu_k = mu_s.

    Both could slip as well. The car of 33 kg or so is lighter than the counterweight.
    """
    masses = (45.0, car) if mirrored else (car, 45.0)
    return lift(
        mechanism={"cord_radius": 0.24, "inertia": 0.2},
        drive__torque=torque,
        effects__hanging_masses={"car": masses[0], "counterweight": masses[1], "g": GRAVITY},
        effects__shaft_friction={"shaft_radius": 0.045, "mu_s": 0.3, "mu_k": 0.3},
        effects__cord_friction={"mu_s": 0.19, "mu_k": 0.12, "wrap_deg": 132.0},
        solver__duration=3.0,
    )


def ramp(*points: tuple[float, float]) -> dict[str, list[float]]:
    return {"time": [t for t, _ in points], "value": [v for _, v in points]}


def solved(data: Scenario) -> Record:
    """Return the run of a scenario that is done and whose audit is passed."""
    result = run_anew(data)
    assert (result.status, result.exit_code) == ("done", 0), result.reason
    return result


# Lifts with their motion in closed form, see tests/data/README.md.
LIFTS = {case["name"]: case for case in cases("lift")}
ROPES = ("car_rope", "counterweight_rope")


def drawn(name: str, **changes: Any) -> Scenario:
    """Return the scenario of a stored case: of each regime some drawn ones."""
    return changed(LIFTS[name]["scenario"], **changes)


def assert_events(done: Record, name: str, time: float, angle: float) -> None:
    """Compare the changes of each contact with those of a case, times in s and angles in rad."""
    for contact in ("shaft", "cord", *ROPES):
        wanted = [(t, *modes, q) for t, c, *modes, q in LIFTS[name]["events"] if c == contact]
        seen = changes(done, contact)
        assert [e[1:3] for e in seen] == [e[1:3] for e in wanted]
        assert [e[0] for e in seen] == pytest.approx([e[0] for e in wanted], abs=time)
        assert [e[-1] for e in seen] == pytest.approx([e[-1] for e in wanted], abs=angle)


def changes(done: Record, contact: str) -> list[tuple[float, int, int, float]]:
    """Return the changes of one contact: time, mode before, mode after, angle in rad."""
    found = [e for e in done.transitions if e.contact == contact and e.mode_from != e.mode_to]
    return [(e.time, e.mode_from, e.mode_to, e.position) for e in found]


def gap_rates(done: Record, radius: float, side: str) -> dict[str, Any]:
    """Return the rates of the gaps at all events, m/s, before or after them, by rope."""
    rim = radius * done.events[f"angular_velocity_{side}"]
    car, other = (done.events[f"{name}_velocity_{side}"] for name in ("car", "counterweight"))
    return {"car_rope": car - rim, "counterweight_rope": other + rim}

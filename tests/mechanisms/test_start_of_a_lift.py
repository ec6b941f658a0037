"""Which contact of a lift gives way at the start: the one that is beyond its limit."""

from typing import Any

import pytest

import frictionsim as fs

# Both "the shaft sticks, the cord slips" and "the shaft slips, the cord sticks" satisfy the
# equations of this lift at rest, since mu_s > mu_k on the cord.
LIFT: dict[str, Any] = {
    "kind": "pulley",
    "mechanism": {"cord_radius": 0.16, "inertia": 0.9},
    "drive": {"torque": 44.0},
    "effects": {
        "hanging_masses": {"car": 90.0, "counterweight": 50.0},
        "cord_friction": {"mu_s": 0.25, "mu_k": 0.127, "wrap_deg": 180.0},
        "shaft_friction": {"shaft_radius": 0.0636, "mu_s": 0.155, "mu_k": 0.147},
    },
    "solver": {"duration": 1.0},
}


@pytest.mark.parametrize("torque", [44.0, 46.0, 48.0])
def test_a_load_at_once_gives_way_where_a_load_that_comes_quickly_does(torque: float) -> None:
    at_once = fs.solve(LIFT, {"drive.torque": torque}, check=True)
    ramp = {"time": [0.0, 1e-6], "value": [49.5, torque]}
    quickly = fs.solve(LIFT, {"drive.torque": ramp}, check=True)
    for result in (at_once, quickly):
        assert [event.contact for event in result.transitions] == ["shaft"]
        assert result.quantities["cord_slip_max"].value == 0.0
    # The ramp takes some 1e-6 s, of motion over 1 s.
    end, expected = (float(result.dataset["angle"][-1]) for result in (at_once, quickly))
    assert end == pytest.approx(expected, rel=1e-4)


def test_two_contacts_that_give_way_at_the_start_pass_the_audit() -> None:
    """Either would hold if the other did; here the cord is beyond its limit, and then the shaft."""
    effects = {
        "hanging_masses": {"car": 74.49028338371194, "counterweight": 191.51925754389023},
        "cord_friction": {"mu_s": 0.2974, "mu_k": 0.24344, "wrap_deg": 180.0},
        "shaft_friction": {"shaft_radius": 0.048187, "mu_s": 0.26605, "mu_k": 0.25351},
    }
    mechanism = {"cord_radius": 0.117984, "inertia": 0.605019}
    lift = {**LIFT, "mechanism": mechanism, "effects": effects, "drive": {"torque": -161.676}}
    result = fs.solve(lift, {"solver.duration": 0.1}, check=True)
    assert [event.time for event in result.transitions][:2] == [0.0, 0.0]

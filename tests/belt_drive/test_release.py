"""The audit `release` of belts: what slides or lets go has all the friction that it can have."""

from typing import Any

import numpy as np
import pytest

from tests.support.belt_kernels import (
    BACKWARD_LIMIT,
    FORWARD_LIMIT,
    FRICTION,
    MODE,
    STICKING,
    observer_of,
    update_contact_modes,
)
from tests.support.belt_scenarios import NO_MOTION_ACROSS, Stepped, pair, scenario_of, stepped
from tests.support.scenarios import simulate

SLIPPERY = {"mu_s": 0.2, "mu_k": 0.1}
# Two pulleys that turn against each other: the belt slides on both within 2 ms.
OVERLOADED = {"effects__belt_friction": SLIPPERY, "drive__driver__torque": -40.0}
PLACES = ("in the plane", "guided")


def belt(place: str, backend: str) -> dict[str, Any]:
    changes: dict[str, Any] = {"solver__backend": backend, "solver__duration": 4e-3, **OVERLOADED}
    if place == "guided":
        changes |= NO_MOTION_ACROSS
    return pair(**changes)


def sliding(end: Stepped) -> tuple[Any, Any]:
    """Return the contacts, and which of them slide under a friction that has a limit."""
    contacts = end.model.system.contacts
    table = contacts.table
    some = (table[STICKING] == 0.0) & (table[FORWARD_LIMIT] > 0.0) & (table[FRICTION] != 0.0)
    return contacts, np.flatnonzero(some)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
def test_what_slides_has_its_limit(backend: str, place: str) -> None:
    done = simulate(belt(place, backend))
    slid = (done.channels["sticking"] == 0.0) & (done.channels["normal_force"] > 0.0)
    assert slid.any()
    assert done.checks["release"].value <= 1e-15
    # From the channels: mu_k N of what slides, mu_s N at the instant at which it lets go.
    used = np.abs(done.channels["friction_force"][slid]) / done.channels["normal_force"][slid]
    limits = np.min(np.abs(used[:, None] - [0.1, 0.2]), axis=1)
    assert np.max(limits) <= (1e-12 if backend == "rkf45" else 1e-9)


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
def test_a_body_that_slides_below_its_limit_is_found(backend: str, place: str) -> None:
    data = belt(place, backend)
    end = stepped(data)
    contacts, some = sliding(end)
    contacts.table[FRICTION, some[0]] *= 0.7
    observer = observer_of(scenario_of(data), end.model)
    observer.force_per_impulse = end.stepper.force_per_impulse
    observer.sample(end.stepper.t, end.state)
    check = observer.observe().checks["release"]
    assert not check.ok
    assert check.value == pytest.approx(0.3, rel=1e-9)


def test_a_body_that_lets_go_below_its_static_limit_is_found() -> None:
    end = stepped(belt("in the plane", "rkf45"))
    contacts, some = sliding(end)
    table = contacts.table
    table[MODE, some[0]] = 0.0
    limit = table[FORWARD_LIMIT if table[FRICTION, some[0]] > 0.0 else BACKWARD_LIMIT, some[0]]
    table[FRICTION, some[0]] = 0.6 * np.copysign(limit, table[FRICTION, some[0]])
    assert contacts.release[0] == 0.0
    update_contact_modes(contacts)
    assert contacts.release[0] == pytest.approx(0.4, rel=1e-9)


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("law", ["regularised", "creep"])
def test_laws_without_stick_have_no_such_check(law: str) -> None:
    extra = {"maximum_creep": 1e-4} if law == "creep" else {}
    table = {"mu_s": 0.6, "mu_k": 0.6, "law": law, "transition_speed": 0.1, **extra}
    done = simulate(pair(effects__belt_friction=table, solver__duration=2e-5))
    assert "release" not in done.checks

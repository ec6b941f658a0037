"""The solver of several contacts: order, location of events, and the choice of modes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from frictionsim.errors import SolverError
from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.scenario.signals import Constant
from frictionsim.solvers.multi_contact import (
    Balance,
    FrictionContact,
    Modes,
    MultiContactMechanism,
)
from frictionsim.solvers.multi_contact_events import PLACES, Event, first_events
from frictionsim.solvers.multi_contact_modes import Margin, Released, consistent_modes
from tests.support.lifts import CORD, SHAFT, events, lift, ramp, solved, times

NOTHING = Balance((0.0,), (0.0,))
BALANCED = {"effects__hanging_masses__car": 80.0}


def search(margins: dict[str, Any], of_force: bool, tie: float = 0.0) -> list[Event]:
    """Return the first events of functions of the time from 0 to 1 s, named by contact."""
    made = [
        Margin(i, 1, of_force, lambda b, q, v, f=f: f(q[0]), lambda u, b: tie)  # type: ignore[misc]
        for i, f in enumerate(margins.values())
    ]

    def at(t: float) -> tuple[float, Balance, Sequence[float], Sequence[float]]:
        return 0.0, NOTHING, (t,), (t,)

    places = [(place, 0.0 < place < 1.0) for place in PLACES]
    return first_events(made, at, places, at, 1.0)


@pytest.mark.parametrize("middle", [0.0005, 0.004, 0.2, 0.45, 0.7, 0.97, 0.9992])
@pytest.mark.parametrize("of_force", [True, False])
def test_a_margin_that_is_used_up_and_restored_within_a_step_is_seen(
    middle: float, of_force: bool
) -> None:
    depth = 1e-9 if 0.01 < middle < 0.99 else 1e-13
    found = search({"a": lambda t: (t - middle) ** 2 - depth}, of_force)
    assert [event.time for event in found] == pytest.approx([middle - depth**0.5], abs=1e-9)


def test_a_margin_that_is_nearly_used_up_lasts() -> None:
    assert search({"a": lambda t: (t - 0.4) ** 2 + 1e-9}, False) == []


def test_the_first_of_several_margins_ends_the_step_and_ties_end_it_together() -> None:
    found = search(
        {"a": lambda t: 0.7 - t, "b": lambda t: 0.3 - t, "c": lambda t: 0.6 - 2 * t}, True
    )
    assert [event.margin.contact for event in found] == [1, 2]
    assert found[0].held <= 0.3 <= found[0].time + 1e-16


def test_a_force_may_equal_its_limit_but_a_velocity_ends_at_zero() -> None:
    assert search({"a": lambda t: 0.0 * t}, True, tie=1e-12) == []
    assert search({"a": lambda t: -1e-13}, True, tie=1e-12) == []
    assert [event.time for event in search({"a": lambda t: 1.0 - t}, False)] == [1.0]


def test_the_zero_at_the_start_of_a_motion_does_not_count() -> None:
    assert search({"a": lambda t: t * t}, False) == []
    found = search({"a": lambda t: t * (0.01 - t)}, False)
    assert [event.time for event in found] == pytest.approx([0.01], abs=1e-12)
    assert [event.time for event in search({"a": lambda t: -t}, False)] == [0.0]


def error_with_step(step: float) -> float:
    """Return the error of the angle with steps of a length, whatever their estimated error."""
    data = lift(
        drive__torque={"sine": {"mean": 0.0, "amplitude": 300.0, "frequency_hz": 1.0}},
        effects__shaft_friction=SHAFT,
        effects__cord_friction=CORD | {"mu_s": 0.05, "mu_k": 0.04},
        effects__viscous_damping={"coefficient": 8.0},
        solver__duration=1.0,
        **BALANCED,
    )
    loose = solved(data | {"solver": data["solver"] | {"rtol": 0.5, "atol": 1e3, "max_step": step}})
    exact = solved(data | {"solver": data["solver"] | {"rtol": 1e-13, "max_step": 1e-2}})
    assert events(loose) == events(exact)
    assert {contact for contact, _, _ in events(loose)} == {"shaft", "cord"}
    return abs(float(loose.channels["angle"][-1] - exact.channels["angle"][-1]))


def test_the_order_is_that_of_the_integrator_across_all_events() -> None:
    coarse, fine = error_with_step(0.04), error_with_step(0.02)
    assert coarse > 1e-9  # far from roundoff
    assert np.log2(coarse / fine) > 4.5


def test_events_agree_for_loose_and_tight_tolerances() -> None:
    data = lift(
        drive__torque=ramp((0.0, 50.0), (0.3, 400.0), (0.6, -900.0), (1.0, 100.0)),
        effects__shaft_friction=SHAFT,
        effects__viscous_damping={"coefficient": 5.0},
        effects__hanging_masses__restitution=0.3,
    )
    tight = solved(data)
    loose = solved(data | {"solver": data["solver"] | {"rtol": 1e-6, "atol": 1e-9}})
    assert events(loose) == events(tight)
    assert len(events(tight)) > 5
    assert times(loose) == pytest.approx(times(tight), abs=1e-6)


def sliding_block(load_per_acceleration: float, driving: float) -> MultiContactMechanism:
    """Return a block of 1 kg and mu = 0.5 whose load is 1 N plus a part of the acceleration."""

    def balance(u: float, q: Sequence[float], v: Sequence[float], modes: Modes) -> Balance:
        if modes[0] == STICK:
            return Balance((0.0,), (-driving, 1.0))
        shift = 0.5 * modes[0]
        acceleration = (driving - shift) / (1.0 + shift * load_per_acceleration)
        load = 1.0 + load_per_acceleration * acceleration
        return Balance((acceleration,), (-shift * load, load))

    contact = FrictionContact(
        "block",
        0,
        force=lambda forces: forces[0],
        static_limit=lambda forces, s: 0.5 * forces[1],
        kinetic_limit=lambda forces, s: 0.5 * forces[1],
        roundoff=lambda u, forces: 1e-12,
    )
    nothing: Any = lambda *arguments: {}  # noqa: E731
    return MultiContactMechanism(
        drive=Constant(0.0),
        contacts=(contact,),
        balance=balance,
        impact=nothing,
        forces=2,
        power_flows={},
        stored_energies={},
        position=(0.0,),
        velocity=(0.0,),
        channels=nothing,
        channel_info={},
        quantities=nothing,
        effects=(),
        energy_scale=1.0,
    )


def modes_from_rest(mechanism: MultiContactMechanism, now: dict[int, int]) -> Modes:
    return consistent_modes(mechanism, 0.0, (0.0,), (0.0,), Released(now, {}))


def test_the_contact_holds_at_its_limit_and_gives_way_beyond_it() -> None:
    assert modes_from_rest(sliding_block(0.0, 0.5), {}) == (STICK,)
    assert modes_from_rest(sliding_block(0.0, -0.50001), {}) == (BACKWARD,)
    # Located at its limit, it gives way, although roundoff would let it hold.
    assert modes_from_rest(sliding_block(0.0, 0.5), {0: FORWARD}) == (FORWARD,)


def test_equations_without_a_solution_are_an_error() -> None:
    with pytest.raises(SolverError) as error:
        modes_from_rest(sliding_block(-3.0, 0.6), {})
    assert str(error.value) == (
        "at t = 0 s no combination of sticking, sliding and slack satisfies the equations of the"
        " motion on the contacts 'block': the friction is too large for them; check the"
        " coefficients of friction and the radius of the shaft"
    )


def test_two_contacts_hold_in_turn_before_both_give_way() -> None:
    """Of two contacts on their own coordinates, that at its limit gives way: the other holds.

    Its acceleration is roundoff of the wrong sign; if the other gave way, it would be positive.
    """

    def balance(u: float, q: Sequence[float], v: Sequence[float], modes: Modes) -> Balance:
        first = 1.0 if modes[1] else -1e-17
        return Balance((first if modes[0] else 0.0, float(modes[1])), (0.0, 0.0))

    contacts = tuple(
        FrictionContact(
            name,
            i,
            force=lambda forces: 0.0,
            static_limit=lambda forces, s: 1.0,
            kinetic_limit=lambda forces, s: 1.0,
            roundoff=lambda u, forces: 1e-12,
        )
        for i, name in enumerate(("shaft", "cord"))
    )
    mechanism = sliding_block(0.0, 0.0)._replace(balance=balance, contacts=contacts)
    found = consistent_modes(mechanism, 0.0, (0.0,) * 2, (0.0,) * 2, Released({0: FORWARD}, {}))
    assert found == (FORWARD, STICK)

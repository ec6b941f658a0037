"""The solver of several contacts: order, location of events, and the choice of modes."""

from array import array
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from frictionsim.errors import SolverError
from frictionsim.mechanisms.extension import Curve, curve_of
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT
from frictionsim.solvers import multi_contact_location
from frictionsim.solvers.contacts import (
    Contact,
    Friction,
    MultiContactMechanism,
    PackedContacts,
    Unilateral,
    table_of,
)
from frictionsim.solvers.event_driven import EventDrivenSolver
from frictionsim.solvers.multi_contact_location import find_first_events
from frictionsim.solvers.multi_contact_modes import write_consistent_modes
from frictionsim.solvers.multi_contact_state import (
    ACCELERATION,
    ENDS,
    FORCES,
    LENGTH,
    MODES,
    RELEASED_NOW,
    RESTING,
    write_phase,
)
from frictionsim.solvers.one_contact_state import HELD, INSIDE, SAMPLED_UNTIL, T_NEW
from frictionsim.solvers.problems import MultiContactProblem
from tests.support.lifts import CORD, SHAFT, events, lift, ramp, solved, times
from tests.support.wheels import buffer_to, settings, signal

BALANCED = {"effects__hanging_masses__car": 80.0}
Margins = list[Callable[[float], float]]


class Bodies(NamedTuple):
    """The interface of the equations of several bodies to the loop; the balance is a field."""

    contacts: PackedContacts
    coordinates: int
    balance: Callable[[float, Any, int], None]
    drive: Curve = curve_of(signal(0.0))

    def powers(self, u: float, s: Any, y: int) -> tuple[float, ...]:
        return (u * s[y + self.coordinates],)


def form(place: int, width: int, value: float = 1.0) -> tuple[float, ...]:
    return tuple(value if i == place else 0.0 for i in range(width))


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a search for the first events of functions of the time from 0 to 1 s.

    It returns their numbers, the last time at which they held, and the time.
    """

    def of(margins: Margins, of_force: bool, tie: float = 0.0) -> tuple[list[int], float, float]:
        m = len(margins)
        contacts = [
            Contact(f"rope {i}", i, Unilateral(), form(2 + i, 2 + m), form(0, 2 + m, tie))
            for i in range(m)
        ]
        s = array("d", bytes(8 * LENGTH))
        s[MODES : MODES + m] = array("d", [TAUT if of_force else SLACK] * m)

        def write(t: float) -> None:
            values = array("d", [margin(t) for margin in margins])
            s[INSIDE : INSIDE + m] = s[FORCES : FORCES + m] = values
            s[FORCES - 2] = 1.0

        for name, place in (("write_at", 3), ("write_cubic", 2)):
            at: Any = lambda *arguments, place=place: write(arguments[place])  # noqa: E731
            monkeypatch.setattr(multi_contact_location, name, at)
        system: Any = Bodies(table_of(contacts), m, lambda u, s, y: None)
        write_phase(system, s)
        s[RESTING], s[T_NEW] = 0.0, 1.0
        run = problem_of(system, contacts).run
        find_first_events(system, run, s)
        return [i for i in range(m) if s[ENDS + i] != 0.0], s[HELD], s[SAMPLED_UNTIL]

    return of


def mechanism_of(system: Any, contacts: list[Contact]) -> MultiContactMechanism:
    """Return bodies that start at rest."""
    nothing: Any = lambda *arguments: {}  # noqa: E731
    rest = (0.0,) * system.coordinates
    return MultiContactMechanism(
        drive=signal(0.0),
        system=system,
        contacts=tuple(contacts),
        power_flows=("energy_input",),
        stored_energies=(),
        position=rest,
        velocity=rest,
        channels=nothing,
        channel_info={},
        quantities=nothing,
        effects=(),
        energy_scale=1.0,
    )


def problem_of(system: Any, contacts: list[Contact]) -> MultiContactProblem:
    tight = settings(duration=1.0, rtol=1e-11, atol=1e-14)
    return MultiContactProblem(mechanism_of(system, contacts), tight, buffer_to(1.0))


@pytest.mark.parametrize("middle", [0.0005, 0.004, 0.2, 0.45, 0.7, 0.97, 0.9992])
@pytest.mark.parametrize("of_force", [True, False])
def test_a_margin_that_is_used_up_and_restored_within_a_step_is_seen(
    middle: float, of_force: bool, search: Any
) -> None:
    depth = 1e-9 if 0.01 < middle < 0.99 else 1e-13
    ends, _, time = search([lambda t: (t - middle) ** 2 - depth], of_force)
    assert ends == [0]
    assert time == pytest.approx(middle - depth**0.5, abs=1e-9)


def test_a_margin_that_is_nearly_used_up_lasts(search: Any) -> None:
    assert search([lambda t: (t - 0.4) ** 2 + 1e-9], False)[0] == []


def test_the_first_of_several_margins_ends_the_step_and_ties_end_it_together(search: Any) -> None:
    margins = [lambda t: 0.7 - t, lambda t: 0.3 - t, lambda t: 0.6 - 2 * t]
    ends, held, time = search(margins, True)
    assert ends == [1, 2]
    assert held <= 0.3 <= time + 1e-16


def test_a_force_may_equal_its_limit_but_a_velocity_ends_at_zero(search: Any) -> None:
    assert search([lambda t: 0.0 * t], True, 1e-12)[0] == []
    assert search([lambda t: -1e-13], True, 1e-12)[0] == []
    assert search([lambda t: 1.0 - t], False)[2] == 1.0


def test_the_zero_at_the_start_of_a_motion_does_not_count(search: Any) -> None:
    assert search([lambda t: t * t], False)[0] == []
    ends, _, time = search([lambda t: t * (0.01 - t)], False)
    assert (ends, time) == ([0], pytest.approx(0.01, abs=1e-12))
    assert search([lambda t: -t], False)[0::2] == ([0], 0.0)


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


def sliding_block(load_per_acceleration: float, driving: float) -> Bodies:
    """Return a block of 1 kg and mu = 0.5 whose load is 1 N plus a part of the acceleration."""

    def balance(u: float, s: Any, y: int) -> None:
        shift, acceleration, friction = 0.5 * s[MODES], 0.0, -driving
        if s[MODES] != STICK:
            acceleration = (driving - shift) / (1.0 + shift * load_per_acceleration)
            friction = -shift * (1.0 + load_per_acceleration * acceleration)
        s[ACCELERATION] = acceleration
        s[FORCES], s[FORCES + 1] = friction, 1.0 + load_per_acceleration * acceleration

    return Bodies(table_of([BLOCK]), 1, balance)


LIMITS = form(3, 4, 0.5), form(3, 4, 0.5)
BLOCK = Contact("block", 0, Friction(LIMITS, LIMITS), form(2, 4), form(0, 4, 1e-12))


def modes_from_rest(system: Bodies, contacts: list[Contact], now: list[int]) -> tuple[float, ...]:
    s, m = array("d", bytes(8 * LENGTH)), len(now)
    s[RELEASED_NOW : RELEASED_NOW + m] = array("d", now)
    write_consistent_modes(system, problem_of(system, contacts).run, s)
    return tuple(s[MODES : MODES + m])


def test_the_contact_holds_at_its_limit_and_gives_way_beyond_it() -> None:
    assert modes_from_rest(sliding_block(0.0, 0.5), [BLOCK], [0]) == (STICK,)
    assert modes_from_rest(sliding_block(0.0, -0.50001), [BLOCK], [0]) == (BACKWARD,)
    # Located at its limit, it gives way, although roundoff would let it hold.
    assert modes_from_rest(sliding_block(0.0, 0.5), [BLOCK], [FORWARD]) == (FORWARD,)


def integrated(system: Any, contacts: list[Contact], duration: float) -> Any:
    """Return the samples and transitions of bodies that start at rest."""
    buffer, tight = buffer_to(duration), settings(duration=duration, rtol=1e-11, atol=1e-14)
    EventDrivenSolver(mechanism_of(system, contacts), tight, buffer).run(lambda t: None)
    return buffer


def test_equations_without_a_solution_are_an_error() -> None:
    with pytest.raises(SolverError) as error:
        integrated(sliding_block(-3.0, 0.6), [BLOCK], 1.0)
    assert str(error.value) == (
        "at t = 0 s no combination of sticking, sliding and slack satisfies the equations of the"
        " motion on the contact 'block': the friction is too large for them; check the"
        " coefficients of friction and the radius of the shaft"
    )


def test_more_contacts_than_can_be_searched_are_refused() -> None:
    contacts = [BLOCK._replace(name=f"block {i}", coordinate=i) for i in range(11)]
    system = Bodies(table_of(contacts), 11, lambda u, s, y: None)
    with pytest.raises(ValueError, match="found 34 states, 2 forces, 11 contacts"):
        integrated(system, contacts, 1.0)


def test_a_pile_of_blocks_slips_from_top_to_bottom_and_comes_to_rest_together() -> None:
    """Three blocks on each other and on the ground; a force on the lowest rises, then is gone."""
    m, g = np.array([3.0, 2.0, 1.0]), 10.0
    mu = np.array([0.1, 0.3, 0.2])  # of the ground, and of the blocks on it
    limits = mu * g * np.cumsum(m[::-1])[::-1]
    top = 60.0  # N; up to it the force rises by 20 N/s

    def balance(u: float, s: Any, y: int) -> None:
        matrix, right = np.zeros((6, 6)), np.zeros(6)  # accelerations of blocks, frictions below
        right[0] = u
        for i in range(3):
            matrix[i, i], matrix[i, 3 + i] = m[i], -1.0
            if i < 2:
                matrix[i, 4 + i] = 1.0
            if s[MODES + i] == STICK:
                matrix[3 + i, i], matrix[3 + i, i - 1] = 1.0, -1.0 if i else 0.0
            else:
                matrix[3 + i, 3 + i], right[3 + i] = 1.0, -s[MODES + i] * limits[i]
        solution = np.linalg.solve(matrix, right)
        for i in range(3):
            moves = s[MODES + i] != STICK
            s[ACCELERATION + i] = moves * (solution[i] - (solution[i - 1] if i else 0.0))
            s[FORCES + i] = solution[3 + i]

    contacts = []
    for i in range(3):
        law = Friction((form(0, 5, limits[i]),) * 2, (form(0, 5, limits[i]),) * 2)
        contacts.append(Contact(f"below {i}", i, law, form(2 + i, 5), form(0, 5, 1e-12)))
    force = {"time": [0.0, top / 20.0, top / 20.0 + 1e-3], "value": [0.0, top, 0.0]}
    system = Bodies(table_of(contacts), 3, balance, curve_of(signal(force)))
    buffer = integrated(system, contacts, 40.0)
    # The ground, then the top block at its mu g, then the middle one with that on it.
    of_middle = (mu[1] * (m[1] + m[2]) - mu[2] * m[2]) * g / m[1]
    forces = (
        limits[0],
        limits[0] + m.sum() * mu[2] * g,
        limits[0] + limits[2] + (m[0] + m[1]) * of_middle,
    )
    slips = [(e.time, e.contact) for e in buffer.transitions if e.mode_from == STICK]
    expected = [(f / 20.0, f"below {i}") for f, i in zip(forces, (0, 2, 1), strict=True)]
    assert slips == [(pytest.approx(t, abs=1e-11), name) for t, name in expected]
    assert buffer.rows[-7:-4].tolist() == [STICK, STICK, STICK]
    work, *heats = buffer.rows[-4:]
    assert sum(heats) == pytest.approx(work, rel=1e-10)


def test_two_contacts_hold_in_turn_before_both_give_way() -> None:
    """Of two contacts on their own coordinates, that at its limit gives way: the other holds.

    Its acceleration is roundoff of the wrong sign; if the other gave way, it would be positive.
    """

    def balance(u: float, s: Any, y: int) -> None:
        first = 1.0 if s[MODES + 1] else -1e-17
        s[ACCELERATION] = first if s[MODES] else 0.0
        s[ACCELERATION + 1] = s[MODES + 1]
        s[FORCES] = s[FORCES + 1] = 0.0

    limits = form(0, 4), form(0, 4)
    contacts = [
        Contact(name, i, Friction(limits, limits), form(2, 4), form(0, 4, 1e-12))
        for i, name in enumerate(("shaft", "cord"))
    ]
    system = Bodies(table_of(contacts), 2, balance)
    assert modes_from_rest(system, contacts, [FORWARD, 0]) == (FORWARD, STICK)

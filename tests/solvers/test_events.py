"""The event-driven loop by name: several contacts, ropes, surfaces."""

from collections.abc import Callable
from math import exp, inf, pi

import numpy as np
import pytest

from frictionsim.errors import BudgetExceeded, InputError, SolverError
from frictionsim.mechanisms.extension import INPUT, MultiplesOf, OneCoordinate, Term
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT
from frictionsim.solvers.events import Events
from frictionsim.solvers.modes import KEEPS, consistent
from frictionsim.solvers.recording import Recording
from frictionsim.solvers.rkf45 import Tolerances
from frictionsim.solvers.system import Contact
from tests.support.wheels import signal, solved


class Bodies:
    """Bodies without energies: a `System`; who derives from it says what accelerates them."""

    surfaces, stops, impact_heat = (), None, 0
    contacts: tuple[Contact, ...]

    def __init__(self, *contacts: Contact, start: list[float] | None = None) -> None:
        self.contacts, self.coordinates = contacts, len(contacts)
        self.start = start or [0.0 for _ in range(2 * len(contacts))]

    def accelerations(self, t: float, modes: list[int]) -> list[float]:
        """Return the accelerations of the coordinates."""
        raise NotImplementedError

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        return [*y[self.coordinates :], *self.accelerations(t, modes)]

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        return []

    def smooth_until(self, t: float, y: list[float], end: float) -> float:
        return end

    def rests_until(self, t: float, y: list[float], end: float) -> float:
        return self.smooth_until(t, y, end)

    def kinetic_and_supplied(self, y: list[float]) -> tuple[float, float]:
        return 0.0, inf


Margins = list[tuple[float, float, float]]


class Stack(Bodies):
    """A block of 1 kg on one of 1 kg: floor and interface hold 3 and 1 N, and slide at 2 and 0.5 N.

    Coordinates are the slips: of the lower block on the floor, of the upper one on the lower.
    """

    def __init__(self, rate: float) -> None:
        super().__init__(Contact("floor", 0), Contact("interface", 1))
        self.rate = rate  # N/s, of the force on the lower block

    def forces(self, t: float, modes: list[int]) -> tuple[float, float, float, float]:
        """Return the accelerations of both slips, and the friction on them."""
        pull, (floor, between) = self.rate * t, modes
        if floor == STICK and between == STICK:
            return 0.0, 0.0, -pull, 0.0
        if floor == STICK:
            force = -0.5 * between
            return 0.0, force, -pull + force, force
        below = -2.0 * floor
        if between == STICK:  # both move as one of 2 kg
            a = 0.5 * (pull + below)
            return a, 0.0, below, a
        force = -0.5 * between  # on the upper block
        a = pull + below - force
        return a, force - a, below, force

    def accelerations(self, t: float, modes: list[int]) -> list[float]:
        return [*self.forces(t, modes)[:2]]

    def margins(self, t: float, y: list[float], modes: list[int]) -> Margins:
        _, _, below, between = self.forces(t, modes)
        return [
            (3.0 + below, 3.0 - below, 1e-14),
            (1.0 + between, 1.0 - between, 1e-14),
        ]


def test_of_two_blocks_the_lower_one_slides_first_and_then_leaves_the_upper_one_behind() -> None:
    """t = 3 at the floor's limit; 0.5 (t - 2) = 1 at that of the interface: t = 4."""
    solver = solved(Stack(1.0), 5.0)
    events = [(e.time, e.contact, e.mode_to) for e in solver.recording.transitions]
    assert events == [
        (pytest.approx(3.0, rel=1e-14), "floor", FORWARD),
        (pytest.approx(4.0, rel=1e-14), "interface", -FORWARD),
    ]
    # From 3 s on 2 v' = t - 2, from 4 s on v' = t - 2.5 of the lower and 0.5 of the upper block.
    v_4 = 0.25 * (2.0**2 - 1.0**2)
    lower = v_4 + 0.5 * (2.5**2 - 1.5**2)
    assert solver.state.y[2:] == pytest.approx([lower, v_4 + 0.5 - lower], rel=1e-12)


class Margin(Bodies):
    """Contacts that hold with margins that are given over time, beside a body that moves."""

    def __init__(self, *given: Callable[[float], float], tie: float = 0.0) -> None:
        self.given, self.tie = given, tie
        super().__init__(*[Contact(f"contact {i}", i) for i in range(len(given))])
        self.coordinates += 1
        self.start = [0.0] * (2 * self.coordinates)

    def accelerations(self, t: float, modes: list[int]) -> list[float]:
        return [*map(float, modes), 1.0]

    def margins(self, t: float, y: list[float], modes: list[int]) -> Margins:
        return [(margin(t), 1.0, self.tie) for margin in self.given]


ONE_STEP = Tolerances(1e-9, 1e-12, fixed_step=1.0)


def released(*given: Callable[[float], float], tie: float = 0.0) -> list[tuple[float, str]]:
    """Return the releases of contacts in a step from 0 to 1 s by margins over time."""
    solver = solved(Margin(*given, tie=tie), 1.0, ONE_STEP)
    return [(e.time, e.contact) for e in solver.recording.transitions]


@pytest.mark.parametrize("middle", [0.0005, 0.2, 0.7, 0.9992])
def test_a_margin_that_is_used_up_and_restored_within_a_step_is_seen(middle: float) -> None:
    depth = 1e-9 if 0.01 < middle < 0.99 else 1e-13
    (time, _), *_ = released(lambda t: (t - middle) ** 2 - depth)
    assert time == pytest.approx(middle - depth**0.5, abs=1e-9)


def test_a_margin_that_is_nearly_used_up_lasts() -> None:
    assert released(lambda t: (t - 0.4) ** 2 + 1e-9) == []


def test_the_first_of_several_margins_ends_the_step_and_ties_end_it_together() -> None:
    events = released(lambda t: 0.7 - t, lambda t: 0.3 - t, lambda t: 0.6 - 2 * t)
    at = pytest.approx(0.3, abs=1e-15)
    assert events == [
        (at, "contact 1"),
        (at, "contact 2"),
        (pytest.approx(0.7, abs=1e-15), "contact 0"),
    ]


def test_a_force_may_equal_its_limit_and_pass_it_by_its_roundoff() -> None:
    assert released(lambda t: 0.0) == []
    assert released(lambda t: -1e-13, tie=1e-12) == []


class Thrown(Bodies):
    """A body with a velocity that is given over time, and friction that holds it where it stops."""

    def __init__(self, slope: Callable[[float], float], velocity: float) -> None:
        super().__init__(Contact("floor"), start=[0.0, velocity])
        self.slope = slope

    def accelerations(self, t: float, modes: list[int]) -> list[float]:
        return [self.slope(t) if modes[0] != STICK else 0.0]

    def margins(self, t: float, y: list[float], modes: list[int]) -> Margins:
        return [(1.0, 1.0, 0.0)]


@pytest.mark.parametrize("middle", [0.0005, 0.2, 0.7, 0.9992])
def test_a_velocity_that_is_zero_and_rises_again_within_a_step_is_seen(middle: float) -> None:
    """v = (t - middle)^2 - depth, which the method integrates but for rounding."""
    depth = 1e-9 if 0.01 < middle < 0.99 else 1e-13
    body = Thrown(lambda t: 2.0 * (t - middle), middle**2 - depth)
    (event,) = solved(body, 1.0, ONE_STEP).recording.transitions
    assert (event.mode_from, event.mode_to) == (FORWARD, STICK)
    assert event.time == pytest.approx(middle - depth**0.5, abs=1e-9)


def test_a_body_that_nearly_stops_moves_on() -> None:
    body = Thrown(lambda t: 2.0 * (t - 0.4), 0.4**2 + 1e-9)
    assert solved(body, 1.0, ONE_STEP).recording.transitions == []


class Hung(Bodies):
    """Two bodies on ropes, which pull with given forces while they are taut; they fall at 10."""

    def __init__(self, *tensions: Callable[[float], float], start: list[float]) -> None:
        ropes = [Contact(f"rope {i}", i, is_rope=True) for i in range(len(tensions))]
        super().__init__(*ropes, start=start)
        self.tensions, self.impacts = tensions, []

    def accelerations(self, t: float, modes: list[int]) -> list[float]:
        return [-10.0 if mode == SLACK else 0.0 for mode in modes]

    def margins(self, t: float, y: list[float], modes: list[int]) -> Margins:
        return [
            (tension(t) if mode == TAUT else 0.0, 0.0, 1e-14)
            for tension, mode in zip(self.tensions, modes, strict=True)
        ]

    def impact(self, i: int, y: list[float], modes: list[int]) -> list[float]:
        """Return the state after an impact that takes half of the speed."""
        self.impacts.append((i, y[self.coordinates + i]))
        after = list(y)
        after[self.coordinates + i] = -0.5 * y[self.coordinates + i] if y[2 + i] < -1.0 else 0.0
        return after


def test_a_rope_becomes_taut_where_its_gap_closes_and_is_thrown_up_by_an_impact() -> None:
    """From 5 m it falls for 1 s to 10 m/s, and comes back with 5, 2.5, 1.25 m/s, then none."""
    bodies = Hung(lambda t: 1.0, lambda t: 1.0, start=[5.0, 0.0, 0.0, 0.0])
    solver = solved(bodies, 5.0)
    speeds = [10.0, 5.0, 2.5, 1.25, 0.625]
    times = np.cumsum([1.0, *[2.0 * v / 10.0 for v in speeds[1:]]])
    assert bodies.impacts == [(0, pytest.approx(-v, rel=1e-9)) for v in speeds]
    changes = [e for e in solver.recording.transitions if e.time > 0.0]
    assert [e.time for e in changes] == pytest.approx(times, abs=1e-9)
    assert [e.contact for e in changes] == ["rope 0"] * 5
    assert [e.mode_to for e in changes] == [SLACK] * 4 + [TAUT]
    assert solver.state.y == [0.0, 0.0, 0.0, 0.0]
    assert solver.state.modes == [TAUT, TAUT]


def test_a_rope_falls_slack_where_its_tension_vanishes() -> None:
    class Lifted(Hung):
        def accelerations(self, t: float, modes: list[int]) -> list[float]:
            return [t - 2.0 if mode == SLACK else 0.0 for mode in modes]

    bodies = Lifted(lambda t: 2.0 - t, lambda t: 9.0, start=[0.0, 0.0, 0.0, 0.0])
    (event,) = solved(bodies, 3.0).recording.transitions
    assert event[:4] == (pytest.approx(2.0, rel=1e-15), "rope 0", TAUT, SLACK)


class Loaded(Bodies):
    """A block of 1 kg and mu = 0.5 whose load is 1 N plus a part of the acceleration."""

    def __init__(self, load_per_acceleration: float, driving: float) -> None:
        super().__init__(Contact("block"))
        self.part, self.driving = load_per_acceleration, driving

    def accelerations(self, t: float, modes: list[int]) -> list[float]:
        shift = 0.5 * modes[0]
        return [(self.driving - shift) / (1.0 + shift * self.part) if modes[0] else 0.0]

    def margins(self, t: float, y: list[float], modes: list[int]) -> Margins:
        return [(0.5 - self.driving, 0.5 + self.driving, 1e-12)]


def modes_from_rest(system: Bodies, now: list[int]) -> list[int]:
    return consistent(system, 0.0, system.start, [STICK for _ in now], now)


def test_a_contact_holds_at_its_limit_and_is_released_beyond_it() -> None:
    assert modes_from_rest(Loaded(0.0, 0.5), [KEEPS]) == [STICK]
    assert modes_from_rest(Loaded(0.0, -0.50001), [KEEPS]) == [BACKWARD]
    # Located at its limit, it is released, although roundoff would let it hold.
    assert modes_from_rest(Loaded(0.0, 0.5), [FORWARD]) == [FORWARD]


def test_equations_without_a_solution_are_an_error() -> None:
    """A load that falls with the acceleration jams the block: 0.6 N are beyond any friction."""
    with pytest.raises(SolverError) as error:
        solved(Loaded(-3.0, 0.6), 1.0)
    assert str(error.value) == (
        "at t = 0 s no combination of sticking, sliding and slack satisfies the equations of the"
        " motion on the contact 'block': the friction is too large for them; check the"
        " coefficients of friction and the radius of the shaft"
    )


def test_two_contacts_hold_in_turn_before_both_are_released() -> None:
    """Of two contacts on their own coordinates, that at its limit is released: the other holds.

    Its acceleration is roundoff of the wrong sign; if the other were released, it would be
    positive.
    """

    class Two(Bodies):
        def accelerations(self, t: float, modes: list[int]) -> list[float]:
            first = 1.0 if modes[1] else -1e-17
            return [first if modes[0] else 0.0, float(modes[1])]

        def margins(self, t: float, y: list[float], modes: list[int]) -> Margins:
            return [(1.0, 1.0, 1e-12)] * 2

    both = Two(Contact("shaft", 0), Contact("cord", 1))
    assert modes_from_rest(both, [FORWARD, KEEPS]) == [FORWARD, STICK]


def test_energies_have_their_names_in_whatever_order_the_terms_are() -> None:
    """A drive of 6 N m against 2 w on 2 kg m^2: w = 3 (1 - exp(-t)), by hand."""
    damping = Term(lambda u, q, v: -2.0 * v, "energy_damping")
    drive = Term(lambda u, q, v: u, INPUT)
    for terms in ((drive, damping), (damping, drive)):
        system = OneCoordinate(signal(6.0), None, 2.0, terms, None)
        solver = solved(system, 1.0)
        energies = dict(zip(system.energies, solver.state.y[2:], strict=True))
        work = 18.0 * exp(-1.0)  # 6 times the integral of w
        assert energies["energy_input"] == pytest.approx(work, rel=1e-11)
        kinetic = 9.0 * (1.0 - exp(-1.0)) ** 2
        assert energies["energy_damping"] == pytest.approx(work - kinetic, rel=1e-10)


def test_heats_of_one_name_are_refused() -> None:
    damping = Term(lambda u, q, v: -v, "energy_damping")
    with pytest.raises(InputError, match="each heat has a name of its own"):
        OneCoordinate(signal(0.0), None, 1.0, (Term(0.0, INPUT), damping, damping), None)


def test_a_run_of_one_step_at_a_time_gets_past_a_jump_of_the_torque() -> None:
    """A wheel of 1 kg m^2 under 2 N m, and 300 N m from a turn of pi on."""
    torque = Term(lambda u, q, v: 2.0 if q < pi else 300.0, INPUT)
    system = OneCoordinate(
        signal(0.0), None, 1.0, (torque,), None, surfaces=(MultiplesOf(pi, "half"),)
    )
    usual = Tolerances(1e-6, 1e-9)
    one = usual._replace(max_steps=1)
    solver = Events(system, one, Recording(system, 2.5, 0.5), 2.5)
    runs, ends = 0, False
    while not ends:
        step, runs = solver.state.step, runs + 1
        assert runs < 1000  # a run of this length takes some ten steps
        solver.tolerances = one._replace(granted=step.taken + step.rejected)
        try:
            solver.run(lambda t: None)
            ends = True
        except BudgetExceeded:
            assert solver.state.step.taken > step.taken or not step.y
    assert solver.state.y[:2] == solved(system, 2.5, usual).state.y[:2]

"""Parts shared by the solvers: samples, right-hand sides, located events, chattering."""

from array import array
from collections import deque
from collections.abc import Callable, Sequence
from math import floor, inf, ulp
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from frictionsim.errors import Chattering
from frictionsim.results import Transition
from frictionsim.scenario.methods import METHODS
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.runge_kutta_fehlberg import RungeKuttaFehlberg45
from frictionsim.solvers.state_values import COUNT, SAMPLE, TIME, Values
from frictionsim.solvers.stepper import Rhs, State, Stepper

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism


def reversal_in_step(
    load: Callable[[float, float, float], tuple[float, float]],
    mechanism: "Mechanism",
    stepper: Stepper,
) -> float:
    """Return when the load of a contact has turned by a right angle since the begin of a step, s.

    A load that passes zero turns by two at once, where its size, and friction with it, has a
    corner. The end of the step if it has not turned so far.
    """
    drive, y_old, y = mechanism.drive, stepper.y_old, stepper.y
    x_old, up_old = load(drive(stepper.t_old), y_old[0], y_old[1])

    def against(u: float, q: float, v: float) -> float:
        x, up = load(u, q, v)
        return -(x * x_old + up * up_old)

    if not against(drive(stepper.t), y[0], y[1]) > 0.0:
        return stepper.t

    def inside(t: float) -> float:
        state = stepper.interpolate(t)
        return against(drive(t), state[0], state[1])

    if not inside(stepper.t) > 0.0:  # the interpolant may differ by roundoff
        return stepper.t
    return bracket_root(inside, stepper.t_old, stepper.t)[1]


# A root search stops at an interval of two units in the last place of the time.
SAME_TIME_ULPS = 2.0


class SampleTimes:
    """The regular sample times: 0, interval, 2 interval, ..., duration."""

    # After the last sample the next one is never: inf.
    CHECKPOINT_FIELDS: ClassVar = {"_next": COUNT, "next": Values(low=0.0, finite=False)}

    def __init__(self, duration: float, interval: float) -> None:
        self.interval = interval
        self._duration = duration
        # A multiple that differs from the duration by rounding is replaced by the duration.
        self.last = floor(duration / interval * (1.0 - 1e-12))
        self.given: Sequence[float] = ()
        self._next = 0
        self.next = 0.0

    @property
    def taken(self) -> int:
        """How many samples were taken."""
        return self._next

    def advance(self) -> None:
        """Advance to the next sample time; `next` is inf after the last."""
        self.set_next(self._next + 1)

    def set_next(self, number: int) -> None:
        """Set the number of samples that were taken."""
        self._next = number
        self.next = self._time_of(number)

    def _time_of(self, number: int) -> float:
        """Return the time of a sample, counted from 0; inf after the last."""
        if number <= self.last:
            return number * self.interval
        return self._duration if number == self.last + 1 else inf

    def restored_fault(self) -> str:
        """Return the field that does not go with the others, empty if all do."""
        if self._next > self.last + 2:
            return "_next"
        return "" if self.next == self._time_of(self._next) else "next"


class GivenTimes(SampleTimes):
    """Sample times from a list, as those of measured data; a run with them is not resumed.

    Parameters
    ----------
    times : sequence of float, s
        Strictly increasing; the last is not after the end of the run.
    """

    def __init__(self, times: Sequence[float]) -> None:
        self.interval, self.last, self.given = inf, 0, list(times)
        self.set_next(0)

    def _time_of(self, number: int) -> float:
        return self.given[number] if number < len(self.given) else inf


Row = tuple[float, ...]
"""A sample: time, drive, position, velocity, acceleration, friction, mode, energy integrals."""


def row(t: float, drive: float, y: State, acceleration: float, friction: float, mode: int) -> Row:
    """Return the sample of a state.

    Parameters
    ----------
    t : float, s
    drive : float
        Value of the input signal.
    y : (n,)
        Position, velocity, energy integrals.
    acceleration : float, rad/s^2
    friction : float, N m
    mode : int
    """
    return (t, drive, y[0], y[1], acceleration, friction, mode, *y[2:])


class SampleBuffer:
    """The samples and events of a run, filled by the solver.

    Attributes
    ----------
    rows : array of double
        The regular samples, concatenated.
    transitions : list of Transition
    sides : array of double
        Two samples for each transition: immediately before and after it.
    """

    COLUMNS = 7  # of a sample, without its energies
    CHECKPOINT_FIELDS: ClassVar = {"rows": SAMPLE, "sides": SAMPLE}

    def __init__(self, times: SampleTimes) -> None:
        self.times = times
        self.rows = array("d")
        self.sides = array("d")
        self.transitions: list[Transition] = []

    def add(self, sample: Row) -> None:
        """Add a regular sample and advance to the next sample time."""
        self.rows.extend(sample)
        self.times.advance()

    def record_event(self, transition: Transition, before: Row, after: Row) -> None:
        """Add an event with the samples immediately before and after it."""
        self.transitions.append(transition)
        self.sides.extend(before)
        self.sides.extend(after)


class ChatteringDetector:
    """Stops a run in which an event recurs too often within a time window.

    Parameters
    ----------
    window : float, s
    max_events : int
        Allowed number of events in the window.
    what : str
        The event, for the message: "the contact 'shaft' changed its mode".
    advice : str
        End of the message.
    """

    CHECKPOINT_FIELDS: ClassVar = {"_times": TIME._replace(ascending=True)}

    def __init__(self, window: float, max_events: int, what: str, advice: str) -> None:
        self._window = window
        self._what = what
        self._advice = advice
        self._times: deque[float] = deque(maxlen=max_events)

    def count(self, t: float) -> None:
        """Count an event at t, s; raise Chattering if there are too many in the window."""
        times = self._times
        if len(times) == times.maxlen and t - times[0] < self._window:
            raise chattering_error(t, self._what, len(times), t - times[0], self._advice)
        times.append(t)


def chattering_error(t: float, what: str, events: int, within: float, advice: str) -> Chattering:
    """Return the error for an event that recurs too often up to t, s; `within` is a time, s."""
    return Chattering(
        f"chattering at t = {t:.9g} s: {what} {events} times within {within:.2g} s; {advice}"
    )


def subject_of(mechanism: "Mechanism") -> str:
    """Return the subject of messages about the motion of a mechanism."""
    contact = mechanism.contact
    return "the motion" if contact is None else f"the motion on the contact '{contact.name}'"


def new_stepper(mechanism: "Mechanism", settings: "SolverSettings") -> Stepper:
    """Return the integrator for a mechanism, with the settings of the scenario."""
    integrator = METHODS[settings.backend].scipy_class
    if integrator:
        # Imported here because SciPy takes 0.3 s to import.
        from frictionsim.solvers.scipy_stepper import ScipyStepper

        return ScipyStepper(
            integrator,
            rtol=settings.rtol,
            atol=settings.atol,
            max_step=settings.max_step or inf,
            max_steps=settings.max_steps,
            what=subject_of(mechanism),
        )
    return RungeKuttaFehlberg45(
        states=len(mechanism.initial_state),
        rtol=settings.rtol,
        atol=settings.atol,
        max_step=settings.max_step or inf,
        max_steps=settings.max_steps,
        fixed_step=settings.step,
        what=subject_of(mechanism),
        advice=settings.budget_advice,
    )


def monotone_segment_end(
    mechanism: "Mechanism", contact: "DryFriction", t: float, end: float
) -> float:
    """Return a time after t up to which drive and friction limits are smooth and monotone, s.

    This is the next extremum of the drive, the next of the contact's `monotonicity_breaks`, or
    `end`, whichever is first.
    """
    drive = mechanism.drive
    b = min(end, drive.next_extremum(t))
    for critical in contact.monotonicity_breaks:
        if (drive(t) - critical) * (drive(b) - critical) < 0.0:
            _, b = bracket_root(lambda x, c=critical: drive(x) - c, t, b)  # type: ignore[misc]
    return b


def segment_end_at_rest(
    mechanism: "Mechanism", contact: "DryFriction", q: float, t: float, end: float
) -> float:
    """Return a time after t up to which a contact at rest in q breaks away at most once, s.

    If it breaks away, it does not hold at that time. The parameters are those of
    `monotone_segment_end`.
    """
    b = monotone_segment_end(mechanism, contact, t, end)
    return b if contact.first_excess is None else contact.first_excess(q, t, b)


def crossing_bracket(
    excess: Callable[[float], float], a: float, b: float, tie: float, end: float
) -> tuple[float, float]:
    """Return adjacent times in [a, b] between which an excess becomes positive, s.

    Both are a if the excess is zero at a, to within `tie`, and becomes positive within the
    roundoff of the time.

    Parameters
    ----------
    excess : callable
        Function of the time, not positive at a and positive at b.
    a, b : float, s
    tie : float
        Roundoff of the excess.
    end : float, s
        Duration of the run, which sets the roundoff of the time.
    """
    before, after = bracket_root(excess, a, b)
    if after - a <= SAME_TIME_ULPS * ulp(end) and excess(a) >= -tie:
        return a, a
    return before, after


class Crossing(NamedTuple):
    """An event at the end of a step: its name, and the state immediately before it."""

    event: str
    before: State


def advance(
    stepper: Stepper,
    mechanism: "Mechanism",
    limit: float,
    floor: float = 0.0,
) -> Crossing | None:
    """Take a step that ends at `limit` or at the first switching surface that it crosses.

    Return the crossing if it is an event. `floor` is that of `Stepper.advance`.
    """
    stepper.advance(limit, floor)
    event, of_table = _cut_at_surfaces(stepper, mechanism)
    while of_table and stepper.repeat_shorter(floor):
        stepper.advance(limit, floor)
        event, of_table = _cut_at_surfaces(stepper, mechanism)
    contact = mechanism.contact
    if contact is not None and contact.load is not None:
        reversal = reversal_in_step(contact.load, mechanism, stepper)
        if reversal < stepper.t:
            stepper.truncate(reversal)
            event = None
    return event


def _cut_at_surfaces(stepper: Stepper, mechanism: "Mechanism") -> tuple[Crossing | None, bool]:
    """End the last step at the first switching surface that it crosses.

    Return the crossing if it is an event, and whether the surface is of a table.
    """
    event, of_table = None, False
    for surface in mechanism.switching_surfaces:
        y_old, y = stepper.y_old, stepper.y
        start = y_old[0], y_old[1], y[0]
        if surface.beyond(*start, y[0], y[1]) > 0.0:

            def beyond(t: float, surface: Any = surface, start: Any = start) -> float:
                q, v, *_ = stepper.interpolate(t)
                past: float = surface.beyond(*start, q, v)
                return past

            before, after = bracket_root(beyond, stepper.t_old, stepper.t)
            event = (
                Crossing(surface.event, list(stepper.interpolate(before)))
                if surface.event
                else None
            )
            stepper.truncate(after)
            of_table = surface.is_of_table
    return event, of_table


def rhs_without_friction(mechanism: "Mechanism") -> Rhs:
    """Return the right-hand side of a mechanism without dry friction."""
    drive, applied_torque, inertia = mechanism.drive, mechanism.applied_torque, mechanism.inertia
    power_flows = tuple(enumerate(mechanism.power_flows.values(), start=2))

    def rhs(t: float, y: State, dy: State) -> None:
        u, q, v = drive(t), y[0], y[1]
        dy[0] = v
        dy[1] = applied_torque(u, q, v) / inertia
        for i, power in power_flows:
            dy[i] = power(u, q, v)

    return rhs


def rhs_with_friction(
    mechanism: "Mechanism", friction: Callable[[float, float, float, float], float]
) -> Rhs:
    """Return the right-hand side of a mechanism with dry friction.

    Parameters
    ----------
    mechanism : Mechanism
    friction : callable, N m
        Friction torque of (u, q, v, applied torque).
    """
    drive, applied_torque, inertia = mechanism.drive, mechanism.applied_torque, mechanism.inertia
    power_flows = tuple(enumerate(mechanism.power_flows.values(), start=2))
    heat = 2 + len(power_flows)

    def rhs(t: float, y: State, dy: State) -> None:
        u, q, v = drive(t), y[0], y[1]
        applied = applied_torque(u, q, v)
        torque = friction(u, q, v, applied)
        dy[0] = v
        dy[1] = (applied + torque) / inertia
        for i, power in power_flows:
            dy[i] = power(u, q, v)
        dy[heat] = -torque * v

    return rhs

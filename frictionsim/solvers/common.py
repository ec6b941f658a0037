"""What the backends share: the samples they fill, the rates they integrate, the storm guard."""

from array import array
from collections import deque
from collections.abc import Callable
from math import floor, inf, ulp
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.errors import Chattering
from frictionsim.results import Transition
from frictionsim.scenario.methods import METHODS
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.runge_kutta_fehlberg import Rhs, RungeKuttaFehlberg45, State
from frictionsim.solvers.stepper import Stepper

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism


# The search for a root stops where its ends are two roundings apart.
ROUNDINGS_OF_TIME = 2.0


class SampleTimes:
    """0, interval, 2 interval, ... and the duration, s."""

    CHECKPOINT_FIELDS = ("_next", "next")

    def __init__(self, duration: float, interval: float) -> None:
        self._interval = interval
        self._duration = duration
        # A last interval that rounding made a hair too long or too short is the duration.
        self._last = floor(duration / interval * (1.0 - 1e-12))
        self._next = 0
        self.next = 0.0

    def advance(self) -> None:
        """Go to the next sample; after the last one `next` is inf."""
        self._next += 1
        if self._next <= self._last:
            self.next = self._next * self._interval
        else:
            self.next = self._duration if self.next < self._duration else inf


Row = tuple[float, ...]
"""time, drive, position, velocity, acceleration, friction, mode; then the energies of the ledger"""


def row(t: float, drive: float, y: State, acceleration: float, friction: float, mode: int) -> Row:
    """Return what is recorded of a state."""
    return (t, drive, y[0], y[1], acceleration, friction, mode, *y[2:])


class SampleBuffer:
    """Samples and events of a run, filled by its backend.

    Attributes
    ----------
    rows : array of double
        The regular samples, one row after the other.
    transitions : list of Transition
    sides : array of double
        Two rows for each of them: right before it, and right after.
    """

    COLUMNS = 7  # of a row, before its energies
    CHECKPOINT_FIELDS = ("rows", "sides")

    def __init__(self, times: SampleTimes) -> None:
        self.times = times
        self.rows = array("d")
        self.sides = array("d")
        self.transitions: list[Transition] = []

    def add(self, sample: Row) -> None:
        """Add the sample that is due."""
        self.rows.extend(sample)
        self.times.advance()

    def record_event(self, transition: Transition, before: Row, after: Row) -> None:
        """Add an event with both of its sides."""
        self.transitions.append(transition)
        self.sides.extend(before)
        self.sides.extend(after)


class ChatteringDetector:
    """Stops a run in which something happens without end: so many times within a window.

    Parameters
    ----------
    window : float, s
        Shorter than that many times would take in any motion worth simulating.
    most : int
    what : str
        The event as the message has it, "the contact 'shaft' changed its mode".
    advice : str
        The end of the message.
    """

    CHECKPOINT_FIELDS = ("_times",)

    def __init__(self, window: float, most: int, what: str, advice: str) -> None:
        self._window = window
        self._what = what
        self._advice = advice
        self._times: deque[float] = deque(maxlen=most)

    def count(self, t: float) -> None:
        """Count one more at t.

        Raises
        ------
        Chattering
            If it is one too many.
        """
        times = self._times
        if len(times) == times.maxlen and t - times[0] < self._window:
            raise Chattering(
                f"chattering at t = {t:.9g} s: {self._what} {len(times)} times within"
                f" {t - times[0]:.2g} s; {self._advice}"
            )
        times.append(t)


def subject_of(mechanism: "Mechanism") -> str:
    """Return what moves, for messages."""
    contact = mechanism.contact
    return "the motion" if contact is None else f"the motion on the contact '{contact.name}'"


def new_stepper(mechanism: "Mechanism", settings: "SolverSettings") -> Stepper:
    """Return the integrator for a mechanism, with the settings of the scenario."""
    integrator = METHODS[settings.backend].scipy_class
    if integrator:
        from frictionsim.solvers.scipy_stepper import ScipyStepper  # scipy takes 0.3 s to import

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
    )


def monotone_segment_end(
    mechanism: "Mechanism", contact: "DryFriction", t: float, end: float
) -> float:
    """Return a time after t up to which drive and friction limits are smooth and monotone, s.

    It is the next turn of the drive, or where the drive passes a critical input before; `end`
    at the latest.
    """
    drive = mechanism.drive
    b = min(end, drive.next_extremum(t))
    for critical in contact.monotonicity_breaks:
        if (drive(t) - critical) * (drive(b) - critical) < 0.0:
            _, b = bracket_root(lambda x, c=critical: drive(x) - c, t, b)  # type: ignore[misc]
    return b


def crossing_bracket(
    excess: Callable[[float], float], a: float, b: float, tie: float, end: float
) -> tuple[float, float]:
    """Return neighbours in [a, b], s, between which an excess becomes positive.

    From a tie at a, where it is `tie` below zero at most, that is at a itself unless it takes
    longer than rounding of the time of a run up to `end`: both are a then.
    """
    before, after = bracket_root(excess, a, b)
    if after - a <= ROUNDINGS_OF_TIME * ulp(end) and excess(a) >= -tie:
        return a, a
    return before, after


class Crossing(NamedTuple):
    """A kink on which a step has ended: the event that it is, and the state right before it."""

    event: str
    before: State


def advance(
    stepper: Stepper,
    mechanism: "Mechanism",
    limit: float,
    floor: float = 0.0,
) -> Crossing | None:
    """Take a step that ends on `limit` or the first kink of the mechanism at the latest.

    Return this kink if it is an event.
    """
    stepper.advance(limit, floor)
    found = None
    for surface in mechanism.switching_surfaces:
        y_old, y = stepper.y_old, stepper.y
        crossing = surface.crossing(y_old[0], y_old[1], y[0], y[1])
        if crossing(y[0], y[1]) > 0.0:
            before, after = _crossing_bracket_in_step(crossing, stepper)
            found = (
                Crossing(surface.event, list(stepper.interpolate(before)))
                if surface.event
                else None
            )
            stepper.truncate(after)
    return found


def _crossing_bracket_in_step(
    crossing: Callable[[float, float], float], stepper: Stepper
) -> tuple[float, float]:
    """Return the neighbours between which a function of q and v becomes positive."""

    def inside(t: float) -> float:
        y = stepper.interpolate(t)
        return crossing(y[0], y[1])

    return bracket_root(inside, stepper.t_old, stepper.t)


def rhs_without_friction(mechanism: "Mechanism") -> Rhs:
    """Compose the rates of a mechanism that has no dry contact."""
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
    """Compose the rates of a mechanism whose friction torque is friction(u, q, v, moment)."""
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

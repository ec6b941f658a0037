"""Friction laws in the right-hand side of one coordinate: the loop over steps and samples.

A law gives the friction of a state, whatever the direction of motion, so that no change of mode
ends a step. Integrator, state and equation are those of the loop for located events, `one_contact`.
"""

from array import array
from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.scenario.methods import METHODS
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.common import SampleBuffer, SampleRow
from frictionsim.solvers.end_stops import first_departure, first_impact
from frictionsim.solvers.event_driven import StepperPart, named_failures
from frictionsim.solvers.law_stepper import LawStepper
from frictionsim.solvers.one_contact import check_energy, is_hit, monotone_segment_end, rebound
from frictionsim.solvers.one_contact_location import against_load, beyond_surface
from frictionsim.solvers.one_contact_step import derivatives
from frictionsim.solvers.problems import Problem, stepper_fields
from frictionsim.solvers.root_finding import bracket_root

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism

StateList = list[float]


class Law(NamedTuple):
    """A friction law in the right-hand side, as `one_contact_step` takes a system.

    Attributes
    ----------
    system : named tuple
    drive : Curve
    inertia : float, kg m^2
    friction : callable
        The friction torque, N m, of (u, q, v), the applied torque, and the kinetic limit in the
        direction of motion.
    """

    system: Any
    drive: Any
    inertia: float
    friction: Callable[[float, float, float, float, float], float]

    def torques_and_powers(
        self, u: float, q: float, v: float, s: float
    ) -> tuple[float, float, tuple[float, ...]]:
        """Return the applied torque, the friction against s, N m, and the powers, W."""
        direction = FORWARD if v > 0.0 else BACKWARD
        applied, kinetic, powers = self.system.torques_and_powers(u, q, v, direction)
        return applied, -s * self.friction(u, q, v, applied, kinetic), powers


class Solver:
    """The loop over steps and the samples within them.

    A solver alternates between steps and the samples within the last step. When it calls on_step,
    its state is complete: a run resumed from it gives the same bits.

    Parameters
    ----------
    mechanism : Mechanism
    settings : SolverSettings
    buffer : SampleBuffer
        Receives samples and transitions.

    Attributes
    ----------
    t : float, s
        Time up to which the run has come.
    stepper : LawStepper
    mode : int
        Of the samples in the last step.
    segment_end : float, s
        Up to which the equation is smooth, for steps to end there.
    CHECKPOINT_FIELDS : tuple of str
        Attributes in a checkpoint; `checkpoint_parts` are all objects in it.
    """

    CHECKPOINT_FIELDS: ClassVar[tuple[str, ...]] = ("t", "started", "mode", "segment_end")
    # Across a jump of the friction no step meets the tolerance. A step of this number of units in
    # the last place of the time is accepted.
    JUMP_ULPS: ClassVar[float] = 0.0
    # As of `EventDrivenSolver`; this loop is Python alone.
    is_to_be_compiled: ClassVar[bool] = False
    compile_seconds: ClassVar[float | None] = None
    mode: int = STICK
    segment_end: float = 0.0

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        self.mechanism, self.buffer, self._settings = mechanism, buffer, settings
        self.contact: Any = mechanism.contact
        problem = self._problem = Problem(mechanism, settings, buffer)
        problem.run = problem.run._replace(jump_ulps=self.JUMP_ULPS)
        self.system, self.end = problem.system, settings.duration
        self.stops = mechanism.stops
        self.law = self.new_law()
        self.stepper = _new_stepper(self.law, problem, settings)
        self.started = False

    @property
    def t(self) -> float:
        return self._problem.state[layout.TIME]

    @t.setter
    def t(self, t: float) -> None:
        self._problem.state[layout.TIME] = t

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        problem = self._problem
        return {
            "solver": self,
            "stepper": StepperPart(problem, stepper_fields(problem.run.states)),
            "buffer": self.buffer,
            "times": self.buffer.times,
        }

    def run(self, on_step: Callable[[float], object]) -> bool:
        """Integrate to the end, from the start or from a restored state; return False.

        `on_step` is called with the time between steps and samples; it may raise Interrupted.
        """
        with named_failures(self._problem, self._settings):
            self._run(on_step)
        return False

    def _run(self, on_step: Callable[[float], object]) -> None:
        times = self.buffer.times
        if not self.started:
            self.start()
            self.started = True
        while True:
            while self.covers(times.next):
                on_step(times.next)
                self.buffer.add(self.sample(times.next, self.stepper.interpolate(times.next)))
            self.process_step()
            if self.t >= self.end:
                return
            on_step(self.t)
            self.step()

    def new_law(self) -> Any:
        """Return the equation that is integrated."""
        return Law(self.system, self.system.drive, self.system.inertia, self.friction)

    def friction(self, u: float, q: float, v: float, applied: float, kinetic: float) -> float:
        """Return the friction torque for an applied torque and a kinetic limit, N m."""
        raise NotImplementedError

    def friction_in(self, mode: int, u: float, q: float, v: float, applied: float) -> float:
        """Return the friction torque of a sample in a mode, N m."""
        kinetic = self.system.kinetic_limit(u, q, v, FORWARD if v > 0.0 else BACKWARD)
        return self.friction(u, q, v, applied, kinetic)

    def start(self) -> None:
        """Start at the initial state."""
        self.stepper.start(0.0, self.mechanism.initial_state)
        self.process_step()

    def step(self) -> None:
        """Take one step, within which samples can be taken afterwards."""
        raise NotImplementedError

    def end_of_segment(self) -> float:
        """Return the end of the present segment, s, which begins where the last one ended."""
        if self.t >= self.segment_end:
            self.segment_end = self.next_segment_end()
        return self.segment_end

    def next_segment_end(self) -> float:
        """Return a time up to which drive and friction limits are smooth and monotone, s."""
        problem = self._problem
        return monotone_segment_end(self.system, problem.run, problem.state, self.t)

    def sample(self, t: float, y: StateList) -> SampleRow:
        """Return the sample of a state within the last step."""
        return self.row(t, y, self.mode)

    def covers(self, t: float) -> bool:
        """Return whether t is within the last step."""
        return t <= self.stepper.t

    def process_step(self) -> None:
        """Process the events of the last step, after its samples are taken."""

    def row(self, t: float, y: StateList, mode: int) -> SampleRow:
        """Return the sample of a state in a mode of the contact."""
        system = self.system
        u, q, v = system.drive.at(t), y[0], y[1]
        applied = system.applied_torque(u, q, v)
        friction = self.friction_in(mode, u, q, v, applied)
        return (t, u, q, v, (applied + friction) / system.inertia, friction, mode, *y[2:])

    def advance(self, limit: float) -> None:
        """Take a step that ends at `limit`, s, at the latest, or at the first switching surface.

        The energy of the state is checked. The state has the surface, if it is an event.
        """
        stepper, system, s = self.stepper, self.system, self._problem.state
        stepper.advance(limit)
        while self._cut_at_surfaces() and stepper.repeat_shorter():
            stepper.advance(limit)
        if system.reversing_load:

            def against(t: float) -> float:
                q, v, *_ = stepper.interpolate(t)
                return against_load(system.reversing_load, system, s, t, q, v)

            if against(stepper.t) > 0.0:
                reversal = bracket_root(against, stepper.t_old, stepper.t)[1]
                if reversal < stepper.t:
                    stepper.truncate(reversal)
                    s[layout.SURFACE_EVENT] = layout.NO_EVENT
        self.check_energy()
        self.t = stepper.t

    def check_energy(self) -> None:
        """End a run whose kinetic energy far exceeds the energy input."""
        problem, names = self._problem, self.mechanism.energy_integrals
        gained = 0.0
        if "energy_friction" in names:  # published friction laws may have positive power
            at = layout.Y_NEW + 2 + names.index("energy_friction")
            gained = max(0.0, -problem.state[at])
        check_energy(self.system, problem.run, problem.state, gained)

    def _cut_at_surfaces(self) -> bool:
        """End the last step at the first surface that it crosses; return whether it is a table's.

        As `one_contact._cut_at_surfaces`, within steps that SciPy's methods interpolate, too.
        """
        stepper, s, surfaces = self.stepper, self._problem.state, self.system.surfaces
        s[layout.SURFACE_EVENT], of_table = layout.NO_EVENT, False
        for i, surface in enumerate(surfaces):

            def beyond(t: float, i: int = i) -> float:
                q, v, *_ = stepper.interpolate(t)
                return beyond_surface(surfaces, s, i, q, v)

            if beyond(stepper.t) > 0.0:
                before, after = bracket_root(beyond, stepper.t_old, stepper.t)
                s[layout.SURFACE_EVENT] = layout.NO_EVENT
                if surface.is_event:
                    y = array("d", stepper.interpolate(before))
                    s[layout.BEFORE : layout.BEFORE + len(y)] = y
                    s[layout.SURFACE_EVENT] = i
                stepper.truncate(after)
                of_table = surface.is_of_table
        return of_table

    def end_at_impact(self) -> None:
        """End the last step at its first impact on a stop, if there is one."""
        if self.stops is None:
            return

        def acceleration(t: float, y: StateList) -> float:
            return derivatives(self.law, t, y[0], y[1], 1.0)[1]

        t = first_impact(self.stepper, self.stops, acceleration)
        if t < inf:
            self.stepper.truncate(t)
            self.t = t
            self._problem.state[layout.SURFACE_EVENT] = layout.NO_EVENT

    def impact(self) -> tuple[StateList, StateList] | None:
        """Return the states before and after the impact at the end of the last step, if any."""
        problem = self._problem
        s, n = problem.state, problem.run.states
        layout.copy(s, layout.Y, layout.Y_NEW, n)
        if not is_hit(self.system.stops, s):
            return None
        rebound(self.system.stops, self.system, problem.run, s)
        return tuple(s[at : at + n].tolist() for at in (layout.BEFORE, layout.Y))  # type: ignore[return-value]

    def record_impact(self, before: StateList, after: StateList, modes: tuple[int, int]) -> None:
        """Record an impact at the present time, and start again from the state after it."""
        t = self.t
        self.record(layout.STOP_EVENT, self.row(t, before, modes[0]), self.row(t, after, modes[1]))
        self.stepper.start(t, after)

    def end_of_rest_on_stop(self, limit: float) -> float:
        """Return the latest end of the next step, s: the end of a rest on a stop, or `limit`.

        Dry friction has no part in that rest: it is absent or regularised. Up to `limit` the
        signals are smooth.
        """
        t, y = self.stepper.t, self.stepper.y
        if self.stops is None or y[1] != 0.0 or self.stops.side(y[0]) == STICK:
            return limit
        until, direction = first_departure(self.system, self.stops.side(y[0]), y[0], (t, limit))
        if until > t:
            return until
        if direction != STICK:
            self.leave_stop(t, y, direction)
            self.stepper.start(t, y)  # begin with a short step
        return limit

    def leave_stop(self, t: float, y: StateList, direction: int) -> None:
        """Record at t, s, that the body leaves a stop, if that is not a change of a contact."""

    def record_crossing(self) -> None:
        """Record the event at the end of the last step, if there is one; the mode is unchanged."""
        s = self._problem.state
        if s[layout.SURFACE_EVENT] == layout.NO_EVENT:
            return
        t, y = self.stepper.t, self.stepper.y
        direction = FORWARD if y[1] > 0.0 else BACKWARD
        mode = self.mode_in_motion(direction)
        before = s[layout.BEFORE : layout.BEFORE + len(y)].tolist()
        self.record(
            layout.FIRST_SURFACE_EVENT + s[layout.SURFACE_EVENT],
            self.row(t, before, mode),
            self.row(t, y, mode),
            (direction, direction),
        )

    def mode_in_motion(self, direction: int) -> int:
        """Return the mode of a sample in motion at the end of the last step."""
        return direction

    def change_mode(
        self, t: float, before: int, after: int, y: StateList, held: float = inf
    ) -> None:
        """Record a transition at which the state is continuous.

        Parameters
        ----------
        t : float, s
        before, after : int
            The modes.
        y : (n,)
        held : float, s
            Last time in the mode before: t, or one rounding earlier if the drive jumps at t.
            Negative if the run starts in the mode after.
        """
        sample_after = self.row(t, y, after)
        sample_before = sample_after
        if held >= 0.0:
            sample_before = (t, *self.row(min(held, t), y, before)[1:])
        self.record(layout.CONTACT_EVENT, sample_before, sample_after, (before, after))

    def record(
        self,
        number: float,
        before: SampleRow,
        after: SampleRow,
        modes: tuple[int, int] | None = None,
    ) -> None:
        """Record an event by its number, with the samples before and after it.

        Its modes are those of the samples if they are not given.
        """
        name, mode = self._problem.event_names[int(number)], layout.ROW_COLUMNS - 1
        mode_from, mode_to = modes or (int(before[mode]), int(after[mode]))
        transition = Transition(after[0], name, mode_from, mode_to, after[2])
        self.buffer.record_event(transition, before, after)


def _new_stepper(law: Any, problem: Problem, settings: "SolverSettings") -> LawStepper:
    """Return the integrator of a law."""
    integrator = METHODS[settings.backend].scipy_class
    if not integrator:
        return LawStepper(law, problem)
    # Imported here because SciPy takes 0.3 s to import.
    from frictionsim.solvers.scipy_stepper import ScipyStepper

    return ScipyStepper(integrator, law, problem)

"""The loop over steps and the samples within them."""

from collections.abc import Callable, Mapping
from math import inf
from typing import TYPE_CHECKING, ClassVar

from frictionsim.errors import Diverged, NonFinite
from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.solvers.common import (
    Crossing,
    Row,
    SampleBuffer,
    advance,
    new_stepper,
    subject_of,
)
from frictionsim.solvers.end_stops import EVENT, StopContact
from frictionsim.solvers.state_values import FLAG, TIME, Values
from frictionsim.solvers.stepper import Rhs, State, Stepper

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism

OnStep = Callable[[float], object]

# Kinetic energy above this multiple of the energy input indicates an unstable integration.
MAX_ENERGY_RATIO = 100.0


class EnergyMonitor:
    """Stops a run whose kinetic energy far exceeds the energy input.

    The input is the initial kinetic energy, the work of the drive and the energy released by the
    other stores. Energies below atol/rtol are only accurate to the absolute tolerance.
    """

    def __init__(self, mechanism: "Mechanism", settings: "SolverSettings") -> None:
        start = mechanism.position, mechanism.velocity
        self._kinetic = mechanism.stored_energies["energy_kinetic"]
        others = (
            energy for name, energy in mechanism.stored_energies.items() if name != "energy_kinetic"
        )
        self._others = [(energy, energy(*start)) for energy in others]
        self._first = self._kinetic(*start) + settings.atol / settings.rtol
        self._input = 2 + mechanism.energy_integrals.index("energy_input")
        friction = "energy_friction" in mechanism.energy_integrals
        self._friction = 2 + mechanism.energy_integrals.index("energy_friction") if friction else 0
        self._advice = f"{subject_of(mechanism)} diverges; give a shorter solver.step or max_step"

    def check(self, t: float, y: State) -> None:
        """Compare the energies.

        Raises
        ------
        Diverged
            If the kinetic energy is too large.
        """
        q, v = y[0], y[1]
        put_in = self._first + abs(y[self._input])
        for energy, first in self._others:
            put_in = put_in + abs(energy(q, v) - first)
        if self._friction:  # published friction laws may have positive power
            put_in = put_in + max(0.0, -y[self._friction])
        kinetic = self._kinetic(q, v)
        if kinetic > MAX_ENERGY_RATIO * put_in:
            raise Diverged(
                f"at t = {t:.9g} s the kinetic energy is {kinetic:.3g} J, but the energy input"
                f" only {put_in:.3g} J: {self._advice}"
            )


class SteppingSolver:
    """The loop over steps and the samples within them, of any solver of a mechanism.

    A solver alternates between steps and the samples within the last step. When it calls on_step,
    its state is complete: a run resumed from it gives the same bits.

    Parameters
    ----------
    stepper : Stepper
    settings : SolverSettings
    buffer : SampleBuffer
        Receives samples and transitions.
    subject : str
        Of messages about the motion.

    Attributes
    ----------
    t : float, s
        Time up to which the run has come.
    stepper : Stepper
    CHECKPOINT_FIELDS : mapping of str to Values
        Attributes in a checkpoint, and what they may hold; `checkpoint_parts` are all objects in
        it.
    """

    CHECKPOINT_FIELDS: ClassVar[Mapping[str, Values]] = {"t": TIME, "started": FLAG}

    def __init__(
        self, stepper: Stepper, settings: "SolverSettings", buffer: SampleBuffer, subject: str
    ) -> None:
        self.buffer, self._subject = buffer, subject
        self.end = settings.duration
        self.stepper = stepper
        self.t = 0.0
        self.started = False

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        buffer = self.buffer
        return {
            "solver": self,
            "stepper": self.stepper,
            "buffer": buffer,
            "times": buffer.times,
        }

    def run(self, on_step: OnStep) -> bool:
        """Integrate to the end, from the start or from a restored state; return False.

        `on_step` is called with the time between steps and samples; it may raise Interrupted.
        """
        try:
            self._run(on_step)
            return False
        except ArithmeticError:
            raise NonFinite(
                f"after t = {self.t:.9g} s {self._subject} exceeds the range of double"
                " precision; check the scenario for forces or inertias that are far too large or"
                " too small"
            ) from None

    def _run(self, on_step: OnStep) -> None:
        times = self.buffer.times
        if not self.started:
            self.start()
            self.started = True
        while True:
            while self.covers(times.next):
                on_step(times.next)
                self.sample(times.next)
            self.process_step()
            if self.t >= self.end:
                self.finish()
                return
            on_step(self.t)
            self.step()

    def start(self) -> None:
        """Start at the initial state."""
        raise NotImplementedError

    def resume(self) -> None:
        """Start at the restored state."""
        raise NotImplementedError

    def step(self) -> None:
        """Take one step, within which samples can be taken afterwards."""
        raise NotImplementedError

    def sample(self, t: float) -> None:
        """Record the state at a time within the last step."""
        raise NotImplementedError

    def covers(self, t: float) -> bool:
        """Return whether t is within the last step."""
        return t <= self.stepper.t

    def process_step(self) -> None:
        """Process the events of the last step, after its samples are taken."""

    def finish(self) -> None:
        """Record the last sample."""


class Solver(SteppingSolver):
    """Base class of the solvers for a mechanism of one coordinate."""

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        super().__init__(new_stepper(mechanism, settings), settings, buffer, subject_of(mechanism))
        self.mechanism = mechanism
        self._energy_monitor = EnergyMonitor(mechanism, settings)
        self.stops = None if mechanism.stops is None else StopContact(mechanism)

    def row(self, t: float, y: State, mode: int) -> Row:
        """Return the sample of a state in a mode of the contact."""
        raise NotImplementedError

    def advance(self, limit: float, floor: float = 0.0) -> Crossing | None:
        """Take a step that ends at `limit`, s, at the latest; return the event at its end.

        The energy of the state is checked. `floor` is that of `Stepper.advance`.
        """
        crossing = advance(self.stepper, self.mechanism, limit, floor)
        self._energy_monitor.check(self.stepper.t, self.stepper.y)
        self.t = self.stepper.t
        return crossing

    def end_at_impact(self, crossing: Crossing | None, rhs: Rhs) -> Crossing | None:
        """End the last step at its first impact on a stop; return the event at its end."""
        if self.stops is None:
            return crossing
        t = self.stops.first_impact(self.stepper, rhs)
        if t == inf:
            return crossing
        self.stepper.truncate(t)
        self.t = t
        return None

    def end_of_rest_on_stop(self, limit: float, rhs: Rhs) -> float:
        """Return the latest end of the next step, s: the end of a rest on a stop, or `limit`.

        Dry friction has no part in that rest: it is absent or regularised. Up to `limit` the
        signals are smooth.
        """
        t, y = self.stepper.t, self.stepper.y
        if self.stops is None or not self.stops.is_at_rest(y):
            return limit
        until, direction = self.stops.departure(y[0], t, limit)
        if until > t:
            return until
        if direction != STICK:
            self.leave_stop(t, y, direction)
            self.stepper.start(rhs, t, list(y))  # begin with a short step
        return limit

    def leave_stop(self, t: float, y: State, direction: int) -> None:
        """Record at t, s, that the body leaves a stop, if that is not a change of a contact."""

    def record_impact(self, y: State, before: int, after: int, y_after: State) -> None:
        """Record an impact at the present time: modes and states before and after it."""
        t = self.t
        transition = Transition(t, EVENT, before, after, y_after[0])
        self.buffer.record_event(transition, self.row(t, y, before), self.row(t, y_after, after))

    def record_crossing(self, crossing: Crossing | None) -> None:
        """Record the event at the end of the last step, if there is one; the mode is unchanged."""
        if crossing is None:
            return
        t, y = self.stepper.t, self.stepper.y
        direction = FORWARD if y[1] > 0.0 else BACKWARD
        transition = Transition(t, crossing.event, direction, direction, y[0])
        mode = self.mode_in_motion(direction)
        self.buffer.record_event(
            transition, self.row(t, crossing.before, mode), self.row(t, y, mode)
        )

    def mode_in_motion(self, direction: int) -> int:
        """Return the mode of a sample in motion at the end of the last step."""
        return direction

    def change_mode(self, t: float, before: int, after: int, y: State, held: float = inf) -> None:
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
        contact = self.mechanism.contact
        name = "drive" if contact is None else contact.name
        sample_after = self.row(t, y, after)
        sample_before = sample_after
        if held >= 0.0:
            sample_before = (t, *self.row(min(held, t), y, before)[1:])
        transition = Transition(t, name, before, after, y[0])
        self.buffer.record_event(transition, sample_before, sample_after)


class ContactSolver(Solver):
    """Base of the solvers of a mechanism with dry friction.

    Attributes
    ----------
    contact : DryFriction
    """

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        if mechanism.contact is None:
            raise ValueError("a mechanism without dry friction takes FrictionlessSolver")
        super().__init__(mechanism, settings, buffer)
        self.contact = mechanism.contact

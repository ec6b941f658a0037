"""The loop of a run - steps, and the samples inside them - and a run without dry friction."""

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING

from frictionsim.errors import Diverged, NonFinite
from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.solvers.common import (
    Crossing,
    Row,
    SampleBuffer,
    advance,
    new_stepper,
    rhs_without_friction,
    row,
    subject_of,
)
from frictionsim.solvers.runge_kutta_fehlberg import State
from frictionsim.solvers.stepper import Stepper

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism

OnStep = Callable[[float], object]

# So many times the energy that was put in is not an error of the steps, but their instability.
MAX_ENERGY_RATIO = 100.0


class EnergyMonitor:
    """Stops a run whose motion has far more energy than was put in.

    Kinetic energy is what there was, the work of the drive and what the other stores gave, less
    the losses; below atol/rtol it is only integrated to the absolute tolerance.
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
        self._advice = f"{subject_of(mechanism)} blows up; give a shorter solver.step or max_step"

    def check(self, t: float, y: State) -> None:
        """Compare the energies at t.

        Raises
        ------
        Diverged
        """
        q, v = y[0], y[1]
        put_in = self._first + abs(y[self._input])
        for energy, first in self._others:
            put_in += abs(energy(q, v) - first)
        if self._friction:  # as it was published, it may drive
            put_in += max(0.0, -y[self._friction])
        kinetic = self._kinetic(q, v)
        if kinetic > MAX_ENERGY_RATIO * put_in:
            raise Diverged(
                f"at t = {t:.9g} s there are {kinetic:.3g} J of motion, where {put_in:.3g} J were"
                f" put in: {self._advice}"
            )


class Solver:
    """A backend at work on a mechanism of one coordinate; each backend is a subclass.

    It alternates between steps and the samples inside the last one. Whenever it calls on_step, its
    state is whole: what is saved there goes on to the same bits.

    Parameters
    ----------
    mechanism : Mechanism
    settings : SolverSettings
    buffer : SampleBuffer
        To be filled.

    Attributes
    ----------
    t : float, s
        How far it has come.
    stepper : Stepper
    CHECKPOINT_FIELDS : tuple of str
        What its own continuation depends on; `checkpoint_parts` are the objects that have more.
    """

    CHECKPOINT_FIELDS: tuple[str, ...] = ("t", "started")

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        self.mechanism, self.buffer = mechanism, buffer
        self.end = settings.duration
        self.stepper: Stepper = new_stepper(mechanism, settings)
        self._energy_monitor = EnergyMonitor(mechanism, settings)
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

    def run(self, on_step: OnStep) -> None:
        """Step to the end, from the start or from what was restored.

        Raises
        ------
        SolverError, Interrupted
            The latter from on_step, which is called with the time between steps and samples.
        """
        try:
            self._run(on_step)
        except ArithmeticError:
            raise NonFinite(
                f"after t = {self.t:.9g} s {subject_of(self.mechanism)} takes a number beyond the"
                " range of double precision; is a force or an inertia far too large or too small?"
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
        """Begin at the initial state."""
        raise NotImplementedError

    def resume(self) -> None:
        """Begin at the state that was restored."""
        raise NotImplementedError

    def step(self) -> None:
        """Take one step, after which samples inside it are known."""
        raise NotImplementedError

    def sample(self, t: float) -> None:
        """Record the state at a time that is known."""
        raise NotImplementedError

    def row(self, t: float, y: State, mode: int) -> Row:
        """Return what is recorded of a state whose contact is in a mode."""
        raise NotImplementedError

    def covers(self, t: float) -> bool:
        """Return whether the last step reaches to t."""
        return t <= self.stepper.t

    def process_step(self) -> None:
        """Draw what follows from the last step, once its samples are taken."""

    def finish(self) -> None:
        """Record what is left at the end."""

    def advance(self, limit: float, floor: float = 0.0) -> Crossing | None:
        """Take a step of the integrator and look at its energy; return the event at its end."""
        crossing = advance(self.stepper, self.mechanism, limit, floor)
        self._energy_monitor.check(self.stepper.t, self.stepper.y)
        self.t = self.stepper.t
        return crossing

    def record_crossing(self, crossing: Crossing | None) -> None:
        """Record the event at the end of the last step, if there was one; it goes on sliding."""
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
        """Return the mode that the samples have at the end of the last step, where it moves."""
        return direction

    def change_mode(self, t: float, before: int, after: int, y: State, held: float = inf) -> None:
        """Record a transition of the contact whose two sides have one state.

        Parameters
        ----------
        t : float, s
        before, after : int
        y : State
        held : float, s
            When it was still in the mode before: at t, or a rounding earlier, where the drive may
            have jumped since. Below zero it never was, and begins in the mode after.
        """
        contact = self.mechanism.contact
        name = "drive" if contact is None else contact.name
        begun = self.row(t, y, after)
        ended = begun if held < 0.0 else (t, *self.row(min(held, t), y, before)[1:])
        self.buffer.record_event(Transition(t, name, before, after, y[0]), ended, begun)


class FrictionlessSolver(Solver):
    """A mechanism that has no dry contact: smooth from kink to kink."""

    def start(self) -> None:
        rhs = rhs_without_friction(self.mechanism)
        self.stepper.start(rhs, 0.0, self.mechanism.initial_state)

    def resume(self) -> None:
        self.stepper.resume(rhs_without_friction(self.mechanism))

    def step(self) -> None:
        limit = min(self.end, self.mechanism.drive.next_discontinuity(self.t))
        self.record_crossing(self.advance(limit))

    def sample(self, t: float) -> None:
        self.buffer.add(self.row(t, self.stepper.interpolate(t), STICK))

    def row(self, t: float, y: State, mode: int) -> Row:
        mechanism = self.mechanism
        u = mechanism.drive(t)
        acceleration = mechanism.applied_torque(u, y[0], y[1]) / mechanism.inertia
        return row(t, u, y, acceleration, 0.0, mode)

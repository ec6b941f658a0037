"""The simulation of a belt drive: from step to step, with samples on the way."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import BeltOffPulleys, BudgetExceeded, Diverged
from frictionsim.mechanisms.belt_drive.assembly import assemble
from frictionsim.mechanisms.belt_drive.kernels import jit
from frictionsim.mechanisms.belt_drive.kernels.contact import CENTRE_X, CENTRE_Y, RADIUS
from frictionsim.mechanisms.belt_drive.sampling import Observer
from frictionsim.mechanisms.belt_drive.schema import CHANNELS
from frictionsim.results import SimulationResult
from frictionsim.simulation.checkpoint import Arrays, dump_part, load_part, mismatch, require_array
from frictionsim.solvers.common import SampleTimes

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.results import Channel

STEPS_BETWEEN_LOOKS = 2000  # some hundredths of a second, in which nobody is told anything
DEEPEST = 0.5  # of a radius: a body that gets further into a pulley does not come out again
MOST_CREATED = 1.0  # of the energy that was stored at the start or put in since
CLOSE = 1e-12  # of a time: two that differ by less are the same


class BeltDrive:
    """The `Simulation` of a scenario of kind `belt_drive`.

    Raises
    ------
    ScenarioError
        If the belt has no rest position.
    """

    def __init__(self, scenario: "BeltDriveScenario") -> None:
        self._scenario = scenario
        self._assembly = assemble(scenario)
        self._times = SampleTimes(scenario.solver.duration, scenario.interval)
        self._kinks = _kinks(scenario)
        self._observer = Observer(scenario, self._assembly)
        module = import_module(scenario.pair.module)
        self._stepping = module.Stepping(self._assembly, scenario.solver)
        self._observer.per_impulse = self._stepping.per_impulse
        self._begun = False
        self.effects = scenario.effect_names
        self.channel_info: Mapping[str, Channel] = CHANNELS
        bodies = tuple(map(str, range(scenario.mechanism.belt.bodies)))
        self.axes = {"pulley": scenario.mechanism.names, "body": bodies, "joint": bodies}
        pulleys = self._assembly.pulleys
        self.states = (
            6 * len(bodies) + pulleys.table.shape[1] + len(pulleys.free) + self._observer.ledger
        )

    def prepare(self, on_step: Callable[[float], Any]) -> float:
        """Evaluate the start, and have all kernels of the run compiled; return how long that took.

        Raises
        ------
        SolverError
        """
        stepping = self._stepping
        with jit.compilation(stepping.compiles_in, on_step) as found:
            if not self._begun:
                stepping.begin()
            stepping.prepare()
        self._begun = True
        return found.seconds

    def solve(self, on_step: Callable[[float], Any]) -> None:
        """Step to the end, from the start or from what was restored.

        Raises
        ------
        SolverError, Interrupted
        """
        stepping, times, end = self._stepping, self._times, self._scenario.solver.duration
        while True:
            while times.next <= stepping.t * (1.0 + CLOSE):
                t = times.next
                self._observer.take(t, stepping.look(t))
                times.advance()
                self._see_energy(t)
            if stepping.t >= end * (1.0 - CLOSE):
                return
            on_step(stepping.t)
            self._see_budget(stepping.t)
            limit = min((kink for kink in self._kinks if kink > stepping.t), default=end)
            stepping.advance(min(limit, end), times.next, STEPS_BETWEEN_LOOKS)
            self._see_belt(stepping.t)

    def _see_budget(self, t: float) -> None:
        """Stop where the steps are spent."""
        steps, rejected, _ = self._stepping.statistics
        most = self._scenario.solver.max_steps
        if steps + rejected >= most:
            raise BudgetExceeded(
                f"{most} steps are spent at t = {t:.9g} s; give a larger solver.max_steps, fewer"
                " bodies, or a law of friction that is less stiff"
            )

    def _see_energy(self, t: float) -> None:
        """Stop where there is more energy than was stored or put in."""
        excess = self._observer.created
        if excess > MOST_CREATED:
            raise Diverged(
                f"at t = {t:.9g} s the belt has {excess:.3g} times the energy that it was given:"
                " the steps are unstable; give a smaller solver.step or solver.max_step, or a"
                " smaller rtol"
            )

    def _see_belt(self, t: float) -> None:
        """Stop where the belt has left its pulleys, or is pressed through one."""
        slots = self._assembly.slots
        count = slots.first[-1]
        if count == 0:
            raise BeltOffPulleys(
                f"the belt has left its pulleys at t = {t:.9g} s; is the pretension too low, or a"
                " torque too high?"
            )
        radius = slots.table[RADIUS, :count]
        filled = np.flatnonzero(radius > 0.0)
        body = slots.body[filled].astype(np.int64)
        x, y = self._observer.positions(self._stepping)
        centre_x, centre_y = slots.table[CENTRE_X, filled], slots.table[CENTRE_Y, filled]
        share = 1.0 - np.hypot(x[body] - centre_x, y[body] - centre_y) / radius[filled]
        deepest = int(np.argmax(share))
        if share[deepest] > DEEPEST:
            raise BeltOffPulleys(
                f"body {body[deepest]} of the belt is pressed {100 * share[deepest]:.0f} % of the"
                f" radius into a pulley at t = {t:.9g} s; stiffen effects.contact, or lower the"
                " tension"
            )

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""
        steps, rejected, evaluations = self._stepping.statistics
        return steps, rejected, evaluations

    def state(self) -> Arrays | None:
        """Return all that the rest of the run depends on; None where nothing could be saved."""
        if not self._stepping.resumable:
            return None
        parts = {f"stepping.{k}": v for k, v in self._stepping.arrays().items()}
        numbers = {name: np.array(v, dtype=np.float64) for name, v in parts.items()}
        return {**numbers, **dump_part(self._times, "times"), **self._observer.state()}

    def restore(self, state: Arrays) -> None:
        """Take over the state of another simulation of the same scenario.

        Raises
        ------
        InputError
            If it is of another scenario.
        """
        for name, array in self._stepping.arrays().items():
            values = require_array(state, f"stepping.{name}", np.float64, ndim=array.ndim)
            if values.shape != array.shape:
                raise mismatch(f"stepping.{name}")
            array[...] = values
        load_part(self._times, "times", state)
        self._observer.restore(state)
        self._begun = True

    def observe(self) -> SimulationResult:
        """Return what was sampled so far, and what follows from it."""
        return self._observer.observe()


def _kinks(scenario: "BeltDriveScenario") -> list[float]:
    """Return the times at which a drive has a kink, s: a step ends there."""
    from frictionsim.scenario.signal_tables import SpeedTable, signal_from

    found = set()
    for drive in scenario.drive.values():
        table = drive.torque if drive.speed is None else drive.speed
        if table is None or isinstance(table, SpeedTable):
            continue
        signal = signal_from(table)
        t = 0.0
        while (t := signal.next_discontinuity(t)) < scenario.solver.duration:
            found.add(t)
    return sorted(found)

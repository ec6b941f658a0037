"""The simulation of a belt drive: from step to step, with samples on the way."""

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim import backends, compiled
from frictionsim.backends.base import SampleTimes
from frictionsim.errors import SolverError
from frictionsim.mechanisms.belt.assembly import assemble
from frictionsim.mechanisms.belt.contact import CENTRE_X, CENTRE_Y, RADIUS
from frictionsim.mechanisms.belt.observation import Observer
from frictionsim.mechanisms.belt.parameters import CHANNELS
from frictionsim.series import Observed

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt.parameters import Scene
    from frictionsim.series import Channel

STEPS_BETWEEN_LOOKS = 2000  # some hundredths of a second, in which nobody is told anything
DEEPEST = 0.5  # of a radius: a body that gets further into a pulley does not come out again


class BeltDrive:
    """The `Simulation` of a scene of kind `belt_drive`.

    Raises
    ------
    ScenarioError
        If the belt has no rest position.
    """

    def __init__(self, scene: "Scene") -> None:
        self._scene = scene
        self._assembly = assemble(scene)
        self._times = SampleTimes(scene.solver.duration, scene.interval)
        self._kinks = _kinks(scene)
        self._observer = Observer(scene, self._assembly)
        self._stepping: Any = None
        self.effects = scene.effect_names
        self.channel_info: Mapping[str, Channel] = CHANNELS
        bodies = tuple(map(str, range(scene.mechanism.belt.bodies)))
        self.axes = {"pulley": scene.mechanism.names, "body": bodies, "joint": bodies}
        pulleys = self._assembly.pulleys
        self.states = (
            6 * len(bodies) + pulleys.table.shape[1] + len(pulleys.free) + self._observer.ledger
        )

    def solve(self, poll: Callable[[float], Any]) -> None:
        """Step to the end.

        Raises
        ------
        SolverError, Interrupted
        """
        module = import_module(backends.BELT[self._scene.solver.backend])
        self._stepping = stepping = module.Stepping(self._assembly, self._scene.solver)
        self._observer.per_impulse = stepping.per_impulse
        with compiled.announced(self._variant(), getattr(poll, "say", None)):
            stepping.begin()
        end = self._scene.solver.duration
        while True:
            while self._times.next <= stepping.t * (1.0 + 1e-12):
                t = self._times.next
                self._observer.take(t, stepping.look(t))
                self._times.advance()
            if stepping.t >= end * (1.0 - 1e-12):
                return
            poll(stepping.t)
            limit = min((kink for kink in self._kinks if kink > stepping.t), default=end)
            stepping.advance(min(limit, end), self._times.next, STEPS_BETWEEN_LOOKS)
            self._see_belt(stepping.t)

    def _variant(self) -> str:
        """Return what the kernels are compiled anew for: the backend and the effects."""
        a = self._assembly
        optional = (*a.laws, a.torques, a.loads, a.speeds, a.friction, a.hysteresis)
        sines = (getattr(part, "sines", None) for part in (a.torques, a.speeds))
        there = "".join("01"[part is not None] for part in (*optional, *sines))
        return f"{self._scene.solver.backend}-{there}"

    def _see_belt(self, t: float) -> None:
        """Stop where the belt has left its pulleys.

        Raises
        ------
        SolverError
        """
        slots = self._assembly.slots
        count = slots.first[-1]
        if count == 0:
            raise SolverError(
                f"the belt has left its pulleys at t = {t:.9g} s; is the pretension too low, or a"
                " torque too high?"
            )
        x, y = self._observer.positions(self._stepping)
        table, body = slots.table[:, :count], slots.body[:count].astype(np.int64)
        depth = table[RADIUS] - np.hypot(x[body] - table[CENTRE_X], y[body] - table[CENTRE_Y])
        worst = int(np.argmax(np.where(table[RADIUS] > 0.0, depth / table[RADIUS].clip(1e-300), 0)))
        if depth[worst] > DEEPEST * table[RADIUS, worst] > 0.0:
            raise SolverError(
                f"body {body[worst]} of the belt is {depth[worst]:.3g} m inside a pulley at"
                f" t = {t:.9g} s; stiffen effects.contact, or lower the tension"
            )

    def counts(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""
        return self._stepping.counts if self._stepping is not None else (0, 0, 0)

    def observe(self) -> Observed:
        """Return what was sampled so far, and what follows from it."""
        return self._observer.observe()


def _kinks(scene: "Scene") -> list[float]:
    """Return the times at which a drive has a kink, s: a step ends there."""
    from frictionsim.drives import SpeedTable, course_of

    found = set()
    for drive in scene.drive.values():
        table = drive.torque if drive.speed is None else drive.speed
        if table is None or isinstance(table, SpeedTable):
            continue
        course = course_of(table)
        t = 0.0
        while (t := course.next_kink(t)) < scene.solver.duration:
            found.add(t)
    return sorted(found)

"""Error estimate of the quantities of a run, from a second, more accurate run.

An adaptive run is repeated with a tenth of its tolerances and, with regularised friction, of its
transition speed; the difference estimates the error of the first run. A fixed step is halved and
the difference doubled: at a switch of the friction the error is of first order in the step, so
that the second run has half of it (Richardson). Extremes are those of the samples, so that the
second run has more of them; not that of a belt, whose means are over its samples.

What has a mesh is solved on a finer one as well, and its quantities there stand beside the errors,
by name: they tell the size of what the mesh does, and are no bound of its error.
"""

from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import InputError
from frictionsim.results import Record
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import REGULARISED
from frictionsim.scenario.schema import TRANSITION_SPEED
from frictionsim.scenario.variants import Setting, short
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.scenario.settings import Scenario

REFINEMENT = 0.1
# Twice as many bodies take four times the time: too much after a run that took longer than this, s.
# Half as many would take a quarter, and say little: tensions of belts are at times nearer to those
# of half as many bodies than to those of very many, by a factor of ten.
MAX_SECONDS = 10.0
MIN_RTOL = 1e-14  # the minimum of solver.rtol
RICHARDSON = 2.0
# What is left of an extreme's error is a sixteenth at most; no more samples than the second number.
DENSER, MAX_SAMPLES = 4, 100_000


class OtherMesh(NamedTuple):
    """The quantities of a scenario on another mesh, by name; None where one is undefined."""

    name: str
    values: dict[str, float | None]


class Estimate(NamedTuple):
    """The estimated errors of the quantities of a run."""

    errors: dict[str, float | None]  # by name; None if undefined; empty without an estimate
    method: str  # how the errors were estimated, or why not
    exit_code: int = 0  # of the further run that a signal stopped
    # None without a mesh, or where another one would cost too much or is not possible.
    other_mesh: OtherMesh | None = None


def estimate(
    scenario: "Scenario",
    first: Record,
    on_step: "Callable[[float], Any]",
    max_steps: int | None = None,
) -> Estimate:
    """Solve a scenario again, more accurately, and compare the quantities; then on another mesh.

    `first` is its run that is done; `on_step` is called with the time, s, after each step. The
    limit of steps is that of each further run.
    """

    def solved(overrides: list[str]) -> tuple[Record, int]:
        """Return a run, and the exit code of a signal that stopped it."""
        done = run(scenario.replace(overrides), on_step, max_steps=max_steps)
        return done, done.exit_code if done.status == "interrupted" else 0

    setting = tighter(scenario)
    study = getattr(mechanism_module(scenario.kind), "mesh_study", None)
    label, overrides = setting.label, list(setting.overrides)
    interval = max(scenario.interval / DENSER, scenario.solver.duration / MAX_SAMPLES)
    if study is None and interval < scenario.interval:
        label += f", output.interval {interval:.4g} s"
        overrides.append(f"output.interval={interval!r}")
    second, exit_code = solved(overrides)
    if second.status != "done":
        reason = f"no error estimate: run with {label} {second.status}: {second.reason}"
        return Estimate({}, reason, exit_code)
    halved = any(override.startswith("solver.step=") for override in setting.overrides)
    errors: dict[str, float | None] = dict.fromkeys(first.quantities)
    for name, quantity in first.quantities.items():
        other = second.quantities.get(name)
        if quantity.value is not None and other is not None and other.value is not None:
            errors[name] = (RICHARDSON if halved else 1.0) * abs(quantity.value - other.value)
    difference = f"{'twice ' if halved else ''}the difference to a run with {label}"
    method, other_mesh = f"error: {difference}", None
    if study is None:
        return Estimate(errors, method)
    seconds = first.statistics.wall_seconds if first.statistics is not None else None
    if seconds is not None and seconds <= MAX_SECONDS:
        own = study.own_mesh(scenario)
        mesh = study.mesh_of(scenario, own.model, 2 * own.bodies)
        overrides = list(mesh.overrides)
        if scenario.solver.step is not None:  # bodies half as long are stable with half the step
            overrides.append(f"solver.step={0.5 * scenario.solver.step!r}")
        with suppress(InputError):  # there is no such mesh
            fine, exit_code = solved(overrides)
            if fine.status == "done":
                values = {name: quantity.value for name, quantity in fine.quantities.items()}
                other_mesh = OtherMesh(f"{mesh.bodies} bodies", values)
    shown = f": '{other_mesh.name}' has the value of that mesh" if other_mesh else ""
    method += f"; that of the mesh is not included{shown}, 'frictionsim cost' compares meshes"
    return Estimate(errors, method, exit_code, other_mesh)


def tighter(scenario: "Scenario") -> Setting:
    """Return a more accurate setting of the backend of a scenario; its kind may provide one."""
    of_kind = getattr(mechanism_module(scenario.kind), "tighter", lambda scenario: None)
    setting: Setting | None = of_kind(scenario)
    if setting is not None:
        return setting
    solver = scenario.solver
    if solver.step is not None:
        step = 0.5 * solver.step
        return Setting(solver.backend, f"step {short(step)} s", (f"solver.step={step!r}",))
    rtol, atol = max(MIN_RTOL, REFINEMENT * solver.rtol), REFINEMENT * (solver.atol or 0.0)
    label, overrides = f"rtol {short(rtol)}", [f"solver.rtol={rtol!r}"]
    if atol > 0.0:  # a belt has none
        label += f", atol {short(atol)}"
        overrides.append(f"solver.atol={atol!r}")
    for name, effect in scenario.friction_effects.items():
        if scenario.law == REGULARISED:
            speed = REFINEMENT * (effect.transition_speed or TRANSITION_SPEED)
            label += f", transition speed {short(speed)}"
            overrides.append(f"effects.{name}.transition_speed={speed!r}")
    return Setting(solver.backend, label, tuple(overrides))

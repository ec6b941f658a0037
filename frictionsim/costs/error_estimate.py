"""Error estimate of the quantities of a run, from a second, more accurate run.

An adaptive run is repeated with a tenth of its tolerances and, with regularised friction, of its
transition speed; the difference estimates the error of the first run. A fixed step is halved and
the difference doubled: at a switch of the friction the error is of first order in the step, so
that the second run has half of it (Richardson).
"""

from typing import TYPE_CHECKING, Any, NamedTuple

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
MIN_RTOL = 1e-14  # the minimum of solver.rtol
RICHARDSON = 2.0


class Estimate(NamedTuple):
    """The estimated errors of the quantities of a run.

    Attributes
    ----------
    errors : dict of float or None
        By name of the quantity; None if the quantity is undefined. Empty if there is no estimate.
    method : str
        How the errors were estimated, or why not.
    exit_code : int
        Of the second run, if a signal stopped it.
    """

    errors: dict[str, float | None]
    method: str
    exit_code: int = 0


def estimate(
    scenario: "Scenario",
    first: Record,
    on_step: "Callable[[float], Any]",
    max_steps: int | None = None,
) -> Estimate:
    """Solve a scenario again, more accurately, and compare the quantities.

    Parameters
    ----------
    scenario : Scenario
    first : Record
        Its run that is done.
    on_step : callable
        Called with the time after each step.
    max_steps : int, optional
        Limit of steps of the second run.
    """
    setting = tighter(scenario)
    second = run(scenario.replace(list(setting.overrides)), on_step, max_steps=max_steps)
    if second.status != "done":
        reason = f"no error estimate: run with {setting.label} {second.status}: {second.reason}"
        return Estimate({}, reason, second.exit_code if second.status == "interrupted" else 0)
    halved = any(override.startswith("solver.step=") for override in setting.overrides)
    errors: dict[str, float | None] = dict.fromkeys(first.quantities)
    for name, quantity in first.quantities.items():
        other = second.quantities.get(name)
        if quantity.value is not None and other is not None and other.value is not None:
            errors[name] = (RICHARDSON if halved else 1.0) * abs(quantity.value - other.value)
    of_mesh = ""
    if hasattr(mechanism_module(scenario.kind), "mesh_study"):
        of_mesh = "; that of the mesh is not included, 'frictionsim cost' compares meshes"
    difference = f"{'twice ' if halved else ''}the difference to a run with {setting.label}"
    return Estimate(errors, f"error: {difference}{of_mesh}")


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

"""What the cost of a belt drive's accuracy is judged by, and the settings that are compared.

Beside tolerances and steps there is the friction law: set-valued as the scenario has it, or
smoothed over a speed, as the literature has it.
"""

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING

from frictionsim.results import ENERGY_BALANCE, Metric
from frictionsim.scenario.methods import BELT, REGULARISED, SET_VALUED

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.scenario.variants import Setting

# Places of single bodies depend on rounding before long; these do not.
METRICS = (
    Metric("driven_speed", "quantity", "driven_speed", "rad/s"),
    Metric("slip", "quantity", "slip_percent", "%"),
    Metric("tension_tight", "quantity", "tension_tight", "N"),
    Metric("tension_slack", "quantity", "tension_slack", "N"),
    Metric("speed_L1", "channel", "pulley_speed", "rad/s"),
    Metric("friction_heat", "quantity", "energy_friction", "J"),
    ENERGY_BALANCE,
)
TOLERANCES = (1e-4, 2e-6, 1e-7)  # looser ones have the same steps, the longest stable ones
REFERENCE_TOLERANCE = 1e-9
SMOOTHED_TOLERANCE = 1e-4
PARTS = (1, 2, 4)  # of the longest stable step
REFERENCE_PART = 16
SPEEDS = (1.0, 0.1, 0.01)  # m/s; smaller ones take minutes for tenths of a second


def ladders(scenario: "BeltDriveScenario", tolerances: Iterable[float]) -> "list[Setting]":
    """Return tolerances, steps and smoothed laws; those tolerances that suit a belt."""
    from frictionsim.scenario.variants import Setting, short

    settings = [_with_rtol("rkf45", rtol) for rtol in _suiting(tolerances)]
    step_limit = _default_step(scenario)
    settings += [_with_step(step_limit, part) for part in PARTS]
    settings = [setting.with_law(SET_VALUED, scenario) for setting in settings]
    if scenario.effects.belt_friction is None:
        return settings
    for speed in SPEEDS:
        smoothed = f"effects.belt_friction.transition_speed={speed:g}"
        overrides = (smoothed, *_with_rtol("rkf45", SMOOTHED_TOLERANCE).overrides)
        setting = Setting("rkf45", f"speed {short(speed)}", overrides)
        settings.append(setting.with_law(REGULARISED, scenario))
    return settings


def references(scenario: "BeltDriveScenario", rtol: float) -> "tuple[Setting, Setting]":
    """Return the adaptive method and short fixed steps."""
    adaptive = _with_rtol("rkf45", max(rtol, REFERENCE_TOLERANCE))
    fixed = _with_step(_default_step(scenario), REFERENCE_PART)
    return adaptive.with_law(SET_VALUED, scenario), fixed.with_law(SET_VALUED, scenario)


def tighter(scenario: "BeltDriveScenario") -> "Setting | None":
    """Return half the step, also where `moreau` takes its own; None where tolerances decide."""
    if scenario.solver.backend != "moreau":
        return None
    return _with_step(scenario.solver.step or _default_step(scenario), 2)


def _suiting(tolerances: Iterable[float]) -> tuple[float, ...]:
    """Return the requested tolerances, or those of a belt instead of the usual ones."""
    from frictionsim.scenario.variants import TOLERANCES as USUAL

    requested = tuple(tolerances)
    return TOLERANCES if requested == USUAL else requested


def _with_rtol(backend: str, rtol: float) -> "Setting":
    from frictionsim.scenario.variants import Setting, short

    return Setting(backend, f"rtol {short(rtol)}", (f"solver.rtol={rtol:.6g}",))


def _with_step(step_limit: float, part: int) -> "Setting":
    from frictionsim.scenario.variants import Setting, short

    step = float(f"{step_limit / part:.3g}")
    return Setting("moreau", f"step {short(step)}", (f"solver.step={step:.3g}",))


def _default_step(scenario: "BeltDriveScenario") -> float:
    """Return the step that `moreau` takes by itself: just short of unstable, s."""
    from frictionsim.mechanisms.belt_drive.model import assemble

    module = import_module(BELT[SET_VALUED, "moreau"].module)
    settings = scenario.solver.model_copy(update={"backend": "moreau", "step": None})
    return float(1.0 / module.STEPPER(assemble(scenario), settings).force_per_impulse)

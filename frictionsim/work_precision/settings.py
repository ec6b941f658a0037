"""The settings and references of a study for mechanisms without a mesh."""

from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.errors import ScenarioError
from frictionsim.scenario.loading import ValidationFailure, validate
from frictionsim.scenario.methods import METHODS, REGULARISED, SET_VALUED, methods_of
from frictionsim.scenario.overrides import apply_override
from frictionsim.scenario.variants import Setting, short, tolerance_overrides, with_tolerance
from frictionsim.solvers.mechanism import Mechanism

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.solvers.multi_contact import MultiContactMechanism

    AnyMechanism = Mechanism | MultiContactMechanism

# Tolerance of the references, relative to the tightest tolerance of the study.
REFERENCE_REFINEMENT = 0.1
# Offset one reference by a factor of two so that both do not share an error.
REFERENCE_OFFSET = 0.5
REFERENCE_STEP = 1e-3  # longest of the second reference of a single method, over the duration
TIGHTEST, LOOSEST = 1e-12, 0.1
STEPS = (1e-2, 1e-3, 1e-4)  # fixed steps, relative to the duration
# Transition speeds, rad/s; the next one would take an explicit method up to ten times the steps.
SPEEDS = (1e-1, 1e-2, 1e-3)
SPEEDS_IF_IMPLICIT = (*SPEEDS, 1e-4, 1e-5)
# The error of regularising with these speeds exceeds that of this tolerance.
RTOL_OF_REGULARISED = 1e-6

SAMPLES = 500  # of the runs for the errors
WARM_UP_FRACTION = 1e-6  # of the duration
# Keys that the settings of a study replace.
SET_BY_LADDERS = ("backend", "step")


class ScenarioVariants:
    """The variants of a scenario in a study.

    Parameters
    ----------
    scenario : Scenario
        Its keys in SET_BY_LADDERS are ignored.
    channels : iterable of str, optional
        The channels that are compared, where those of all bodies would take much memory.
    """

    def __init__(self, scenario: "Scenario", channels: Iterable[str] | None = None) -> None:
        self._data: dict[str, Any] = scenario.to_dict()
        for key in SET_BY_LADDERS:
            self._data["solver"].pop(key, None)
        for name, effect in scenario.friction_effects.items():
            for key in effect.LAW_KEYS:
                self._data["effects"][name].pop(key, None)
        self._channels = None if channels is None else list(channels)
        self.duration = scenario.solver.duration
        # Means of quantities are of samples: never fewer of them than the scenario's own.
        self._interval = min(self.duration / SAMPLES, scenario.interval)

    # A setting of a mesh may not be valid: then these raise ScenarioError.
    def judged(self, setting: Setting) -> "Scenario":
        """Return the scenario with a setting, sampled for the comparison with the reference."""
        return self._with(setting, self._interval, self.duration)

    def timed(self, setting: Setting) -> "Scenario":
        """Return the scenario with a setting, sampled at start and end only, for the timing."""
        return self._with(setting, self.duration, self.duration)

    def warm_up(self, setting: Setting) -> "Scenario":
        """Return a tiny part of the scenario, to load and compile everything before the timing."""
        instant = self.duration * WARM_UP_FRACTION
        return self._with(setting, instant, instant)

    def _with(self, setting: Setting, interval: float, duration: float) -> "Scenario":
        data = deepcopy(self._data)
        data["solver"]["duration"] = duration
        data["solver"]["backend"] = setting.backend
        # No samples at events: their times differ between the settings.
        data["output"] = {"interval": interval, "at_events": False}
        if self._channels is not None:
            data["output"]["channels"] = self._channels
        for override in setting.all_overrides:
            apply_override(data, override)
        try:
            return validate(data, Path())
        except ValidationFailure as failure:
            raise ScenarioError(failure.lines()) from None


def ladders(
    scenario: "Scenario", tolerances: Iterable[float], mechanism: "AnyMechanism"
) -> list[Setting]:
    """Return the settings of every law and method for a mechanism without a mesh.

    Adaptive methods have several tolerances, fixed-step methods several steps, and the regularised
    law several transition speeds at one tolerance. Without dry friction, or with a prescribed
    speed, there is no law, and every method has several tolerances.

    Parameters
    ----------
    scenario : Scenario
    tolerances : iterable of float
        Relative tolerances.
    mechanism : Mechanism or MultiContactMechanism
    """
    if _is_smooth(mechanism):
        names = methods_of(scenario.pairs)
        return [with_tolerance(name, rtol) for name in names for rtol in tolerances]
    settings: list[Setting] = []
    for (law, name), pair in scenario.pairs.items():
        if pair.fixed_step:
            duration = scenario.solver.duration
            of_pair = [_with_step(name, fraction * duration) for fraction in STEPS]
        elif law == REGULARISED:
            speeds = SPEEDS_IF_IMPLICIT if METHODS[name].implicit else SPEEDS
            of_pair = [_with_speed(name, speed, scenario) for speed in speeds]
        else:
            of_pair = [with_tolerance(name, rtol) for rtol in tolerances]
        settings += [setting.with_law(law, scenario) for setting in of_pair]
    return settings


def references(
    scenario: "Scenario", mechanism: "AnyMechanism", rtol: float
) -> tuple[Setting, Setting]:
    """Return two references with different methods for a mechanism without a mesh.

    Where there is one method only, the second has short steps, too.
    """
    if methods_of(scenario.pairs) == ("events",):
        step = REFERENCE_STEP * scenario.solver.duration
        first, second = (with_tolerance("events", x * rtol) for x in (REFERENCE_OFFSET, 1.0))
        label, overrides = f"{second.label}, max_step {short(step)}", f"solver.max_step={step:.6g}"
        second = second._replace(label=label, overrides=(*second.overrides, overrides))
        return first.with_law(SET_VALUED, scenario), second.with_law(SET_VALUED, scenario)
    smooth = _is_smooth(mechanism)
    # Without dry friction, `events` and `rkf45` are the same method.
    other = "dop853" if smooth else "rkf45"
    first = with_tolerance("events", REFERENCE_OFFSET * rtol)
    second = with_tolerance(other, rtol)
    if smooth:
        return first, second
    return first.with_law(SET_VALUED, scenario), second.with_law(SET_VALUED, scenario)


def _is_smooth(mechanism: "AnyMechanism") -> bool:
    """Return whether there is no friction law to choose, so that every method is possible."""
    if isinstance(mechanism, Mechanism):
        return mechanism.contact is None or mechanism.prescribed
    return False


def _with_step(backend: str, step: float) -> Setting:
    return Setting(backend, f"step {short(step)}", (f"solver.step={step:.12g}",))


def _with_speed(backend: str, speed: float, scenario: "Scenario") -> Setting:
    speeds = (f"effects.{name}.transition_speed={speed:g}" for name in scenario.friction_effects)
    return Setting(
        backend, f"speed {short(speed)}", (*tolerance_overrides(RTOL_OF_REGULARISED), *speeds)
    )

"""Settings to compare, and the ladders of them that mechanisms of one coordinate are given."""

from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.scenario.loading import apply_override, resolved_tables, validate
from frictionsim.scenario.methods import METHODS, REGULARISED, SET_VALUED, methods_of
from frictionsim.scenario.variants import Setting, short, tolerance_overrides, with_tolerance

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.solvers.mechanism import Mechanism

# Ten times tighter than the tightest is what the references are run at.
TIGHTER = 0.1
# ... and one of them twice as tight again, so that they do not take the same steps and agree on
# the same error.
REFERENCE_OFFSET = 0.5
TIGHTEST, LOOSEST = 1e-12, 0.1
STEPS = (1e-2, 1e-3, 1e-4)  # of fixed steps, over the duration
# rad/s, about the default. An explicit method takes up to ten times the steps for the next.
SPEEDS = (1e-1, 1e-2, 1e-3)
SPEEDS_IF_IMPLICIT = (*SPEEDS, 1e-4, 1e-5)
# Smoothing by these speeds is worse than a tolerance as tight as this.
RTOL_OF_SMOOTHED = 1e-6

SAMPLES = 500  # of the runs that are judged
WARM_UP_FRACTION = 1e-6  # of the duration
# What a ladder sets is not what the scenario says.
SET_BY_LADDERS = ("backend", "step")


class ScenarioVariants:
    """A scenario in all its settings.

    Parameters
    ----------
    scenario : Scenario
        Solver settings that are part of a ladder do not count.
    """

    def __init__(self, scenario: "Scenario") -> None:
        self._data: dict[str, Any] = resolved_tables(scenario)
        for key in SET_BY_LADDERS:
            self._data["solver"].pop(key, None)
        for name, effect in scenario.friction_effects.items():
            for key in effect.LAW_KEYS:
                self._data["effects"][name].pop(key, None)
        self._duration = scenario.solver.duration

    def judged(self, setting: Setting) -> "Scenario":
        """Return the scenario with a setting, sampled so that it can be judged."""
        return self._with(setting, self._duration / SAMPLES, self._duration)

    def timed(self, setting: Setting) -> "Scenario":
        """Return the scenario with a setting, sampled at its ends only: samples cost time, too."""
        return self._with(setting, self._duration, self._duration)

    def warm_up(self, setting: Setting) -> "Scenario":
        """Return its first instant: what is loaded or compiled then is not timed."""
        instant = self._duration * WARM_UP_FRACTION
        return self._with(setting, instant, instant)

    def _with(self, setting: Setting, interval: float, duration: float) -> "Scenario":
        data = deepcopy(self._data)
        data["solver"]["duration"] = duration
        data["solver"]["backend"] = setting.backend
        # Settings are compared sample by sample, and each has its own times of events.
        data["output"] = {"interval": interval, "at_events": False}
        for override in setting.all_overrides:
            apply_override(data, override)
        return validate(data, Path())


def ladders(
    scenario: "Scenario", tolerances: Iterable[float], mechanism: "Mechanism"
) -> list[Setting]:
    """Return the settings of every law and method for a mechanism of one coordinate.

    Tolerances for adaptive methods, steps for those of fixed steps, and for the regularised law
    the speeds over which it smooths friction, at one tolerance. Without dry friction, or where the
    speed is given, there is no law and every method has its tolerances.
    """
    if mechanism.contact is None or mechanism.prescribed:
        names = methods_of(scenario.PAIRS)
        return [with_tolerance(name, rtol) for name in names for rtol in tolerances]
    found: list[Setting] = []
    for (law, name), pair in scenario.PAIRS.items():
        if pair.fixed_step:
            rungs = [_with_step(name, share * scenario.solver.duration) for share in STEPS]
        elif law == REGULARISED:
            speeds = SPEEDS_IF_IMPLICIT if METHODS[name].implicit else SPEEDS
            rungs = [_with_speed(name, speed, scenario) for speed in speeds]
        else:
            rungs = [with_tolerance(name, rtol) for rtol in tolerances]
        found += [rung.with_law(law, scenario) for rung in rungs]
    return found


def references(
    scenario: "Scenario", mechanism: "Mechanism", rtol: float
) -> tuple[Setting, Setting]:
    """Return two different methods for a mechanism of one coordinate."""
    smooth = mechanism.contact is None or mechanism.prescribed
    # Without a contact to solve for, `events` and `rkf45` are one method.
    other = "dop853" if smooth else "rkf45"
    first = with_tolerance("events", REFERENCE_OFFSET * rtol)
    second = with_tolerance(other, rtol)
    if smooth:
        return first, second
    return first.with_law(SET_VALUED, scenario), second.with_law(SET_VALUED, scenario)


def _with_step(backend: str, step: float) -> Setting:
    return Setting(backend, f"step {short(step)}", (f"solver.step={step:.12g}",))


def _with_speed(backend: str, speed: float, scenario: "Scenario") -> Setting:
    speeds = (f"effects.{name}.transition_speed={speed:g}" for name in scenario.friction_effects)
    return Setting(
        backend, f"speed {short(speed)}", (*tolerance_overrides(RTOL_OF_SMOOTHED), *speeds)
    )

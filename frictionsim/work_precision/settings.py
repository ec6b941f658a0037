"""Settings to compare, and the ladders of them that mechanisms of one coordinate are given."""

import tomllib
from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.scenario.loading import apply_override, resolved_toml, validate
from frictionsim.scenario.methods import BACKENDS
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
SET_BY_LADDERS = ("backend", "step", "transition_speed")


class ScenarioVariants:
    """A scenario in all its settings.

    Parameters
    ----------
    scenario : Scenario
        Solver settings that are part of a ladder do not count.
    """

    def __init__(self, scenario: "Scenario") -> None:
        self._data: dict[str, Any] = tomllib.loads(resolved_toml(scenario))
        for key in SET_BY_LADDERS:
            self._data["solver"].pop(key, None)
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
        for override in setting.overrides:
            apply_override(data, override)
        return validate(data, Path())


def ladders(
    scenario: "Scenario", tolerances: Iterable[float], mechanism: "Mechanism"
) -> list[Setting]:
    """Return the settings of every backend that can do a mechanism of one coordinate.

    Tolerances for adaptive backends, steps for those of fixed steps, and for those that smooth
    dry friction the speeds over which they do, at one tolerance.
    """
    smooth = mechanism.contact is not None and not mechanism.prescribed
    found: list[Setting] = []
    for name in scenario.BACKENDS:
        backend = BACKENDS[name]
        if backend.fixed_step:
            found += [_with_step(name, share * scenario.solver.duration) for share in STEPS]
        elif backend.regularised and smooth:
            speeds = SPEEDS_IF_IMPLICIT if backend.implicit else SPEEDS
            found += [_with_speed(name, speed) for speed in speeds]
        else:
            found += [with_tolerance(name, rtol) for rtol in tolerances]
    return found


def references(mechanism: "Mechanism", rtol: float) -> tuple[Setting, Setting]:
    """Return two different methods for a mechanism of one coordinate."""
    smooth = mechanism.contact is None or mechanism.prescribed
    # Without a contact to solve for, `events` and `rkf45` are one method.
    other = "dop853" if smooth else "rkf45"
    return with_tolerance("events", REFERENCE_OFFSET * rtol), with_tolerance(other, rtol)


def _with_step(backend: str, step: float) -> Setting:
    return Setting(backend, f"step {short(step)}", (f"solver.step={step:.12g}",))


def _with_speed(backend: str, speed: float) -> Setting:
    overrides = (*tolerance_overrides(RTOL_OF_SMOOTHED), f"solver.transition_speed={speed:g}")
    return Setting(backend, f"speed {short(speed)}", overrides)

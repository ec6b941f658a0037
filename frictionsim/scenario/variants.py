"""One scenario under other settings of its solver."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.scenario.loading import apply_override, resolved_tables, validate

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


# Of a study, unless others are asked for.
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
ATOL_OVER_RTOL = 1e-3


class Setting(NamedTuple):
    """A way to solve a scenario.

    Attributes
    ----------
    backend : str
    label : str
        What tells it from others of its law and method, "rtol 1e-5".
    overrides : tuple of str
        `a.b=VALUE` each, as --set has them.
    law : str
        Empty without friction.
    laws : tuple of str
        The overrides that set the law.
    """

    backend: str
    label: str
    overrides: tuple[str, ...]
    law: str = ""
    laws: tuple[str, ...] = ()

    @property
    def line(self) -> str:
        """The name of the line in the diagram."""
        return f"{self.backend}, {self.law}" if self.law else self.backend

    @property
    def all_overrides(self) -> tuple[str, ...]:
        """What a user gives as --set to have this setting, the method apart."""
        return (*self.laws, *self.overrides)

    def with_law(self, law: str, scenario: "Scenario") -> "Setting":
        """Return the setting with another friction law for all friction effects of a scenario."""
        effects = scenario.friction_effects
        laws = tuple(f"effects.{name}.law={law}" for name in effects)
        return self._replace(law=law, laws=laws) if effects else self


def with_overrides(scenario: "Scenario", overrides: Iterable[str]) -> "Scenario":
    """Return a scenario with some of its keys set, `a.b=VALUE` each."""
    data = resolved_tables(scenario)
    for override in overrides:
        apply_override(data, override)
    return validate(data, Path())  # signals of files are filled in already


def with_tolerance(backend: str, rtol: float) -> Setting:
    """Return the setting of an adaptive backend at a relative tolerance."""
    return Setting(backend, f"rtol {short(rtol)}", tolerance_overrides(rtol))


def tolerance_overrides(rtol: float) -> tuple[str, ...]:
    return f"solver.rtol={rtol:.6g}", f"solver.atol={rtol * ATOL_OVER_RTOL:.6g}"


def short(value: float) -> str:
    """Return a number as short as it can be: 1e-5, 0.03."""
    if value >= 0.01:
        return f"{value:.6g}"
    digits, exponent = f"{value:.5e}".split("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"

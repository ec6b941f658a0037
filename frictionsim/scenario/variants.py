"""Variants of a scenario with other settings of the solver."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


# Default tolerances of a work-precision study.
TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)
ATOL_OVER_RTOL = 1e-3


class Mesh(NamedTuple):
    """A model in space, its number of bodies, and the overrides that make it, as for --set."""

    model: str
    bodies: int
    overrides: tuple[str, ...] = ()  # none for the scenario's own


class Setting(NamedTuple):
    """A backend with the settings of one run of a study; its overrides are as for --set."""

    backend: str
    label: str  # such as "rtol 1e-5"
    overrides: tuple[str, ...]
    law: str = ""  # empty without friction
    laws: tuple[str, ...] = ()  # the overrides that set the law
    mesh: Mesh | None = None

    @property
    def line(self) -> str:
        """The name of the line in the diagram."""
        parts = (self.backend, self.law, self.mesh.model if self.mesh else "")
        return ", ".join(part for part in parts if part)

    @property
    def detail(self) -> str:
        """The setting's label on its line in the diagram."""
        return f"{self.mesh.bodies} bodies, {self.label}" if self.mesh else self.label

    @property
    def name(self) -> str:
        """The name of the setting in a list of several."""
        return f"{self.line}, {self.detail}"

    @property
    def all_overrides(self) -> tuple[str, ...]:
        """The overrides for --set that give this setting, without the method."""
        return (*(self.mesh.overrides if self.mesh else ()), *self.laws, *self.overrides)

    def with_law(self, law: str, scenario: "Scenario") -> "Setting":
        """Return the setting with a friction law for all friction effects of a scenario."""
        effects = scenario.friction_effects
        laws = tuple(f"effects.{name}.law={law}" for name in effects)
        return self._replace(law=law, laws=laws) if effects else self


class Limit(NamedTuple):
    """Two meshes whose results are extrapolated; the coarse one has half the bodies."""

    fine: Setting
    coarse: Setting

    @property
    def name(self) -> str:
        """The name of the extrapolated mesh limit."""
        meshes = (self.coarse.mesh, self.fine.mesh)
        counts = " and ".join(str(mesh.bodies) for mesh in meshes if mesh)
        return f"{self.fine.line}, extrapolated from {counts} bodies"


def with_tolerance(backend: str, rtol: float) -> Setting:
    """Return the setting of an adaptive backend with a relative tolerance."""
    return Setting(backend, f"rtol {short(rtol)}", tolerance_overrides(rtol))


def tolerance_overrides(rtol: float) -> tuple[str, ...]:
    """Return the overrides for a relative tolerance and the matching absolute one."""
    return f"solver.rtol={rtol:.6g}", f"solver.atol={rtol * ATOL_OVER_RTOL:.6g}"


def short(value: float) -> str:
    """Return a number as short text: 1e-5, 0.03."""
    if value >= 0.01:
        return f"{value:.6g}"
    digits, exponent = f"{value:.5e}".split("e")
    return f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"

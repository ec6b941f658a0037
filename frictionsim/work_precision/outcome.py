"""What a study runs and what it finds: settings in, rows and references out."""

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.scenario.variants import Limit, Setting
from frictionsim.work_precision.errors import Comparable, Error, max_relative_error

if TYPE_CHECKING:
    from collections.abc import Mapping

    from frictionsim.results import Metric
    from frictionsim.scenario.settings import Scenario


class Plan(NamedTuple):
    """What a study runs.

    Attributes
    ----------
    settings : list of Setting
    references : tuple of Setting
        Different methods, tighter than any of the settings, on the scenario's own mesh if it has
        one. Empty if no setting is of that mesh.
    metrics : tuple of Metric
    limits : tuple of Limit
        Whose first is what the errors are of and whose second is compared with it. Empty for a
        study over time alone, whose errors are those against the references.
    """

    settings: list[Setting]
    references: tuple[Setting, ...]
    metrics: "tuple[Metric, ...]"
    limits: tuple[Limit, ...] = ()


class Row(NamedTuple):
    """The results of a setting.

    Attributes
    ----------
    setting : Setting
    status : str
        `done` or `failed`.
    reason : str
        Why it failed, or which checks of the audit failed.
    wall_seconds : float, s
        Median over the repeats, or the time of the failed run.
    repeats : int
        Number of timed runs.
    steps, rejected, rhs_evaluations, states : int
        Without evaluations for samples. `rejected` is None if the backend does not report it.
    events : int
    errors : dict of Error
        By metric; empty if failed.
    time_errors : mapping of Error
        Against the same mesh converged in time; empty if that is not known, and without meshes.
    wall_spread : float or None, s
        Largest minus least wall time of the repeats; None of a single run.
    """

    setting: Setting
    status: str
    reason: str
    wall_seconds: float
    repeats: int
    steps: int
    rejected: int | None
    rhs_evaluations: int
    states: int
    events: int
    errors: dict[str, Error]
    time_errors: "Mapping[str, Error]" = MappingProxyType({})
    wall_spread: float | None = None

    @property
    def error(self) -> float | None:
        """The largest relative error; None if failed."""
        return max_relative_error(self.errors) if self.status == "done" else None

    @property
    def time_error(self) -> float | None:
        """The largest relative error in time alone; None if it is not known."""
        return max_relative_error(self.time_errors) if self.time_errors else None


class Diagram(NamedTuple):
    """What a picture of a study shows, whether it was just run or read from its table.

    Attributes
    ----------
    title : str
    rows : list of Row
    floor, floor_in_time : float
        The reference uncertainty, and that of the references in time; 0 where it is not known.
    """

    title: str
    rows: list[Row]
    floor: float
    floor_in_time: float = 0.0

    @property
    def of_meshes(self) -> bool:
        """Whether it compares meshes, by a common limit."""
        return any(row.setting.mesh is not None for row in self.rows)


class Reference(NamedTuple):
    """The reference of a study.

    Attributes
    ----------
    outcome : Comparable
    names : tuple of str
        Backends and settings of the reference runs that are done.
    floor : dict of Error
        Difference of the two reference runs, by metric; empty if there is only one.
    """

    outcome: Comparable
    names: tuple[str, ...]
    floor: dict[str, Error]

    @property
    def uncertainty(self) -> float:
        """The largest relative difference of the two."""
        return max_relative_error(self.floor)


class WorkPrecision(NamedTuple):
    """The results of a study; if interrupted, of the settings run before.

    `time_reference` is the scenario's own mesh converged in time, in a study of meshes.
    """

    scenario: "Scenario"
    metrics: "tuple[Metric, ...]"
    reference: Reference | None
    rows: list[Row]
    status: str
    reason: str
    exit_code: int
    time_reference: Reference | None = None

    @property
    def of_meshes(self) -> bool:
        """Whether it compares meshes, by a common limit."""
        return any(row.setting.mesh is not None for row in self.rows)

    @property
    def floor(self) -> float:
        """The reference uncertainty: the largest relative difference of the reference runs."""
        return self.reference.uncertainty if self.reference else 0.0

    @property
    def diagram(self) -> Diagram:
        """What its picture shows."""
        title = self.scenario.title or self.scenario.kind
        in_time = self.time_reference.uncertainty if self.time_reference else 0.0
        return Diagram(title, self.rows, self.floor, in_time)

    def below_uncertainty(self, row: Row) -> list[str]:
        """Return the errors of a row that are below the reference uncertainty, by their names.

        They are not resolved: `error`, `time_error`, and measures.
        """
        floors = self.reference.floor if self.reference else {}
        in_time = self.time_reference.uncertainty if self.time_reference else 0.0
        found = [("error", row.error, self.floor), ("time_error", row.time_error, in_time)]
        found += [
            (n, row.errors[n].relative, e.relative) for n, e in floors.items() if n in row.errors
        ]
        return [name for name, error, floor in found if error is not None and error < floor]

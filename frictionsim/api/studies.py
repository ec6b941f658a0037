"""Work-precision studies from Python: error against run time."""

from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.result_base import Ending, ResultBase
from frictionsim.api.scenarios import with_overrides
from frictionsim.display import error_text, number_text, short_text
from frictionsim.document import Cell, Data, Document, Number, Table
from frictionsim.errors import InputError
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.options import as_path
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.work_precision.outcome import WorkPrecision
from frictionsim.work_precision.recommendation import recommendations
from frictionsim.work_precision.settings import MAX_WALL, REPEATS
from frictionsim.work_precision.settings import CostOptions as CostOptions
from frictionsim.work_precision.study import study
from frictionsim.work_precision.table import study_json, table_of

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.scenario.overrides import Overrides
    from frictionsim.work_precision.outcome import Row


def study_parts(study: WorkPrecision) -> Document:
    """Yield the reference uncertainty, the table and the recommendations of a study."""
    yield f"{study.title or study.kind}: error against run time ({study.status})"
    yield from _reference_lines(study)
    names = [metric.name for metric in study.metrics]
    mesh_headings, time_heading = (
        (["model", ">bodies"], [">in time"]) if study.of_meshes else ([], [])
    )
    headings = [
        *(*mesh_headings, "law", "method", "setting", ">error", *time_heading),
        *(f">{name}" for name in names),
        *(">events", ">wall time [s]", ">spread [s]", ">steps", ">rejected", ">evaluations"),
    ]
    rows = [_cells(study, row, names) for row in study.rows]
    if any(row.reason for row in study.rows):
        headings.append("reason")
        rows = [[*cells, row.reason] for cells, row in zip(rows, study.rows, strict=True)]
    yield Table(headings, rows)
    yield from (advice.sentence for advice in recommendations(study))


def _reference_lines(study: WorkPrecision) -> list[str]:
    reference = study.reference
    lines: list[str] = []
    if reference is not None and reference.names:
        lines.append(f"reference: {' and '.join(reference.names)}")
    if reference is not None and reference.floor:
        parts = ", ".join(f"{name} {error_text(e.relative)}" for name, e in reference.floor.items())
        lines.append(
            f"reference uncertainty: {error_text(study.floor)}, the difference of the references"
            f" ({parts}); smaller errors cannot be resolved"
        )
    elif reference is not None and len(reference.names) == 1:
        lines.append("reference uncertainty: unknown, the second reference failed")
    else:
        lines.append("reference uncertainty: unknown; errors may not be resolved so finely")
    if study.time_reference is not None:
        lines.append(
            f"`in time`: error against {' and '.join(study.time_reference.names)}, which differ by"
            f" {error_text(study.time_reference.uncertainty)}"
        )
    return [
        *lines,
        "errors are relative, `error` is the largest; * below the reference uncertainty; spread:"
        " largest minus least wall time of the repeats; evaluations: of the right-hand side",
    ]


def _cells(study: WorkPrecision, row: "Row", names: list[str]) -> list[Cell]:
    below, has_meshes = study.below_uncertainty(row), study.of_meshes

    def marked(name: str, error: float | None) -> Cell:
        if error is None:
            return error_text(error)
        return Number(error_text(error) + "*" * (name in below), error)

    mesh = row.setting.mesh
    spread = row.wall_spread
    return [
        *((mesh.model, str(mesh.bodies)) if mesh else ("", "") if has_meshes else ()),
        row.setting.law,
        row.setting.backend,
        row.setting.label,
        marked("error", row.error) or "failed",
        *((marked("time_error", row.time_error),) if has_meshes else ()),
        *(marked(n, row.errors[n].relative if n in row.errors else None) for n in names),
        _count(row.events),
        short_text(row.wall_seconds),
        "" if spread is None else number_text(spread, 2),
        _count(row.steps),
        _count(row.rejected),
        _count(row.rhs_evaluations),
    ]


def _count(count: int | None) -> str:
    """Return a count; an older file may lack it."""
    return "" if count is None else str(count)


class Study(ResultBase):
    """A work-precision study: errors and run times of a scenario for several settings.

    Attributes
    ----------
    data : frictionsim.work_precision.outcome.WorkPrecision
        Its rows, reference and metrics.
    """

    def __init__(self, data: WorkPrecision) -> None:
        self.data = data

    @property
    def _scenario(self) -> Scenario:
        assert self.data.scenario is not None, "a study that was just run has its scenario"
        return self.data.scenario

    @property
    def _ending(self) -> Ending:
        return Ending(self.data.status, self.data.reason, self.data.exit_code)

    @property
    def recommendations(self) -> list[str]:
        """The cheapest setting for each of several errors, in a sentence each."""
        return [advice.sentence for advice in recommendations(self.data)]

    @property
    def dataset(self) -> "xarray.Dataset":
        """The table along the dimension `row`: one row for each setting."""
        import xarray

        return xarray.Dataset(
            {
                name: ("row", values, {"long_name": words} | ({"units": unit} if unit else {}))
                for name, unit, words, values in table_of(self.data).columns.values()
            }
        )

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the table as CSV, with units in the header line; return its file.

        Raises
        ------
        InputError
            If the suffix is another one.
        OutputError
            If it cannot be written, or would replace a file of another kind.
        """
        from frictionsim.io.cost_table import write_csv

        target = as_path("path", path)
        if target.suffix != ".csv":
            raise InputError(f"{target}: expected a name that ends in .csv")
        write_csv(table_of(self.data), target)
        return target

    def plot(self, *, ax: "Axes | None" = None) -> "Figure":
        """Draw error against wall time and against evaluations of the right-hand side.

        Parameters
        ----------
        ax : Axes, optional
            Draw in the place of these axes, which are removed.
        """
        from frictionsim.plots.studies import cost_diagram

        return cost_diagram(self.data, ax=ax)

    def parts(self) -> Document:
        """Yield the reference uncertainty, the table and the recommendations, and their data."""
        yield from study_parts(self.data)
        yield Data(study_json(self.data, self._scenario))

    def __repr__(self) -> str:
        study, rows = self.data, len(self.data.rows)
        title = f" '{study.title}'" if study.title else ""
        return f"<frictionsim.Study {study.kind}{title}: {self.status}, {rows} settings>"


def cost(
    scenario: Scenario | ScenarioSource,
    overrides: "Overrides | None" = None,
    *,
    laws: str | Iterable[str] | None = None,
    backends: str | Iterable[str] | None = None,
    tolerances: float | Iterable[float] | None = None,
    max_wall: float = MAX_WALL,
    repeats: int = REPEATS,
    bodies: int | Iterable[int] | None = None,
    models: str | Iterable[str] | None = None,
    progress: Callable[[str], Any] | None = None,
) -> Study:
    """Measure error against run time for every friction law and method at several settings.

    A study of a belt also compares models and numbers of bodies.

    Parameters
    ----------
    scenario, overrides
        As for `solve`.
    laws, backends : str or iterable of str, optional
        Friction laws and methods to use; by default all that fit the scenario.
    tolerances : float or iterable of float, optional
        Relative tolerances of adaptive methods.
    max_wall : float, s
        Limit of the wall time of each run.
    repeats : int
        Maximum number of timed runs of each setting.
    bodies : int or iterable of int, optional
        Numbers of bodies of a belt; ``[]`` compares time steps only. By default from 0.4 to 4
        times the scenario's.
    models : str or iterable of str, optional
        Models of a belt: `string`, `corrected`, `polygon`; by default all.
    progress : callable, optional
        Called with the name of each setting.

    Raises
    ------
    InputError, ScenarioError
        If the scenario or an argument is not valid; before anything is run.
    SolverError
        If all reference runs fail.
    """
    options = CostOptions.among(locals())
    return cost_with(with_overrides(scenario, overrides), options)


def cost_with(scenario: Scenario, options: CostOptions, monitor: RunMonitor | None = None) -> Study:
    """Run a study of a scenario."""
    show = options.progress or (lambda name: None)
    limits = (options.max_wall, options.repeats)
    return Study(study(scenario, options.plan(scenario), *limits, monitor or RunMonitor(), show))

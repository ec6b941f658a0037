"""Work-precision studies from Python: error against run time."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.result import Outcome, ResultBase
from frictionsim.api.scenarios import with_overrides
from frictionsim.costs.study import MAX_WALL, REPEATS
from frictionsim.costs.study import CostOptions as CostOptions
from frictionsim.costs.study import study as study
from frictionsim.costs.study_table import recommended_lines, table_json
from frictionsim.display import error_text, number_text, short_text
from frictionsim.document import Cell, Data, Document, Number, Table
from frictionsim.io.cost_table import COUNTS, RELATIVE, CostTable
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.origin import Origin
from frictionsim.scenario.settings import Scenario

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.scenario.overrides import Overrides


# Columns of the summary before the errors and behind them, and headings that are not their names.
SETTING = ("model", "bodies", "law", "backend", "setting")
FIRST = (*SETTING, "error", "time_error")
LAST = ("events", "wall_seconds", "wall_spread", "steps", "rejected", "rhs_evaluations")
HEADINGS = {name: name for name in ("model", "bodies", "law", "setting")} | {
    "backend": "method",
    "time_error": ">in time",
    "wall_seconds": ">wall time [s]",
    "wall_spread": ">spread [s]",
    "rhs_evaluations": ">evaluations",
}


def study_parts(table: CostTable) -> Document:
    """Yield the reference uncertainty, the table and the recommendations of a study."""
    yield f"{table.title or table.kind}: error against run time ({table.status})"
    if table.overrides:
        yield f"set: {table.overrides}"
    yield from _reference_lines(table)
    relative = [name + RELATIVE for name in table.measures]
    names = [name for name in (*FIRST, *relative, *LAST) if name in table.columns]
    headings = [HEADINGS.get(name, f">{name.removesuffix(RELATIVE)}") for name in names]
    yield Table(headings, [[_cell(row, name) for name in names] for row in table.rows])
    for row in table.rows:
        if row.get("reason"):
            setting = [str(_cell(row, name)) for name in SETTING if name in table.columns]
            yield f"{', '.join(filter(None, setting))}: {row['reason']}"
    yield from recommended_lines(table)


def _reference_lines(table: CostTable) -> Iterator[str]:
    if table.references:
        yield f"reference: {' and '.join(table.references)}"
    if table.uncertainty:
        each = ", ".join(
            f"{name} {error_text(e.relative)}" for name, e in table.uncertainty.items()
        )
        yield (
            f"reference uncertainty: {error_text(table.floor)}, the difference of the references"
            f" ({each}); smaller errors cannot be resolved"
        )
    elif len(table.references) == 1:
        yield "reference uncertainty: unknown, the second reference failed"
    else:
        yield "reference uncertainty: unknown; errors may not be resolved so finely"
    if table.time_references:
        greatest = table.time_uncertainty
        differ = "" if greatest is None else f", which differ by {error_text(greatest)}"
        yield f"`in time`: error against {' and '.join(table.time_references)}{differ}"
    yield (
        "errors are relative, `error` is the largest; * below the reference uncertainty; spread:"
        " largest minus least wall time of the repeats; evaluations: of the right-hand side"
    )


def _cell(row: dict[str, Any], name: str) -> Cell:
    """Return the text of a value in a column of the table; of an error with its star."""
    value = row[name]
    if isinstance(value, str):
        return value
    if value != value:
        return "failed" if name == "error" else ""
    if name in ("error", "time_error") or name.endswith(RELATIVE):
        below = row.get("below_uncertainty", "").split()
        return Number(error_text(value) + "*" * (name.removesuffix(RELATIVE) in below), value)
    if name in COUNTS:
        return f"{value:.0f}"
    return number_text(value, 2) if name == "wall_spread" else short_text(value)


class Study(ResultBase):
    """A work-precision study: errors and run times of a scenario for several settings.

    Attributes
    ----------
    table : CostTable
        Its columns, with a row for each setting, and its references.
    origin : Origin
        The scenario's file and overrides.
    """

    def __init__(self, origin: Origin, table: CostTable, exit_code: int) -> None:
        self.table, self.origin = table, origin
        self._exit_code = exit_code

    @property
    def _outcome(self) -> Outcome:
        return Outcome(self.table.status, self.table.reason, self._exit_code)

    @property
    def recommendations(self) -> list[str]:
        """The cheapest setting for 1 %, 0.1 % and 0.01 %; one sentence where it is the same."""
        return recommended_lines(self.table)

    @property
    def dataset(self) -> "xarray.Dataset":
        """The table along the dimension `row`: one row for each setting."""
        import xarray

        values = {name: [row[name] for row in self.table.rows] for name in self.table.columns}
        return xarray.Dataset(
            {
                name: ("row", values[name], {"long_name": words} | ({"units": u} if u else {}))
                for name, (u, words) in self.table.columns.items()
            }
        )

    @property
    def _writers(self) -> Mapping[str, Callable[[Path], Path]]:
        return {".csv": self.save_csv}

    def save_csv(self, path: str | PathLike[str]) -> Path:
        """Write the table as CSV, with units in the header line; return its file."""
        from frictionsim.io.cost_table import write_csv

        target = as_path("path", path)
        write_csv(self.table, target)
        return target

    def plot(self, *, figure: "Figure | SubFigure | None" = None) -> "Figure":
        """Draw error against wall time and against evaluations of the right-hand side.

        Of a study of meshes both panels are over wall time: the error, and that in time alone.

        Parameters
        ----------
        figure : Figure or SubFigure, optional
            An empty one that is drawn into.
        """
        from frictionsim.plots.studies import cost_diagram

        return cost_diagram(self.table, figure=figure)

    def _parts(self) -> Document:
        """Yield the reference uncertainty, the table and the recommendations, and their data."""
        yield from study_parts(self.table)
        scenario = {"scenario": self.origin.source, "overrides": self.origin.values}
        yield Data(scenario | table_json(self.table))

    def __repr__(self) -> str:
        table, settings = self.table, len(self.table.rows)
        title = f" '{table.title}'" if table.title else ""
        return f"<frictionsim.Study {table.kind}{title}: {self.status}, {settings} settings>"


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
        times the scenario's, up to 600 or, if that is more, its own.
    models : str or iterable of str, optional
        Models of a belt: `string`, `corrected`, `polygon`; by default all.
    progress : callable, optional
        Called with a text before the references and each setting: ``"2 of 9: rkf45, rtol 1e-5"``.

    Raises
    ------
    InputError, ScenarioError
        If the scenario or an argument is not valid; before anything is run.
    SolverError
        If all reference runs fail.
    """
    options = CostOptions.among(locals())
    loaded = with_overrides(scenario, overrides)
    return Study(loaded.origin, *study(loaded, options))

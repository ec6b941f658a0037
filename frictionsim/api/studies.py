"""Work-precision studies from Python: what accuracy costs in time."""

from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from frictionsim.api.arguments import as_number, as_path, check_keywords
from frictionsim.api.statics import with_overrides
from frictionsim.api.study_plan import Choice, Meshes, plan_of
from frictionsim.errors import ArgumentError, InputError
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.settings import Scenario
from frictionsim.work_precision import outcome
from frictionsim.work_precision import study as work_precision
from frictionsim.work_precision.recommendation import recommendations
from frictionsim.work_precision.report import attributes, columns, study_json, write_csv

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.scenario.overrides import Overrides

CSV, HDF5 = ".csv", (".h5", ".hdf5", ".nc")


class Study:
    """A work-precision study: errors and run times of a scenario for several settings.

    Attributes
    ----------
    data : frictionsim.work_precision.outcome.Study
        Its rows, reference and metrics.
    """

    def __init__(self, data: outcome.Study) -> None:
        self.data = data

    @property
    def status(self) -> str:
        """`done` or `interrupted`."""
        return self.data.status

    @property
    def reason(self) -> str:
        """Why it stopped; empty if done."""
        return self.data.reason

    @property
    def exit_code(self) -> int:
        """The exit code of the command line for this study."""
        return self.data.exit_code

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
                for name, unit, words, values in columns(self.data)
            }
        )

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the table as HDF5 or CSV, by the suffix of the path.

        Raises
        ------
        InputError
            If the suffix is another one.
        OutputError
            If it cannot be written.
        """
        target = as_path("path", path)
        if target.suffix == CSV:
            self.save_csv(target)
        elif target.suffix in HDF5:
            self.save_hdf5(target)
        else:
            raise InputError(f"{target}: expected a name that ends in {', '.join(HDF5)} or {CSV}")
        return target

    def save_csv(self, path: Path) -> None:
        """Write the table as CSV, with units in the header line."""
        write_csv(self.data, path)

    def save_hdf5(self, path: Path) -> None:
        """Write the table as HDF5, see `frictionsim.io.hdf5_writer.write_table`."""
        from frictionsim.io.hdf5_writer import write_table

        write_table(self.data.scenario, columns(self.data), attributes(self.data), path)

    def plot(self, *, ax: "Axes | None" = None) -> "Figure":
        """Draw error against wall time and against evaluations of the right-hand side.

        Parameters
        ----------
        ax : Axes, optional
            Draw in the place of these axes, which are removed.
        """
        from frictionsim.plots.work_precision import diagram

        return diagram(self.data, ax=ax)

    def summary(self) -> str:
        """Return the table as text, as the command line prints it."""
        from frictionsim.api.study_table import study_parts
        from frictionsim.api.tables import as_text

        return as_text(study_parts(self.data))

    def to_json(self) -> dict[str, Any]:
        """Return the table as plain data, as the command line prints it with --json."""
        return study_json(self.data, self.data.scenario.origin.source)

    def __repr__(self) -> str:
        scenario, rows = self.data.scenario, len(self.data.rows)
        title = f" '{scenario.title}'" if scenario.title else ""
        return f"<frictionsim.Study {scenario.kind}{title}: {self.status}, {rows} settings>"

    def _repr_html_(self) -> str:
        from frictionsim.api.study_table import study_parts
        from frictionsim.api.tables import as_html

        return as_html(study_parts(self.data))


def cost(
    scenario: Scenario | ScenarioSource,
    overrides: "Overrides | None" = None,
    *,
    laws: str | Iterable[str] | None = None,
    backends: str | Iterable[str] | None = None,
    tolerances: float | Iterable[float] | None = None,
    max_wall: float = 5.0,
    repeats: int = 3,
    progress: "Progress | Callable[[str], Any] | None" = None,
    **meshes: Unpack[Meshes],
) -> Study:
    """Measure error against run time for every friction law and method at several settings.

    Of a belt, for several models and numbers of bodies, too.

    Parameters
    ----------
    scenario, overrides
        As of `solve`.
    laws, backends : str or iterable of str, optional
        Friction laws and methods to use; by default all that apply.
    tolerances : float or iterable of float, optional
        Relative tolerances of adaptive methods.
    max_wall : float, s
        Limit of the wall time of each run.
    repeats : int
        Maximum number of timed runs of each setting.
    progress : callable or Progress, optional
        Is called with the name of each setting; a `Progress` is told each step as well.
    **meshes
        Of belts only. `bodies`, int or iterable of int: numbers of bodies to compare; none, `[]`,
        for a study over time alone. `models`, str or iterable of str: of `string`, `corrected` and
        `polygon`. By default all models, and from 0.4 to 4 times the scenario's bodies.

    Raises
    ------
    InputError, ScenarioError
        If the scenario or an argument is not valid; before anything is run.
    SolverError
        If all reference runs fail.
    TypeError
        If there is no such argument.
    """
    check_keywords(cost, meshes, Meshes)
    if as_number("max_wall", max_wall, "s") == float("inf"):
        raise ArgumentError("max_wall", "expected a number above 0 s, got inf")
    if not isinstance(repeats, int) or repeats < 1:
        raise ArgumentError("repeats", f"expected a number of at least 1, got {repeats!r}")
    told = _progress(progress)
    loaded = with_overrides(scenario, overrides)
    wanted = Choice(laws, backends, tolerances, **meshes)
    return Study(
        work_precision.study(
            loaded, plan_of(loaded, wanted), max_wall, repeats, told.on_step, told.on_setting
        )
    )


class Progress:
    """What a study tells: each step of a run, s, and the name of each setting."""

    def __init__(
        self,
        on_step: Callable[[float], Any] = lambda t: None,
        on_setting: Callable[[str], Any] = lambda name: None,
    ) -> None:
        self.on_step, self.on_setting = on_step, on_setting


def _progress(given: Progress | Callable[[str], Any] | None) -> Progress:
    if given is None or isinstance(given, Progress):
        return given or Progress()
    if not callable(given):
        raise ArgumentError(
            "progress", f"expected a function of the name of a setting, got {given!r}"
        )
    return Progress(on_setting=given)

"""Sweeps from Python: a scenario at many combinations of values."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from frictionsim.api.arguments import as_path
from frictionsim.api.statics import with_overrides
from frictionsim.errors import ArgumentError
from frictionsim.io.sweep_table import RUN, STATUS, TEXTS, Coordinate, SweepTable
from frictionsim.parameter_study.design import Sampling
from frictionsim.parameter_study.in_process import InProcess
from frictionsim.parameter_study.study_file import (
    Study,
    is_study,
    study_of,
    study_toml,
)
from frictionsim.parameter_study.sweep import Assembly, plan_of, run_sweep
from frictionsim.parameter_study.values import values_of
from frictionsim.scenario.loading import ScenarioSource
from frictionsim.scenario.settings import Scenario

if TYPE_CHECKING:
    import xarray

    from frictionsim.scenario.overrides import Overrides


class SweepOptions(TypedDict, total=False):
    """The options of `sweep` by name."""

    zip: bool
    sample: int | None
    method: str
    seed: int
    indices: bool
    output: str | PathLike[str] | None
    no_clobber: bool


def sweep(
    scenario: Scenario | ScenarioSource,
    vary: Mapping[str, Any] | None = None,
    overrides: "Overrides | None" = None,
    **options: Unpack[SweepOptions],
) -> "xarray.Dataset":
    """Run a scenario for many combinations of values.

    Parameters
    ----------
    scenario : Scenario, path or mapping
        As of `solve`; or a study, whose tables are [study], [set] and [vary].
    vary : mapping of str
        By key as of `solve`'s overrides: a list or array of values, or text as
        ``"lin(0.1, 0.4, 4)"``, ``"log(1, 100, 5)"``; with `sample` distributions, as
        ``"uniform(0.1, 0.4)"``, ``"normal(2224, 50)"``. Without `zip` and `sample`, all
        combinations are run.
    overrides : mapping or iterable of str, optional
        What is the same in all runs, as of `solve`.
    **options
        `zip` : vary the keys together: the first values of all, then the second ones.
        `sample` : number of runs of a sample; `method` is sobol, lhs or random, `seed` a whole
        number. `indices` : run the combinations that Sobol indices need, sample (keys + 2) runs.
        `output` : file to write to. `no_clobber` : do not replace an existing file.

    Returns
    -------
    xarray.Dataset
        The varied keys are coordinates, each quantity of the summary is an array with its unit;
        `status`, `failure`, `reason` and `warnings` are beside them.

    Raises
    ------
    InputError, ScenarioError
        If an argument or a combination is not valid; before anything is run.
    OutputError
        If the file cannot be written.
    """
    output = options.get("output")
    path = None if output is None else as_path("output", output)
    study = _study(scenario, vary, overrides, options)
    plan = plan_of(study.scenario, study.vary, study.together, study.sampling)
    execution, assembly = InProcess(), Assembly(plan.design.runs)
    execution.check(plan, _nothing)
    run_sweep(plan, assembly, execution, _nothing)
    table = assembly.table(plan, study_toml(study))
    if path is not None:
        from frictionsim.io.sweep_file import write_sweep

        write_sweep(table, path)
    return dataset_of(table)


def open_sweep(path: str | PathLike[str]) -> "xarray.Dataset":
    """Read the file of a sweep.

    Parameters
    ----------
    path : path

    Returns
    -------
    xarray.Dataset
        As `sweep` returned it. The data are read at once; the file is closed.

    Raises
    ------
    InputError
        If it does not exist or is not a sweep.
    """
    from frictionsim.io.hdf5_reader import read_sweep

    return dataset_of(read_sweep(as_path("path", path)))


def _study(
    scenario: Scenario | ScenarioSource,
    vary: Mapping[str, Any] | None,
    overrides: "Overrides | None",
    options: SweepOptions,
) -> Study:
    """Return the study that arguments describe."""
    if isinstance(scenario, Mapping) and is_study(scenario):
        return study_of(scenario, Path(), "study")
    loaded = with_overrides(scenario, overrides)
    if vary is not None and not isinstance(vary, Mapping):
        raise ArgumentError("vary", f"expected values by key, got {type(vary).__name__}")
    values = {str(key): values_of(str(key), given) for key, given in (vary or {}).items()}
    sampling, count = None, options.get("sample")
    if count is not None:
        sampling = Sampling(
            count,
            options.get("method", "sobol"),
            options.get("seed", 0),
            options.get("indices", False),
        )
    return Study(loaded, values, options.get("zip", False), sampling)


def _nothing(*_: Any) -> None:
    pass


def dataset_of(table: SweepTable) -> "xarray.Dataset":
    """Return a sweep as a dataset, with the data and attributes of its file."""
    import xarray

    dimensions, shape = tuple(table.dimensions), table.shape
    coordinates: dict[str, Any] = {
        key: (coordinate.dimension, _values(coordinate), _attributes(coordinate))
        for key, coordinate in table.coordinates.items()
    }
    if RUN in table.dimensions:
        of_run = {"units": "1", "long_name": "number of the run, from 0"}
        coordinates[RUN] = (RUN, np.arange(table.runs), of_run)
    variables: dict[str, Any] = {
        name: (
            dimensions,
            values.reshape(shape),
            {"units": table.units[name], "long_name": name.replace("_", " ")},
        )
        for name, values in table.values.items()
    }
    numbers, meanings = zip(*table.statuses, strict=True)
    variables[STATUS] = (
        dimensions,
        table.status.reshape(shape),
        {
            "units": "1",
            "long_name": "outcome of the run",
            "flag_values": list(numbers),
            "flag_meanings": " ".join(meanings),
        },
    )
    for name, words in TEXTS.items():
        variables[name] = (dimensions, table.text_array(name), {"long_name": words})
    return xarray.Dataset(variables, coordinates, dict(table.attributes))


def _values(coordinate: Coordinate) -> Any:
    values = coordinate.values
    return np.array(values, dtype=str) if isinstance(values, list) else values


def _attributes(coordinate: Coordinate) -> dict[str, str]:
    words = {"long_name": coordinate.long_name}
    return (
        words if isinstance(coordinate.values, list) else words | {"units": coordinate.unit or "1"}
    )

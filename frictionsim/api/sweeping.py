"""Sweeps from Python: a scenario at many combinations of values."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from frictionsim.api.arguments import as_path, check_keywords
from frictionsim.api.statics import with_overrides
from frictionsim.api.sweep_run import resume_study, run_study
from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.sweep_table import (
    RUN,
    STATUS,
    TEXTS,
    Coordinate,
    SweepTable,
)
from frictionsim.parameter_study.design import Sampling
from frictionsim.parameter_study.study_file import (
    Study,
    check_not_fixed,
    check_of_sample,
    is_study,
    study_of,
)
from frictionsim.parameter_study.values import values_by_key
from frictionsim.scenario.loading import ScenarioSource, read_toml
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.shipped import scenario_file

if TYPE_CHECKING:
    import xarray

    from frictionsim.api.sweep_run import OnProgress
    from frictionsim.scenario.overrides import Overrides

OF_STUDIES = ("zip", "sample", "method", "seed", "indices", "keep_series")


class SweepOptions(TypedDict, total=False):
    """The options of `sweep` by name."""

    zip: bool
    sample: int | None
    method: str
    seed: int
    indices: bool
    output: str | PathLike[str] | None
    no_clobber: bool
    keep_series: bool
    workers: int | None
    dask: str | None
    progress: "OnProgress | bool"


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
        ``"uniform(0.1, 0.4)"``, ``"normal(2224, 50)"``. Several keys with commas between them
        have one value. Without `zip` and `sample`, all combinations are run.
    overrides : mapping or iterable of str, optional
        What is the same in all runs, as of `solve`.
    **options
        `zip` : vary the keys together: the first values of all, then the second ones.
        `sample` : number of runs of a sample; `method` is sobol, lhs or random, `seed` a whole
        number. `indices` : run the combinations that Sobol indices need, sample (keys + 2) runs.
        `output` : file to write to. An incomplete sweep never replaces a complete one: it is
        written to NAME.partial.h5 then. Ctrl-C keeps what is done, for `resume_sweep`.
        `no_clobber` : do not replace an existing file. `keep_series` : keep the result of each run
        in the folder NAME.series beside the output.
        `workers` : number of processes, by default as many as there are cores. `dask` : address of
        a scheduler of Dask, as ``"tcp://host:8786"``, or ``"local:4"``.
        `progress` : True shows a bar on a terminal; a callable is called some times each second
        with how far the sweep is.

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
    TypeError
        If there is no such argument.
    """
    check_keywords(sweep, options, SweepOptions)
    output = options.get("output")
    path = None if output is None else as_path("output", output)
    with shown(options.get("progress", False)) as progress:
        done = run_study(
            study_from(scenario, vary, overrides, options),
            path,
            options.get("no_clobber", False),
            progress,
            options.get("workers"),
            options.get("dask"),
        )
    return dataset_of(done.table)


def resume_sweep(
    path: str | PathLike[str],
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    progress: "OnProgress | bool" = False,
) -> "xarray.Dataset":
    """Do the runs that are left of an interrupted sweep; the file is that of an uninterrupted one.

    Parameters
    ----------
    path : path
        The incomplete file of the sweep.
    output : path, optional
        File to write to when it is done; by default the file that is resumed, and NAME.h5 instead
        of NAME.partial.h5.
    no_clobber, workers, dask, progress
        As of `sweep`.

    Returns
    -------
    xarray.Dataset
        Of all runs, as `sweep` returns it.

    Raises
    ------
    InputError
        If the sweep cannot be resumed.
    OutputError
        If another process is running it, or the file cannot be written.
    """
    target = None if output is None else as_path("output", output)
    with shown(progress) as on_progress:
        done = resume_study(as_path("path", path), target, no_clobber, on_progress, workers, dask)
    return dataset_of(done.table)


def open_sweep(path: str | PathLike[str]) -> "xarray.Dataset":
    """Read the file of a sweep.

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


@contextmanager
def shown(progress: "OnProgress | bool") -> "Iterator[OnProgress | None]":
    """Return the context of a sweep that shows its progress as wanted."""
    if callable(progress):
        yield progress
    elif progress:
        from frictionsim.api.progress import SweepBar

        with SweepBar() as bar:
            yield bar
    else:
        yield None


def study_from(
    scenario: Scenario | ScenarioSource,
    vary: Mapping[str, Any] | None,
    overrides: "Overrides | None",
    options: SweepOptions,
) -> Study:
    """Return the study that arguments describe, as of `sweep`.

    Raises
    ------
    InputError, ScenarioError
    """
    written = _written_study(scenario)
    if written is not None:
        _check_alone(vary, overrides, options)
        return written
    loaded = with_overrides(scenario, overrides)
    if vary is not None and not isinstance(vary, Mapping):
        raise ArgumentError("vary", f"expected values by key, got {type(vary).__name__}")
    values = values_by_key((str(key), given) for key, given in (vary or {}).items())
    check_not_fixed(_keys(overrides), values)
    sampling, count = None, options.get("sample")
    if count is None:
        check_of_sample([name for name, value in options.items() if value not in (None, False)])
    else:
        sampling = Sampling(
            count,
            options.get("method", "sobol"),
            options.get("seed", 0),
            options.get("indices", False),
        )
    kept = options.get("keep_series", False)
    return Study(loaded, values, options.get("zip", False), sampling, kept)


def _keys(overrides: "Overrides | None") -> list[str]:
    """Return the keys of overrides."""
    if isinstance(overrides, Mapping):
        return list(map(str, overrides))
    return [text.partition("=")[0] for text in overrides or () if isinstance(text, str)]


def _written_study(source: Scenario | ScenarioSource) -> Study | None:
    """Return the study of a file or of tables; None if they are a scenario."""
    if isinstance(source, Mapping):
        return study_of(source, Path(), "study") if is_study(source) else None
    if isinstance(source, Scenario):
        return None
    path = scenario_file(as_path("scenario", source))
    data = read_toml(path)
    return study_of(data, path.parent, str(path)) if is_study(data) else None


def _check_alone(
    vary: Mapping[str, Any] | None, overrides: "Overrides | None", options: SweepOptions
) -> None:
    """Check that a study is not given in two places, of which neither would say what is run.

    Raises
    ------
    InputError
    """
    given = [
        name
        for name in OF_STUDIES
        if options.get(name) is not None and options.get(name) is not False
    ]
    if vary:
        given.insert(0, "vary")
    if overrides:
        given.insert(0, "set")
    if given:
        raise InputError(
            f"{given[0]}: this is a study already, which says what is varied; change it there"
        )


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
    of_sobol = {} if table.sobol is None else table.sobol.datasets
    for name, (along, values, words) in of_sobol.items():
        attributes = {"long_name": words} | ({} if isinstance(values, list) else {"units": "1"})
        (coordinates if name in along else variables)[name] = (along, values, attributes)
    return xarray.Dataset(variables, coordinates, dict(table.attributes))


def _values(coordinate: Coordinate) -> Any:
    values = coordinate.values
    return np.array(values, dtype=str) if isinstance(values, list) else values


def _attributes(coordinate: Coordinate) -> dict[str, str]:
    words = {"long_name": coordinate.long_name}
    return (
        words if isinstance(coordinate.values, list) else words | {"units": coordinate.unit or "1"}
    )

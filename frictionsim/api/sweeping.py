"""Sweeps from Python: a scenario at many combinations of values."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.statics import with_overrides
from frictionsim.api.sweep_result import Sweep
from frictionsim.api.sweep_run import ExecutionOptions, resume_study, run_study
from frictionsim.errors import ArgumentError, InputError
from frictionsim.parameter_study.design import METHODS as METHODS
from frictionsim.parameter_study.study_file import (
    SweepStudy,
    check_not_fixed,
    is_study,
    settings_of,
    study_of,
    study_with,
)
from frictionsim.parameter_study.values import values_by_key
from frictionsim.scenario.loading import ScenarioSource, read_toml
from frictionsim.scenario.options import as_path
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.shipped import scenario_file

if TYPE_CHECKING:
    from frictionsim.api.sweep_run import OnProgress
    from frictionsim.scenario.overrides import Overrides


def sweep(
    scenario: Scenario | ScenarioSource,
    vary: Mapping[str, Any] | Iterable[str] | None = None,
    overrides: "Overrides | None" = None,
    *,
    zip: bool = False,
    sample: int | None = None,
    method: str | None = None,
    seed: int | None = None,
    indices: bool = False,
    keep_series: bool = False,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    progress: "OnProgress | bool" = False,
) -> Sweep:
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
    zip : bool
        Vary the keys together: the first values of all, then the second ones.
    sample : int, optional
        Number of runs of a sample.
    method : str, optional
        Of the sample: sobol (default), lhs or random.
    seed : int, optional
        Of the sample, by default 0.
    indices : bool
        Run the combinations that Sobol indices need, sample (keys + 2) runs.
    keep_series : bool
        Keep the result of each run in the folder NAME.series beside the output.
    output : path, optional
        File to write to. An incomplete sweep never replaces a complete one: it is written to
        NAME.partial.h5 then. Ctrl-C keeps what is done, for `resume_sweep`.
    no_clobber : bool
        Do not replace an existing file.
    workers : int, optional
        Number of processes, by default as many as there are cores.
    dask : str, optional
        Address of a scheduler of Dask, as ``"tcp://host:8786"``, or ``"local:4"``.
    progress : bool or callable
        True shows a bar on a terminal; a callable is called some times each second with how far
        the sweep is.

    Returns
    -------
    Sweep
        What it comes to; `dataset` has the varied keys and the quantities.

    Raises
    ------
    InputError, ScenarioError
        If an argument or a combination is not valid; before anything is run.
    OutputError
        If the file cannot be written.
    """
    options = {
        "zip": zip, "sample": sample, "method": method, "seed": seed, "indices": indices,
        "keep_series": keep_series,
    }  # fmt: skip
    path = None if output is None else as_path("output", output)
    execution = ExecutionOptions.of(workers=workers, dask=dask)
    with shown(progress) as on_progress:
        study = study_from(scenario, vary, overrides, options)
        return run_study(study, path, no_clobber, on_progress, execution)


def resume_sweep(
    path: str | PathLike[str],
    *,
    output: str | PathLike[str] | None = None,
    no_clobber: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    progress: "OnProgress | bool" = False,
) -> Sweep:
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
    Sweep
        Of all runs, as `sweep` returns it.

    Raises
    ------
    InputError
        If the sweep cannot be resumed.
    OutputError
        If another process is running it, or the file cannot be written.
    """
    target = None if output is None else as_path("output", output)
    execution = ExecutionOptions.of(workers=workers, dask=dask)
    with shown(progress) as on_progress:
        return resume_study(as_path("path", path), target, no_clobber, on_progress, execution)


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
    vary: Mapping[str, Any] | Iterable[str] | None,
    overrides: "Overrides | None",
    options: Mapping[str, Any],
) -> SweepStudy:
    """Return the study that arguments describe, as of `sweep`.

    Parameters
    ----------
    options : mapping
        Of `StudySettings`; None and False are those that are not given.

    Raises
    ------
    InputError, ScenarioError
    """
    given = {
        name: value for name, value in options.items() if value is not None and value is not False
    }
    written = _written_study(scenario)
    if written is not None:
        _check_alone(vary, overrides, given)
        return written
    loaded = with_overrides(scenario, overrides)
    values = values_by_key(_varied(vary or {}))
    check_not_fixed(_keys(overrides), values)
    return study_with(loaded, values, settings_of(given))


def _varied(vary: Mapping[str, Any] | Iterable[str]) -> list[tuple[str, Any]]:
    """Return keys and their values, of a mapping or of texts KEY=VALUES."""
    if isinstance(vary, Mapping):
        return [(str(key), levels) for key, levels in vary.items()]
    if isinstance(vary, str) or not isinstance(vary, Iterable):
        raise ArgumentError("vary", f"expected values by key, got {type(vary).__name__}")
    values: dict[str, str] = {}
    for text in vary:
        key, sign, levels = str(text).partition("=")
        key = key.strip()
        if not sign or not key:
            raise ArgumentError("vary", f"expected KEY=VALUES, as a.b=[1, 2], got '{text}'")
        if key in values:
            raise ArgumentError("vary", f"{key} is given twice; give all its values in one list")
        values[key] = levels
    return list(values.items())


def _keys(overrides: "Overrides | None") -> list[str]:
    """Return the keys of overrides."""
    if isinstance(overrides, Mapping):
        return list(map(str, overrides))
    return [text.partition("=")[0] for text in overrides or () if isinstance(text, str)]


def _written_study(source: Scenario | ScenarioSource) -> SweepStudy | None:
    """Return the study of a file or of tables; None if they are a scenario."""
    if isinstance(source, Mapping):
        return study_of(source, Path(), "study") if is_study(source) else None
    if isinstance(source, Scenario):
        return None
    path = scenario_file(as_path("scenario", source))
    data = read_toml(path)
    return study_of(data, path.parent, str(path)) if is_study(data) else None


def _check_alone(
    vary: Mapping[str, Any] | Iterable[str] | None,
    overrides: "Overrides | None",
    options: Mapping[str, Any],
) -> None:
    """Check that a study is not given in two places, of which neither would say what is run.

    Raises
    ------
    InputError
    """
    given = [*(["set"] if overrides else []), *(["vary"] if vary else []), *options]
    if given:
        raise InputError(
            f"{given[0]}: this is a study already, which says what is varied; change it there"
        )

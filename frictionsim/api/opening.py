"""Results, sweeps and studies by their files, and what tells several results apart."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.result import Result, ResultBase
from frictionsim.display import short_names, study_text, with_unit
from frictionsim.errors import InputError
from frictionsim.results import Record
from frictionsim.scenario.arguments import as_path

if TYPE_CHECKING:
    from frictionsim.api.sweep_result import Sweep

MAX_KEYS = 2  # in a name; results that differ in more have the names of their files
UNNAMED = ("title", "$schema")
MAX_VALUE = 36  # characters of a key's value, of which two are beside each other in a line


def result_or_sweep(path: Path) -> "Result | Sweep":
    """Read a result file, the file of a sweep or an unfinished sweep.

    InputError is raised if it is neither the result of a run nor a sweep.
    """
    from frictionsim.io.names import existing_name
    from frictionsim.io.sweep_file import read_any

    path = existing_name(path)
    content = read_any(path)
    if isinstance(content, Record):
        return Result(content, path)
    from frictionsim.api.sweep_result import Sweep  # the result of a run needs none of it

    return Sweep(content, path)


def opened(source: Any, *kinds: type[ResultBase], argument: str = "result") -> Any:
    """Return what an argument is: one of some kinds, of a dataset its sweep, or what a file has."""
    if isinstance(source, kinds):
        return source
    if hasattr(source, "data_vars"):
        from frictionsim.api.dataset import sweep_table
        from frictionsim.api.sweep_result import Sweep

        return Sweep(sweep_table(source))
    return result_or_sweep(as_path(argument, source))


def file_to_resume(path: Path) -> tuple[Path, Result | None]:
    """Return the file of a run or a sweep to resume, and its run; None for a sweep.

    InputError is raised if there is none, or it is of neither.
    """
    from frictionsim.io.names import resumable_name
    from frictionsim.io.result_reader import is_unfinished_sweep

    file = resumable_name(path)
    content = None if is_unfinished_sweep(file) else result_or_sweep(file)
    return file, content if isinstance(content, Result) else None


def side_by_side(results: Sequence[Result]) -> str:
    """Return the tables of several results beside each other, as text."""
    from frictionsim.document import as_text
    from frictionsim.reports.run_tables import ReportedRun, differences, summary

    runs = [*map(ReportedRun, results, names_of(results))]
    return as_text([differences(runs, MAX_VALUE), *summary(runs)])


def files_of(results: Sequence[Any]) -> list[str]:
    """Return the paths of results as text; of one without a file its number."""
    return [str(one.path or f"result {number}") for number, one in enumerate(results, start=1)]


def results_of_one_kind(contents: "Sequence[Result | Sweep]") -> list[Result]:
    """Return results that are shown together.

    InputError is raised if one is a sweep, or of another kind than the first.
    """
    files, results = files_of(contents), list[Result]()
    for file, one in zip(files, contents, strict=True):
        if not isinstance(one, Result):
            raise InputError(
                f"{file}: a sweep is not shown beside results of runs; give it alone, or vary more"
                " keys in one sweep"
            )
        results.append(one)
        if one.kind != results[0].kind:
            raise InputError(
                f"cannot show results of different kinds together: {files[0]} is of kind"
                f" '{results[0].kind}', {file} of kind '{one.kind}'"
            )
    return results


def names_of(results: Sequence[Result]) -> list[str]:
    """Return a name for each result, such as "mu_s = 0.3"; that of its file if there is none.

    A single result has the empty one.
    """
    if len(results) == 1:
        return [""]
    names, files = _by_keys([result.record for result in results]), files_of(results)
    for candidates in (names, [Path(file).stem for file in files], files):
        if len(set(candidates)) == len(results):
            return candidates
    return [f"{name} ({number})" for number, name in enumerate(files, 1)]


def _by_keys(records: Sequence[Record]) -> list[str]:
    """Return the values of the keys that differ; an empty list if these are none or too many."""
    from frictionsim.scenario.kinds import unit_of
    from frictionsim.scenario.toml_data import differing_keys

    try:
        differing = differing_keys([record.attributes["scenario"] for record in records])
    except InputError:
        return []
    keys = [key for key in differing if key not in UNNAMED]
    if not 0 < len(keys) <= MAX_KEYS:
        return []
    kind = records[0].attributes["kind"]
    columns = [
        [f"{word} = {_text(value, unit_of(kind, key))}" for value in differing[key]]
        for key, word in zip(keys, short_names(keys), strict=True)
    ]
    return [", ".join(parts) for parts in zip(*columns, strict=True)]


def _text(value: Any, unit: str) -> str:
    from frictionsim.scenario.overrides import override_text

    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return with_unit(study_text(value), unit) if is_number else override_text(value)

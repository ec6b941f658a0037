"""What tells several results apart: the values of the keys in which they differ, or their files."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.display import short_names, study_text, with_unit
from frictionsim.errors import InputError
from frictionsim.scenario.kinds import unit_of
from frictionsim.scenario.toml_data import differing_keys

if TYPE_CHECKING:
    from frictionsim.results import Record

MAX_KEYS = 2  # in a name; results that differ in more have the names of their files
UNNAMED = ("title", "$schema")


def names_of(records: Sequence["Record"], files: Sequence[str]) -> list[str]:
    """Return a name for each result, such as "mu_s = 0.3"; that of its file if there is none.

    A single result has the empty one.

    Parameters
    ----------
    files : sequence of str
        The paths of their files, or other names.
    """
    if len(records) == 1:
        return [""]
    names = _by_keys(records)
    stems = [Path(file).stem for file in files]
    for candidates in (names, stems, files):
        if len(set(candidates)) == len(records):
            return list(candidates)
    return [f"{name} ({number})" for number, name in enumerate(files, 1)]


def files_of(paths: Sequence[Path | None]) -> list[str]:
    """Return the paths of results as text; of one without a file its number."""
    return [str(path or f"result {number}") for number, path in enumerate(paths, start=1)]


def _by_keys(records: Sequence["Record"]) -> list[str]:
    """Return the values of the keys that differ; an empty list if these are none or too many."""
    try:
        differing = differing_keys(records)
    except InputError:
        return []
    keys = [key for key in differing if key not in UNNAMED]
    if not 0 < len(keys) <= MAX_KEYS:
        return []
    units = [unit_of(records[0].attributes["kind"], key) for key in keys]
    words = short_names(keys)
    return [
        ", ".join(
            f"{word} = {_text(differing[key][i], unit)}"
            for key, word, unit in zip(keys, words, units, strict=True)
        )
        for i in range(len(records))
    ]


def _text(value: Any, unit: str) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value).lower() if isinstance(value, bool) else str(value)
    return with_unit(study_text(value), unit)

"""Names of results and sweeps: NAME.h5, and until it is done NAME.partial.h5, NAME.partial.runs."""

import logging
import os
from pathlib import Path

from frictionsim.errors import InputError, OutputError
from frictionsim.io.output_file import SUFFIXES, Kind, check_free

LOG = logging.getLogger(__name__)

PARTIAL, RUNS = ".partial", ".runs"


def partial_name(path: Path) -> Path:
    """Return the name of the unfinished result of a file: a.partial.h5 for a.h5."""
    if not path.name:  # a folder, which is refused
        return path
    return path.with_name(f"{path.stem}{PARTIAL}{path.suffix}")


def unfinished_sweep_name(path: Path) -> Path:
    """Return the name of the unfinished sweep of a file: a.partial.runs for a.h5."""
    if not path.name:
        return path
    return path.with_name(f"{path.stem}{PARTIAL}{RUNS}")


def whole_name(path: Path) -> Path:
    """Return the name of the complete result: a.h5 for a.partial.h5; other names are unchanged."""
    name = path.name.removesuffix(path.suffix)
    if path.suffix == PARTIAL:  # the complete file has no suffix
        return path.with_name(name)
    if name.endswith(PARTIAL) and name != PARTIAL:
        suffix = SUFFIXES[0] if path.suffix == RUNS else path.suffix
        return path.with_name(name.removesuffix(PARTIAL) + suffix)
    return path


def unfinished_beside(path: Path) -> str:
    """Return the end of a message that a result is done: the unfinished one next to it, if any."""
    for partial in (partial_name(path), unfinished_sweep_name(path)):
        if partial.is_file():
            return f"; 'frictionsim resume {partial}' continues the unfinished one"
    return ""


def is_same_file(path: Path | None, other: Path | None) -> bool:
    """Return whether two paths are those of one file."""
    return (
        path is not None and other is not None and os.path.realpath(path) == os.path.realpath(other)
    )


def check_names(whole: Path, partial: Path, resumed: Path | None, kind: Kind, new: bool) -> None:
    """Check the names of an output file and of its unfinished one.

    With `new` neither may exist, except the resumed file.
    """
    if whole_name(whole) != whole:
        raise OutputError(
            f"{whole}: cannot write the {kind.word}: such names are those of unfinished ones; give"
            f" {whole_name(whole).name}"
        )
    for path in (whole, partial):
        if new and not is_same_file(path, resumed):
            check_free(path, kind)


def warn_of_name(target: Path) -> None:
    """Warn, before a run, of an HDF5 file without a suffix of HDF5; that of CSV is refused."""
    if target.suffix.lower() == ".csv":
        name = target.with_suffix(SUFFIXES[0])
        raise InputError(
            f"{target}: a result is written as HDF5; give {name}, of which 'frictionsim show {name}"
            f" --csv -o {target}' writes CSV"
        )
    if target.suffix.lower() not in SUFFIXES:
        ends = " or ".join((", ".join(SUFFIXES[:-1]), SUFFIXES[-1]))
        text = "%s: the file is HDF5 whatever its name; names of HDF5 end in %s"
        LOG.warning(text, target, ends)


def existing_name(path: Path) -> Path:
    """Return the name of a result or sweep, or of the unfinished one if only that exists."""
    if os.path.lexists(path) or not path.name:
        return path
    for partial in (partial_name(path), unfinished_sweep_name(path)):
        if os.path.isfile(partial):
            text = "%s: there is no such file; the unfinished %s is taken"
            LOG.warning(text, path, partial)
            return partial
    return path


def resumable_name(path: Path) -> Path:
    """Return the name of a file to resume, as `existing_name` does.

    InputError is raised if there is none. It suggests no other file: that is of another run.
    """
    found = existing_name(path)
    if path.name and os.path.isdir(path.parent) and not os.path.lexists(found):
        whole = whole_name(path)
        names = whole.name, partial_name(whole).name, unfinished_sweep_name(whole).name
        raise InputError(
            f"{path}: there is nothing to resume: there is no {names[0]}, {names[1]} or {names[2]}."
            " A run that is killed before its first checkpoint, which it makes after 60 s"
            " (output.checkpoint), or a sweep before its first runs, leaves none; start it again"
        )
    return found

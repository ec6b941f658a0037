"""Names of results and sweeps: NAME.h5, and NAME.partial.h5 until it is done."""

import logging
import os
from pathlib import Path

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import SUFFIXES, check_no_clobber
from frictionsim.io.replaceable import Kind, check_no_link

LOG = logging.getLogger(__name__)

PARTIAL = ".partial"


def partial_name(path: Path) -> Path:
    """Return the name of the unfinished result of a file: a.partial.h5 for a.h5."""
    if not path.name:  # a folder, which is refused
        return path
    return path.with_name(f"{path.stem}{PARTIAL}{path.suffix}")


def whole_name(path: Path) -> Path:
    """Return the name of the complete result: a.h5 for a.partial.h5; other names are unchanged."""
    name = path.name.removesuffix(path.suffix)
    if path.suffix == PARTIAL:  # the complete file has no suffix
        return path.with_name(name)
    if name.endswith(PARTIAL) and name != PARTIAL:
        return path.with_name(name.removesuffix(PARTIAL) + path.suffix)
    return path


def whole_name_beside(resumed: Path, kind: Kind) -> Path:
    """Return the name of the complete result of a resumed file, for which no user gave a name.

    OutputError is raised if a link is at this name or at that of the unfinished result.
    """
    whole = whole_name(resumed)
    for path in {whole, partial_name(whole)} - {resumed}:
        check_no_link(path, kind)
    return whole


def unfinished_beside(path: Path) -> str:
    """Return the end of a message that a result is done: the unfinished one next to it, if any."""
    partial = partial_name(path)
    return f"; the unfinished {partial} can be resumed" if partial.is_file() else ""


def check_names(whole: Path, resumed: Path | None, no_clobber: bool) -> None:
    """Check the name of an output file and of its unfinished one.

    With `no_clobber` neither may exist, except the resumed file.
    """
    if whole_name(whole) != whole:
        raise OutputError(
            f"{whole}: cannot write the result: such names are those of unfinished results; give"
            f" {whole_name(whole).name}"
        )
    for path in (whole, partial_name(whole)):
        if no_clobber and path != resumed:
            check_no_clobber(path)


def warn_of_name(target: Path) -> None:
    """Warn, before a run, of an HDF5 file without a suffix of HDF5."""
    if target.suffix.lower() not in SUFFIXES:
        ends = " or ".join((", ".join(SUFFIXES[:-1]), SUFFIXES[-1]))
        text = "%s: the file is HDF5 whatever its name; names of HDF5 end in %s"
        LOG.warning(text, target, ends)


def existing_name(path: Path) -> Path:
    """Return the name of a result, or of the unfinished one if only that exists."""
    if os.path.lexists(path) or not path.name:
        return path
    partial = partial_name(path)
    if not os.path.isfile(partial):
        return path
    LOG.warning("%s: there is no such file; the unfinished %s is taken", path, partial)
    return partial


def resumable_name(path: Path) -> Path:
    """Return the name of a file to resume, as `existing_name` does.

    InputError is raised if there is none. It suggests no other file: that is of another run.
    """
    found = existing_name(path)
    if path.name and os.path.isdir(path.parent) and not os.path.lexists(found):
        whole = whole_name(path)
        raise InputError(
            f"{path}: there is nothing to resume: neither {partial_name(whole).name} nor"
            f" {whole.name} exists. A run that is killed leaves its last checkpoint only with"
            " output.checkpoint, the wall time between checkpoints in s (--set"
            " output.checkpoint=60.0); without one, solve its scenario again"
        )
    return found

"""Checks of output files: a new file, or an existing one of the same kind, may be written.

A result replaces a result, a sweep a sweep, a picture a picture, a report a report, a GIF a GIF, an
MP4 an MP4, a table of costs such a table, a sweep in CSV one in CSV, and Sobol indices in CSV such
indices. Any other file, such as a scenario, a text, or HDF5 of another program, is refused whatever
its name is. An empty file may be replaced by anything: programs that reserve names create such
files.

An HDF5 file is ours if it ends in the line with our checksum, even if the checksum does not match:
it is damaged, and its run should be repeated. A file without that line was written or changed by
another program. Other formats are recognised by their first bytes.
"""

import os
import re
from pathlib import Path
from typing import NamedTuple

from frictionsim.errors import InputError, OutputError
from frictionsim.io import checksum
from frictionsim.io.atomic_write import check_place
from frictionsim.results import HDF5_SIGNATURE

HEAD = 2**20  # bytes


class Kind(NamedTuple):
    """A kind of file that the program writes."""

    word: str
    described: str  # with its article, for messages
    begins: bytes  # a regular expression
    mark: bytes = b""  # start of the line with the checksum

    def recognises(self, path: Path) -> bool:
        """Return whether a file is of this kind."""
        with path.open("rb") as file:
            if not re.match(self.begins, file.read(HEAD), re.DOTALL):
                return False
            return not self.mark or checksum.mark_of(file) == self.mark

    def is_unsealed(self, path: Path) -> bool:
        """Return whether a file has this format but no checksum: another program wrote it."""
        with path.open("rb") as file:
            is_hdf5 = bool(self.mark) and re.match(self.begins, file.read(HEAD)) is not None
            return is_hdf5 and not checksum.mark_of(file)


HDF5 = re.escape(HDF5_SIGNATURE)
RESULT = Kind("result", "a result", HDF5, checksum.RESULT)
SWEEP = Kind("sweep", "a sweep", HDF5, checksum.SWEEP)
SEGMENT = Kind("segment", "a segment of a run", HDF5, checksum.SEGMENT)
COSTS_IN_HDF5 = Kind("table", "a table of costs", HDF5, checksum.COSTS)
COSTS = Kind("table", "a table of costs", rb"law,backend,setting,")
SWEEP_IN_CSV = Kind(
    "table", "a sweep in CSV", rb"run \[1\],[^\r\n]*,status,failure,reason,warnings\r?\n"
)
SOBOL_IN_CSV = Kind("table", "a table of Sobol indices in CSV", rb"quantity,key,sobol_first ")
PICTURE = Kind("picture", "a picture", rb"\x89PNG|%PDF|<svg|<\?xml.{,4000}<svg")
REPORT = Kind("report", "a report", rb'.{,4000}<meta name="generator" content="frictionsim"')
ANIMATIONS = {
    ".gif": Kind("animation", "a GIF", rb"GIF8[79]a"),
    ".mp4": Kind("animation", "an MP4", rb".{4}ftyp"),
}
"""By suffix."""


def files_of_sweep_in_csv(path: Path, with_indices: bool) -> dict[Path, Kind]:
    """Return the CSV files of a sweep: NAME.csv, and NAME.sobol.csv for indices."""
    files = {path: SWEEP_IN_CSV}
    return files | {path.with_suffix(".sobol.csv"): SOBOL_IN_CSV} if with_indices else files


def check_replaceable(path: Path, kind: Kind) -> None:
    """Check that an existing file is of the kind that will replace it.

    `atomic_write.check_place` checks folders and devices.
    """
    if not os.path.isfile(path) or not os.path.getsize(path):
        return
    try:
        if kind.recognises(path):
            return
        problem = f"is not {kind.described}"
        if kind.is_unsealed(path):
            problem = "was changed or made by another program (it has no checksum)"
        reason = f"the existing file {problem} and is not overwritten"
    except OSError as error:
        reason = f"the existing file cannot be read ({error.strerror}) and is not overwritten"
    raise OutputError(f"{path}: cannot write the {kind.word}: {reason}; give another name")


def check_target(path: Path, kind: Kind) -> None:
    """Check that a file can be written, before its content is computed."""
    check_replaceable(path, kind)
    check_place(path, kind.word)


def check_segment(path: Path) -> None:
    """Check that a segment may be written to a path."""
    check_no_link(path, SEGMENT)
    check_replaceable(path, SEGMENT)


def check_no_link(path: Path, kind: Kind) -> None:
    """Check that a file whose name another file determines is not written through a link."""
    if path.is_symlink():
        raise OutputError(
            f"{path}: cannot write the {kind.word}: this is a link; remove it, or give another name"
        )


def check_apart(paths: dict[str, Path]) -> None:
    """Check that the files of one command, by option, are distinct."""
    options: dict[str, str] = {}
    for option, path in paths.items():
        place = os.path.normcase(os.path.realpath(path))
        if place in options:
            raise InputError(
                f"{options[place]} and {option} would both be written to {path}; give two names"
            )
        options[place] = option

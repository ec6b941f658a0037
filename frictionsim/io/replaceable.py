"""What may be written to: a new file, or one of the kind that replaces it.

A result replaces a result, a sweep a sweep, a picture a picture, a report a report, a GIF a GIF, an
MP4 an MP4, a table of costs such a table, a sweep in CSV one in CSV, and Sobol indices in CSV such
indices. Any other file, as a scenario, a text, or HDF5 of another program, is refused whatever its
name is. An empty file may be replaced by anything: programs that make names for new files leave
such.

A file that bears the line with our checksum is ours, also where the checksum does not match: it is
a result that was damaged, and the run that made it should be run again. A file of HDF5 without that
line was written or changed by another program: it may hold what somebody has made of a result.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import check_place
from frictionsim.io.checksum import LENGTH, MARK
from frictionsim.results import HDF5_SIGNATURE

TABLE = b"law,backend,setting,"  # what the first line of a table of costs in CSV begins with
SWEEP_TABLE = b"run [1],", b",status,failure,reason,warnings\n"  # that of a sweep, and its end
SOBOL_TABLE = b"quantity,key,sobol_first "  # what that of Sobol indices begins with
MAX_LINE = 2**20  # bytes
PICTURES = (b"\x89PNG", b"%PDF", b"<svg")
XML, SVG = b"<?xml", b"<svg"
REPORT_MARK = b'<meta name="generator" content="frictionsim"'
GIF, MP4 = (b"GIF87a", b"GIF89a"), b"ftyp"  # the latter after the length of the first box
HEAD = 4096  # bytes, within which XML says that it is SVG


class Kind(NamedTuple):
    """A kind of file that the program writes.

    Attributes
    ----------
    word : str
    described : str
        With its article, for messages.
    recognises : callable
        Of a path: whether the file is one of this kind.
    """

    word: str
    described: str
    recognises: Callable[[Path], bool]


def _is_sealed(path: Path) -> bool:
    """Return whether a file is HDF5 with the line of our checksum."""
    with path.open("rb") as file:
        if file.read(len(HDF5_SIGNATURE)) != HDF5_SIGNATURE:
            return False
        file.seek(max(file.seek(0, os.SEEK_END) - LENGTH, 0))
        return file.read(LENGTH).startswith(MARK)


def _is_result(path: Path) -> bool:
    return _is_sealed(path) and not _is_table_of_hdf5(path) and not _is_sweep(path)


def _is_sweep(path: Path) -> bool:
    from frictionsim.io.hdf5_reader import is_sweep

    return _is_sealed(path) and is_sweep(path)


def _is_table_of_hdf5(path: Path) -> bool:
    from frictionsim.io.hdf5_reader import is_table

    return _is_sealed(path) and is_table(path)


def _is_picture(path: Path) -> bool:
    with path.open("rb") as file:
        head = file.read(HEAD)
    return head.startswith(PICTURES) or (head.startswith(XML) and SVG in head)


def _is_table(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(TABLE)) == TABLE


def _is_sobol_in_csv(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(SOBOL_TABLE)) == SOBOL_TABLE


def _is_sweep_in_csv(path: Path) -> bool:
    with path.open("rb") as file:
        line = file.readline(MAX_LINE)
    begin, end = SWEEP_TABLE
    return line.startswith(begin) and line.replace(b"\r\n", b"\n").endswith(end)


def _is_report(path: Path) -> bool:
    with path.open("rb") as file:
        return REPORT_MARK in file.read(HEAD)


def _is_gif(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(GIF[0])) in GIF


def _is_mp4(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(8)[4:] == MP4


RESULT = Kind("result", "a result", _is_result)
PICTURE = Kind("picture", "a picture", _is_picture)
COSTS_IN_HDF5 = Kind("table", "a table of costs", _is_table_of_hdf5)
SWEEP = Kind("sweep", "a sweep", _is_sweep)
COSTS = Kind("table", "a table of costs", _is_table)
SWEEP_IN_CSV = Kind("table", "a sweep in CSV", _is_sweep_in_csv)
SOBOL_IN_CSV = Kind("table", "a table of Sobol indices in CSV", _is_sobol_in_csv)
REPORT = Kind("report", "a report", _is_report)
ANIMATIONS = {
    ".gif": Kind("animation", "a GIF", _is_gif),
    ".mp4": Kind("animation", "an MP4", _is_mp4),
}
"""By suffix."""


def files_of_sweep_in_csv(path: Path, with_indices: bool) -> dict[Path, Kind]:
    """Return the files in CSV that a sweep is written to: NAME.csv, and NAME.sobol.csv of indices.

    Parameters
    ----------
    path : Path
        Of the table of the runs.
    with_indices : bool
        Whether it is a sample with Sobol indices.
    """
    found = {path: SWEEP_IN_CSV}
    return found | {path.with_suffix(".sobol.csv"): SOBOL_IN_CSV} if with_indices else found


def check_replaceable(path: Path, kind: Kind) -> None:
    """Check that an existing file is of the kind that will replace it.

    Parameters
    ----------
    path : Path
        What is no file is left to `atomic_write.check_place`.
    kind : Kind
    """
    if not os.path.isfile(path) or not os.path.getsize(path):
        return
    try:
        if kind.recognises(path):
            return
        reason = f"the existing file is not {kind.described} and is not overwritten"
    except OSError as error:
        reason = f"the existing file cannot be read ({error.strerror}) and is not overwritten"
    raise OutputError(f"{path}: cannot write the {kind.word}: {reason}; give another name")


def check_target(path: Path, kind: Kind) -> None:
    """Check that a file can be written, before what it will hold is computed."""
    check_replaceable(path, kind)
    check_place(path, kind.word)


def check_apart(paths: dict[str, Path]) -> None:
    """Check that no two files of one command are the same.

    Parameters
    ----------
    paths : dict of Path
        By the option that gives them.
    """
    found: dict[str, str] = {}
    for option, path in paths.items():
        place = os.path.normcase(os.path.realpath(path))
        if place in found:
            raise InputError(
                f"{found[place]} and {option} would both be written to {path}; give two names"
            )
        found[place] = option

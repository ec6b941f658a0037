"""The files of a sweep: an incomplete one never replaces a complete one.

While a sweep runs, its file is an incomplete one without the newest runs, which are in the journal
beside it. It is that of the target, or FILE.partial.h5 if there is a complete FILE.h5 already.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_reader
from frictionsim.io.atomic_write import check_no_clobber
from frictionsim.io.destination import partial_name, whole_name
from frictionsim.io.replaceable import SWEEP, check_target
from frictionsim.io.segment_file import open_regular
from frictionsim.io.sweep_file import write_sweep
from frictionsim.parameter_study.journal import Journal, journal_name, remove_left_over

if TYPE_CHECKING:
    from frictionsim.io.sweep_table import SweepTable
    from frictionsim.parameter_study.block import Block
    from frictionsim.parameter_study.sweep import Assembly

SERIES, STUDY = ".series", "study.toml"


class SweepFiles:
    """The file that a sweep writes to, and those that it needs until it is whole.

    Parameters
    ----------
    whole : Path
    resumed : Path, optional
        The incomplete file of the sweep that goes on.

    Attributes
    ----------
    place : Path
        Of the incomplete file.
    """

    def __init__(self, whole: Path, resumed: Path | None = None) -> None:
        self.whole, self._resumed = whole, resumed
        self.place = _place_of(whole) if resumed is None else resumed
        self._journal: Journal | None = None

    def check(self, no_clobber: bool = False) -> None:
        """Check that the files can be written."""
        if no_clobber and self.whole != self._resumed:
            check_no_clobber(self.whole)
        for path in {self.whole, self.place}:
            check_target(path, SWEEP)
        if self._resumed is None:
            self._check_nothing_is_lost()

    def _check_nothing_is_lost(self) -> None:
        """Check that no interrupted sweep with runs that are done would be replaced."""
        place = self.place
        if not (place.is_file() and place.stat().st_size and hdf5_reader.is_sweep(place)):
            return
        journal = Journal(place)  # raises if a process is running it
        try:
            begun = journal.has_runs or bool(hdf5_reader.read_sweep(place).status.any())
        except InputError:  # it is damaged
            return
        finally:
            journal.close(remove=False)
        if begun:
            raise OutputError(
                f"{place}: this is an interrupted sweep, of which runs are done:"
                f" 'frictionsim resume {place}' goes on with it; give another name, or remove it"
            )

    def lock(self) -> None:
        """Have no other process write this sweep."""
        self._journal = Journal(self.place)

    def take_up(self, assembly: "Assembly", table: "SweepTable") -> None:
        """Add what file and journal have."""
        assert self._journal is not None
        try:
            assembly.take_up(table)
            for block in self._journal.blocks(digest_of(table)):
                assembly.add(block)
        except (ValueError, KeyError, TypeError):
            raise InputError(f"{self.place}: cannot resume this sweep: it is damaged") from None

    def begin(self, table: "SweepTable") -> None:
        """Write the incomplete file, and begin the journal."""
        if self._journal is None:
            self.lock()
        assert self._journal is not None
        digest = digest_of(table)
        if self._resumed is None:
            # The runs of an earlier sweep, if there are any, are not those of the file any more.
            try:
                self._journal.start(digest)
                write_sweep(table, self.place)
            except BaseException:
                self._journal.close(remove=True)
                raise
        else:
            write_sweep(table, self.place)
            self._journal.start(digest)

    def keep(self, block: "Block") -> None:
        """Keep a block."""
        assert self._journal is not None
        self._journal.append(block)

    @contextmanager
    def resumable(self) -> Iterator[None]:
        """Return the context in which a message of what cannot be written says how to go on."""
        try:
            yield
        except OutputError as error:
            raise OutputError(
                f"{error}. The runs that are done are kept in {self.place} and"
                f" {journal_name(self.place).name} beside it: make space, then"
                f" 'frictionsim resume {self.place}' continues the sweep"
            ) from None

    def write_incomplete(self, table: "SweepTable") -> None:
        """Write what is done of a sweep that was stopped."""
        assert self._journal is not None
        write_sweep(table, self.place)
        self._journal.close(remove=True)

    def write_whole(self, table: "SweepTable") -> None:
        """Write the file of a sweep that is done, and remove all others."""
        assert self._journal is not None
        write_sweep(table, self.whole)
        if self.place != self.whole and whole_name(self.place) == self.whole:
            self.place.unlink(missing_ok=True)
        self._journal.close(remove=True)
        remove_left_over(self.whole)

    def close(self, remove: bool = False) -> None:
        """Give the lock up; what is in the journal is kept, unless nothing is."""
        if self._journal is not None:
            self._journal.close(remove=remove)


def check_same_study(whole: Path, table: "SweepTable", resumed: Path) -> None:
    """Check that an existing file is of the study whose sweep will replace it."""
    if whole == resumed or not (whole.is_file() and whole.stat().st_size):
        return
    try:
        if hdf5_reader.read_sweep(whole).attributes["study"] == table.attributes["study"]:
            return
        found = "is of another study"
    except InputError:
        found = "cannot be read as a sweep"
    raise OutputError(
        f"{whole}: the existing file {found} and is not replaced by that of {resumed}; give the"
        f" sweep another name with -o, or {whole} if it is to be replaced"
    )


def series_folder(whole: Path) -> Path:
    """Return the folder for the results of the runs: a.series for a.h5."""
    return whole.with_name(whole.stem + SERIES)


def check_series_folder(folder: Path, study: str) -> None:
    """Check that a folder can take the results of a study's runs."""
    if os.path.lexists(folder) and not _is_of_study(folder, study):
        raise OutputError(
            f"{folder}: the results of the runs would be written here, and it is not a folder of"
            " the same study; move it, or give another name with -o"
        )


def check_is_series_folder(folder: Path, study: str) -> None:
    """Check that an interrupted sweep has the results of its runs beside it.

    A file that someone else made does not have folders written without them.
    """
    if not _is_of_study(folder, study):
        raise InputError(
            f"{folder}: the sweep keeps the results of its runs, and this is not the folder with"
            " them; put it back beside the sweep, or run the study again"
        )


def _is_of_study(folder: Path, study: str) -> bool:
    """Return whether a folder has the results of a study's runs."""
    try:
        if (folder / STUDY).stat().st_size > len(study.encode()):
            return False
        with open_regular(folder / STUDY) as file:
            return bool(file.read() == study.encode())
    except OSError:
        return False


def make_series_folder(folder: Path, study: str) -> None:
    """Make the folder for the results of a study's runs, and say in it whose they are."""
    try:
        folder.mkdir(exist_ok=True)
        (folder / STUDY).write_bytes(study.encode())
    except OSError as error:
        raise OutputError(f"{folder}: cannot make this folder: {error.strerror}") from None


def _place_of(whole: Path) -> Path:
    place = whole
    while hdf5_reader.may_be_done(place):
        place = partial_name(place)
    return place


def digest_of(table: "SweepTable") -> bytes:
    """Return the identity of a sweep in its journal: study, version and the values of the keys."""
    found = sha256()
    for name in ("frictionsim_version", "study", "overrides"):
        found.update(table.attributes[name].encode() + b"\0")
    for key, coordinate in table.coordinates.items():
        values = coordinate.values
        found.update(key.encode() + b"\0")
        found.update(repr(values).encode() if isinstance(values, list) else values.tobytes())
    return found.digest()

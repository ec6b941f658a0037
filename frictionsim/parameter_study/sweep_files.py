"""The files of a sweep: NAME.h5 when it is done, until then NAME.partial.h5 and its journal.

While a sweep runs, NAME.partial.h5 lacks the newest runs, which are in the journal next to it.

A sweep as CSV has a line for each run, and for a sample with Sobol indices a second file:

    run [1], <key> [unit] ..., <quantity> [unit] ..., status, failure, reason, warnings
    quantity, key, sobol_first [1], ..., sobol_total_high [1], sobol_basis

Numbers have as many digits as they need to be read back exactly; an undefined quantity is empty.
Text that a spreadsheet would interpret as a formula begins with an apostrophe.
"""

import csv
import os
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from frictionsim.errors import InputError, OutputError
from frictionsim.io.names import check_names, partial_name, warn_of_name
from frictionsim.io.output_file import (
    SOBOL_IN_CSV,
    SWEEP,
    SWEEP_IN_CSV,
    Kind,
    check_output,
    check_replaceable,
    replacing,
)
from frictionsim.io.sweep_file import write_sweep
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL,
    SOBOL_BASIS,
    SOBOL_NAMES,
    STATUS,
    TEXTS,
    Coordinate,
    SobolIndices,
    SweepTable,
)
from frictionsim.parameter_study.journal import SweepJournal, journal_name

if TYPE_CHECKING:
    from frictionsim.parameter_study.block import RunBlock
    from frictionsim.parameter_study.sweep import Assembly

SERIES, STUDY = ".series", "study.toml"
RUNS_AT_ONCE = 4096  # of a table in CSV
FORMULA = ("=", "+", "-", "@", "\t", "\r")


class SweepFiles:
    """The file of a sweep, and the files that it needs until it is complete.

    The file of a resumed sweep is kept unless it is `whole`.
    """

    def __init__(self, whole: Path, resumed: Path | None = None) -> None:
        self.whole, self.partial, self._resumed = whole, partial_name(whole), resumed
        self._journal: SweepJournal | None = None
        self._earlier: SweepJournal | None = None  # of a resumed file of another name

    def check(self, no_clobber: bool = False) -> None:
        """Check that the files can be written."""
        check_names(self.whole, self.partial, self._resumed, SWEEP, no_clobber)
        for path in (self.whole, self.partial):
            check_output(path, SWEEP)
        partial = self.partial
        if partial != self._resumed and partial.is_file() and partial.stat().st_size:
            SweepJournal(partial).close(remove=False)  # raises if a process is running it
            raise OutputError(
                f"{partial}: this is an interrupted sweep: 'frictionsim resume {partial}' continues"
                " it; give another name, or remove it"
            )
        warn_of_name(self.whole)

    def lock(self) -> None:
        """Lock this sweep against other processes."""
        self._journal = SweepJournal(self.partial)
        if self._resumed is not None and self._resumed != self.partial:
            self._earlier = SweepJournal(self._resumed)

    def restore(self, assembly: "Assembly", table: SweepTable) -> None:
        """Add the content of the resumed file and of its journal."""
        journal = self._earlier or self._journal
        assert journal is not None
        try:
            assembly.restore(table)
            taken = {RUN, STATUS, *TEXTS, *SOBOL_NAMES, *table.coordinates}
            for block in journal.blocks(digest_of(table), table.runs):
                if taken & block.units.keys():
                    raise ValueError
                assembly.add(block)
        except (ValueError, KeyError, TypeError, OverflowError):  # of an order that is infinite
            raise InputError(f"{self._resumed}: cannot resume this sweep: it is damaged") from None

    def begin(self, table: SweepTable) -> None:
        """Write the unfinished file, and begin the journal."""
        if self._journal is None:
            self.lock()
        assert self._journal is not None
        digest = digest_of(table)
        if self._resumed == self.partial:
            write_sweep(table, self.partial)
            self._journal.start(digest)
            return
        # The journal may hold runs of an earlier sweep, which do not belong to the new file.
        try:
            self._journal.start(digest)
            write_sweep(table, self.partial)
        except BaseException:
            self._journal.close(remove=True)
            raise
        if self._earlier is not None:
            is_older = self._resumed == self.whole
            if is_older:
                self.whole.unlink(missing_ok=True)
            self._earlier.close(remove=is_older)

    def keep(self, block: "RunBlock") -> None:
        """Append a block to the journal."""
        assert self._journal is not None
        self._journal.append(block)

    @contextmanager
    def resumable(self) -> Iterator[None]:
        """Add to an OutputError of the context how to resume the sweep."""
        try:
            yield
        except OutputError as error:
            raise OutputError(
                f"{error}. The runs written before are kept in {self.partial} and"
                f" {journal_name(self.partial).name} beside it: make space, then"
                f" 'frictionsim resume {self.partial}' continues the sweep"
            ) from None

    def write_unfinished(self, table: SweepTable) -> None:
        """Write the completed runs of an interrupted sweep."""
        assert self._journal is not None
        write_sweep(table, self.partial)
        self._journal.close(remove=True)

    def write_whole(self, table: SweepTable) -> None:
        """Write the file of a completed sweep, and remove all others."""
        write_sweep(table, self.whole)
        self.discard()

    def discard(self) -> None:
        """Remove the unfinished file and the journal."""
        assert self._journal is not None
        self.partial.unlink(missing_ok=True)
        self._journal.close(remove=True)

    def close(self) -> None:
        """Release the locks; a journal is kept unless it is empty."""
        for journal in (self._journal, self._earlier):
            if journal is not None:
                journal.close(remove=False)


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
    """Check that the folder of an interrupted sweep has the results of its runs.

    A file from someone else must not have a folder written.
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
        return (folder / STUDY).read_bytes() == study.encode()
    except OSError:
        return False


def make_series_folder(folder: Path, study: str) -> None:
    """Make the folder for the results of a study's runs, and write the study into it."""
    if _is_of_study(folder, study):
        return
    try:
        folder.mkdir(exist_ok=True)
        (folder / STUDY).write_bytes(study.encode())
    except OSError as error:
        raise OutputError(f"{folder}: cannot make this folder: {error.strerror}") from None


def digest_of(table: SweepTable) -> bytes:
    """Return the identity of a sweep in its journal: study, version and the values of the keys."""
    digest = sha256()
    for name in ("frictionsim_version", "study", "overrides"):
        digest.update(table.attributes[name].encode() + b"\0")
    for key, coordinate in table.coordinates.items():
        values = coordinate.values
        digest.update(key.encode() + b"\0")
        digest.update(repr(values).encode() if isinstance(values, list) else values.tobytes())
    return digest.digest()


class Writable(Protocol):
    """A target for text."""

    def write(self, text: str, /) -> object:
        """Write text."""


def files_of_sweep_in_csv(path: Path, with_indices: bool) -> dict[Path, Kind]:
    """Return the CSV files of a sweep: NAME.csv, and NAME.sobol.csv for indices."""
    files = {path: SWEEP_IN_CSV}
    return files | {path.with_suffix(".sobol.csv"): SOBOL_IN_CSV} if with_indices else files


def write_csv(table: SweepTable, path: Path) -> None:
    """Write a sweep as CSV, each file atomically."""
    files = files_of_sweep_in_csv(path, table.sobol is not None)
    for target, kind in files.items():
        check_replaceable(target, kind)
    for target, kind in files.items():
        with replacing(target, kind) as part:
            text = TextIOWrapper(part, encoding="utf-8", newline="")
            if target == path:
                write_lines(table, text)
            elif table.sobol is not None:
                _write_indices(table.sobol, text)
            text.detach()  # which writes the rest, and closes nothing


def _write_indices(indices: SobolIndices, file: Writable) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["quantity", "key", *(f"{name} [1]" for name in SOBOL), SOBOL_BASIS])
    for i, quantity in enumerate(indices.quantities):
        for j, key in enumerate(indices.keys):
            values = (indices.columns[name][i, j].item() for name in SOBOL)
            cells = ["" if value != value else value for value in values]
            writer.writerow([quantity, key, *cells, indices.basis[i]])


def write_lines(table: SweepTable, file: Writable) -> None:
    """Write the heading and a line for each run."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(
        [
            f"{RUN} [1]",
            *(_heading(key, coordinate) for key, coordinate in table.coordinates.items()),
            *(f"{name} [{table.units[name]}]" for name in table.values),
            *(STATUS, *TEXTS),
        ]
    )
    for start in range(0, table.runs, RUNS_AT_ONCE):
        runs = range(start, min(start + RUNS_AT_ONCE, table.runs))
        writer.writerows(zip(*_columns(table, runs), strict=True))


def _heading(key: str, coordinate: Coordinate) -> str:
    return key if isinstance(coordinate.values, list) else f"{key} [{coordinate.unit or '1'}]"


def _columns(table: SweepTable, runs: range) -> Iterator[list[Any]]:
    """Yield the cells of some runs, column by column."""
    yield list(runs)
    indices = table.places(np.arange(runs.start, runs.stop))
    for key, coordinate in table.coordinates.items():
        if isinstance(coordinate.values, list):
            yield [_text(coordinate.values[i]) for i in indices[key].tolist()]
        else:
            values = coordinate.values[indices[key]]
            # As in HDF5, which has no boolean type.
            yield (values.astype(np.int8) if values.dtype == np.bool_ else values).tolist()
    for values in table.values.values():
        yield ["" if value != value else value for value in values[runs.start : runs.stop].tolist()]
    words = dict(table.statuses)
    yield [words[status] for status in table.status[runs.start : runs.stop].tolist()]
    for name in TEXTS:
        yield [_text(table.texts[name].get(run, "")) for run in runs]


def _text(text: str) -> str:
    return f"'{text}" if text.startswith(FORMULA) else text

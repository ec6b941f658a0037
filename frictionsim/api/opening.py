"""What a file in HDF5 holds: the result of a run, or a sweep."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.api import result as results
from frictionsim.errors import InputError

if TYPE_CHECKING:
    from frictionsim.api.channel_csv import Writable
    from frictionsim.io.sweep_table import SweepTable


class SweepFile(NamedTuple):
    """A sweep and the name of its file."""

    table: "SweepTable"
    path: Path | None

    def summary(self) -> str:
        """Return statistics or extremes of the quantities, with what there is to know of the runs.

        Raises
        ------
        InputError
            If the study in the file is not valid.
        """
        from frictionsim.api.sweep_tables import sweep_parts
        from frictionsim.api.tables import as_text

        return as_text(sweep_parts(self.table, self.path))

    def to_json(self) -> dict[str, Any]:
        """Return the summary as data for JSON.

        Raises
        ------
        InputError
            If the study in the file is not valid.
        """
        from frictionsim.api.sweep_tables import sweep_json

        return sweep_json(self.table, self.path)

    def write_csv(self, file: "Writable") -> None:
        """Write a line for each run."""
        from frictionsim.parameter_study.report import write_lines

        write_lines(self.table, file)

    def save_csv(self, path: Path) -> None:
        """Write a line for each run into a file.

        Raises
        ------
        OutputError
            If it cannot be written.
        """
        from frictionsim.parameter_study.report import write_csv

        write_csv(self.table, path)

    @property
    def failures(self) -> list[str]:
        """How many runs failed, and how many their audit; empty if none did."""
        from frictionsim.parameter_study.block import AUDIT_FAILED, FAILED

        counts = (
            (int((self.table.status == status).sum()), words)
            for status, words in ((FAILED, "failed"), (AUDIT_FAILED, "failed their audit"))
        )
        return [f"{count} of {self.table.runs} runs {words}" for count, words in counts if count]

    @property
    def all_failed(self) -> bool:
        """Whether no run has come to its end."""
        from frictionsim.parameter_study.block import FAILED

        return bool((self.table.status == FAILED).all())

    def toml(self, name: str) -> str:
        """Return the `scenario` that is varied, or the `study`, in TOML."""
        return self.table.attributes[name].rstrip("\n")

    @property
    def left(self) -> str:
        """Which runs are left and why; empty if the sweep is done."""
        from frictionsim.parameter_study.block import NOT_RUN

        attributes, count = self.table.attributes, int((self.table.status == NOT_RUN).sum())
        if attributes["status"] == "done":
            return ""
        reason = f": {attributes['reason']}" if attributes["reason"] else ""
        return f"sweep {attributes['status']}: {count} of {self.table.runs} runs are left{reason}"


def result_or_sweep(path: Path) -> results.Result | SweepFile:
    """Read a file.

    Raises
    ------
    InputError
        If it is neither the result of a run nor a sweep.
    """
    try:
        return results.open(path)
    except InputError:
        from frictionsim.io.hdf5_reader import is_sweep, read_sweep

        if not is_sweep(path):
            raise
        return SweepFile(read_sweep(path), path)

"""The base of results of runs, sweeps, cost studies and fits."""

from abc import ABC, abstractmethod
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from frictionsim.document import as_json, as_text
from frictionsim.errors import EXIT_AUDIT_FAILED, AuditError, InputError, SolverError
from frictionsim.scenario.arguments import as_path

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from matplotlib.figure import Figure

    from frictionsim.document import Document

PICTURES = (".png", ".pdf", ".svg")


class Ending(NamedTuple):
    """How a run, a sweep, a cost study or a fit ended."""

    status: str
    reason: str
    exit_code: int


class ResultBase(ABC):
    """A result with a status, a summary, a picture and a file."""

    @property
    @abstractmethod
    def _ending(self) -> Ending: ...

    @property
    def status(self) -> str:
        """`done`, or the way it ended early: `failed`, `stopped` or `interrupted`."""
        return self._ending.status

    @property
    def reason(self) -> str:
        """Why it ended early or cannot be trusted; else empty."""
        return self._ending.reason

    @property
    def exit_code(self) -> int:
        """The exit code of the command line for this result."""
        return self._ending.exit_code

    @abstractmethod
    def _parts(self) -> "Document":
        """Yield the lines and tables of the summary, and its data."""

    @abstractmethod
    def plot(self) -> "Figure":
        """Draw the result."""

    @property
    @abstractmethod
    def _writers(self) -> "Mapping[str, Callable[[Path], Path]]":
        """What writes the result to a file, by the suffix of its path."""

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the result, or its picture, by the suffix of the path; return the file.

        Raises
        ------
        InputError
            If the suffix is another one.
        OutputError
            If the file cannot be written, or would replace one of another kind.
        """
        from frictionsim.io.names import whole_name

        target = as_path("path", path)
        writers = {**self._writers, **dict.fromkeys(PICTURES, self.save_picture)}
        suffix = whole_name(target).suffix.lower()
        if suffix[1:].isdecimal():  # run_0.3 has no ending
            suffix = ""
        if suffix not in writers:
            *ends, last = filter(None, writers)
            raise InputError(f"{target}: expected a name that ends in {', '.join(ends)} or {last}")
        return writers[suffix](target)

    def check(self) -> Self:
        """Return the result itself if its exit code is 0.

        Raises
        ------
        SolverError
            With its exit code, if it failed or ended early.
        AuditError
            If all runs that are done failed their audits.
        """
        if self.exit_code:
            error = AuditError if self.exit_code == EXIT_AUDIT_FAILED else SolverError
            raised = error(
                self._fault if self.status == "done" else f"{self.status}: {self._fault}"
            )
            raised.exit_code = self.exit_code
            raise raised
        return self

    @property
    def _fault(self) -> str:
        return self.reason

    def save_picture(self, path: str | PathLike[str]) -> Path:
        """Write the picture, by the suffix of the path: .png, .pdf or .svg."""
        from frictionsim.plots.style import save

        target = as_path("path", path)
        save(self.plot(), target)
        return target

    def summary(self) -> str:
        """Return the summary as text."""
        return as_text(self._parts())

    def to_json(self) -> dict[str, Any]:
        """Return the summary as plain data, as the command line prints it with --json."""
        return as_json(self._parts())

    def _repr_html_(self) -> str:
        from frictionsim.reports.html import notebook

        return notebook(self._parts())

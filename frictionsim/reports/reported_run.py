"""A run as its report shows it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from frictionsim.results import Record


class ReportedRun(NamedTuple):
    """A run as its report shows it.

    Attributes
    ----------
    record : Record
    path : Path or None
        Of its file.
    label : str
        Its name among the runs of a comparison.
    effects : tuple of str
        The effects that were simulated.
    errors : mapping
        The estimated error by quantity; empty if they were not estimated.
    error_estimate : str
        How they were estimated.
    """

    record: "Record"
    path: Path | None = None
    label: str = ""
    effects: tuple[str, ...] = ()
    errors: Mapping[str, float | None] = {}
    error_estimate: str = ""

    def attribute(self, name: str) -> str:
        """Return a root attribute of its file; empty if it has none of that name."""
        return self.record.attributes.get(name, "")

    @property
    def title(self) -> str:
        """The title of the scenario, or the kind."""
        return self.attribute("title") or self.attribute("kind")

    @property
    def warnings(self) -> list[str]:
        """Reasons to doubt the quantities."""
        return list(filter(None, self.attribute("warnings").split("\n")))


def labels_of(paths: Sequence[Path | None]) -> list[str]:
    """Return a name for each result of a comparison: that of its file, and as much more as needed.

    Parameters
    ----------
    paths : sequence of Path or None
        None of a result without a file.
    """
    stems = ["" if path is None else path.stem for path in paths]
    names = [
        f"result {number}" if path is None else stem if stems.count(stem) == 1 else str(path)
        for number, (path, stem) in enumerate(zip(paths, stems, strict=True), start=1)
    ]
    if len(set(names)) == len(names):
        return names
    return [f"{number}: {name}" for number, name in enumerate(names, start=1)]

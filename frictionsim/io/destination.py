"""Where the results of a run go: a part of one never takes the place of a whole one."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.io.atomic_write import check_no_clobber, check_writable

if TYPE_CHECKING:
    from frictionsim.simulation.simulate import RunResult

PARTIAL = ".partial"


def partial_name(path: Path) -> Path:
    """Return the name beside a file for a part of what belongs there: a.h5, a.partial.h5."""
    return path.with_name(f"{path.stem}{PARTIAL}{path.suffix}")


def whole_name(path: Path) -> Path:
    """Return the name of what a file is a part of: a.partial.h5, a.h5; its own if of nothing."""
    name = path.name.removesuffix(path.suffix)
    if path.suffix == PARTIAL:  # of a file whose name has no suffix
        return path.with_name(name)
    if name.endswith(PARTIAL) and name != PARTIAL:
        return path.with_name(name.removesuffix(PARTIAL) + path.suffix)
    return path


class Destination:
    """The file that a run's result belongs in.

    A result that is done goes there. Any other goes there too, unless a result that is done stands
    there already, or what cannot be read; then it goes beside it, to `partial_name`.

    Parameters
    ----------
    whole : Path
    resumed : Path, optional
        The result that the run goes on from. If it is the part of `whole` it stays the place for
        parts, and is removed when the whole is there.
    """

    def __init__(self, whole: Path, resumed: Path | None = None) -> None:
        self.whole = whole
        self._resumed = resumed
        own = resumed is not None and resumed != whole and whole_name(resumed) == whole
        self._part = resumed if own else None
        self._written = {resumed} if resumed is not None and own else set()

    def check(self, no_clobber: bool = False) -> None:
        """See that results can be written, before the time to compute them is spent.

        Parameters
        ----------
        no_clobber : bool
            Whether another file than the one that is resumed must not be replaced.

        Raises
        ------
        OutputError
        """
        if no_clobber and self.whole != self._resumed:
            check_no_clobber(self.whole)
        check_writable(self.whole)
        part = self._place_of_part()
        if part != self.whole:
            check_writable(part)

    def write(self, run: "RunResult") -> Path | None:
        """Write a result; return where it is, None if there was nothing worth another's place.

        Raises
        ------
        OutputError
        """
        if run.status == "done":
            hdf5_writer.write(run, self.whole)
            for part in self._written - {self.whole}:
                with suppress(OSError):
                    part.unlink()
            return self.whole
        place = self._place_of_part()
        nothing = run.time.size <= 1 and not run.transitions
        if nothing and place.exists() and place != self._resumed:
            return None
        hdf5_writer.write(run, place)
        self._written.add(place)
        return place

    def _place_of_part(self) -> Path:
        """Return where a part goes now; another run may have come to its end meanwhile."""
        if self._part is not None:
            return self._part
        place = self.whole
        while hdf5_reader.may_be_done(place):
            place = partial_name(place)
        return place

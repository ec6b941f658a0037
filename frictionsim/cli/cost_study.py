"""`frictionsim cost`: interprets the options, runs the study and writes its files."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import frictionsim as fs
from frictionsim.api.studies import Progress
from frictionsim.cli.messages import warn_of_name
from frictionsim.cli.monitor import StatusLine, monitor_run
from frictionsim.errors import ArgumentError, OutputError
from frictionsim.io.atomic_write import check_no_clobber
from frictionsim.io.replaceable import COSTS, COSTS_IN_HDF5, check_apart, check_target

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


NONE = "none"  # of bodies: no study of meshes


class Wanted(NamedTuple):
    """The options on what is measured, not yet interpreted."""

    backends: str | None
    laws: str | None
    tolerances: str | None
    bodies: str | None
    models: str | None
    max_wall: float
    repeats: int


class Files(NamedTuple):
    """The files to write; None if not wanted."""

    output: Path | None
    csv: Path | None
    plot: Path | None

    def check(self, no_clobber: bool) -> None:
        """Check that the files can be written, before the study runs."""
        options = ("-o", "--csv", "--plot")
        given = {option: path for option, path in zip(options, self, strict=True) if path}
        check_apart(given)
        if no_clobber:
            for target in given.values():
                check_no_clobber(target)
        if self.plot is not None:
            from frictionsim.plots.picture_file import check_picture

            check_picture(self.plot)
        if self.output is not None:
            check_target(self.output, COSTS_IN_HDF5)
        if self.csv is not None:
            check_target(self.csv, COSTS)

    def write(self, study: "fs.Study") -> None:
        """Write the files; one that cannot be written does not keep the others from it."""
        errors = []
        for path, write in (
            (self.output, study.save_hdf5),
            (self.csv, study.save_csv),
            (self.plot, lambda path: _draw(study, path)),
        ):
            if path is not None:
                try:
                    write(path)
                except OutputError as error:
                    errors.append(str(error))
        if errors:
            raise OutputError("\n".join(errors))
        warn_of_name(self.output)


def _draw(study: "fs.Study", path: Path) -> None:
    from frictionsim.plots.picture_file import save

    save(study.plot(), path)


def run_study(scenario: "Scenario", wanted: Wanted) -> "fs.Study":
    """Run the study that the options ask for."""
    with (
        monitor_run(scenario.solver.duration, with_progress=False) as on_step,
        StatusLine() as show,
    ):
        return fs.cost(
            scenario,
            laws=_names(wanted.laws),
            backends=_names(wanted.backends),
            tolerances=_tolerances(wanted.tolerances),
            max_wall=wanted.max_wall,
            repeats=wanted.repeats,
            progress=Progress(on_step, show),
            bodies=_bodies(wanted.bodies),
            models=_names(wanted.models),
        )


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [part.strip() for part in text.split(",")]


def _bodies(text: str | None) -> list[int] | None:
    if text is None:
        return None
    if text.strip() == NONE:
        return []
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentError(
            "bodies",
            f"expected whole numbers separated by commas, as 60,150, or none, got '{text}'",
        ) from None


def _tolerances(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise ArgumentError(
            "tolerances", f"expected numbers separated by commas, as 1e-3,1e-6, got '{text}'"
        ) from None

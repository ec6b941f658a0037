"""The fastest setting for a required error."""

from collections.abc import Iterable
from typing import NamedTuple

from frictionsim.work_precision.errors import max_relative_error
from frictionsim.work_precision.outcome import Row, Study

TARGET_ERRORS = (1e-2, 1e-3, 1e-4)
QUANTITY_TARGETS = (1e-2, 1e-3)  # of a single quantity
# Wall times within 10 % count as equal; the first wins, so that the default backend is preferred.
TIME_TIE_RATIO = 1.1


class Advice(NamedTuple):
    """The fastest setting with an error of at most `wanted`.

    `row` is None if no setting reaches this error, or if the reference uncertainty exceeds it.
    `metric` is the name of the one that counts; empty if all do.
    """

    wanted: float
    row: Row | None
    floor: float
    metric: str = ""

    @property
    def sentence(self) -> str:
        """The recommendation as text."""
        goal = f"for {100 * self.wanted:g} %{self.metric and ' of '}{self.metric}"
        if self.floor > self.wanted:
            return f"{goal}: unknown, the reference uncertainty is {self.floor:.1e}"
        if self.row is None:
            return f"{goal}: no setting reached it"
        row = self.row
        error = row.errors[self.metric].relative if self.metric else row.error
        return (
            f"{goal}: {row.setting.line} with {row.setting.detail}, {1e3 * row.wall_seconds:.3g}"
            f" ms, error {error:.1e}"
        )


def recommendations(study: Study) -> list[Advice]:
    """Return what a study recommends; of meshes for each of the quantities, too.

    Meshes are not equally good at all quantities, and few may have all of them right.
    """
    found = advise(study.rows, study.floor)
    if not study.of_meshes:
        return found
    floors = study.reference.floor if study.reference else {}
    for metric in study.metrics:
        if metric.what == "quantity":
            floor = max_relative_error({n: e for n, e in floors.items() if n == metric.name})
            found += [
                _of_quantity(study.rows, metric.name, wanted, floor) for wanted in QUANTITY_TARGETS
            ]
    return found


def _of_quantity(rows: Iterable[Row], metric: str, wanted: float, floor: float) -> Advice:
    errors = [(row, row.errors[metric].relative) for row in rows if row.error is not None]
    return Advice(wanted, _fastest(_sufficient(errors, wanted, floor)), floor, metric)


def _sufficient(errors: list[tuple[Row, float]], wanted: float, floor: float) -> list[Row]:
    """Return the rows with no more error, whose finer meshes have no more, too.

    On one mesh errors of opposite sign may cancel; that is no reason to trust it.
    """
    best: dict[str, dict[int, float]] = {}
    for row, error in errors:
        mesh = row.setting.mesh
        if mesh is not None:
            of = best.setdefault(mesh.model, {})
            of[mesh.bodies] = min(error, of.get(mesh.bodies, error))

    def holds(row: Row) -> bool:
        mesh = row.setting.mesh
        return mesh is None or all(
            error <= wanted for bodies, error in best[mesh.model].items() if bodies > mesh.bodies
        )

    return [row for row, error in errors if max(error, floor) <= wanted and holds(row)]


def advise(rows: Iterable[Row], floor: float) -> list[Advice]:
    """Return the fastest setting for each of TARGET_ERRORS.

    Parameters
    ----------
    rows : iterable of Row
    floor : float
        Reference uncertainty.

    Returns
    -------
    list of Advice
    """
    done = [(row, row.error) for row in rows if row.error is not None]
    return [
        Advice(wanted, _fastest(_sufficient(done, wanted, floor)), floor)
        for wanted in TARGET_ERRORS
    ]


def _fastest(rows: list[Row]) -> Row | None:
    shortest = min((row.wall_seconds for row in rows), default=0.0)
    return next((row for row in rows if row.wall_seconds <= shortest * TIME_TIE_RATIO), None)

"""The fastest setting for a required error.

Settings whose wall times differ by less than their spread are ranked by their evaluations of the
right-hand side, whose number is the same in each run.
"""

from collections.abc import Iterable
from typing import NamedTuple

from frictionsim.display import error_text, short_text, study_text
from frictionsim.work_precision.outcome import Row, WorkPrecision

TARGET_ERRORS = (1e-2, 1e-3, 1e-4)
QUANTITY_TARGETS = (1e-2, 1e-3)  # of a single quantity
# Of wall times, relative: repeats within a second agree better than runs minutes apart.
MIN_SPREAD = 0.1


class Advice(NamedTuple):
    """The fastest setting with an error of at most `wanted`.

    `row` is None if no setting reaches this error, or if the reference uncertainty exceeds it.
    `metric` is the name of the one that counts; empty if all do. `equal` is the number of settings
    that are as fast within the spread of the times, of which `row` has the fewest evaluations.
    """

    wanted: float
    row: Row | None
    floor: float
    metric: str = ""
    equal: int = 1

    @property
    def sentence(self) -> str:
        """The recommendation as text."""
        goal = f"for {study_text(100 * self.wanted)} %{self.metric and ' of '}{self.metric}"
        if self.floor > self.wanted:
            return f"{goal}: unknown, the reference uncertainty is {error_text(self.floor)}"
        if self.row is None:
            return f"{goal}: no setting reached it"
        row = self.row
        error = row.errors[self.metric].relative if self.metric else row.error
        equal = f"; of {self.equal} as fast, the fewest evaluations" if self.equal > 1 else ""
        return (
            f"{goal}: {row.setting.line} with {row.setting.detail},"
            f" {short_text(row.wall_seconds)} s, error {error_text(error)}{equal}"
        )


def recommendations(study: WorkPrecision) -> list[Advice]:
    """Return the recommendations of a study; of meshes for each of the quantities, too.

    Meshes are not equally good at all quantities, and few may have all of them right.
    """
    floors = study.reference.floor if study.reference else {}
    quantities = [m.name for m in study.metrics if m.what == "quantity"] if study.of_meshes else []
    advice = advise(study.rows, study.floor)
    for name in quantities:
        floor = floors[name].relative if name in floors else 0.0
        advice += [_quantity_advice(study.rows, name, error, floor) for error in QUANTITY_TARGETS]
    return advice


def _quantity_advice(rows: Iterable[Row], metric: str, wanted: float, floor: float) -> Advice:
    errors = [
        (row, row.errors[metric].relative)
        for row in rows
        if row.error is not None and metric in row.errors
    ]
    return _fastest(_sufficient(errors, wanted, floor), Advice(wanted, None, floor, metric))


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
    """
    done = [(row, row.error) for row in rows if row.error is not None]
    return [
        _fastest(_sufficient(done, wanted, floor), Advice(wanted, None, floor))
        for wanted in TARGET_ERRORS
    ]


def _fastest(rows: list[Row], advice: Advice) -> Advice:
    """Return the advice with the fastest row; the first of those with as few evaluations."""
    if not rows:
        return advice
    shortest = min(rows, key=lambda row: row.wall_seconds)
    equal = [
        row
        for row in rows
        if row.wall_seconds - shortest.wall_seconds <= max(_spread(row), _spread(shortest))
    ]
    best = min(equal, key=lambda row: row.rhs_evaluations)
    return advice._replace(row=best, equal=len(equal))


def _spread(row: Row) -> float:
    """Return the spread of the wall time of a row, s."""
    return max(row.wall_spread or 0.0, MIN_SPREAD * row.wall_seconds)

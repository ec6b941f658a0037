"""Studies of costs whose rows are made by hand, from those of a study that was run."""

from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import frictionsim as fs
from frictionsim.results import Metric
from tests.support.scenarios import pulley


class Mesh(NamedTuple):
    """A model of a belt with a number of bodies."""

    model: str
    bodies: int
    overrides: tuple[str, ...] = ()


@cache
def measured() -> fs.Study:
    """Return a short study of the pulley."""
    scenario = pulley(solver__duration=1.0)
    return fs.cost(scenario, backends=["events", "lsoda"], tolerances=[1e-3, 1e-6], repeats=1)


def errors_of(relative: Mapping[str, float]) -> dict[str, Any]:
    known = next(iter(measured().data.rows[0].errors.values()))
    return {name: known._replace(absolute=e, relative=e) for name, e in relative.items()}


def made_row(
    backend: str,
    errors: Mapping[str, float],
    seconds: float,
    evaluations: int = 6,
    spread: float | None = None,
    label: str = "rtol 1",
    mesh: Mesh | None = None,
) -> Any:
    """Return a row; without errors that of a run that failed."""
    first = measured().data.rows[0]
    setting = first.setting._replace(backend=backend, law="", laws=(), overrides=())
    return first._replace(
        setting=setting._replace(label=label, mesh=mesh),
        status="done" if errors else "failed",
        errors=errors_of(errors),
        wall_seconds=seconds,
        wall_spread=spread,
        rhs_evaluations=evaluations,
    )


def made_study(rows: list[Any], uncertainty: Mapping[str, float] | None = None) -> fs.Study:
    """Return a study of rows, with the difference of its references by measure."""
    data = measured().data
    names = list(dict.fromkeys(name for row in rows for name in row.errors))
    floor = errors_of(dict.fromkeys(names, 0.0) if uncertainty is None else uncertainty)
    reference = data.reference
    assert reference is not None
    return fs.Study(
        data._replace(
            rows=rows,
            metrics=tuple(Metric(name, "quantity", name) for name in names),
            reference=reference._replace(names=("one", "two"), floor=floor),
        )
    )

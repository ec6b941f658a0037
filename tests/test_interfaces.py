"""The contracts of mechanisms with solvers, and of scenarios with what is recorded of them."""

from math import pi, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.mechanisms.extension import INPUT, MultiplesOf, OneCoordinate, Term
from frictionsim.solvers.rkf45 import Tolerances
from tests.support.scenarios import pulley, simulate
from tests.support.wheels import signal, solved, wheel

EVENT = "half turn"


class Place(NamedTuple):
    """The surface of one place, by an author's own hand."""

    place: float
    event: str = EVENT

    def beyond(self, step: Any, t: float, y: list[float]) -> float:
        """Return how far the motion is beyond it, if the step began before it."""
        return y[0] - self.place if step.y_old[0] < self.place else -1.0


@pytest.mark.parametrize(
    "surfaces", [(Place(pi), Place(2.0 * pi)), (MultiplesOf(pi, EVENT),)], ids=["own", "multiples"]
)
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_steps_end_on_switching_surfaces(
    backend: str, friction: float, surfaces: tuple[Any, ...]
) -> None:
    # 1 kg m^2 under 2 N m, and 1 N m more where sin(q) is negative.
    mechanism = wheel(
        signal(2.0),
        lambda u, q, v: u + 0.5 * (1.0 - float(np.sign(sin(q)))),
        (lambda u: friction) if friction else None,
        surfaces=surfaces,
    )
    solver = solved(mechanism, 3.0, Tolerances(1e-10, 1e-12), backend)
    # From rest with 2 N m to pi, then with 3 N m to 2 pi, then with 2 N m to the end.
    t, v = 0.0, 0.0
    expected = []
    for k, torque in enumerate((2.0, 3.0), start=1):
        faster = (v * v + 2.0 * (torque - friction) * pi) ** 0.5
        t, v = t + (faster - v) / (torque - friction), faster
        expected.append((t, k * pi))
    transitions = solver.recording.transitions
    events = [(e.time, e.position) for e in transitions if e.contact == EVENT]
    # Before and after the jump the motion is a parabola, which the method gives exactly; the last
    # stage of the step that ends on it may see what is beyond, which the tolerance covers.
    assert np.array(events[:2]) == pytest.approx(np.array(expected), abs=1e-8)


def test_output_channels_are_the_only_channels(tmp_path: Path) -> None:
    whole = simulate(pulley())
    some = simulate(pulley(output__channels=["mode", "angle"]))
    none = simulate(pulley(output__channels=[]))
    assert list(some.channels) == ["time", "angle", "mode"]
    assert np.array_equal(some.channels["angle"], whole.channels["angle"])
    assert list(none.channels) == ["time"]
    assert list(some.events) == ["time", "contact", "mode_from", "mode_to", "angle"]
    for run in (some, none):
        assert run.quantities == whole.quantities
        assert run.checks == whole.checks
        assert run.transitions == whole.transitions
        content = fs.open(fs.Result(run).save(tmp_path / "a.h5")).record
        assert content.channels.keys() == run.channels.keys()
        assert len(content.events["time"]) == 1
    assert "channels = []" in content.attributes["scenario"]


def test_an_equation_has_no_second_term_of_its_drive() -> None:
    """One without any is refused in `plugin/test_faulty_plugins.py`."""
    with pytest.raises(InputError, match="'energy_input', of a drive; found 2"):
        OneCoordinate(signal(1.0), None, 1.0, (Term(1.0, INPUT), Term(2.0, INPUT)), None)


@pytest.mark.parametrize("lost", [Term(1.0), Term(1.0, "energy_spring", lambda q: q)])
def test_each_term_says_where_its_energy_goes(lost: Term) -> None:
    with pytest.raises(InputError, match=r"give it an energy, .* or a potential"):
        OneCoordinate(signal(1.0), None, 1.0, (Term(1.0, INPUT), lost), None)

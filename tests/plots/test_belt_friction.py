"""The clouds of friction over slip before the law of friction, and the wear along the belt."""

from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

import frictionsim as fs
from frictionsim.results import Record
from tests.support.belt_scenarios import path_of, scenario_of, shipped
from tests.support.cases import slow
from tests.support.records import draw
from tests.support.scenarios import simulate

OIL = {"mu_s": 0.5, "mu_k": 0.4}
SHORT: dict[str, Any] = {"solver__duration": 0.02, "output__interval": 1e-3}
SPEED, CREEP, TIME = 0.02, 1e-4, 0.01  # m/s, m, s
SMOOTHED = {"mu_s": 1.0, "mu_k": 0.8, "law": "regularised", "transition_speed": SPEED}
CREEPING = {**SMOOTHED, "law": "creep", "maximum_creep": CREEP, "elementary_time": TIME}


def run(**changes: Any) -> Record:
    return simulate(shipped("belt_string", **{**SHORT, **changes}))


def curves(ax: Axes, words: str) -> list[tuple[Any, Any]]:
    """Return the points of the lines whose words begin so."""
    lines = [line for line in ax.lines if str(line.get_label()).startswith(words)]
    return [(np.asarray(line.get_xdata()), np.asarray(line.get_ydata())) for line in lines]


def half_course(x: Any) -> Any:
    """Return half of the course of Kubas 2014, eq 10, from 0 at 0 to 1 at 1: 3 d^2 - 2 d^3."""
    d = 0.5 + 0.5 * np.minimum(np.abs(x), 1.0)
    return np.sign(x) * 2.0 * (d * d * (3.0 - 2.0 * d) - 0.5)


def published(slip: Any, law: dict[str, Any], mu_s: float, mu_k: float) -> Any:
    """Return mu(v) of eqs 12 and 13: Threlfall's curve, below it the blend with the creep."""
    x = np.abs(slip) / law["transition_speed"]
    falling = np.clip(2.0 * (x - 1.0), 0.0, 1.0)
    above = mu_s + (mu_k - mu_s) * falling**2 * (3.0 - 2.0 * falling)
    beta = half_course(np.minimum(x, 1.0))
    mu_1 = 0.0
    if "maximum_creep" in law:
        mu_1 = mu_s * half_course(np.abs(slip) * law["elementary_time"] / law["maximum_creep"])
    return np.sign(slip) * np.where(x > 1.0, above, (1.0 - beta) * mu_1 + beta * mu_s)


@pytest.mark.parametrize("law", [slow(SMOOTHED), slow(CREEPING)])
def test_the_cloud_of_a_smoothed_law_lies_on_its_curve(law: dict[str, Any]) -> None:
    patch = {"from": 0.5, "to": 0.7, **OIL}
    record = run(effects__belt_friction=law, effects__patch=patch, solver__backend="rkf45")
    ax = draw(record, "friction").axes[0]
    pairs = [(1.0, 0.8), (0.5, 0.4)]
    for (slip, mu), pair in zip(curves(ax, "law, "), pairs, strict=True):
        assert mu == pytest.approx(published(slip, law, *pair), abs=1e-12)
    clouds = curves(ax, "bodies on ")
    assert len(clouds) == 2
    for slip, ratio in clouds:
        assert slip.size
        # A body has one of the two pairs of coefficients.
        off = [np.abs(ratio - published(slip, law, *pair)) for pair in pairs]
        assert np.max(np.min(off, axis=0)) < 1e-9
    shares = curves(ax, "share of the creep")
    assert len(shares) == ("maximum_creep" in law)
    for slip, share in shares:
        beta, mu_1 = half_course(slip / SPEED), half_course(slip * TIME / CREEP)
        expected = 0.5 * (1.0 - np.abs(beta)) * mu_1  # of the second pair, drawn last
        assert share == pytest.approx(expected, abs=1e-12)


def test_the_cloud_of_exact_friction_lies_on_a_vertical_and_two_rays() -> None:
    law = {"mu_s": 1.0, "mu_k": 0.8}
    speeds = {
        "driver": {"speed": {"time": [0.0, 0.01], "value": [0.0, -30.0]}},
        "driven": {"torque": {"speed": [-50.0, 50.0], "value": [30.0, -30.0]}},
    }
    record = run(solver__backend="moreau", effects__belt_friction=law, drive=speeds)
    ax = draw(record, "friction").axes[0]
    ((slip, mu),) = curves(ax, "law, μs = 1, μk = 0.8")
    assert mu.tolist() == [-0.8, -0.8, -1.0, 0.0, 0.0, 1.0, 0.8, 0.8]
    assert slip.tolist()[1:-1] == [0.0] * 6
    assert slip[-1] == -slip[0]
    late = record.time >= 0.8 * record.time[-1]
    touching = np.sum(record.channels["normal_force"][late] > 0.0)
    clouds = curves(ax, "bodies on ")
    assert sum(slip.size for slip, _ in clouds) == touching
    for slip, ratio in clouds:
        sticks = np.abs(slip) < 1e-9  # rounding of speeds of a metre per second
        assert np.all(np.abs(ratio[sticks]) <= 1.0 + 1e-9)
        assert ratio[~sticks] == pytest.approx(0.8 * np.sign(slip[~sticks]), rel=1e-9)
    assert slip.size


def test_the_law_of_a_patch_is_named() -> None:
    patches = [{"from": 0.2, "to": 0.3, "mu_s": 1.0, "mu_k": 1.0}]
    patches += [{"from": 0.5, "to": 0.7, "name": "oil", **OIL}]
    ax = draw(run(effects__patch=patches, solver__backend="moreau"), "friction").axes[0]
    words = [str(line.get_label()) for line in ax.lines]
    assert [w for w in words if w.startswith("law")] == [
        "law, μs = 1, μk = 1",
        "law, μs = 0.5, μk = 0.4 (oil)",
    ]


@pytest.mark.slow
def test_fast_slip_is_drawn_by_its_logarithm() -> None:
    for speed, scale in ((1e-5, "symlog"), (10.0, "linear")):
        law = SMOOTHED | {"transition_speed": speed}
        changes = {"solver__duration": 0.001, "solver__rtol": 1e-2, "solver__backend": "rkf45"}
        record = run(effects__belt_friction=law, **changes)
        assert draw(record, "friction").axes[0].get_xscale() == scale


def test_the_areas_of_the_wear_are_the_work_of_friction() -> None:
    patches = [{"from": 0.5, "to": 0.7, **OIL, "name": "oil"}, {"from": 0.8, "to": 0.9, **OIL}]
    data = shipped(
        "belt_string",
        **{**SHORT, "solver__backend": "moreau", "effects__patch": patches, "effects__wear": {}},
    )
    record = simulate(data)
    for sample in (-1, 10):
        ax = draw(record, "wear", time=float(record.time[sample])).axes[0]
        values, edges, _ = ax.patches[0].get_data()  # type: ignore[attr-defined]
        length = path_of(scenario_of(data)).length / (1.0 + 555.0 / 1.52e5)
        assert edges[[0, -1]] == pytest.approx([0.0, length], rel=1e-9)
        heat = record.channels["energy_friction"][sample]
        assert np.sum(values * np.diff(edges)) == pytest.approx(heat, rel=1e-9)
    shaded = sorted((p.get_x(), p.get_x() + p.get_width()) for p in ax.patches[1:])
    # To the ends of bodies, whose middles are inside.
    half = 0.5 * length / 60 + 1e-12
    assert np.ravel(shaded) == pytest.approx([0.5, 0.7, 0.8, 0.9], abs=half)
    ax = draw(record, "wear").axes[0]
    for name in ("clean", "oil", "patch"):
        mean = record.quantities[f"friction_work_{name}"].value
        drawn = [y[0] for _, y in curves(ax, f"mean of {name}, ")]
        assert drawn == [pytest.approx(mean, rel=1e-12)]


def test_wear_is_drawn_of_results_that_have_it() -> None:
    record = run(solver__backend="moreau")
    with pytest.raises(fs.InputError, match="this result has no channel friction_work"):
        draw(record, "wear")

"""Means of belts whose motion repeats: over whole periods, as read from the channels."""

from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.cases import slow


def belt(drive: Any, duration: float, patch: Any = None) -> dict[str, Any]:
    """Return a guided belt on two pulleys with a load that rises with its speed."""
    pulleys = [
        {"name": name, "center": [x, 0.0], "radius": 0.05, "inertia": 1e-3}
        for name, x in (("a", 0.0), ("b", 0.4))
    ]
    string = {"bodies": 60, "mass_per_length": 0.1, "axial_rigidity": 1e4, "pretension": 300.0}
    load = {"torque": {"speed": [-100.0, 100.0], "value": [12.0, -12.0]}}
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": string, "pulleys": pulleys},
        "drive": {"a": drive, "b": load},
        "effects": {
            "belt_friction": {"mu_s": 0.8, "mu_k": 0.8},
            "axial_damping": {"coefficient": 2.0},
        }
        | ({"patch": patch} if patch else {}),
        "solver": {"backend": "moreau", "duration": duration},
        "output": {"interval": 5e-4},
    }


def values(run: fs.Result) -> dict[str, float | None]:
    return {name: quantity.value for name, quantity in run.quantities.items()}


def mean_of_last(run: fs.Result, start: float) -> Any:
    """Return the plain mean of the speeds of a and b from a time on."""
    time, speed = run.dataset["time"].values, run.dataset["pulley_speed"].values
    k = np.argmin(np.abs(time - start))
    return np.trapezoid(speed[k:], time[k:], axis=0) / (time[-1] - time[k])


OIL = {"from": 0.3, "to": 0.6, "mu_s": 0.1, "mu_k": 0.1}
LITTLE = {"from": 0.1, "to": 0.2, "mu_s": 0.2, "mu_k": 0.15}


@pytest.mark.parametrize(
    ("speed", "patch", "duration", "turns"),
    [
        (-100.0, OIL, 0.32, 1),
        (60.0, LITTLE, 0.45, 1),
        slow(200.0, OIL, 1.8, 2),
    ],
)
def test_a_patch_is_averaged_over_whole_turns(
    speed: float, patch: Any, duration: float, turns: int
) -> None:
    run = fs.solve(belt({"speed": speed}, duration, patch))
    got = values(run)
    # In a turn of the belt each of its bodies turns once.
    angle, time = run.dataset["angle"].values.mean(axis=1), run.dataset["time"].values
    turned = np.abs(angle - angle[-1]) / (2.0 * np.pi)
    start = time[np.argmin(np.abs(turned - turns))]
    period = got["mean_duration"]
    # Waves: the belt moves by another way than the mean of its bodies turns.
    assert period == pytest.approx(duration - start, rel=5e-3)
    first, other = mean_of_last(run, duration - period)
    assert got["drive_speed"] == pytest.approx(first, rel=1e-12)
    assert got["driven_speed"] == pytest.approx(other, rel=1e-9)
    assert got["slip_percent"] == pytest.approx(100.0 * (1.0 - other / first), abs=1e-6)
    assert not any("not steady" in warning for warning in run.warnings), run.warnings
    assert not any("give more pretension" in warning for warning in run.warnings)
    label = fs.plot(run, "speeds").axes[-1].lines[-1].get_label()
    assert label.startswith("slip of the mean speeds over whole periods")


@pytest.mark.parametrize(("frequency", "duration", "periods"), [(50.0, 0.35, 3), (10.0, 0.45, 1)])
def test_drives_of_one_sine_are_averaged_over_whole_periods(
    frequency: float, duration: float, periods: int
) -> None:
    sine = {"mean": 60.0, "amplitude": 10.0, "frequency_hz": frequency}
    run = fs.solve(belt({"speed": {"sine": sine}}, duration))
    got = values(run)
    assert got["mean_duration"] == pytest.approx(periods / frequency, rel=1e-9)
    # Of a sine, but for the samples that stand for it.
    assert got["drive_speed"] == pytest.approx(60.0, rel=1e-4)
    assert not any("not steady" in warning for warning in run.warnings), run.warnings


RISING = {"time": [0.0, 0.5], "value": [0.0, 100.0]}
BESIDE = [{"sine": {"amplitude": 5.0, "frequency_hz": f}} for f in (30.0, 47.0)]


@pytest.mark.parametrize(
    ("speed", "patch"),
    [(RISING, None), ([60.0, *BESIDE], None), (10.0, OIL)],
    ids=["a ramp", "two frequencies", "less than a turn"],
)
def test_other_means_are_weighted_over_the_last_fifth(speed: Any, patch: Any) -> None:
    run = fs.solve(belt({"speed": speed}, 0.2, patch))
    assert "mean_duration" not in run.quantities
    late = run.dataset["pulley_speed"].sel(time=slice(0.16 - 1e-9, None)).values
    weight = np.sin(np.linspace(0.0, np.pi, len(late))) ** 2
    mean = np.average(late, axis=0, weights=weight)
    assert values(run)["drive_speed"] == pytest.approx(mean[0], rel=1e-9)


def test_periods_that_differ_are_warned_of() -> None:
    """A ramp goes on below the sine."""
    sine = {"sine": {"amplitude": 5.0, "frequency_hz": 50.0}}
    run = fs.solve(belt({"speed": [RISING, sine]}, 0.3))
    assert any("from one to the next" in warning for warning in run.warnings), run.warnings


def test_a_sweep_says_what_its_means_are() -> None:
    swept = fs.sweep(belt({"speed": 10.0}, 0.01), vary={"drive.a.speed": [5.0, 10.0]}, workers=1)
    assert "weighted mean" in swept["slip_percent"].attrs["long_name"]

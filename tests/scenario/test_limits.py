"""Numbers, texts and files that are too large or too small are refused where they are read."""

import os
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.scenario.test_signals import signal
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS, pulley

MARBLES = SCENARIOS / "marble_machine.toml"


def test_a_capstan_ratio_beyond_the_largest_number_is_undefined() -> None:
    statics = fs.static(pair(effects__belt_friction={"mu_s": 1e40, "mu_k": 1.0}))
    assert statics["capstan_ratio_driver"].value is None
    radius = pair()["mechanism"]["pulleys"][0]["radius"]
    tension = statics["pretension"].value
    assert tension is not None
    assert statics["torque_limit_driver"].value == pytest.approx(2.0 * tension * radius, rel=1e-12)


def test_extreme_gears_have_a_verdict_without_a_traceback() -> None:
    extreme = [
        "mechanism.pinion_radius=1e-50",
        "mechanism.gear_ratio=1e50",
        "effects.shaft_friction.shaft_radius=1e-49",
        "mechanism.pressure_angle_deg=89.9999999999999",
    ]
    assert set(fs.static(MARBLES, extreme)) >= {"torque_to_lift", "self_locking"}


@pytest.mark.parametrize("phase", [-1e30, 1e49])
def test_a_large_phase_is_the_rest_of_whole_turns(phase: float) -> None:
    """Beside 1e28 turns, the time would not count any more, and no extremum be found."""
    sine: dict[str, Any] = {"mean": 2200.0, "amplitude": 500.0, "frequency_hz": 1.0}
    short = {"solver": {"backend": "events", "duration": 0.3, "rtol": 1e-6, "atol": 1e-9}}
    ours = fs.solve(pulley(drive__force={"sine": {**sine, "phase_deg": phase}}, **short))
    rest = fs.solve(
        pulley(drive__force={"sine": {**sine, "phase_deg": float(int(phase) % 360)}}, **short)
    )
    assert ours.status == "done"
    force, other = (of.record.channels["drive_force"] for of in (ours, rest))
    assert force == pytest.approx(other, rel=1e-9)


def test_the_extrema_of_a_sine_above_the_resolution_of_time_are_found() -> None:
    force = signal({"sine": {"amplitude": 1.0, "frequency_hz": 1e50}})
    assert force.next_extremum(1.0) > 1.0


def test_a_long_line_is_read_once() -> None:
    """Searched for the parts of a key from each of its letters it would take minutes."""
    with pytest.raises(fs.ScenarioError):
        fs.loads(f'kind = "pulley"\n{"a" * 900_000}\n')


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="POSIX")
@pytest.mark.parametrize("path", ["pipe", "/dev/zero"])
def test_csv_files_are_no_pipes_or_devices(path: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(fs.ScenarioError, match=r"cannot read '.*' \(this is a device or a pipe\)"):
        fs.load(pulley(drive__force={"csv": str(tmp_path / path)}))


def test_a_csv_file_without_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_bytes(b" " * (16 * 2**20 + 1))
    with pytest.raises(fs.ScenarioError, match="has more than 16 MiB; give fewer lines"):
        fs.load(pulley(drive__force={"csv": "force.csv"}), folder=tmp_path)

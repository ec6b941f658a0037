"""Numbers, texts and files that are too large or too small are refused where they are read."""

import os
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import pair
from tests.support.scenarios import pulley


def test_a_capstan_ratio_beyond_the_largest_number_is_undefined() -> None:
    """As of a belt that is not to slip at all."""
    statics = fs.static(pair(effects__belt_friction={"mu_s": 1e3, "mu_k": 1e3}))
    assert statics["capstan_ratio_driver"].value is None
    radius = pair()["mechanism"]["pulleys"][0]["radius"]
    tension = statics["pretension"].value
    assert tension is not None
    assert statics["torque_limit_driver"].value == pytest.approx(2.0 * tension * radius, rel=1e-12)


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

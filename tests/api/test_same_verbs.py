"""Results of runs, sweeps, cost studies and fits have the same verbs."""

import json
from pathlib import Path
from typing import Any
from unittest.mock import ANY

import pytest

import frictionsim as fs

MU_S = "effects.shaft_friction.mu_s"
SHORT = {"solver.duration": 0.5}
LOAD = {"mechanism.load": [2000.0, 2100.0]}
FEW: dict[str, Any] = {"backends": ["events"], "tolerances": [1e-5], "repeats": 1}


def fitted(force: float) -> fs.Fit:
    return fs.fit("pulley", SHORT, quantities={"force_to_lift": force}, free={MU_S: (0.15, 0.4)})


@pytest.fixture(scope="module")
def done() -> dict[str, Any]:
    """Return a result of each sort, by the suffix of its file of data."""
    return {
        ".h5": fs.solve("pulley", SHORT),
        ".hdf5": fs.sweep("pulley", LOAD, SHORT, workers=1),
        ".csv": fs.cost("pulley", SHORT, **FEW),
        ".toml": fitted(2700.0),
    }


@pytest.mark.parametrize("suffix", [".h5", ".hdf5", ".csv", ".toml"])
def test_each_is_checked_shown_and_saved_in_the_same_words(
    suffix: str, done: dict[str, Any], tmp_path: Path
) -> None:
    result = done[suffix]
    assert (result.status, result.reason, result.exit_code) == ("done", "", 0)
    assert result.check() is result
    assert json.loads(json.dumps(result.to_json()))["status"] == "done"
    assert result.summary()
    assert result.plot().axes
    for kind in (suffix, ".png"):
        assert result.save(tmp_path / f"a{kind}") == tmp_path / f"a{kind}"
    assert (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"
    assert (tmp_path / f"a{suffix}").read_bytes()[1:4] != b"PNG"
    for name in ("a.txt", "a.json", "a.html", "a.gif", "a.jpg", "a.partial.md"):
        with pytest.raises(fs.InputError, match=r"expected a name that ends in \..*\.pdf or \.svg"):
            result.save(tmp_path / name)
        assert not (tmp_path / name).exists()


@pytest.mark.parametrize("name", ["a.h5", "a.HDF5", "a.nc", "a"])
def test_a_result_that_is_saved_as_hdf5_is_in_that_file(name: str, tmp_path: Path) -> None:
    made = [fs.solve("pulley", SHORT), fs.sweep("pulley", LOAD, SHORT, workers=1)]
    for result, read in zip(made, (fs.open, fs.open_sweep), strict=True):
        said = result.summary()
        assert "none" not in said.splitlines()[-1]
        path = tmp_path / type(result).__name__ / name
        path.parent.mkdir()
        result.save(path.with_name("a.png"))
        assert result.path is None
        assert result.save(path) == result.path == path
        assert result.summary().splitlines() == [*said.splitlines(), ANY]
        assert result.summary().endswith(f": {path}")
        assert read(path).to_json()["quantities"] == result.to_json()["quantities"]
        # A copy of what is in a file leaves it there.
        result.save(path.with_name("copy.h5"))
        assert result.path == path


def test_what_cannot_be_trusted_is_raised_with_the_exit_code_of_its_command() -> None:
    few = {**SHORT, "solver.max_steps": 2}
    for result, words in (
        (
            fs.solve("pulley", {**few, "mechanism.load": 2000.0}),
            "run failed: limit of 2 steps reached",
        ),
        (fs.sweep("pulley", LOAD, few, workers=1), "^2 of 2 runs failed"),
        (fitted(2500.0), "^out of reach: force_to_lift = 2500 N"),
    ):
        with pytest.raises(fs.SolverError, match=words) as raised:
            result.check()
        assert raised.value.exit_code == result.exit_code != 0


def test_a_number_behind_a_point_is_no_ending(tmp_path: Path) -> None:
    result = fs.solve("pulley")
    assert result.save(tmp_path / "run_0.3") == tmp_path / "run_0.3" == result.path
    assert fs.open(tmp_path / "run_0.3").status == "done"

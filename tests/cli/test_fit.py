"""`frictionsim fit`: options, tables, files and exit codes."""

import tomllib
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.fits.measurements import LOAD, MU_K, MU_S, PULLEY, pulley, series, write_csv
from tests.support.file_sizes import limited_files

SET = ("--set", "solver.duration=1.5", "--set", "solver.rtol=1e-8")
ONE = ("--free", f"{MU_S}=0.1:0.4", "--channel", "angular_velocity", "--starts", "1")


@pytest.fixture
def log(here: Path) -> Path:
    """Measured velocity of a pulley with mu_s = 0.23."""
    data = series(pulley().replace({MU_S: 0.23}), 0.1, angular_velocity=0.02)
    return write_csv(here / "log.csv", data)


def test_a_fit_prints_its_tables(told: Run, log: Path) -> None:
    free = ("--free", f"{MU_S}=0.1:0.4", "--free", f"{MU_K}=0.02:0.2")
    channel = ("--channel", "angular_velocity")
    out, err = told("fit", PULLEY, *SET, *free, "--data", log, *channel, "--starts", "1")
    title, overrides, *table = out.splitlines()
    assert title == "Pulley on a dry shaft: fit of 2 keys to 16 values"
    assert overrides == "set: solver.duration = 1.5, solver.rtol = 1e-08"
    lines = [[], *(line.split() for line in table)]
    assert lines[1][0] == "key"
    assert lines[2][0] == MU_S
    assert float(lines[2][1]) == pytest.approx(0.23, rel=0.01)
    assert lines[4] == ["correlation", "(1)", "(2)"]
    assert lines[5][:3] == ["(1)", MU_S, "1.000"]
    assert lines[7] == ["residual", "values", "rms", "largest", "sigma", "unit"]
    assert lines[8][:2] == ["angular_velocity", "16"]
    assert lines[8][-2:] == ["estimated", "rad/s"]
    assert table[8] == "data: angular_velocity from 'angular_velocity' in rad/s"
    assert lines[10][:7] == ["1", "of", "1", "search", "found", "this", "minimum,"]
    assert err == ""
    assert sorted(path.name for path in Path().iterdir()) == ["log.csv"]


def test_a_fit_writes_a_scenario_and_a_picture(told: Run, log: Path) -> None:
    files = ("-o", "fitted.toml", "--plot", "fit.png")
    out, err = told("fit", PULLEY, *SET, *ONE, "--data", log, *files)
    assert out.splitlines()[-2:] == ["output: fitted.toml", "picture: fit.png"]
    assert err == ""
    text = Path("fitted.toml").read_text(encoding="utf-8")
    assert text.startswith(
        "# Fitted by 'frictionsim fit' from pulley.toml to measured angular_velocity: estimate,"
        f" standard error\n#   {MU_S} = 0.2"
    )
    value = tomllib.loads(text)["effects"]["shaft_friction"]["mu_s"]
    assert value == pytest.approx(0.23, rel=0.01)
    assert Path("fit.png").read_bytes().startswith(b"\x89PNG")
    told("solve", "fitted.toml", "-q", "-o", "result.h5")
    assert fs.open("result.h5").scenario.effects.shaft_friction.mu_s == value
    # A scenario is not replaced, a picture is; nothing is fitted before that is known.
    _, err = told("fit", PULLEY, *SET, *ONE, "--data", log, "-o", "fitted.toml", code=4)
    assert err == (
        "frictionsim: fitted.toml: cannot write the scenario: the file exists and is not replaced;"
        " give another name\n"
    )
    assert Path("fitted.toml").read_text(encoding="utf-8") == text
    _, err = told(
        "fit", PULLEY, *SET, *ONE, "--data", log, "--plot", "fit.png", "--no-clobber", code=4
    )
    assert err.startswith(
        "frictionsim: fit.png: cannot write the picture: the file exists and is not"
    )


def test_a_fit_as_json(told: Run, log: Path) -> None:
    options = ("--sigma", "angular_velocity=0.02", "--bootstrap", "40", "--seed", "2", "--json")
    out, err = told("fit", PULLEY, *SET, *ONE, "--data", log, *options)
    data = strict_json(out)
    assert err == ""
    key = data["keys"][MU_S]
    assert key["value"] == pytest.approx(0.23, rel=0.01)
    low, high = key["interval"]
    assert high - low == pytest.approx(2.0 * 1.959964 * key["standard_error"])
    assert key["bounds"] == [0.1, 0.4]
    assert len(key["bootstrap_interval"]) == 2
    assert data["bootstrap"] == {"done": 40, "failed": 0}
    assert data["residuals"]["angular_velocity"]["sigma"] == pytest.approx(0.02)
    assert data["residuals"]["angular_velocity"]["sigma_given"] is True
    part = data["residuals"]["angular_velocity"]
    # Of so many values the largest is more than the root of the mean square, and not above it by
    # the root of their number.
    assert 1.2 * part["rms"] < part["largest"] <= part["rms"] * part["count"] ** 0.5
    assert data["degrees_of_freedom"] == 15
    assert data["reduced_chi_squared"] == pytest.approx(data["chi_squared"] / 15)
    assert data["status"] == "done"
    assert len(data["starts"]) == 1
    assert data["correlations"] == [[1.0]]
    assert data["overrides"] == {"solver.duration": 1.5, "solver.rtol": 1e-8}
    assert (data["output"], data["picture"]) == (None, None)
    out, _ = told("fit", PULLEY, *SET, *ONE, "--data", log, "-o", "a.toml", "--json")
    assert (strict_json(out)["output"], strict_json(out)["picture"]) == ("a.toml", None)


def test_files_that_cannot_be_written_are_not_named(told: Run, log: Path) -> None:
    """The others are, and the estimates are printed."""
    long = ("--set", f"title='{'long ' * 1000}'")
    files = ("-o", "fitted.toml", "--plot", "fit.png")
    with limited_files(4096):
        out, err = told("fit", PULLEY, *SET, *ONE, *long, "--data", log, *files, code=4)
    assert "written" not in out
    assert MU_S in out
    assert "fit.png: cannot write the picture" in err


def test_units_offset_and_columns(told: Run, here: Path) -> None:
    data = series(pulley().replace({MU_S: 0.23}), 0.1, angular_velocity=0.0)
    shifted: dict[str, Any] = {
        "t": 1e3 * (data["time"] + 5.0),
        "n": data["angular_velocity"] * 30.0 / 3.141592653589793,
    }
    path = write_csv(here / "rig.csv", shifted)
    out, _ = told(
        *("fit", PULLEY, *SET, "--data", path, "--channel", "angular_velocity=n", "--time", "1"),
        *("--time-unit", "ms", "--time-offset", "-5", "--unit", "angular_velocity=rpm"),
        *("--free", f"{MU_S}=0.1:0.4:0.25", "--starts", "1", "--json"),
    )
    assert strict_json(out)["keys"][MU_S]["value"] == pytest.approx(0.23, rel=1e-6)


def test_a_table_of_runs(told: Run, here: Path) -> None:
    rows = ["W,t"]
    for load in (2000.0, 2200.0):
        result = fs.solve(pulley(), {MU_S: 0.23, LOAD: load})
        rows.append(f"{load},{result.quantities['breakaway_time'].value!r}")
    (here / "curve.csv").write_text("\n".join(rows))
    out, _ = told(
        *("fit", PULLEY, *SET, "--data", "curve.csv", "--quantity", "breakaway_time=t"),
        *("--over", f"{LOAD}=W", "--free", f"{MU_S}=0.1:0.4", "--starts", "1"),
        *("--plot", "curve.svg"),
    )
    assert float(out.splitlines()[3].split()[1]) == pytest.approx(0.23, rel=1e-6)
    assert Path("curve.svg").exists()
    out, _ = told(
        *("fit", PULLEY, *SET, "--quantity", "breakaway_time=0.6", "--free", f"{MU_S}=0.1:0.4"),
        *("--sigma", "breakaway_time=0.01", "--starts", "1", "--json"),
    )
    fitted = fs.solve(pulley(), {MU_S: strict_json(out)["keys"][MU_S]["value"]})
    assert fitted.quantities["breakaway_time"].value == pytest.approx(0.6)


@pytest.mark.slow
def test_a_value_out_of_reach_is_exit_1(told: Run, here: Path) -> None:
    arguments = ("fit", PULLEY, *SET, "--free", f"{MU_S}=0.1:0.4", "--quantity")
    out, err = told(*arguments, "breakaway_time=1.4", code=1)
    reason = "out of reach: breakaway_time = 1.4 s; "
    assert out.splitlines()[-1].startswith(reason)
    assert f"warning: {reason}" in err


def test_a_fit_of_which_all_runs_fail(told: Run, log: Path) -> None:
    limits = ("--set", "solver.max_steps=2", "--set", "mechanism.initial_angular_velocity=1.0")
    out, err = told("fit", PULLEY, *SET, *limits, *ONE, "--data", log, "-o", "f.toml", code=1)
    assert out == ""
    assert err.startswith("frictionsim: the run of the fit failed: limit of 2 steps")
    assert not Path("f.toml").exists()

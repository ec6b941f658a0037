"""What a user's program may look like: each public function with the types that it takes.

`mypy --strict` reads it (test_typing), and it runs.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import frictionsim as fs

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

MU_S = "effects.shaft_friction.mu_s"


def scenarios() -> list[fs.Scenario]:
    """Load a scenario from a path, a text and a dict, with overrides of both kinds."""
    pulley: Path = fs.scenarios()["pulley"]
    text: str = fs.new("pulley")
    by_path: fs.Scenario = fs.load(pulley, {MU_S: 0.3, "solver.rtol": np.float64(1e-8)})
    by_name: fs.Scenario = fs.load(str(pulley), [f"{MU_S}=0.3"])
    by_text: fs.Scenario = fs.loads(text, backend="rkf45")
    tables: dict[str, Any] = by_path.to_dict()
    by_dict: fs.Scenario = fs.load(tables)
    other: fs.Scenario = by_path.replace({"solver.duration": 2.0}, title="shorter")
    written: str = other.to_toml()
    source: str = other.origin.source
    warnings: list[str] = other.warnings()
    print(other.kind, other.title, source, other.interval, len(written), warnings)
    return [by_path, by_name, by_text, by_dict, other]


def report(result: fs.Result) -> float:
    """Use all that a result has."""
    quantity: fs.Quantity = result.quantities["breakaway_time"]
    check: fs.Check = result.audit["energy_balance"]
    data: xarray.Dataset = result.dataset
    events: xarray.Dataset = result.events
    status: str = result.status
    warnings: tuple[str, ...] = result.warnings
    scenario: fs.Scenario = result.scenario
    path: Path | None = result.path
    steps: int = 0 if result.statistics is None else result.statistics.steps
    print(status, result.reason, result.failure, result.exit_code, path, steps, warnings)
    inertia: float = scenario.mechanism.inertia
    print(check.value, check.limit, check.ok, scenario.kind, inertia, result.summary())
    print(data["angle"].attrs["units"], events["contact"].values, result.to_json()["kind"])
    assert quantity.value is not None
    return quantity.value


def simulate(folder: Path) -> None:
    """Solve, save, open, resume, compare and draw."""
    loaded: list[fs.Scenario] = scenarios()
    result: fs.Result = fs.solve(loaded[0], output=folder / "a.h5", no_clobber=True)
    value: float = report(result)
    name: str | PathLike[str] = str(result.save(folder / "b.h5"))
    opened: fs.Result = fs.open(name).check()
    comparison: fs.Comparison = fs.compare(opened, folder / "a.h5", rtol=1e-9, ignore=["energy_*"])
    differences: list[float | None] = [row.difference for row in comparison.rows]
    figure: Figure = fs.plot(result, view="response")
    fs.plot(name, figure=None)
    written: Path = fs.report(result, folder / "a.html")
    moving: Path = fs.animate(result, folder / "a.gif", fps=2.0, speed=np.float64(3.0))
    print(value, written, moving, comparison.same, comparison.notes, differences, figure.axes)
    part: fs.Result = fs.solve(loaded[1], {"solver.max_steps": 100}, progress=print, max_wall=60.0)
    whole: fs.Result = fs.resume(part, progress=False, max_wall=60.0)
    estimated: fs.Result = fs.solve(loaded[4], estimate_error=True)
    errors: dict[str, float | None] = estimated.errors
    print(whole.status, errors)


def other_functions(folder: Path) -> None:
    """Use the rest."""
    quantities: dict[str, fs.Quantity] = fs.static(fs.scenarios()["pulley"], {MU_S: 0.3})
    study: fs.Study = fs.cost(
        fs.scenarios()["pulley"],
        laws=["set-valued"],
        backends="events",
        tolerances=[1e-3],
        max_wall=1.0,
        repeats=1,
    )
    path: Path = study.save(folder / "cost.csv")
    table: xarray.Dataset = study.dataset
    advice: list[str] = study.recommendations
    drawn: Figure = study.plot()
    vary = {MU_S: [0.2, 0.3], "mechanism.load": "lin(1000.0, 2000.0, 3)"}
    swept: fs.Sweep = fs.sweep(fs.scenarios()["pulley"], vary, output=folder / "s.h5")
    sample: fs.Sweep = fs.sweep(scenarios()[1], {MU_S: "uniform(0.2, 0.3)"}, sample=4)
    again: fs.Sweep = fs.open_sweep(folder / "s.h5")
    dataset: xarray.Dataset = again.dataset
    try:
        again = fs.resume_sweep(folder / "s.h5")
    except fs.InputError as error:
        print(error)  # it is done
    print(swept.sizes, sample.sizes, again.sizes, dataset.attrs)
    schema: dict[str, Any] = fs.schema("pulley")
    kinds: tuple[str, ...] = fs.kinds()
    code: int = fs.run_command_line(["check", "pulley"])
    warm_up: Callable[[str], tuple[fs.WarmedUp, ...]] = fs.warm_up  # it takes its seconds
    print(quantities, path, table.sizes, advice, drawn, schema["title"], kinds, warm_up, code)
    print(fs.__version__)


def identify(folder: Path) -> None:
    """Fit a coefficient of friction to measured data."""
    pulley = fs.load(fs.scenarios()["pulley"], {"solver.duration": 1.0, "solver.rtol": 1e-6})
    measured: xarray.Dataset = fs.solve(pulley, {MU_S: 0.23, "output.interval": 0.05}).dataset
    fit: fs.Fit = fs.fit(
        pulley,
        data=measured,
        channels="angular_velocity",
        free={MU_S: (0.1, 0.4)},
        sigma={"angular_velocity": 0.1},
        starts=1,
    )
    values: dict[str, float] = fit.values
    errors: dict[str, float | None] = fit.standard_errors
    intervals: dict[str, tuple[float, float] | None] = fit.intervals
    correlations: dict[str, dict[str, float]] = fit.correlations
    unknown: dict[str, str] = fit.not_identified
    fitted: fs.Scenario = fit.scenario
    path: Path = fit.save_toml(folder / "fitted.toml")
    drawn: Figure = fit.plot()
    print(values, errors, intervals, correlations, unknown, fitted.kind, path, drawn)
    print(fit.status, fit.reduced_chi_squared, fit.residual_rms, fit.summary())


def errors_of(source: str) -> list[str]:
    """Return the faults of a scenario, or why it failed."""
    try:
        fs.solve(source, check=True)
    except fs.ScenarioError as error:
        faults: list[str] = error.faults
        return faults
    except fs.ArgumentError as error:
        print(error.argument, error.text)
    except fs.Interrupted as error:
        print(error.exit_code)
    except (fs.SolverError, fs.AuditError, fs.OutputError, fs.InputError) as error:
        code: int = error.exit_code
        return [f"{code}: {error}"]
    except fs.FrictionsimError:
        raise
    return []


def in_threads() -> list[float | None]:
    """Solve several scenarios at once."""
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(fs.solve, scenarios()))
    return [result.quantities["final_angle"].value for result in results]


def main(folder: Path) -> None:
    """Do all of it."""
    simulate(folder)
    other_functions(folder)
    identify(folder)
    print(errors_of("none.toml"), in_threads())

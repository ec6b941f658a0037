"""Work-precision studies: errors, settings, recommendations, the command `cost`."""

import csv
import json
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.api.studies import Study as PublicStudy
from frictionsim.cli import study_commands
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import Interrupted, SolverError
from frictionsim.results import Metric, Quantity, Transition
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import load, validate
from frictionsim.scenario.methods import SCIPY
from frictionsim.scenario.variants import TOLERANCES, Setting, with_tolerance
from frictionsim.work_precision import settings
from frictionsim.work_precision.outcome import (
    Error,
    Plan,
    Reference,
    Row,
    WorkPrecision,
    metric_errors,
)
from frictionsim.work_precision.recommendation import advise
from frictionsim.work_precision.settings import ScenarioVariants
from frictionsim.work_precision.study import Benchmark, study
from frictionsim.work_precision.table import table_of
from tests.support.cases import slow
from tests.support.problems import RAMP
from tests.support.scenarios import GOLDEN, SCENARIOS, pulley, simulate, with_method

PULLEY, RETURN = (str(SCENARIOS / f"{name}.toml") for name in ("pulley", "pulley_return"))
SHORT = ["--set", "solver.duration=1"]  # the pulley breaks away at 0.8 s


def ignore(what: Any) -> None:
    """Do nothing."""


def ladders_of(path: str) -> list[Setting]:
    scenario = load(Path(path))
    mechanism = mechanism_module(scenario.kind).build(scenario)
    return settings.ladders(scenario, TOLERANCES, mechanism)


def study_of(
    path: str, chosen: list[Setting], repeats: int = 1, references: tuple[Setting, ...] = ()
) -> WorkPrecision:
    scenario = load(Path(path))
    module = mechanism_module(scenario.kind)
    best = references or settings.references(scenario, 1e-12, module.build(scenario))
    return study(scenario, Plan(chosen, best, module.METRICS), 60.0, repeats, ignore, ignore)


def row(
    backend: str,
    error: float | None,
    seconds: float,
    evaluations: int = 6,
    spread: float | None = None,
) -> Row:
    errors = {} if error is None else {"angle": Error(error, error), "energy": Error(0.0, 0.0)}
    status = "failed" if error is None else "done"
    setting = Setting(backend, "rtol 1", ())
    counts = (1, 1, 0, evaluations, 5, 1)
    return Row(setting, status, "", seconds, *counts, errors, wall_spread=spread)


# --- recommendations ------------------------------------------------------------------------


def test_the_fastest_sufficient_setting_is_recommended() -> None:
    rows = [
        row("slow", 1e-9, 3.0),
        row("rough", 5e-3, 0.1),
        row("good", 5e-4, 1.0),
        row("bad", 2.0, 0.01),
        row("broken", None, 0.001),
    ]
    assert [a.row and a.row.setting.backend for a in advise(rows, 0.0)] == ["rough", "good", "slow"]
    assert advise(rows, 0.0)[1].sentence == "for 0.1 %: good with rtol 1, 1 s, error 5.0e-04"
    assert advise(rows[1:2], 0.0)[1].sentence == "for 0.1 %: no setting reached it"
    assert [a.row for a in advise([], 0.0)] == [None, None, None]


def test_equal_times_prefer_the_first_setting() -> None:
    rows = [row("default", 1e-9, 1.05), row("same", 1e-9, 1.0), row("other", 1e-9, 1.2)]
    assert {a.row and a.row.setting.backend for a in advise(rows, 0.0)} == {"default"}


def test_times_within_their_spread_are_ranked_by_evaluations() -> None:
    rows = [row("fast", 1e-9, 1.0, 90, 0.02), row("few", 1e-9, 1.3, 40, 0.4)]
    advice = advise(rows, 0.0)[0]
    assert advice.row is rows[1]
    assert advice.sentence.endswith("; of 2 as fast, the fewest evaluations")
    # They differ by more than the spread of both.
    apart = [row("fast", 1e-9, 1.0, 90, 0.02), row("few", 1e-9, 1.3, 40, 0.2)]
    assert advise(apart, 0.0)[0].row is apart[0]
    # Of a single run the spread is not known: 10 %.
    single = [row("fast", 1e-9, 1.0, 90), row("few", 1e-9, 1.05, 40), row("slow", 1e-9, 1.2, 1)]
    assert advise(single, 0.0)[0].row is single[1]


@given(
    st.lists(
        st.tuples(st.floats(0.1, 2.0), st.integers(1, 5), st.none() | st.floats(0.0, 1.0)),
        min_size=1,
    )
)
def test_nothing_beats_what_is_recommended(drawn: list[tuple[float, int, float | None]]) -> None:
    rows = [row(str(i), 1e-9, *values) for i, values in enumerate(drawn)]
    best = advise(rows, 0.0)[0].row
    assert best is not None
    for other in rows:
        least = 0.1 * max(other.wall_seconds, best.wall_seconds)
        spread = max(other.wall_spread or 0.0, best.wall_spread or 0.0, least)
        if other.wall_seconds < best.wall_seconds - spread:
            # Then another one, as fast as both, has times with a larger spread.
            assert best.rhs_evaluations <= other.rhs_evaluations


def test_nothing_is_recommended_below_the_reference_uncertainty() -> None:
    advice = advise([row("events", 1e-6, 1.0)], 2e-3)
    assert [a.row is None for a in advice] == [False, True, True]
    assert advice[2].sentence == "for 0.01 %: unknown, the reference uncertainty is 2.0e-03"


def test_errors_below_the_reference_uncertainty_are_marked(tmp_path: Path) -> None:
    metrics = (Metric("angle", "quantity", "angle"), Metric("energy", "quantity", "energy"))
    floor = {"angle": Error(1e-6, 1e-6), "energy": Error(1e-9, 1e-9)}
    rows = [row("a", 2e-6, 1.0), row("b", 5e-7, 1.0), row("c", None, 1.0)]
    rows[0].errors["energy"] = Error(5e-10, 5e-10)
    rows[1].errors["energy"] = Error(5e-9, 5e-9)
    scenario = validate(pulley(), SCENARIOS)
    reference = Reference(Told(1.0, 1.0), ("one", "two"), floor)
    public_study = PublicStudy(WorkPrecision(scenario, metrics, reference, rows, "done", "", 0))
    wanted = [["energy"], ["error", "angle"], []]
    assert [line["below_uncertainty"] for line in public_study.to_json()["settings"]] == wanted
    assert [text.split() for text in public_study.dataset["below_uncertainty"].values] == wanted
    cells = [line.split() for line in public_study.summary().splitlines() if "rtol 1 " in line]
    assert [cells[0][3:6], cells[1][3:6]] == [
        ["2.0e-06", "2.0e-06", "5.0e-10*"],
        ["5.0e-07*", "5.0e-07*", "5.0e-09"],
    ]
    for name in ("a.csv", "a.h5"):
        public_study.save(tmp_path / name)
        page = fs.report(tmp_path / name, tmp_path / "a.html").read_text(encoding="utf-8")
        # Two stars of the second row, one of the first, and one that explains them.
        assert page.count("5.0e\N{MINUS SIGN}07*") == 2
        assert page.count("5.0e\N{MINUS SIGN}10*") == 1
        assert page.count("5.0e\N{MINUS SIGN}09*") == 0
        assert "* below the reference uncertainty" in page
    in_time = reference._replace(names=("on its own mesh",))
    about = table_of(public_study.data._replace(time_reference=in_time)).attributes
    assert (about["references"], about["time_references"]) == ("one\ntwo", "on its own mesh")
    unknown = reference._replace(floor={})
    other = PublicStudy(public_study.data._replace(reference=unknown))
    assert [line["below_uncertainty"] for line in other.to_json()["settings"]] == [[], [], []]


def test_the_spread_is_that_of_the_timed_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter([5.0, 0.3, 0.1, 0.35])
    monkeypatch.setattr("frictionsim.work_precision.study._seconds", lambda run: next(times))
    scenario = validate(pulley(solver__duration=0.1), SCENARIOS)
    setting = with_tolerance("events", 1e-3)
    timed = Benchmark(ScenarioVariants(scenario), (), 60.0, 3).row(setting, Told(1.0, 1.0), ignore)
    assert (timed.wall_seconds, timed.wall_spread) == (0.3, pytest.approx(0.25))


# --- errors ---------------------------------------------------------------------------------


class Told:
    """An outcome of one event and one quantity."""

    def __init__(self, time: float, value: float | None, mode: int = 1) -> None:
        self.channels: dict[str, Any] = {}
        self.checks: dict[str, Any] = {}
        self.transitions = [Transition(time, "shaft", 0, mode)]
        self.quantities = {"angle": Quantity(value, "rad")}


EVENTS, FIGURE = Metric("time", "events"), Metric("angle", "quantity", "angle")


def test_errors_are_scaled_and_total_of_other_events_and_missing_quantities() -> None:
    def errors_of(values: Told, wanted: Told, *metrics: Metric) -> dict[str, Error]:
        return metric_errors(metrics or (EVENTS, FIGURE), values, wanted, duration=4.0)

    for time, value in ((1.2, 3.0), (0.8, 1.0)):
        errors = errors_of(Told(time, value), Told(1.0, 2.0))
        assert errors["time"] == (pytest.approx(0.2), pytest.approx(0.05))
        assert errors["angle"] == (1.0, 0.5)
    errors = errors_of(Told(1.0, None, mode=-1), Told(1.0, 2.0))
    assert set(errors.values()) == {Error(None, 1.0)}
    assert errors_of(Told(1.0, None), Told(1.0, None), FIGURE) == {"angle": Error(0.0, 0.0)}


# --- studies of the pulley -----------------------------------------------------------------


@pytest.mark.slow
def test_errors_fall_with_tolerance_and_transition_speed_but_not_those_of_eq_30() -> None:
    by_line: dict[str, list[float]] = {}  # by method and law, from the loosest to the tightest
    for r in study_of(RETURN, ladders_of(RETURN)).rows:
        assert r.error is not None, r.reason
        by_line.setdefault(r.setting.line, []).append(r.error)
    for backend in ("events", "rkf45"):
        errors = by_line.pop(f"{backend}, set-valued")
        # From one rung to the next the tolerance falls by 100, and the error follows it.
        assert all(fine < 0.2 * coarse for coarse, fine in pairwise(errors)), backend
        assert errors[-1] < 1e-12, backend
    # It runs back instead of sticking: other events, and an error of the angle of 58 %.
    assert by_line.pop("rkf45, published") == [1.0, 1.0, 1.0]
    for backend in ("rkf45", "rk45", "dop853", "radau", "bdf", "lsoda"):
        errors = by_line.pop(f"{backend}, regularised")
        # By 10 in speed: at first order 10, where the breakaway decides 10^(2/3) = 4.6.
        assert all(fine < coarse / 4.0 for coarse, fine in pairwise(errors)), backend
        assert errors[0] < 0.02, backend
    assert by_line == {}


def test_the_reference_uncertainty_is_realistic() -> None:
    scenario = validate(pulley(solver__duration=5.0), SCENARIOS)
    metrics = (Metric("final_angle", "quantity", "final_angle"),)
    benchmark = Benchmark(ScenarioVariants(scenario), metrics, 60.0, 1)
    names = settings.references(scenario, 1e-12, mechanism_module("pulley").build(scenario))
    reference = benchmark.reference(names, ignore)
    exact = RAMP[3][1]
    error = abs((reference.outcome.quantities["final_angle"].value or 0.0) / exact - 1.0)
    assert 0.0 < reference.floor["final_angle"].relative < 1e-12
    # `exact` is given to 17 digits; the floor is a difference of two errors of its own size.
    assert error < 10.0 * reference.floor["final_angle"].relative


COUNTS = GOLDEN / "pulley_cost.json"


@pytest.mark.slow
def test_step_counts_agree_with_the_golden_file(request: pytest.FixtureRequest) -> None:
    """Those of our own integrator; SciPy's change with its version."""
    chosen = [s for s in ladders_of(PULLEY) if s.backend in ("events", "rkf45")]
    rows = study_of(PULLEY, chosen).rows
    statistics = {
        f"{r.setting.line}, {r.setting.label}": [r.steps, r.rejected, r.rhs_evaluations]
        for r in rows
    }
    if request.config.getoption("--update-golden"):
        lines = ",\n".join(f"  {json.dumps(name)}: {list_}" for name, list_ in statistics.items())
        COUNTS.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    golden = json.loads(COUNTS.read_text(encoding="utf-8"))
    assert statistics.keys() == golden.keys()
    for name, counts in statistics.items():
        # Sums in another order moved a step in 140, and two rejected ones in 3151.
        assert counts == pytest.approx(golden[name], rel=0.01, abs=3), name


def test_step_counts_exclude_samples() -> None:
    first_row = study_of(PULLEY, [with_tolerance("events", 1e-9)], repeats=2).rows[0]
    bare = simulate(pulley(solver__rtol=1e-9, solver__atol=1e-12, output__interval=3.0))
    assert (first_row.steps, first_row.rhs_evaluations) == (
        bare.statistics.steps,
        bare.statistics.rhs_evaluations,
    )
    assert first_row.repeats == 2


def test_settings_of_a_study_override_the_scenario() -> None:
    scenario = validate(with_method(pulley(solver__step=1e-2), "published", "rkf45"), SCENARIOS)
    variant = ScenarioVariants(scenario).judged(with_tolerance("events", 1e-5))
    assert (variant.solver.backend, variant.solver.step, variant.solver.rtol) == (
        *("events", None),
        1e-5,
    )
    scenario = validate(pulley(output__channels=["mode"]), SCENARIOS)
    assert ScenarioVariants(scenario).judged(with_tolerance("events", 1e-5)).output.channels is None


def test_references_without_friction_use_two_methods() -> None:
    scenario = validate(pulley(effects=None), SCENARIOS)
    mechanism = mechanism_module("pulley").build(scenario)
    names = [setting.backend for setting in settings.references(scenario, 1e-12, mechanism)]
    assert names == ["events", "dop853"]
    variants = settings.ladders(scenario, (1e-4,), mechanism)
    assert [(s.line, s.label) for s in variants] == [
        (name, "rtol 1e-4") for name in ("events", "rkf45", *SCIPY)
    ]


# --- failures ------------------------------------------------------------------------------


FEW_STEPS = Setting(
    *("rk45", "few", ("solver.max_steps=20",), "regularised"),
    ("effects.shaft_friction.law=regularised",),
)


@pytest.fixture(scope="module")
def failing() -> WorkPrecision:
    return study_of(PULLEY, [FEW_STEPS, with_tolerance("events", 1e-5)])


def test_failed_settings_are_reported_with_the_reason(failing: WorkPrecision) -> None:
    assert [r.status for r in failing.rows] == ["failed", "done"]
    assert failing.rows[0].reason.startswith("limit of 20 steps reached at t = ")
    assert failing.rows[0].error is None


def test_failed_references_are_reported_and_an_error_if_all_fail() -> None:
    few = Setting("events", "few", ("solver.max_steps=2",))
    with pytest.raises(SolverError, match=r"all reference runs failed: events, few: limit"):
        study_of(PULLEY, [], references=(few,))
    failed_study = study_of(PULLEY, [], references=(few, with_tolerance("rkf45", 1e-10)))
    said = PublicStudy(failed_study).summary()
    assert "reference uncertainty: unknown, the second reference failed" in said


def stop_after(calls: int) -> Callable[..., Any]:
    """Return a watch under which a signal comes with the n-th step."""

    @contextmanager
    def monitor_run(duration: float, with_progress: bool) -> Iterator[Callable[[float], None]]:
        left = iter(range(calls))

        def on_step(t: float) -> None:
            if next(left, None) is None:
                raise Interrupted(signal.SIGINT, t)

        yield on_step

    return monitor_run


@pytest.mark.parametrize(("calls", "rows"), [(10, 0), (3_000, 2)])
def test_an_interrupted_study_shows_its_results(
    calls: int,
    rows: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    monkeypatch.setattr(study_commands, "CommandMonitor", stop_after(calls))
    table = tmp_path / "table.csv"
    assert run_command_line(["cost", PULLEY, *SHORT, "--csv", str(table)]) == 130
    captured = capsys.readouterr()
    assert "error against run time (interrupted)" in captured.out
    assert captured.out.count("events  rtol") >= min(rows, 1)
    assert captured.err.startswith("frictionsim: study interrupted by SIGINT at t = ")
    assert len(table.read_text(encoding="utf-8").splitlines()) >= 1 + rows


# --- the command ---------------------------------------------------------------------------


@pytest.fixture
def timed_by_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have a run take a millisecond a step, so that no other load decides what is fastest."""
    monkeypatch.setattr(
        "frictionsim.work_precision.study._seconds", lambda run: 1e-3 * run.statistics.steps
    )


def test_the_command_writes_table_json_csv_hdf5_and_picture(
    timed_by_steps: None, cli: Callable, tmp_path: Path
) -> None:
    done = cli(
        *("cost", PULLEY, "--backends", "events,lsoda", "--tolerances", "1e-4,1e-8", *SHORT),
        *("--json", "-o", "a.h5", "--csv", "a.csv", "--plot", "a.png", "--repeats", "1"),
    )
    assert (done.returncode, done.stderr) == (0, "")
    told = json.loads(done.stdout)
    assert [s["setting"] for s in told["settings"][:2]] == ["rtol 1e-4", "rtol 1e-8"]
    assert told["settings"][0]["overrides"] == [
        "effects.shaft_friction.law=set-valued",
        *("solver.rtol=0.0001", "solver.atol=1e-07"),
    ]
    assert told["recommendations"][0]["backend"] == "events"
    assert told["references"] == ["events, set-valued, rtol 5e-10", "rkf45, set-valued, rtol 1e-9"]
    errors = [s["error"] for s in told["settings"]]
    with (tmp_path / "a.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert [float(line["error [1]"]) for line in lines] == errors
    with h5py.File(tmp_path / "a.h5") as file:
        assert list(file["cost/error"][...]) == errors
        assert file["cost/wall_seconds"].attrs["units"] == "s"
        assert file["cost/backend"].asstr()[0] == "events"
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "a.png").stat().st_size < 200_000
    refused = cli("compare", "a.h5", "a.h5")
    assert refused.returncode == 2
    assert "this is a table of `frictionsim cost`, not the result of a run" in refused.stderr


@pytest.mark.parametrize("suffix", [".pdf", slow(".svg")])
def test_a_study_with_failures_can_be_drawn(
    suffix: str, failing: WorkPrecision, tmp_path: Path
) -> None:
    from frictionsim.plots.picture_file import save

    save(PublicStudy(failing).plot(), tmp_path / f"a{suffix}")
    save(PublicStudy(failing._replace(rows=[], reference=None)).plot(), tmp_path / f"b{suffix}")
    if suffix == ".svg":
        drawn = (tmp_path / "a.svg").read_text(encoding="utf-8")
        assert ">rk45, regularised: 1 failed</text>" in drawn


# --- a kind with ladders of its own ----------------------------------------------------------


@pytest.mark.slow
def test_a_belt_compares_tolerances_steps_and_friction_laws() -> None:
    scenario = load(SCENARIOS / "belt_drive.toml", ["solver.duration=0.002"])
    kind = mechanism_module("belt_drive")
    variants = kind.ladders(scenario, TOLERANCES)
    lines = [f"{name}, set-valued" for name in ("rkf45", "moreau")]
    lines.append("rkf45, regularised")
    assert list(dict.fromkeys(s.line for s in variants)) == lines
    for setting in variants:
        variant = ScenarioVariants(scenario).timed(setting)
        assert variant.solver.backend == setting.backend
        assert variant.effects.belt_friction.law == setting.law  # type: ignore[attr-defined]
    chosen = [setting for setting in variants if setting.backend == "moreau"]
    references = kind.references(scenario, 1e-12)
    done = study(scenario, Plan(chosen, references, kind.METRICS), 60.0, 1, ignore, ignore)
    assert [r.status for r in done.rows] == ["done"] * 3
    # The driving torque has just begun to rise: what moves is small and its errors relative to it.
    assert max(r.errors["tension_tight"].relative for r in done.rows) < 1e-4


def test_a_kind_without_metrics_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(mechanism_module("pulley"), "METRICS")
    assert run_command_line(["cost", PULLEY]) == 2

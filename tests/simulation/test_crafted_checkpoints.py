"""A checkpoint with a valid digest and seal is not believed: what does not fit is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.solvers import state_values
from frictionsim.solvers.event_driven import EventDrivenSolver
from frictionsim.solvers.state_values import Values
from tests.support.cases import one_in
from tests.support.crafted_checkpoints import ORIGINALS, craft, small_segments, write_original

# The kernels of these are compiled for little else.
SLOW = [name for name in ORIGINALS if "stiff" in name]
SLOW += ["belt of many effects rkf45", "belt moreau", "string moreau"]
NAMES = [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in ORIGINALS]
PLANE = ["belt moreau", "belt rkf45", "belt of many effects moreau"]
STRINGS = ["string moreau", "string rkf45"]
BELTS, ADAPTIVE = [*PLANE, *STRINGS], ["belt rkf45", "string rkf45"]
State = dict[str, Any]


def set_number(name: str, at: Any, value: float) -> Callable[[State], None]:
    def change(state: State) -> None:
        state[name] = state[name].copy()
        state[name][at] = value

    return change


def refusal(original: str, change: Callable[[State], None], folder: Path) -> str:
    """Return the message with which a crafted checkpoint is refused."""
    path = write_original(original, folder)
    craft(path, change)
    before = path.read_bytes()
    with small_segments(original), pytest.raises(fs.InputError) as refused:
        fs.resume(path)
    assert path.read_bytes() == before
    assert str(refused.value).startswith(f"{path}: cannot resume this run: its checkpoint does not")
    return str(refused.value)


@pytest.mark.parametrize("name", one_in(5, NAMES))
def test_what_is_not_changed_is_resumed(name: str, tmp_path: Path) -> None:
    path = write_original(name, tmp_path)
    craft(path, lambda state: None)
    with small_segments(name):
        assert fs.resume(path).status == "done"


OUT_OF_RANGE: list[tuple[list[str], str, Any, tuple[float, ...], str]] = [
    # whose checkpoints, array, place, numbers that it may not hold there, what is said
    (BELTS, "contact_bodies", 0, (2.0**31, 2.0**52, -1.0), "'stepping.contact_bodies' "),
    (BELTS, "contact_bodies", 3, (5e3,), "'stepping.contact_bodies' "),
    (BELTS, "contact_bodies", 0, (8.0,), "'stepping."),  # which does not go with the others
    (BELTS, "contact_offsets", -1, (2.0**40, 3.0), "'stepping.contact_offsets' "),
    (BELTS, "contact_offsets", 0, (-8.0,), "'stepping.contact_offsets' "),
    (BELTS, "contact_offsets", 1, (1e6, np.nan), "'stepping.contact_offsets' "),
    (BELTS, "contacts", (2, 0), (7.0,), "'stepping.contacts' "),
    (BELTS, "pulleys", (2, 0), (1e-3,), "'stepping.pulleys' "),
    (BELTS, "counts", 0, (-1.0, 0.5), "'stepping.counts' "),
    (BELTS, "y", 0, (np.inf,), "'stepping.y' "),
    (STRINGS, "runs", (0, 0), (23.0,), "'stepping."),
    (STRINGS, "runs", (1, 0), (8.0,), "'stepping."),
    (STRINGS, "runs", (2, 0), (24.0, 0.0), "'stepping."),
    (STRINGS, "runs", (3, 0), (2.0, -1.0), "'stepping."),
    (STRINGS, "run_count", 0, (1e5, 1.0), "'stepping.run"),
    (ADAPTIVE, "clock", 0, (1.0,), "'stepping.clock' "),
    (ADAPTIVE, "clock", 1, (1.0, 0.0), "'stepping.clock' "),
    (ADAPTIVE, "clock", 2, (0.0, -1e-6), "'stepping.clock' "),
    (ADAPTIVE, "clock", 3, (-1.0, np.nan), "'stepping.clock' "),
]


@pytest.mark.parametrize(("names", "array", "at", "values", "message"), one_in(3, OUT_OF_RANGE))
def test_numbers_of_belts_stay_in_their_ranges(
    names: list[str], array: str, at: Any, values: tuple[float, ...], message: str, tmp_path: Path
) -> None:
    """Each number in the checkpoints of two belts, every belt with some of them."""
    for i, value in enumerate(values):
        for name in {names[(len(array) + 3 * i + k) % len(names)] for k in (0, 1)}:
            assert message in refusal(name, set_number(f"stepping.{array}", at, value), tmp_path)


@pytest.mark.parametrize(
    ("name", "array", "at", "value", "message"),
    [
        ("pulley events", "solver.t", (), 99.0, "holds 99, which is out of its range"),
        ("pulley events", "solver.t", (), np.nan, "is not finite"),
        ("pulley events", "solver.mode", (), 3.0, "holds 3, which is out of its range"),
        ("pulley events", "solver.started", (), 0.5, "holds a number that is not whole"),
        ("pulley events", "solver.held", (), -2.0, "holds -2, which is out of its range"),
        ("pulley events", "chattering._times", -1, 0.0, "is not in ascending order"),
        ("pulley rkf45", "stepper._h", (), 0.0, "is not a length of a step"),
        ("pulley rkf45", "stepper._h", (), -1.0, "holds -1, which is out of its range"),
        ("pulley rkf45", "stepper._error_before", (), -1.0, "holds -1, which is out of its"),
        ("pulley rkf45", "stepper.t_old", (), 1.5, "does not go with the other numbers"),
        ("pulley rkf45", "stepper.steps", (), -1.0, "holds -1, which is out of its range"),
        ("pulley rkf45", "times.next", (), 0.7, "does not go with the other numbers"),
        ("pulley rkf45", "buffer.rows", 0, 1.2, "is not in ascending order"),
        ("pulley rkf45", "buffer.rows", 6, 4.0, "holds 4, which is out of its range"),
        ("pulley rkf45", "transitions", (0, 2), 9.0, "holds 9, which is out of its range"),
        ("pulley rkf45", "transitions", (0, 0), -1.0, "holds -1, which is out of its range"),
        ("pulley rkf45", "transitions.contact", 0, b"\xff", "names no contact of it"),
        ("pulley rkf45", "clock.solving", (), -1.0, "holds -1, which is out of its range"),
        ("pulley published", "stepper._h", (), 1e-3, "does not go with the other numbers"),
        ("belt moreau", "samples.time", 0, np.nan, "is not finite"),
        ("belt moreau", "samples.sticking", (0, 0), 1e9, "holds 1e+09, which is out of its range"),
        ("belt moreau", "stepping.counts", 0, 1e9, "holds 1e+09, which is out of its range"),
        ("belt moreau", "stepping.counts", 2, 2.0, "holds 2, which is out of its range (row 2)"),
        ("belt in segments", "stored", 0, 0.0, "does not fit"),
        ("belt in segments", "stored", 1, 8.0, "does not fit"),
        ("belt in segments", "stored", 2, 1e9, "does not fit"),
    ],
)
def test_the_message_names_the_array_and_what_is_wrong(
    name: str, array: str, at: Any, value: Any, message: str, tmp_path: Path
) -> None:
    text = refusal(name, set_number(array, at, value), tmp_path)
    assert f"does not belong to this scenario or was changed: '{array}' {message}" in text


def less_one(name: str) -> Callable[[State], None]:
    return lambda state: state.update({name: state[name][:-1].copy()})


def as_float32(name: str) -> Callable[[State], None]:
    return lambda state: state.update({name: state[name].astype(np.float32)})


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("pulley rkf45", less_one("stepper.y"), "'stepper.y' is of another type or shape"),
        ("pulley rkf45", less_one("buffer.rows"), "'buffer.rows' is of another type or shape"),
        ("pulley rkf45", less_one("transitions"), "'transitions' is of another type or shape"),
        ("pulley rkf45", as_float32("solver.t"), "'solver.t' is of another type or shape"),
        ("pulley rkf45", lambda s: s.pop("solver.t"), "'solver.t' is missing"),
        ("pulley rkf45", lambda s: s.update(a=np.zeros(2)), "'a' is unknown"),
        ("belt rkf45", less_one("stepping.y"), "'stepping.y' is of another type or shape"),
        ("belt rkf45", less_one("samples.x"), "'samples.x' is of another type or shape"),
        ("belt rkf45", lambda s: s.pop("samples.time"), "'samples.time' is missing"),
        ("belt rkf45", lambda s: s.pop("samples.x"), "'samples.x' is missing"),
        ("belt rkf45", lambda s: s.update({"samples.z": np.zeros(2)}), "'samples.z' is unknown"),
        ("belt in segments", lambda s: s.pop("first.x"), "'first.x' is missing"),
        ("belt in segments", less_one("stored"), "'stored' does not fit"),
    ],
)
def test_arrays_are_those_of_the_run(
    name: str, change: Callable[[State], None], message: str, tmp_path: Path
) -> None:
    assert message in refusal(name, change, tmp_path)


def test_what_python_raises_later_is_no_defect(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: Any, on_step: Any) -> None:
        raise ValueError("no change of sign")

    write_original("pulley events", tmp_path)  # kept, as `refusal` writes it again
    monkeypatch.setattr(EventDrivenSolver, "run", fail)
    message = refusal("pulley events", lambda state: None, tmp_path)
    assert "no run continues from it (ValueError)" in message


def test_errors_of_a_progress_function_are_its_own(tmp_path: Path) -> None:
    def progress(t: float) -> None:
        raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        fs.resume(write_original("pulley events", tmp_path), progress=progress)


def test_a_method_without_checkpoints_takes_none(tmp_path: Path) -> None:
    stopped = fs.open(write_original("pulley regularised", tmp_path))
    record, state = stopped.record, stopped.load_checkpoint()
    text = record.attributes["scenario"].replace('"rkf45"', '"radau"')
    record = record._replace(attributes={**record.attributes, "scenario": text}, checkpoint=state)
    with pytest.raises(fs.InputError, match="its backend leaves no state to resume from"):
        fs.resume(fs.Result(record))


def test_what_values_may_be() -> None:
    for expected, good, bad in (
        (state_values.NUMBER, [-1e300, 0.0], [np.inf]),
        (state_values.POSITIVE, [1e-300], [0.0]),
        (state_values.FLAG, [0.0, 1.0], [0.5]),
        (state_values.COUNT, [2.0**53], [2.0**54]),
        (state_values.DIRECTION, [-1.0, 0.0, 1.0], [2.0]),
        (state_values.TIME, [0.0, 2.0], [2.0000001]),
        (state_values.SAMPLE, [np.nan, np.inf], []),
        (Values(ascending=True), [1.0, 1.0, 2.0], [1.0, 0.9]),
    ):
        assert expected.fault(np.array(good), 2.0) == ""
        assert not bad or expected.fault(np.array(bad), 2.0)

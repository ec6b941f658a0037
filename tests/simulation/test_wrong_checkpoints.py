"""A checkpoint whose arrays are not those of its run is refused by name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.crafted_checkpoints import original, write_original

State = dict[str, Any]
OTHER = "is of another type or shape"


def less_one(name: str) -> Callable[[State], None]:
    return lambda state: state.update({name: state[name][:-1].copy()})


def infinite(name: str) -> Callable[[State], None]:
    return lambda state: state.update({name: np.full_like(state[name], np.inf)})


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("pulley rkf45", less_one("step.y"), f"'step.y' {OTHER}"),
        ("pulley events", less_one("step.k_old"), f"'step.k_old' {OTHER}"),
        ("pulley events", less_one("state.y"), f"'state.y' {OTHER}"),
        ("lift with slack rope", less_one("state.modes"), f"'state.modes' {OTHER}"),
        ("gear of given speed", less_one("state.y"), f"'state.y' {OTHER}"),
        ("pulley rkf45", less_one("samples.angle"), f"'samples.angle' {OTHER}"),
        ("pulley events", less_one("sides"), f"'sides' {OTHER}"),
        ("pulley rkf45", less_one("transitions"), f"'transitions' {OTHER}"),
        ("pulley rkf45", lambda s: s.pop("state.t"), "'state.t' is missing"),
        ("pulley rkf45", lambda s: s.update(a=np.zeros(2)), "'a' is unknown"),
        ("pulley events", infinite("state.t"), "'state.t' is not finite"),
        ("string rkf45", less_one("stepping.y"), f"'stepping.y' {OTHER}"),
        ("string rkf45", less_one("samples._excess"), f"'samples._excess' {OTHER}"),
        ("string rkf45", lambda s: s.pop("samples._excess"), "'samples._excess' is missing"),
        ("string rkf45", infinite("stepping.y"), "'stepping.y' is not finite"),
        ("string rkf45", infinite("samples._excess"), "'samples._excess' is not finite"),
    ],
)
def test_arrays_are_those_of_the_run(
    name: str, change: Callable[[State], None], message: str, tmp_path: Path
) -> None:
    path = write_original(name, tmp_path, change)
    before = path.read_bytes()
    with pytest.raises(fs.InputError) as refused:
        fs.resume(path)
    assert path.read_bytes() == before
    assert str(refused.value) == (
        f"{path}: cannot resume this run: its checkpoint does not belong to this scenario or was"
        f" changed: {message}"
    )


def test_errors_of_a_progress_function_are_its_own(tmp_path: Path) -> None:
    def progress(t: float) -> None:
        raise ValueError("mine")

    with pytest.raises(ValueError, match="mine"):
        fs.resume(write_original("pulley events", tmp_path), progress=progress)


def test_a_method_without_checkpoints_takes_none() -> None:
    record = original("pulley regularised").record
    text = record.attributes["scenario"].replace('"rkf45"', '"radau"')
    record = record._replace(attributes={**record.attributes, "scenario": text})
    with pytest.raises(fs.InputError, match="its backend leaves no state to resume from"):
        fs.resume(fs.Result(record))

"""Crafted checkpoints: arrays changed at random, under a new digest and seal."""

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import h5py
import numpy as np

import frictionsim as fs
from frictionsim.errors import BudgetExceeded
from frictionsim.io.checksum import append_trailer
from frictionsim.io.result_format import state_digest
from frictionsim.simulation import sample_store
from tests.attacks.promise import BrokenPromise, outcome
from tests.support.belt_scenarios import pair, trio
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}
SHORT = {"duration": 1.5, "rtol": 1e-4, "atol": 1e-6}
WITHOUT_CONTACT = {"effects__contact": None, "effects__bending": None}


def shipped(name: str, backend: str, **changes: Any) -> Scenario:
    """Return a shipped scenario of one coordinate as data, with few samples."""
    data = fs.load(SCENARIOS / f"{name}.toml").to_dict()
    short = {"solver__rtol": 1e-4, "solver__atol": 1e-6, "solver__backend": backend}
    return changed(data, **{**short, "output__interval": 0.05, **changes})


def sliding(**changes: Any) -> Scenario:
    """Return a pulley that sticks and slips."""
    return pulley(drive__force=SINE, solver=dict(SHORT), output__interval=0.05, **changes)


def belt(data: Scenario, backend: str, **changes: Any) -> Scenario:
    """Return a belt as data, for a few milliseconds."""
    short = {"solver__duration": 4e-3, "output__interval": 2e-4, "solver__backend": backend}
    return changed(data, **{**short, **changes})


SPEED = {"speed": {"sine": {"mean": 0.5, "amplitude": 3.0, "frequency_hz": 0.7}}}
PRESCRIBED: dict[str, Any] = {"drive": SPEED, "solver__duration": 3.0}
LAW = "effects__shaft_friction__law"
PUBLISHED: dict[str, Any] = {LAW: "published", "solver__backend": "rkf45"}
REGULARISED = PUBLISHED | {LAW: "regularised", "effects__shaft_friction__transition_speed": 0.05}
FORMULATION = "mechanism__formulation"
STIFF = {"effects__axial_damping": {"coefficient": 200.0}}
# Scenarios, and after how many calls of `on_step` they are stopped.
ORIGINALS: dict[str, tuple[Callable[[], Scenario], int]] = {
    "pulley events": (lambda: sliding(), 40),
    "pulley rkf45": (lambda: sliding(solver__backend="rkf45"), 60),
    "pulley at rest": (lambda: pulley(output__interval=0.1), 4),
    "pulley published": (lambda: sliding(**PUBLISHED, solver__step=1e-2), 60),
    "pulley regularised": (lambda: sliding(**REGULARISED), 60),
    "pulley frictionless": (lambda: sliding(effects__shaft_friction=None), 40),
    "marble machine events": (lambda: shipped("marble_machine", "events"), 60),
    "marble machine rkf45": (lambda: shipped("marble_machine", "rkf45"), 60),
    "gear events": (lambda: shipped("epicyclic", "events"), 40),
    "gear rkf45": (lambda: shipped("epicyclic", "rkf45"), 40),
    "gear of given speed": (lambda: shipped("epicyclic", "events", **PRESCRIBED), 60),
    "gear published": (lambda: shipped("epicyclic", "rkf45", **{FORMULATION: "published"}), 40),
    "hoist drum events": (lambda: shipped("hoist_drum", "events"), 40),
    "hoist drum rkf45": (lambda: shipped("hoist_drum", "rkf45"), 150),
    "end stop events": (lambda: shipped("hard/bouncing_body", "events"), 40),
    "end stop rkf45": (lambda: shipped("hard/bouncing_body", "rkf45"), 120),
    "lift events": (lambda: shipped("lift", "events"), 25),
    "lift with slack rope": (lambda: shipped("hard/lift_slack_rope", "events"), 40),
    "belt moreau": (lambda: belt(pair(), "moreau"), 12),
    "belt rkf45": (lambda: belt(pair(), "rkf45"), 12),
    "belt stiff moreau": (lambda: belt(pair(**STIFF), "moreau"), 12),
    "belt of many effects moreau": (lambda: belt(trio(), "moreau"), 12),
    "belt of many effects rkf45": (lambda: belt(trio(), "rkf45"), 12),
    "string moreau": (lambda: belt(pair(**WITHOUT_CONTACT), "moreau"), 12),
    "string stiff moreau": (lambda: belt(pair(**WITHOUT_CONTACT, **STIFF), "moreau"), 12),
    "string rkf45": (lambda: belt(pair(**WITHOUT_CONTACT), "rkf45"), 12),
    "belt in segments": (lambda: belt(pair(), "moreau", output__interval=2e-5), 25),
}

NUMBERS = [
    *(0.0, -0.0, 1.0, -1.0, 2.0, 3.0, 0.5, 7.0, 8.0, 64.0, 1e3, -1e3, 1e6, 1e300, -1e300, 1e-300),
    *(float("nan"), float("inf"), -float("inf"), 2.0**31, 2.0**53, -(2.0**53), 2.0**63, 2.0**64),
]
TEXTS = [b"", b"x", b"\xff\xfe", b"shaft\x1b[2J", b"drive", b"hinge", b"a" * 5000]


@contextmanager
def small_segments(name: str) -> Iterator[None]:
    """Have the samples of one original in segments of few samples."""
    before = sample_store.SEGMENT_BYTES, sample_store.MIN_ROW_BYTES
    if name.endswith("segments"):
        sample_store.SEGMENT_BYTES, sample_store.MIN_ROW_BYTES = 16 * 2048, 1
    try:
        yield
    finally:
        sample_store.SEGMENT_BYTES, sample_store.MIN_ROW_BYTES = before


@cache
def original(name: str) -> dict[str, bytes]:
    """Return the files of a run that was stopped, by their names."""
    data, calls = ORIGINALS[name]
    left = iter(range(calls))

    def on_step(t: float) -> None:
        if next(left, None) is None:
            raise BudgetExceeded(f"stopped at t = {t:.9g} s")

    with TemporaryDirectory() as place, small_segments(name):
        folder = Path(place)
        result = fs.solve(data(), output=folder / "a.h5", progress=on_step)
        assert result.failure == "budget_exceeded", f"{name}: {result.status}, {result.reason}"
        paths = [path for path in folder.rglob("*") if path.is_file()]
        return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def write_original(name: str, folder: Path) -> Path:
    """Write the files of a run that was stopped; return its result."""
    for file, content in original(name).items():
        (folder / file).parent.mkdir(exist_ok=True)
        (folder / file).write_bytes(content)
    return folder / "a.partial.h5"


def craft(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change the state in a result, and renew its digest and seal."""
    with h5py.File(path, "r+") as file:
        group = file["checkpoint"]
        state = {name: item[...] for name, item in group.items() if not item.is_scale}
        before = dict(state)
        change(state)
        for name in before.keys() | state.keys():
            if state.get(name) is not before.get(name):
                if name in group:
                    del group[name]
                if name in state:
                    group[name] = state[name]
        group.attrs["digest"] = state_digest(dict(file.attrs), state)
    append_trailer(path)


def changed_array(rng: random.Random, values: Any, state: dict[str, Any]) -> Any:
    """Return an array with a few numbers, its shape or its type changed."""
    if values.dtype.kind == "S":
        texts = np.atleast_1d(values)
        others = np.array([rng.choice(TEXTS)] * len(texts))
        return rng.choice([others, texts[:-1], np.zeros(len(texts))])
    way = rng.randrange(10)
    if way < 6 and values.size:
        array = values.copy()
        for _ in range(rng.choice([1, 1, 1, 3, values.size])):
            at = rng.randrange(values.size)
            near = array.flat[at] + rng.choice([-8, -1, 1, 8]), array.flat[at] * rng.choice([-1, 2])
            array.flat[at] = rng.choice([*NUMBERS, *near])
        return array
    if way == 6:
        return np.full(values.shape, rng.choice(NUMBERS))
    if way == 7:
        shapes = [(), (0,), (1,), (2, 2), (values.size + 1,), (*values.shape, 2)]
        return np.resize(values, rng.choice(shapes)) if values.size else np.zeros(3)
    if way == 8:
        with np.errstate(invalid="ignore"):
            return values.astype(rng.choice(["f4", "i8", "i1", "S8", "c16", "?"]))
    return state[rng.choice(sorted(state))]


def changes(rng: random.Random, state: dict[str, Any]) -> str:
    """Change a state at random; return a description of the change."""
    captured = []
    for _ in range(rng.choice([1, 1, 1, 2, 4])):
        name = rng.choice(sorted(state))
        way = rng.randrange(20)
        if way == 0:
            del state[name]
        elif way == 1:
            state[rng.choice(["more", "samples.more", "first.x", "stored", "stepper.z"])] = state[
                name
            ].copy()
        elif way == 2:
            other = rng.choice(sorted(state))
            state[name], state[other] = state[other].copy(), state[name].copy()
        elif way == 3:
            donor = rng.choice(list(ORIGINALS))
            state.clear()
            state |= state_of(donor)
            captured.append(f"of {donor}")
            break
        else:
            state[name] = changed_array(rng, state[name], state)
        captured.append(f"{name} way {way}")
    return "; ".join(captured)


@cache
def state_of(name: str) -> dict[str, Any]:
    """Return the state in an original."""
    with TemporaryDirectory() as place, h5py.File(write_original(name, Path(place)), "r") as file:
        items = file["checkpoint"].items()
        return {name: item[...] for name, item in items if not item.is_scale}


def attack(rng: random.Random, folder: Path) -> str:
    """Resume a run from a crafted checkpoint: refused, or a sound file comes of it."""
    name = rng.choice(list(ORIGINALS))
    return f"{name}: {attack_on(name, rng, folder)}"


def warm_up() -> None:
    """Make all originals."""
    for name in ORIGINALS:
        original(name)


def attack_on(name: str, rng: random.Random, folder: Path) -> str:
    """Craft a checkpoint of one of the originals, as `attack`."""
    path, captured = write_original(name, folder), [name]
    craft(path, lambda state: captured.append(changes(rng, state)))
    description = "; ".join(captured)
    command = ["resume", str(path), "-q", "-o", str(folder / "b.h5"), "--max-wall", "1"]
    with small_segments(name):
        code = outcome(command, description)
    written = folder / "b.h5"
    if code == "exit 2":
        if written.exists():
            raise BrokenPromise(f"{command}: refused, but there is a file\n{description}")
        return code
    if code == "exit 4":
        raise BrokenPromise(f"{command}: {code}\n{description}")
    if not written.exists():  # it failed before its first step
        return code
    time = np.asarray(fs.open(written).record.channels["time"])
    if not (np.all(np.isfinite(time)) and np.all(np.diff(time) >= 0.0)):
        raise BrokenPromise(f"{command}: {code}, its times are not in order\n{description}")
    if code == "exit 0" and (fault := physics_fault(path, written, "regularised" in name)):
        raise BrokenPromise(f"{command}: {code}, but {fault}\n{description}")
    return "sound"


ENERGY = 0.02  # of the largest change of an energy: runs at rtol 1e-4 were seen to miss 1e-3


def physics_fault(part: Path, whole: Path, creeps: bool) -> str:
    """Return the contradiction in a resumed run that passed its audit; empty if there is none.

    From the recorded channels alone: energies add up, what sticks is at rest, friction brakes.
    """
    with h5py.File(part, "r") as file:
        since = file["time"][-1]
    with h5py.File(whole, "r") as file:
        rows = file["time"][...] > since
        columns = {name: file[name] for name in file if isinstance(file[name], h5py.Dataset)}
        data = {n: of[...][rows] for n, of in columns.items() if of.shape[:1] == rows.shape}
    if np.sum(rows) < 2:
        return ""
    energies = {name: values for name, values in data.items() if name.startswith("energy_")}
    gained = sum(energies.values()) - 2.0 * energies.get("energy_input", 0.0)
    largest = max(np.ptp(values) for values in energies.values())
    if np.ptp(gained) > ENERGY * largest:
        return f"its energies change by {np.ptp(gained):.3g} J in all, and none by {largest:.3g} J"
    if data.keys() >= {"mode", "angular_velocity", "friction_torque"}:
        mode, speed, torque = data["mode"], data["angular_velocity"], data["friction_torque"]
        if not creeps and np.any(speed[mode == 0]):
            return "it moves while it sticks"
        if np.any(torque * speed > 0.0):
            return "friction drives it"
    return ""

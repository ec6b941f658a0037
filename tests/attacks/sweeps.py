"""Sweeps: values and studies that are damaged, files and journals that others have changed."""

import random
import re
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path
from signal import SIGTERM
from typing import Any

import h5py

import frictionsim as fs
from frictionsim.api.sweeping import SweepInterrupted
from frictionsim.io.checksum import LENGTH, SWEEP, append_trailer
from frictionsim.io.unfinished import partial_name
from frictionsim.parameter_study import dispatch
from frictionsim.simulation.monitor import SweepProgress
from tests.attacks import journals
from tests.attacks.hdf5_bytes import damaged_file
from tests.attacks.promise import outcome
from tests.attacks.toml import TOKENS, edited
from tests.support.scenarios import SCENARIOS

TARGET, STUDY = "sweep.h5", "study.toml"
PULLEY = SCENARIOS / "pulley.toml"
MU_S, LOAD = "effects.shaft_friction.mu_s", "mechanism.load"
SHORT = ["--set", "solver.rtol=1e-4", "-j", "1", "-q"]
VALUES = [
    *("[0.2, 0.3]", "lin(0.2, 0.4, 3)", "log(0.2, 0.4, 3)", '["none", "x"]', "[[0.2], [0.3]]"),
    *("uniform(0.2, 0.4)", "normal(0.3, 0.01)", "lognormal(-1.2, 0.1)"),
    "triangular(0.2, 0.3, 0.4)",
]
PIECES = [
    *TOKENS,
    *["(", ")", ",", "lin", "normal", "1e9", "1e-9", "-0.0", "1e308", "__import__('os')"],
]
KEYS = [MU_S, LOAD, "solver.duration", "drive.force.value.1", "drive.force", "title", "kind", ""]


@cache
def originals() -> tuple[bytes, ...]:
    """Return files of sweeps: a grid and a sample, done and interrupted."""
    with tempfile.TemporaryDirectory() as name:
        target, loose = Path(name) / TARGET, {"solver.rtol": 1e-4}
        vary = {MU_S: [0.2, 0.3], "drive.direction": ["vertical", "horizontal"]}
        often, dispatch.SECONDS_BETWEEN_TICKS = dispatch.SECONDS_BETWEEN_TICKS, 0.0
        designs: list[dict[str, Any]] = [
            {"vary": vary},
            {"vary": {MU_S: "uniform(0.2, 0.4)"}, "sample": 4},
        ]
        contents = []
        for design in designs:
            fs.sweep(PULLEY, overrides=loose, output=target, **design)
            contents.append(target.read_bytes())
            with suppress(SweepInterrupted):
                fs.sweep(PULLEY, overrides=loose, output=target, progress=_stop, **design)
            contents.append(partial_name(target).read_bytes())
            partial_name(target).unlink()
        dispatch.SECONDS_BETWEEN_TICKS = often
        return tuple(contents)


def _stop(progress: SweepProgress) -> None:
    if progress.done and progress.checked == progress.total:
        raise SweepInterrupted(SIGTERM)


def attack(rng: random.Random, folder: Path) -> str:
    """Give values or a study that are damaged, or use a file or journal that is."""
    return rng.choice([_values, _study, _file, _content, _content, journals.attack])(rng, folder)


def _values(rng: random.Random, folder: Path) -> str:
    options = []
    for _ in range(rng.randint(1, 3)):
        text = edited(rng, rng.choice(VALUES), PIECES) if rng.random() < 0.7 else rng.choice(VALUES)
        options += ["--vary", f"{rng.choice(KEYS)}={text}".replace("\0", "")]
    if rng.random() < 0.5:
        options += ["--sample", rng.choice(["4", "0", "-1", "1e3", "1000000000000", "x", "3"])]
        options += rng.choice([[], ["--indices"], ["--method", "lhs"], ["--method", "x"]])
    elif rng.random() < 0.3:
        options += ["--zip"]
    return outcome(["sweep", str(PULLEY), *options, "-o", TARGET, *SHORT], " ".join(options))


def _study(rng: random.Random, folder: Path) -> str:
    text = (
        f'[study]\nscenario = "{PULLEY.as_posix()}"\nsample = 4\n[set]\nsolver.rtol = 1e-4\n'
        f'[vary]\n{MU_S} = "uniform(0.2, 0.4)"\n"{LOAD}" = "normal(2000, 10)"\n'
    )
    changed = edited(rng, text, PIECES)
    (folder / STUDY).write_text(changed, encoding="utf-8", errors="replace")
    return outcome(["sweep", STUDY, "-o", TARGET, "-j", "1", "-q"], changed)


def _file(rng: random.Random, folder: Path) -> str:
    raw, way = damaged_file(rng, rng.choice(originals()))
    (folder / TARGET).write_bytes(raw)
    show = [["show", TARGET, *more] for more in ([], ["--json"], ["--csv"], ["--study"])]
    arguments = rng.choice([*show, ["plot", TARGET, "-o", "a.svg"], ["resume", TARGET, "-q"]])
    return outcome(arguments, way)


TEXTS = [
    *("", "x", "{}", "[]", "[" * 30_000, '{"a": 1e999}', "done", "interrupted", "grid", "sample"),
    *("\x1b[2J", "x=" + "[" * 30_000, "9" * 5000, "a" * 70_000, '[study]\nscenario = "secret"\n'),
]
HUGE = ["1e999", "9" * 30, "9" * 400]
NUMBERS = [float("nan"), float("inf"), -1.0, 0.0, 1e300, 127.0]


def _content(rng: random.Random, folder: Path) -> str:
    """Change attributes and values; the checksum is renewed, and no secret is read."""
    path = folder / rng.choice((TARGET, "sweep.partial.h5"))
    path.write_bytes(rng.choice(originals())[:-LENGTH])
    Path("secret").write_text("hunter2 = 1\n")
    with h5py.File(path, "r+") as file:
        way = "; ".join(_changed(rng, file) for _ in range(rng.choice((1, 1, 2))))
    append_trailer(path, SWEEP)
    show = ["show", path.name, *rng.choice(([], ["--json"], ["--csv"], ["--scenario"]))]
    draw = ["plot", path.name, "-o", "a.svg"], ["report", path.name, "-o", "a.html"]
    resume = ["resume", path.name, "-q", "-j", "1"]
    command = rng.choice([show, *draw, resume, [*resume, "-o", "other.h5"]])
    code = outcome(command, way, secret="hunter2")
    if command[0] == "resume" and code == "exit 0":
        outcome(["show", "other.h5" if "-o" in command else TARGET], f"resumed: {way}")
    return code


def _changed(rng: random.Random, file: Any) -> str:
    name = rng.choice([*file.attrs, *file])
    if name in file.attrs:
        text = str(file.attrs[name])
        changed = edited(rng, text, PIECES), text.replace("0.2", "nan"), _with_huge(rng, text)
        new = rng.choice([rng.choice(TEXTS), *changed])
        with suppress(ValueError):  # HDF5 takes no such text
            file.attrs[name] = new.replace("\0", "").encode("utf-8", "replace").decode()
        return f"{name} = {new[:200]!r}"
    dataset = file[name]
    if dataset.dtype.kind == "f" and dataset.size and rng.random() < 0.8:
        values = dataset[...]
        values.flat[rng.randrange(values.size)] = rng.choice(NUMBERS)
        dataset[...] = values
        return f"{name}: {values}"
    del file[name]
    return f"{name} is missing"


def _with_huge(rng: random.Random, text: str) -> str:
    """Return a text in which one of the numbers is huge."""
    numbers = [*re.finditer(r"\d+(\.\d+)?", text)]
    if not numbers:
        return text
    start, end = rng.choice(numbers).span()
    return text[:start] + rng.choice(HUGE) + text[end:]


def warm_up() -> None:
    """Make the originals that the cases change."""
    originals()
    journals.original()

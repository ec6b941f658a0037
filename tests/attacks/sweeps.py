"""Sweeps: values and studies that are damaged, files and journals that others have changed."""

import random
import tempfile
from functools import cache
from pathlib import Path

import frictionsim as fs
from frictionsim.io.checksum import LENGTH
from tests.attacks import journals
from tests.attacks.hdf5_bytes import damaged, sealed
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
    """Return files of sweeps: a grid and a sample."""
    with tempfile.TemporaryDirectory() as name:
        target, loose = Path(name) / TARGET, {"solver.rtol": 1e-4}
        vary = {MU_S: [0.2, 0.3], "drive.direction": ["vertical", "horizontal"]}
        fs.sweep(PULLEY, vary, loose, output=target)
        grid = target.read_bytes()
        fs.sweep(PULLEY, {MU_S: "uniform(0.2, 0.4)"}, loose, sample=4, output=target)
        return grid, target.read_bytes()


def attack(rng: random.Random, folder: Path) -> str:
    """Give values or a study that are damaged, or use a file or journal that is."""
    return rng.choice([_values, _study, _file, _file, journals.attack])(rng, folder)


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
    whole = rng.choice(originals())
    content = bytearray(whole[:-LENGTH])
    way = damaged(rng, content)
    raw, seal = sealed(rng, bytes(content), whole[-LENGTH:])
    (folder / TARGET).write_bytes(raw)
    show = [["show", TARGET, *more] for more in ([], ["--json"], ["--csv"], ["--study"])]
    arguments = rng.choice([*show, ["plot", TARGET, "-o", "a.svg"], ["resume", TARGET, "-q"]])
    return outcome(arguments, f"{way}, checksum {seal}")


def warm_up() -> None:
    """Make what the cases change."""
    originals()
    journals.original()

"""Fits: data of others, with numbers, times and columns as no measurement has them."""

import random
from pathlib import Path

from tests.attacks.promise import outcome
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")
HEAD = "time,angular_velocity"
CELLS = [
    *(
        "0",
        "0.5",
        "1",
        "3",
        "-1",
        "1e200",
        "-1e308",
        "1e50",
        "1e-320",
        "nan",
        "inf",
        "",
        "x",
        "1,2",
    ),
    *("1,2", "0x10", "1e999", "\x1b[2J", '"', "1_0", "\u0661", "9" * 400),
]
FREE = "effects.shaft_friction.mu_s=0.05:0.4"


def attack(rng: random.Random, folder: Path) -> str:
    """Fit one number to crafted data, with few runs."""
    rows = [[str(0.3 * i), str(0.1 * i)] for i in range(rng.choice((0, 1, 2, 5)))]
    for _ in range(rng.choice((0, 1, 1, 3))):
        if rows:
            rows[rng.randrange(len(rows))][rng.randrange(2)] = rng.choice(CELLS)
    head = HEAD if rng.random() < 0.8 else rng.choice(["", "a", "time", "time,time", f"{HEAD},x"])
    text = "\n".join([head, *map(",".join, rows)])
    Path("d.csv").write_text(text, encoding="utf-8")
    channel = rng.choice(("angular_velocity",) * 4 + ("angle", "mode", "none"))
    given = ["--data", "d.csv", "--channel", channel, "--free", FREE, "--starts", "1"]
    return outcome(["fit", PULLEY, *given, "--set", "solver.rtol=1e-3"], f"{channel}: {text}")

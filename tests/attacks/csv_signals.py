"""Damaged CSV files of signals, by columns and without."""

import random
from pathlib import Path

from tests.attacks.promise import outcome
from tests.attacks.toml import edited
from tests.support.scenarios import SCENARIOS

SIGNALS = (
    '{ csv = "force.csv" }',
    '{ csv = "force.csv", time = "time", value = "force" }',
    '{ csv = "force.csv", value = 2, decimal = ",", delimiter = ";" }',
    '{ csv = "force.csv", time = 1, value = "force", delimiter = "," }',
)
TOKENS = ["nan", "inf", "1e999", ",", ";", "\t", "\n", "#", "x", "\ufeff", "-1", "0.1", "\x00"]
TOKENS += ["1e-310", "1e60", "\r", '"', "\x1b[2J", "\u2028", "1_0", "٣", "0x10", "," * 5000]


def attack(rng: random.Random, folder: Path) -> str:
    """Check or solve a pulley whose force is in a damaged file."""
    lines = [f"{0.1 * i}, {2000 + 100 * i}" for i in range(12)]
    text = edited(rng, "time, force\n" + "\n".join(lines), TOKENS)
    raw = text.encode("utf-8", "replace")
    if rng.random() < 0.2:
        raw = rng.choice([text.encode("utf-16"), rng.randbytes(40), raw * 300, b"1,\n" * 70_000])
    (folder / "force.csv").write_bytes(raw)
    scenario = folder / "s.toml"
    source = (SCENARIOS / "pulley.toml").read_text()
    ramp = "{ time = [0.0, 0.8], value = [1832.6, 3113.75] }"
    assert ramp in source
    scenario.write_text(source.replace(ramp, rng.choice(SIGNALS)))
    command = rng.choice([["check"], ["solve", "-q", "-o", "a.h5", "--max-wall", "0.05"]])
    return outcome([command[0], str(scenario), *command[1:]], repr(raw[:2000]))

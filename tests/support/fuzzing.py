"""Damaged input for the command line, case by case in a process of its own with bounded memory.

    python -m tests.support.fuzzing WHAT SEED COUNT

makes COUNT cases of WHAT (toml, csv) from a seed and prints the count of each exit
code as JSON. A case that ends in a traceback, in an undocumented exit code,
or without a message ends the process.
"""

import contextlib
import faulthandler
import io
import json
import random
import resource
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from frictionsim.cli.commands import run_command_line
from tests.support.scenarios import SCENARIOS

MEMORY = 2 << 30  # address space; the program and its libraries take half a gigabyte of it
LEGAL = {
    "check": {0, 2},
    "static": {0, 2},
    "solve": {0, 1, 2, 3, 5},
}

Case = tuple[list[str], str]
TOKENS = [
    *("nan", "inf", "-1", "0", "1e400", "1e-320", "9" * 400, "true", '"x"', "[]", "{}", "[[[", "#"),
    *("=", "\n", "\x00", "é", "[effects]", "[solver]\n", 'kind = "epicyclic"\n', "1979-05-27"),
    *("[" * 900, "a.b.c = 1\n", "{sine={amplitude=1e308, frequency_hz=1e308}}", '{csv="s.toml"}'),
    *("drive.force = 1\n", "max_steps = 3\n", "duration = 1e-300\n", "interval = 1e-9\n"),
]


CSV_SIGNALS = (
    '{ csv = "force.csv" }',
    '{ csv = "force.csv", time = "time", value = "force" }',
    '{ csv = "force.csv", value = 2, decimal = ",", delimiter = ";" }',
    '{ csv = "force.csv", time = 1, value = "force", delimiter = "," }',
)


def edited(rng: random.Random, text: str, tokens: list[str]) -> str:
    """Return a text with a few pieces cut out, doubled, moved or replaced."""
    for _ in range(rng.randint(1, 5)):
        a = rng.randrange(len(text) + 1)
        b = min(len(text), a + rng.choice([0, 1, 2, 8, 60]))
        piece = rng.choice([rng.choice(tokens), "", text[a:b] * 2, chr(rng.randrange(1, 0x2FF))])
        text = text[:a] + piece + text[b:]
    return text


def toml_case(rng: random.Random, folder: Path) -> Case:
    path = folder / "s.toml"
    source = rng.choice(sorted(SCENARIOS.glob("*.toml"))).read_text()
    if rng.random() < 0.3:  # replace a word
        words = source.split(" ")
        words[rng.randrange(len(words))] = rng.choice(TOKENS)
        text = " ".join(words)
    else:
        text = edited(rng, source, TOKENS)
    path.write_text(text, errors="replace")
    command = rng.choice(["check", "check", "static", "solve"])
    bounded = ["-o", "a.h5", "-q", "--max-wall", "0.05"] if command == "solve" else []
    return [command, str(path), *bounded], text


def csv_case(rng: random.Random, folder: Path) -> Case:
    lines = [f"{0.1 * i}, {2000 + 100 * i}" for i in range(12)]
    tokens = ["nan", "inf", "1e999", ",", ";", "\t", "\n", "#", "x", "\ufeff", "-1", "0.1", "\x00"]
    text = edited(rng, "time, force\n" + "\n".join(lines), tokens)
    raw = text.encode()
    if rng.random() < 0.2:
        raw = rng.choice([raw.decode().encode("utf-16"), bytes(rng.randbytes(40)), raw * 300])
    (folder / "force.csv").write_bytes(raw)
    scenario = folder / "s.toml"
    scenario.write_text(
        (SCENARIOS / "pulley.toml")
        .read_text()
        .replace("{ time = [0.0, 0.8], value = [1832.6, 3113.75] }", rng.choice(CSV_SIGNALS))
    )
    command = rng.choice([["check"], ["solve", "-q", "-o", "a.h5", "--max-wall", "0.05"]])
    return [command[0], str(scenario), *command[1:]], repr(raw[:2000])


def outcome(arguments: list[str]) -> tuple[int, str]:
    """Run the command line in this process; return its exit code and stderr."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run_command_line(arguments)
    return code, err.getvalue()


def run_case(case: Case) -> int:
    arguments, description = case
    code, captured = outcome(arguments)
    legal = code in LEGAL[arguments[0]] and "Traceback" not in captured
    if legal and (code == 0 or captured.startswith("frictionsim: ")):
        return code
    print(f"{arguments}: exit {code}, {captured!r}\n{description}", file=sys.stderr)
    raise SystemExit(1)


def main(what: str, seed: int, count: int) -> None:
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    codes: Counter[int] = Counter()
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        folder = Path(name)
        makers: dict[str, Callable[[random.Random], Case]] = {
            "toml": lambda rng: toml_case(rng, folder),
            "csv": lambda rng: csv_case(rng, folder),
        }
        for number in range(count):
            case_seed = f"{what} {seed} {number}"
            print(case_seed, file=sys.stderr)  # the last one printed ended the process
            codes[run_case(makers[what](random.Random(case_seed)))] += 1
    print(json.dumps({str(code): n for code, n in sorted(codes.items())}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))

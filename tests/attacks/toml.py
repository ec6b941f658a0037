"""Damaged scenarios: pieces cut out, doubled, moved, replaced; and texts made by a grammar."""

import random
from functools import cache
from pathlib import Path

from tests.attacks.promise import outcome
from tests.support.scenarios import SCENARIOS

TOKENS = [
    *("nan", "inf", "-1", "0", "1e400", "1e-320", "9" * 400, "true", '"x"', "[]", "{}", "[[[", "#"),
    *("=", "\n", "\x00", "é", "[effects]", "[solver]\n", 'kind = "epicyclic"\n', "1979-05-27"),
    *("[" * 900, "a.b.c = 1\n", "{sine={amplitude=1e308, frequency_hz=1e308}}", '{csv="s.toml"}'),
    *("drive.force = 1\n", "max_steps = 3\n", "duration = 1e-300\n", "interval = 1e-9\n"),
    *('name = "load"\n', "[[forces]]\n", "[[couples]]\n", "{angle_deg=[0], value=[1]}"),
    *("a." * 500 + "a = 1\n", "\x1b]0;title\x07", "\u202e", '{csv="/dev/zero"}', '{csv="."}'),
]
KEYS = ["kind", "title", "solver", "output", "mechanism", "drive", "effects", "forces", "couples"]
KEYS = [*KEYS, "a-b", '"q q"', "''"]


@cache
def sources() -> tuple[str, ...]:
    """Return the texts of the shipped scenarios, hard ones included."""
    return tuple(path.read_text() for path in sorted(SCENARIOS.rglob("*.toml")))


def edited(rng: random.Random, text: str, tokens: list[str]) -> str:
    """Return a text with a few pieces cut out, doubled, moved or replaced."""
    for _ in range(rng.randint(1, 5)):
        a = rng.randrange(len(text) + 1)
        b = min(len(text), a + rng.choice([0, 1, 2, 8, 60]))
        piece = rng.choice([rng.choice(tokens), "", text[a:b] * 2, chr(rng.randrange(1, 0x2FF))])
        text = text[:a] + piece + text[b:]
    return text


def value(rng: random.Random, depth: int) -> str:
    """Return a TOML value, often legal."""
    if depth > 3 or rng.random() < 0.6:
        return rng.choice(TOKENS[:13]) if rng.random() < 0.3 else f"{rng.uniform(-2, 2):.3g}"
    inner = [value(rng, depth + 1) for _ in range(rng.randint(0, 4))]
    if rng.random() < 0.5:
        return "[" + ", ".join(inner) + "]"
    return "{" + ", ".join(f"{rng.choice(KEYS)} = {item}" for item in inner) + "}"


def grammatical(rng: random.Random) -> str:
    """Return a text of tables and keys that is TOML, mostly, and hardly a scenario."""
    kinds = ["pulley", "belt_drive", "epicyclic", "marble_machine", "shaft"]
    lines = [f'kind = "{rng.choice(kinds)}"']
    for _ in range(rng.randint(1, 12)):
        name = ".".join(rng.choices(KEYS, k=rng.randint(1, 4)))
        if rng.random() < 0.4:
            lines.append(rng.choice(["[{}]", "[[{}]]"]).format(name))
        else:
            lines.append(f"{name} = {value(rng, 0)}")
    if rng.random() < 0.05:
        form = rng.choice(["[t{}]", "k{} = 1", "[[list]]\na{} = 1"])
        lines += [form.format(i) for i in range(rng.choice([100, 3000, 20_000]))]
    return "\n".join(lines)


def attack(rng: random.Random, folder: Path) -> str:
    """Check, solve or statically solve a damaged scenario."""
    source, way = rng.choice(sources()), rng.random()
    if way < 0.25:  # replace a word
        words = source.split(" ")
        words[rng.randrange(len(words))] = rng.choice(TOKENS)
        text = " ".join(words)
    elif way < 0.45:  # a line of another scenario
        lines = source.split("\n")
        lines.insert(rng.randrange(len(lines)), rng.choice(rng.choice(sources()).split("\n")))
        text = "\n".join(lines)
    elif way < 0.6:
        text = grammatical(rng)
    else:
        text = edited(rng, source, TOKENS)
    path = folder / "s.toml"
    path.write_bytes(text.encode("utf-8", "replace"))
    if way > 0.95:
        path.write_bytes(damaged_bytes(rng, path.read_bytes()))
    command = rng.choice(["check", "check", "static", "solve"])
    if command == "solve" and "belt_drive" in text:
        command = "static"  # kernels would be compiled for each combination of effects
    bounded = ["-o", "a.h5", "-q", "--max-wall", "0.05"] if command == "solve" else []
    return outcome([command, str(path), *bounded], text[:5000])


def damaged_bytes(rng: random.Random, raw: bytes) -> bytes:
    """Return bytes that are another encoding, cut off, or changed anywhere."""
    changed = bytearray(raw or b"x")
    for _ in range(rng.randint(1, 9)):
        changed[rng.randrange(len(changed))] = rng.randrange(256)
    text = raw.decode("utf-8", "replace")
    return rng.choice([bytes(changed), text.encode("utf-16"), raw[: rng.randrange(len(raw) + 1)]])

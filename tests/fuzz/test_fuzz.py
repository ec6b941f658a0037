"""Inputs edited at random: a command answers with a sentence and a documented exit code.

Scenarios, CSV files and results are cut, doubled, moved and replaced in places; what comes of it is
refused or used, without a traceback; `fs.load` and `fs.open` raise errors of `fs` alone.
"""

from contextlib import suppress
from pathlib import Path
from typing import Any
from zlib import crc32

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from tests.support.examples import examples
from tests.support.scenarios import SCENARIOS, frictionsim, in_this_process

SOURCES = [path.read_text(encoding="utf-8") for path in sorted(SCENARIOS.rglob("*.toml"))]
NUMBERS = ("nan", "inf", "-1", "0", "1e400", "1e-320", "9" * 400, "true", '"x"', "[]", "{}")
PIECES = (
    *(*NUMBERS, "", "=", "\n", "#", "\x00", "é", "[[[", "[" * 900, "a." * 500 + "a = 1\n"),
    *("[effects]", "[solver]\n", 'kind = "epicyclic"\n', "1979-05-27", "[[forces]]\n"),
    *("07:32:00", "{a = [{b = 1979-05-27T07:32:00Z}]}"),
    *("{sine={amplitude=1e308, frequency_hz=1e308}}", '{csv="s.toml"}', '{csv="/dev/zero"}'),
    *("max_steps = 3\n", "duration = 1e-300\n", "interval = 1e-9\n", "\x1b]0;title\x07", "\u202e"),
)
KEYS = (
    *("title", "mechanism", "mechanism.inertia", "drive.force", "drive.force.value.1", "forces.0"),
    *("effects.shaft_friction", "effects.shaft_friction.mu_s", "solver.backend", "output.channels"),
)
CSV_PIECES = (
    *("", "nan", "inf", "1e999", ",", ";", "\t", "\n", "#", "x", "\ufeff", "-1", "0.1", "\x00"),
    *("1e-310", "1e60", "\r", '"', "\x1b[2J", "\u2028", "1_0", "٣", "0x10", "," * 5000, "[N]"),
)
SIGNALS = (
    '{ csv = "force.csv" }',
    '{ csv = "force.csv", time = "time", value = "force" }',
    '{ csv = "force.csv", value = 2, decimal = ",", delimiter = ";" }',
)
TABLE = "time, force\n" + "".join(f"{0.1 * i}, {2000 + 100 * i}\n" for i in range(12))
BOUNDED = ("-q", "-o", "a.h5", "--max-wall", "0.05")
CODES = {  # of `docs/failures.md`
    "check": {0, 2},
    "static": {0, 2},
    "solve": {0, 1, 2, 3, 5},
    "show": {0, 2},
    "plot": {0, 2},
    "compare": {0, 1, 2},
    "resume": {0, 1, 2, 3, 5},
}


@st.composite
def edited(draw: st.DrawFn, texts: list[str], pieces: tuple[str, ...]) -> str:
    """Return a text with pieces cut out, doubled, moved or replaced in some places."""
    text = draw(st.sampled_from(texts))
    for _ in range(draw(st.integers(0, 4))):
        start = draw(st.integers(0, len(text)))
        end = min(len(text), start + draw(st.sampled_from((0, 1, 2, 8, 60))))
        piece = draw(st.sampled_from((*pieces, text[start:end] * 2, text[:60])))
        text = text[:start] + piece + text[end:]
    return text


def assert_answered(
    capsys: pytest.CaptureFixture[str], command: str, *arguments: str | Path
) -> None:
    """Check that a command says what is wrong in a sentence, with a code that is documented."""
    done = in_this_process(capsys, command, *arguments)
    assert done.returncode in CODES[command], done
    assert "Traceback" not in done.stderr
    assert "out of memory" not in done.stderr
    assert done.returncode == 0 or command == "compare" or done.stderr.startswith("frictionsim: ")


@given(
    text=edited(SOURCES, PIECES),
    encoding=st.sampled_from(("utf-8",) * 8 + ("utf-16", "latin-1")),
    overrides=st.lists(
        st.tuples(st.sampled_from(KEYS), st.sampled_from(PIECES)).map("=".join), max_size=2
    ),
    command=st.sampled_from(("check", "static", "solve")),
)
def test_an_edited_scenario_is_used_or_refused(
    text: str, encoding: str, overrides: list[str], command: str, here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = here / "s.toml"
    path.write_bytes(text.encode(encoding, "replace"))
    loaded = None
    with suppress(fs.ScenarioError):
        loaded = fs.load(path, overrides)
    if loaded:  # it can be printed and loaded again, the interval of its samples filled in
        assert fs.loads(loaded.to_toml()) == loaded.replace({"output.interval": loaded.interval})
    if command == "solve" and "belt" in text:
        command = "check"  # kernels would be compiled for each combination of effects
    words = [word for override in overrides for word in ("--set", override)]
    assert_answered(capsys, command, path, *words, *(BOUNDED if command == "solve" else ()))


@given(
    text=edited([TABLE], CSV_PIECES),
    signal=st.sampled_from(SIGNALS),
    encoding=st.sampled_from(("utf-8", "utf-8", "utf-8", "utf-16", "latin-1")),
    command=st.sampled_from((("check",), ("solve", *BOUNDED))),
)
def test_an_edited_csv_file_is_read_or_refused(
    text: str, signal: str, encoding: str, command: tuple[str, ...], here: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (here / "force.csv").write_bytes(text.encode(encoding, "replace"))
    source = (SCENARIOS / "pulley.toml").read_text("utf-8")
    ramp = "{ time = [0.0, 0.8], value = [1832.6, 3113.75] }"
    assert ramp in source
    (here / "s.toml").write_text(source.replace(ramp, signal), "utf-8")
    assert_answered(capsys, command[0], here / "s.toml", *command[1:])


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> list[bytes]:
    """The files of a whole and of an interrupted run."""
    folder, short = tmp_path_factory.mktemp("results"), {"output.interval": 0.1}
    fs.solve("pulley", short, output=folder / "a.h5")
    fs.solve("pulley", {**short, "solver.max_steps": 40}, output=folder / "b.h5")
    return [(folder / name).read_bytes() for name in ("a.h5", "b.partial.h5")]


READERS = (
    *(("show",), ("show", "--json"), ("show", "--csv"), ("show", "--scenario")),
    *(("plot", "-o", "p.svg"), ("compare", "whole.h5"), ("resume", "-q", "-o", "c.h5")),
)
TRAILER = len(b"\nfrictionsim crc32 01234567\n")


def sealed(content: bytes, whole: bytes) -> bytes:
    """Return content with the line of a checksum at its end, which is right."""
    return content + whole[-TRAILER:-9] + b"%08x\n" % crc32(content)


MEMBERS = (
    *("time", "angle", "mode", "quantities", "audit", "solver", "events", "events/time"),
    *("checkpoint", "@scenario", "@format_version", "@status", "@warnings", "@new"),
)
VALUES = (None, 1.0, "x", np.zeros(3), np.full(5, np.nan), np.zeros((2, 2), "i8"), b"\xff\x1b[2J")


@given(
    which=st.integers(0, 1),
    name=st.sampled_from(MEMBERS),
    value=st.sampled_from(VALUES),
    reader=st.sampled_from(READERS),
)
def test_a_result_of_another_structure_is_read_or_refused(
    which: int, name: str, value: Any, reader: tuple[str, ...],
    results: list[bytes], here: Path, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """A member is missing or another one; h5py wrote it, and the checksum is right."""
    path = here / "a.h5"
    path.write_bytes(results[which][:-TRAILER])
    (here / "whole.h5").write_bytes(results[0])
    with h5py.File(path, "r+") as file:
        group, key = (file.attrs, name[1:]) if name.startswith("@") else (file, name)
        if key in group:
            del group[key]
        if value is not None:
            group[key] = value
    path.write_bytes(sealed(path.read_bytes(), results[which]))
    assert_answered(capsys, reader[0], "a.h5", *reader[1:])


def test_a_result_without_any_one_of_its_members_is_read_or_refused(
    results: list[bytes], here: Path
) -> None:
    path, names = here / "a.h5", list[str]()
    path.write_bytes(results[0])
    with h5py.File(path) as file:
        file.visit(names.append)
        names += [f"@{name}" for name in file.attrs]
    for name in names:
        path.write_bytes(results[0][:-TRAILER])
        with h5py.File(path, "r+") as file:
            group, key = (file.attrs, name[1:]) if name.startswith("@") else (file, name)
            del group[key]
        path.write_bytes(sealed(path.read_bytes(), results[0]))
        with suppress(fs.InputError):
            result = fs.open(path)
            assert result.summary()
            assert result.dataset.sizes["time"]


@examples(3)
@given(
    changes=st.lists(
        st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 255)),
        min_size=1,
        max_size=5,
    ),
    reader=st.sampled_from(READERS),
)
def test_a_result_with_another_byte_and_its_checksum_ends_no_process(
    changes: list[tuple[float, int]], reader: tuple[str, ...], results: list[bytes], here: Path
) -> None:
    """HDF5 may crash on such a file, or never return."""
    content = bytearray(results[0][:-TRAILER])
    for where, value in changes:
        content[int(where * len(content))] = value
    (here / "a.h5").write_bytes(sealed(bytes(content), results[0]))
    (here / "whole.h5").write_bytes(results[0])
    done = frictionsim(reader[0], "a.h5", *reader[1:], cwd=here)
    assert done.returncode in CODES[reader[0]], done
    assert "Traceback" not in done.stderr

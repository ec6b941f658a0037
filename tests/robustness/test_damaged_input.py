"""Damaged scenarios, CSV files and result files are refused with a message."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from frictionsim.errors import InputError
from frictionsim.io import hdf5_reader, hdf5_writer
from tests.support.scenarios import ROOT, pulley, simulate

COUNTS = {"toml": 150, "csv": 150}
LONG_COUNTS = {"toml": 5000, "csv": 3000}


def fuzz(what: str, seed: int, count: int, seconds: float) -> dict[str, int]:
    """Run cases in a process with limited memory; return the count of each exit code."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.fuzzing", what, str(seed), str(count)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=seconds,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    codes: dict[str, int] = json.loads(done.stdout)
    assert sum(codes.values()) == count
    return codes


@pytest.mark.parametrize("what", COUNTS)
def test_damaged_input_is_reported(what: str) -> None:
    assert fuzz(what, 0, COUNTS[what], 60.0)["2"] > 0


@pytest.mark.long
@pytest.mark.parametrize("what", LONG_COUNTS)
def test_thousands_of_damaged_inputs_are_reported(what: str, tally: dict[str, int]) -> None:
    codes = fuzz(what, 1, LONG_COUNTS[what], 900.0)
    tally["damaged inputs"] = tally.get("damaged inputs", 0) + LONG_COUNTS[what]
    tally[f"damaged inputs: {what}"] = LONG_COUNTS[what]
    tally[f"damaged inputs: {what}, refused"] = codes["2"]


def test_every_flipped_bit_is_detected(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    hdf5_writer.write(simulate(pulley(output__interval=1.0)), path)
    content = path.read_bytes()
    end = len(content) - len("\nfrictionsim crc32 01234567\n")
    for place in range(0, end, 97):
        changed = bytearray(content)
        changed[place] ^= 1 << place % 8
        path.write_bytes(changed)
        with pytest.raises(InputError, match="cannot read this result: it is damaged"):
            hdf5_reader.read(path)


def test_a_file_without_a_checksum_is_read(tmp_path: Path) -> None:
    """HDF5 drops the checksum when another program changes the file."""
    path = tmp_path / "a.h5"
    hdf5_writer.write(simulate(pulley(output__interval=1.0)), path)
    path.write_bytes(path.read_bytes()[: -len("\nfrictionsim crc32 01234567\n")])
    assert hdf5_reader.read(path).attributes["status"] == "done"

"""Every change of a bit of a result file is noticed by its checksum."""

from pathlib import Path

import pytest

from frictionsim.errors import InputError
from frictionsim.io import hdf5_reader, hdf5_writer
from tests.support.scenarios import pulley, simulate


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

"""The file of a sweep: read as it was written, refused if damaged or of another kind."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from tests.support.sweep_files import LOOSE, MU_S, PULLEY

Change = Callable[[Any], object]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweeps")
    fs.sweep(PULLEY, {MU_S: [0.2, 0.3, 0.4]}, LOOSE, output=folder / "grid.h5", workers=1)
    return folder


def test_a_changed_byte_is_found(files: Path, tmp_path: Path) -> None:
    image = (files / "grid.h5").read_bytes()
    (tmp_path / "s.h5").write_bytes(image[:5000] + bytes([image[5000] ^ 1]) + image[5001:])
    with pytest.raises(InputError, match=r"it is damaged \(its checksum does not match\)"):
        fs.open_sweep(tmp_path / "s.h5")


def put(name: str, value: object) -> Change:
    """Return the change of a dataset for another."""
    return lambda file: (file.pop(name, None), file.update({name: value}))


CHANGES: dict[str, Change] = {
    "another shape": put("final_time", np.zeros(2)),
    "numbers for text": put("reason", np.zeros(3)),
    "an unknown status": lambda file: file["status"].__setitem__(0, 9),
    "a link elsewhere": put("other", h5py.ExternalLink("/etc/passwd", "/")),
    "no status": lambda file: file.pop("status"),
    "no study": lambda file: file.attrs.pop("study"),
    "another version": lambda file: file.attrs.update(sweep_version=99),
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_file_made_by_others_is_refused(what: str, files: Path, tmp_path: Path) -> None:
    changed = tmp_path / "s.h5"
    changed.write_bytes((files / "grid.h5").read_bytes())
    with h5py.File(changed, "a") as file:  # HDF5 drops the line with the checksum
        CHANGES[what](file)
    version = r"its format version is 99, this program reads version 1"
    other = r"it is HDF5, but not a frictionsim sweep$"
    expected = version if what == "another version" else other
    with pytest.raises(InputError, match=expected):
        fs.open_sweep(changed)

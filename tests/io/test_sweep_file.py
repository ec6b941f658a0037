"""The file of a sweep: read as it was written, refused if damaged or of another kind."""

import random
from pathlib import Path

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError, OutputError
from frictionsim.io.hdf5_reader import read_sweep
from frictionsim.io.replaceable import RESULT, SWEEP, check_replaceable
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
MU_S = "effects.shaft_friction.mu_s"
LOOSE = {"solver.rtol": 1e-4}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweeps")
    fs.sweep(PULLEY, {MU_S: [0.2, 0.3, 0.4]}, LOOSE, output=folder / "grid.h5")
    fs.sweep(PULLEY, {MU_S: "uniform(0.2, 0.4)"}, LOOSE, sample=4, output=folder / "sample.h5")
    fs.solve(PULLEY, LOOSE, output=folder / "result.h5")
    return folder


def test_two_sweeps_of_one_study_have_the_same_bytes(files: Path, tmp_path: Path) -> None:
    fs.sweep(PULLEY, {MU_S: [0.2, 0.3, 0.4]}, LOOSE, output=tmp_path / "again.h5")
    assert (tmp_path / "again.h5").read_bytes() == (files / "grid.h5").read_bytes()


def test_a_result_and_a_sweep_are_told_apart(files: Path) -> None:
    with pytest.raises(InputError, match=r"this is a sweep, not the result of a run"):
        fs.open(files / "grid.h5")
    with pytest.raises(InputError, match=r"it is HDF5, but not a sweep of frictionsim"):
        fs.open_sweep(files / "result.h5")
    with pytest.raises(InputError, match=r"there is no such file"):
        fs.open_sweep(files / "none.h5")
    for kind, other in ((SWEEP, "result.h5"), (RESULT, "grid.h5")):
        with pytest.raises(OutputError, match=f"is not {kind.described} and is not overwritten"):
            check_replaceable(files / other, kind)
    check_replaceable(files / "grid.h5", SWEEP)


@pytest.mark.parametrize("name", ["grid.h5", "sample.h5"])
def test_changed_bytes_are_found(files: Path, tmp_path: Path, name: str) -> None:
    image, rng = (files / name).read_bytes(), random.Random(1)
    for _ in range(3):
        changed = bytearray(image)
        changed[rng.randrange(len(changed) - 40)] ^= 1 << rng.randrange(8)
        (tmp_path / "s.h5").write_bytes(changed)
        with pytest.raises(InputError, match=r"it is damaged \(its checksum does not match\)"):
            read_sweep(tmp_path / "s.h5")


def set_shape(file: h5py.File) -> None:
    del file["final_time"]
    file["final_time"] = np.zeros(2)


def set_status(file: h5py.File) -> None:
    file["status"][0] = 9


def link_elsewhere(file: h5py.File) -> None:
    file["other"] = h5py.ExternalLink("/etc/passwd", "/")


def set_version(file: h5py.File) -> None:
    file.attrs["sweep_version"] = 99


def drop_status(file: h5py.File) -> None:
    del file["status"]


def drop_study(file: h5py.File) -> None:
    del file.attrs["study"]


def numbers_for_text(file: h5py.File) -> None:
    del file["reason"]
    file["reason"] = np.zeros(3)


@pytest.mark.parametrize(
    "change",
    [set_shape, set_status, link_elsewhere, drop_status, drop_study, numbers_for_text],
)
def test_a_file_made_by_others_is_refused(files: Path, tmp_path: Path, change: object) -> None:
    changed = tmp_path / "s.h5"
    changed.write_bytes((files / "grid.h5").read_bytes())
    with h5py.File(changed, "a") as file:  # HDF5 drops the line with the checksum
        assert callable(change)
        change(file)
    with pytest.raises(InputError, match=r"cannot read this sweep: it is damaged$"):
        read_sweep(changed)


def test_another_version_is_said(files: Path, tmp_path: Path) -> None:
    changed = tmp_path / "s.h5"
    changed.write_bytes((files / "grid.h5").read_bytes())
    with h5py.File(changed, "a") as file:
        set_version(file)
    with pytest.raises(InputError, match=r"its format version is 99, this program reads version 1"):
        read_sweep(changed)

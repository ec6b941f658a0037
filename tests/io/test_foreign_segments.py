"""The folder of segments that a result names is one of segments, or it is left alone."""

from pathlib import Path

import h5py
import pytest

import frictionsim as fs
from frictionsim.io.checksum import append_trailer
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"


@pytest.mark.parametrize("name", ["photos", "..", ".", "a.samples-", "x.samples-0123456789"])
def test_a_folder_that_a_result_names_is_not_removed(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "work"
    photos = folder / "photos"
    photos.mkdir(parents=True)
    for other in ("photos", "a.samples-", "x.samples-0123456789"):
        (folder / other).mkdir(exist_ok=True)
        (folder / other / "mine.txt").write_text("precious")
    before = sorted(folder.rglob("mine.txt"))
    target = folder / "a.h5"
    fs.solve(PULLEY, output=target, max_steps=40)
    with h5py.File(target, "r+") as file:
        file.attrs["segments"] = f"{name} 1 4096 0"
    append_trailer(target)
    fs.solve(PULLEY, output=target)  # replaces it
    assert sorted(folder.rglob("mine.txt")) == before

from pathlib import Path

import pytest

from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.results import Record
from tests.support.belt_results import FOUR, TWO, belt_run


@pytest.fixture(scope="session")
def belts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, Record]]:
    """Results of belts on two and on four pulleys: file and content."""
    folder, found = tmp_path_factory.mktemp("belts"), {}
    for name, pulleys in (("two", TWO), ("four", FOUR)):
        path = folder / f"{name}.h5"
        hdf5_writer.write(belt_run(pulleys), path)
        found[name] = path, hdf5_reader.read(path)
    return found

"""Runs as the records that pictures are made of."""

from pathlib import Path
from tempfile import TemporaryDirectory

from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.results import Record
from frictionsim.simulation.simulate import RunResult


def record_of(run: RunResult) -> Record:
    """Return a run as it is read back from its file."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.h5"
        hdf5_writer.write(run, path)
        return hdf5_reader.read(path)

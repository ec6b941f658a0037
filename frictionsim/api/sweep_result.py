"""The result of a sweep: its table, and the same as a dataset."""

from collections.abc import Iterator
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.api.result import Result, open
from frictionsim.api.result_base import ResultBase
from frictionsim.api.sweep_tables import sweep_json, sweep_parts
from frictionsim.document import Document
from frictionsim.errors import EXIT_DONE, EXIT_SOLVER_FAILED, InputError
from frictionsim.io.sweep_table import (
    NAMES_OF_SOBOL,
    RUN,
    STATUS,
    TEXTS,
    Coordinate,
    SweepTable,
)
from frictionsim.parameter_study.block import AUDIT_FAILED, FAILED, NOT_RUN
from frictionsim.scenario.options import as_path

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.parameter_study.report import Writable

ATTRIBUTES = ("study", "scenario", "source", "kind", "title", "design", "status", "reason")
CSV, HDF5 = ".csv", (".h5", ".hdf5", ".nc")


class Sweep(ResultBase):
    """The result of a sweep, made by `sweep`, `resume_sweep` and `open_sweep`.

    What an `xarray.Dataset` has, it has as well: ``sweep["breakaway_time"]``, ``sweep.sel(...)``.
    A function that asks for a dataset takes ``sweep.dataset``.

    Attributes
    ----------
    table : SweepTable
        What its file holds.
    path : Path or None
        Its file.
    """

    def __init__(self, table: SweepTable, path: Path | None = None) -> None:
        self.table, self.path = table, path

    @cached_property
    def dataset(self) -> "xarray.Dataset":
        """The varied keys as coordinates, and each quantity of the summary with its unit.

        `status`, `failure`, `reason` and `warnings` of the runs are beside the quantities.
        """
        return dataset_of(self.table)

    @property
    def status(self) -> str:
        """`done` or `interrupted`."""
        return self.table.attributes["status"]

    @property
    def reason(self) -> str:
        """Why it stopped; empty if done."""
        return self.table.attributes["reason"]

    @property
    def exit_code(self) -> int:
        """The exit code of the command line: that of a failure if all runs have failed."""
        all_failed = bool((self.table.status == FAILED).all())
        return EXIT_SOLVER_FAILED if all_failed else EXIT_DONE

    @property
    def failures(self) -> list[str]:
        """How many runs failed, and how many their audit; empty if none did."""
        counts = (
            (int((self.table.status == status).sum()), words)
            for status, words in ((FAILED, "failed"), (AUDIT_FAILED, "failed their audit"))
        )
        return [f"{count} of {self.table.runs} runs {words}" for count, words in counts if count]

    @property
    def missing_runs(self) -> str:
        """How many runs are left and why; empty if the sweep is done."""
        if self.status == "done":
            return ""
        count = int((self.table.status == NOT_RUN).sum())
        reason = f": {self.reason}" if self.reason else ""
        return f"sweep {self.status}: {count} of {self.table.runs} runs are left{reason}"

    def to_toml(self, name: str) -> str:
        """Return the `scenario` that is varied, or the `study`, in TOML."""
        return self.table.attributes[name].rstrip("\n")

    def parts(self) -> Document:
        """Yield the lines and tables of the summary: of a sample statistics, else extremes.

        Raises
        ------
        InputError
            If the study in the file is not valid.
        """
        return sweep_parts(self.table, self.path)

    def to_json(self) -> dict[str, Any]:
        """Return the summary as plain data, as the command line prints it with --json.

        Raises
        ------
        InputError
            If the study in the file is not valid.
        """
        return sweep_json(self.table, self.path)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the sweep to HDF5, which can be opened again, or a line for each run to CSV."""
        target = as_path("path", path)
        if target.suffix == CSV:
            self.save_csv(target)
        elif target.suffix in HDF5:
            from frictionsim.io.sweep_file import write_sweep

            write_sweep(self.table, target)
        else:
            raise InputError(f"{target}: expected a name that ends in {', '.join(HDF5)} or {CSV}")
        return target

    def save_csv(self, path: Path) -> None:
        """Write a line for each run, and the Sobol indices of a sample beside it."""
        from frictionsim.parameter_study.report import write_csv

        write_csv(self.table, path)

    def write_csv(self, file: "Writable") -> None:
        """Write a line for each run."""
        from frictionsim.parameter_study.report import write_lines

        write_lines(self.table, file)

    def plot(
        self,
        quantities: str | None = None,
        *,
        at: "Mapping[str, Any] | None" = None,
        ax: "Axes | None" = None,
    ) -> "Figure":
        """Draw quantities; `frictionsim.plot` has further options.

        Parameters
        ----------
        quantities : str, optional
            With commas between them; by default the first that vary.
        at : mapping, optional
            By varied key of a grid, the one value of it that is drawn.
        ax : Axes, optional
            Draw in the place of these axes, which are removed.
        """
        from frictionsim.plots.sweep import draw_sweep

        return draw_sweep(self.table, quantities_of(quantities), at, ax=ax)

    def equals(self, other: Any) -> bool:
        """Return whether another sweep or dataset has the same values and coordinates."""
        return bool(self.dataset.equals(getattr(other, "dataset", other)))

    def identical(self, other: Any) -> bool:
        """Return whether another sweep or dataset is equal, with the same attributes."""
        return bool(self.dataset.identical(getattr(other, "dataset", other)))

    def __getattr__(self, name: str) -> Any:
        """Return an attribute of the dataset.

        Raises
        ------
        AttributeError
            If it has none of this name.
        """
        if not name.startswith("_"):
            found = getattr(self.dataset, name, self)
            if found is not self:
                return found
        raise AttributeError(f"neither this sweep nor its .dataset has an attribute '{name}'")

    def __getitem__(self, key: Any) -> Any:
        return self.dataset[key]

    def __iter__(self) -> Iterator[Any]:
        return iter(self.dataset)

    def __len__(self) -> int:
        return len(self.dataset)

    def __contains__(self, key: Any) -> bool:
        return key in self.dataset

    def __enter__(self) -> "Sweep":
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: the file is closed already."""

    def __repr__(self) -> str:
        kind, runs = self.table.attributes["kind"], self.table.runs
        keys = ", ".join(self.table.coordinates)
        return f"<frictionsim.Sweep {kind}: {self.status}, {runs} runs over {keys}>"


def open_sweep(path: str | PathLike[str]) -> Sweep:
    """Read the file of a sweep.

    Returns
    -------
    Sweep
        As `sweep` returned it. The data are read at once; the file is closed.

    Raises
    ------
    InputError
        If it does not exist or is not a sweep.
    """
    from frictionsim.io.hdf5_reader import read_sweep

    found = as_path("path", path)
    return Sweep(read_sweep(found), found)


def result_or_sweep(path: Path) -> Result | Sweep:
    """Read a file in HDF5.

    Raises
    ------
    InputError
        If it is neither the result of a run nor a sweep.
    """
    try:
        return open(path)
    except InputError:
        from frictionsim.io.hdf5_reader import is_sweep

        if not is_sweep(path):
            raise
        return open_sweep(path)


def quantities_of(view: str | None) -> list[str]:
    """Return the quantities that a view of a sweep names."""
    return [] if view is None else [name.strip() for name in view.split(",")]


def dataset_of(table: SweepTable) -> "xarray.Dataset":
    """Return a sweep as a dataset, with the data and attributes of its file."""
    import xarray

    dimensions, shape = tuple(table.dimensions), table.shape
    coordinates: dict[str, Any] = {
        key: (coordinate.dimension, _values(coordinate), _attributes(coordinate))
        for key, coordinate in table.coordinates.items()
    }
    if RUN in table.dimensions:
        of_run = {"units": "1", "long_name": "number of the run, from 0"}
        coordinates[RUN] = (RUN, np.arange(table.runs), of_run)
    variables: dict[str, Any] = {
        name: (
            dimensions,
            values.reshape(shape),
            {"units": table.units[name], "long_name": name.replace("_", " ")},
        )
        for name, values in table.values.items()
    }
    numbers, meanings = zip(*table.statuses, strict=True)
    variables[STATUS] = (
        dimensions,
        table.status.reshape(shape),
        {
            "units": "1",
            "long_name": "outcome of the run",
            "flag_values": list(numbers),
            "flag_meanings": " ".join(meanings),
        },
    )
    for name, words in TEXTS.items():
        variables[name] = (dimensions, table.text_array(name), {"long_name": words})
    of_sobol = {} if table.sobol is None else table.sobol.datasets
    for name, (along, values, words) in of_sobol.items():
        attributes = {"long_name": words} | ({} if isinstance(values, list) else {"units": "1"})
        (coordinates if name in along else variables)[name] = (along, values, attributes)
    return xarray.Dataset(variables, coordinates, dict(table.attributes))


def _values(coordinate: Coordinate) -> Any:
    values = coordinate.values
    return np.array(values, dtype=str) if isinstance(values, list) else values


def _attributes(coordinate: Coordinate) -> dict[str, str]:
    words = {"long_name": coordinate.long_name}
    return (
        words if isinstance(coordinate.values, list) else words | {"units": coordinate.unit or "1"}
    )


def table_of(dataset: Any) -> SweepTable:
    """Return the table of a dataset of `sweep` or `open_sweep`, or of a part of one.

    Parameters
    ----------
    dataset : xarray.Dataset
        Keys of a grid to which one value was given (`sel`, `isel`) are no longer varied.

    Raises
    ------
    InputError
        If it is no dataset of a sweep.
    """
    attributes = {str(name): str(text) for name, text in dataset.attrs.items()}
    missing = [name for name in ATTRIBUTES if name not in attributes]
    missing += [name for name in (STATUS, *TEXTS) if name not in dataset.data_vars]
    if missing:
        raise InputError(
            "expected a dataset as fs.sweep and fs.open_sweep return it; this one has no"
            f" '{missing[0]}', which a reduction as mean() leaves out"
        )
    status = dataset[STATUS]
    dimensions = {
        str(name): int(size) for name, size in zip(status.dims, status.shape, strict=True)
    }
    if not dimensions or status.size == 0:
        raise InputError("expected a dataset of several runs, got one run or none of a sweep")
    coordinates = {
        str(key): _coordinate(str(key), values)
        for key, values in dataset.coords.items()
        if key not in (RUN, *NAMES_OF_SOBOL) and values.ndim == 1
    }
    others = {STATUS, *TEXTS, *NAMES_OF_SOBOL}
    names = [str(n) for n in dataset.data_vars if n not in others]
    for name in (*names, *TEXTS):
        if dataset[name].dims != status.dims:
            raise InputError(f"'{name}' of this dataset does not have a value for each run")
    flags = zip(status.attrs["flag_values"], status.attrs["flag_meanings"].split(), strict=True)
    texts = {name: dataset[name].values.reshape(-1).tolist() for name in TEXTS}
    return SweepTable(
        attributes=attributes,
        dimensions=dimensions,
        coordinates=coordinates,
        units={name: str(dataset[name].attrs.get("units", "1")) for name in names},
        values={n: np.asarray(dataset[n].values, dtype=np.float64).reshape(-1) for n in names},
        status=np.asarray(status.values, dtype=np.int8).reshape(-1),
        statuses=tuple((int(number), word) for number, word in flags),
        texts={name: {i: t for i, t in enumerate(found) if t} for name, found in texts.items()},
    )


def _coordinate(key: str, found: Any) -> Coordinate:
    values, words = found.values, str(found.attrs.get("long_name", key))
    dimension = str(found.dims[0])
    if values.dtype.kind in "OUST":
        return Coordinate(dimension, [str(value) for value in values], "", words)
    return Coordinate(dimension, values, str(found.attrs.get("units", "1")), words)

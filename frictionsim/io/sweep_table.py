"""The content of a sweep as plain data; `sweep_file` and `sweep_journal` document its files."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from frictionsim.results import Array, Flags

VERSION_NAME, VERSION = "sweep_version", 1
RUN, STATUS = "run", "status"
NOT_RUN, DONE, FAILED, AUDIT_FAILED = 0, 1, 2, 3
STATUSES: "Flags" = (
    (NOT_RUN, "not_run"),
    (DONE, "done"),
    (FAILED, "failed"),
    (AUDIT_FAILED, "audit_failed"),
)
TEXTS = {
    "failure": "kind of failure",
    "reason": "why the run failed, or which checks of its audit",
    "warnings": "warnings, one per line",
}
SOBOL_QUANTITY, SOBOL_KEY, SOBOL_BASIS = "sobol_quantity", "sobol_key", "sobol_basis"
SOBOL = {
    "sobol_first": "first-order Sobol index",
    "sobol_first_low": "lower end of the 95 % interval of the first-order index",
    "sobol_first_high": "upper end of the 95 % interval of the first-order index",
    "sobol_total": "total Sobol index",
    "sobol_total_low": "lower end of the 95 % interval of the total index",
    "sobol_total_high": "upper end of the 95 % interval of the total index",
}
SOBOL_NAMES = (SOBOL_QUANTITY, SOBOL_KEY, SOBOL_BASIS, *SOBOL)


class SobolIndices(NamedTuple):
    """The Sobol indices of a quantity."""

    basis: str  # the data of the indices, or why there are none
    values: "Array"  # (6, keys), in the order of SOBOL; NaN where there are none

    @property
    def exist(self) -> bool:
        """Whether there are indices."""
        return bool((self.values[0] == self.values[0]).all())


class Coordinate(NamedTuple):
    """The values of a varied key.

    They are an array of float64, int64 or bool, or texts; other values are text in TOML.
    """

    dimension: str  # the key itself in a grid, else `run`
    values: Any
    unit: str  # empty if the key is no number
    long_name: str

    @property
    def is_number(self) -> bool:
        """Whether the values are numbers, and neither text nor true and false."""
        return not isinstance(self.values, list) and self.values.dtype != "bool"

    @property
    def stored(self) -> Any:
        """The values as in files and in a dataset: true and false as 1 and 0, of int8."""
        is_bool = not (isinstance(self.values, list) or self.is_number)
        return self.values.astype("int8") if is_bool else self.values


def from_stored(values: Any) -> Any:
    """Return the values of a key, for numbers as `Coordinate.stored` has them."""
    return values.astype("bool") if values.dtype == "int8" else values


class SweepHeader(NamedTuple):
    """What a sweep is before its runs."""

    attributes: dict[str, str]  # of the root, see `sweep_file`
    dimensions: dict[str, int]  # lengths by name: the keys of a grid, or `run`
    coordinates: dict[str, Coordinate]  # by key


class RunBlock(NamedTuple):
    """The outcomes of consecutive runs."""

    first: int  # the number of the first of these runs
    status: Any  # (n,) of int8, among STATUSES
    units: dict[str, str]  # of each quantity of any of these runs, by name
    values: "Array"  # (quantities, n); NaN if undefined
    texts: dict[str, dict[int, str]]  # nonempty TEXTS, by name and run

    @property
    def runs(self) -> int:
        """The number of runs."""
        return len(self.status)


class SweepTable(NamedTuple):
    """The runs of a sweep; n is their number, in the order of the design."""

    attributes: dict[str, str]  # as those of its header, like the next two
    dimensions: dict[str, int]
    coordinates: dict[str, Coordinate]
    units: dict[str, str]  # of each quantity, by name
    values: "dict[str, Array]"  # of each quantity, (n,); NaN where it is not defined
    status: Any  # (n,) of int8
    texts: dict[str, dict[int, str]]  # nonempty TEXTS, by name and run
    sobol: dict[str, SobolIndices] | None = None  # of a completed sample with `indices`

    @property
    def shape(self) -> tuple[int, ...]:
        """The lengths of the dimensions."""
        return tuple(self.dimensions.values())

    @property
    def runs(self) -> int:
        """The number of runs, including those not run yet."""
        return len(self.status)

    def count(self, status: int) -> int:
        """Return the number of runs of a status."""
        return int((self.status == status).sum())

    def places(self, runs: Any) -> dict[str, Any]:
        """Return the indices of the values of each varied key in a run, or in an array of runs."""
        if RUN in self.dimensions:
            return dict.fromkeys(self.coordinates, runs)
        import numpy as np

        return dict(zip(self.dimensions, np.unravel_index(runs, self.shape), strict=True))

    def text_array(self, name: str) -> Any:
        """Return `failure`, `reason` or `warnings` of all runs in the shape of the sweep."""
        import numpy as np

        texts = np.full(self.runs, "", dtype=object)
        for number, text in self.texts[name].items():
            texts[number] = text
        return texts.reshape(self.shape)

    @property
    def sobol_datasets(self) -> dict[str, tuple[tuple[str, ...], Any, str]]:
        """Dimensions, values and description of the datasets of Sobol indices, by name.

        The dimensions come first. Values are lists of text, or arrays of pure numbers.
        """
        if self.sobol is None:
            return {}
        import numpy as np

        quantity, key = (SOBOL_QUANTITY,), (SOBOL_KEY,)
        columns = np.array([indices.values for indices in self.sobol.values()])
        columns = columns.reshape(-1, len(SOBOL), len(self.coordinates)).swapaxes(0, 1)
        basis = [indices.basis for indices in self.sobol.values()]
        words = "what the indices are computed from, or why there are none"
        return {
            SOBOL_QUANTITY: (quantity, list(self.sobol), "quantity"),
            SOBOL_KEY: (key, list(self.coordinates), "varied key"),
            SOBOL_BASIS: (quantity, basis, words),
        } | {
            name: (quantity + key, column, SOBOL[name])
            for name, column in zip(SOBOL, columns, strict=True)
        }


def table_of(header: SweepHeader, blocks: Iterable[RunBlock]) -> SweepTable:
    """Return the sweep of which some runs are done.

    It does not depend on the blocks' order and sizes: quantities are in the order of their first
    appearance, in the order of the runs.
    """
    import numpy as np

    status = np.full(int(np.prod([*header.dimensions.values()])), NOT_RUN, dtype=np.int8)
    units: dict[str, str] = {}
    values: dict[str, Array] = {}
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    for block in sorted(blocks, key=lambda block: block.first):
        runs = slice(block.first, block.first + block.runs)
        status[runs] = block.status
        for (name, unit), row in zip(block.units.items(), block.values, strict=True):
            if name not in units:
                units[name], values[name] = unit, np.full(len(status), np.nan)
            values[name][runs] = row
        for name, by_run in block.texts.items():
            texts[name] |= by_run
    return SweepTable(*header, units, values, status, texts)

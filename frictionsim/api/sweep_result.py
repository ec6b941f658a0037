"""The result of a sweep: its table and dataset."""

from collections.abc import Iterator
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.api.result import Result
from frictionsim.api.result_base import Ending, ResultBase
from frictionsim.display import ratio_text, set_line, study_text
from frictionsim.document import Data, Document, Table
from frictionsim.errors import (
    EXIT_AUDIT_FAILED,
    EXIT_DONE,
    EXIT_SOLVER_FAILED,
    InputError,
    exit_code_of_interruption,
)
from frictionsim.io.names import existing_name, resumable_name
from frictionsim.io.reading import read_any
from frictionsim.io.result_reader import is_unfinished_sweep
from frictionsim.io.sweep_file import read_sweep
from frictionsim.io.sweep_journal import read_unfinished
from frictionsim.io.sweep_table import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    NOT_RUN,
    SOBOL,
    SobolIndices,
    SweepTable,
)
from frictionsim.results import finite
from frictionsim.scenario.loading import origin_of
from frictionsim.scenario.options import as_path
from frictionsim.scenario.toml_data import toml_value
from frictionsim.sweeps.design import SAMPLE, Sampling
from frictionsim.sweeps.statistics import (
    Extremes,
    Group,
    Statistics,
    counts,
    extremes,
    grouped,
    independent_runs,
    is_constant,
    sample_statistics,
    sound_values,
    variation,
    varied_values,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.sweeps.sweep_csv import Writable


class Sweep(ResultBase):
    """The result of a sweep, made by `sweep`, `resume_sweep` and `open_sweep`.

    It has the members of its `xarray.Dataset`: ``sweep["breakaway_time"]``, ``sweep.sel(...)``;
    a function that requires a dataset is given ``sweep.dataset``.

    Attributes
    ----------
    table : SweepTable
        The contents of its file.
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
        from frictionsim.api.dataset import sweep_dataset

        return sweep_dataset(self.table)

    @property
    def _ending(self) -> Ending:
        status, reason = (self.table.attributes[name] for name in ("status", "reason"))
        outcomes = {*self.table.status.tolist()}
        code = EXIT_DONE
        if DONE not in outcomes:
            code = EXIT_AUDIT_FAILED if AUDIT_FAILED in outcomes else EXIT_SOLVER_FAILED
        if status != "done":
            code = exit_code_of_interruption(reason)
        return Ending(status, reason, code)

    @property
    def failures(self) -> list[str]:
        """The numbers of failed runs and of failed audits; empty without any."""
        counts = (
            (int((self.table.status == status).sum()), words)
            for status, words in ((FAILED, "failed"), (AUDIT_FAILED, "failed their audit"))
        )
        return [f"{count} of {self.table.runs} runs {words}" for count, words in counts if count]

    @property
    def missing_runs(self) -> str:
        """The number of remaining runs and the reason; empty if the sweep is done."""
        if self.status == "done":
            return ""
        count = int((self.table.status == NOT_RUN).sum())
        reason = f": {self.reason}" if self.reason else ""
        return f"sweep {self.status}: {count} of {self.table.runs} runs are left{reason}"

    def to_toml(self, name: str) -> str:
        """Return the varied `scenario`, or the `study`, in TOML."""
        return self.table.attributes[name].rstrip("\n")

    def parts(self) -> Document:
        """Yield the summary and its data: of a sample statistics, else extremes.

        Raises
        ------
        InputError
            If the study in the file is not valid.
        """
        return _parts(self.table, self.path)

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the sweep as HDF5 or CSV, by the suffix of the path; return its file.

        Raises
        ------
        InputError
            If the suffix is another one.
        OutputError
            If it cannot be written, or would replace a file of another kind.
        """
        from frictionsim.io.output_file import SUFFIXES

        target = as_path("path", path)
        if target.suffix == ".csv":
            self.save_csv(target)
            return target
        if target.suffix in SUFFIXES:
            return self.save_hdf5(target)
        raise InputError(f"{target}: expected a name that ends in {', '.join(SUFFIXES)} or .csv")

    def save_csv(self, path: Path) -> None:
        """Write a line for each run, and the Sobol indices of a sample beside it."""
        from frictionsim.sweeps.sweep_csv import write_csv

        write_csv(self.table, path)

    def save_hdf5(self, path: Path) -> Path:
        """Write the sweep as HDF5, for `open_sweep`: NAME.partial.h5 if it is not done."""
        from frictionsim.io.names import partial_name, whole_name
        from frictionsim.io.sweep_file import write_sweep

        target = whole_name(path)
        target = target if self.status == "done" else partial_name(target)
        write_sweep(self.table, target)
        return target

    def write_csv(self, file: "Writable") -> None:
        """Write a line for each run."""
        from frictionsim.sweeps.sweep_csv import write_lines

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
            Separated by commas; by default the first varying ones.
        at : mapping, optional
            Value to draw of a varied key, by key; of a grid.
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
            attribute = getattr(self.dataset, name, self)
            if attribute is not self:
                return attribute
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
    """Read the file of a sweep, or an unfinished sweep, NAME.partial.runs.

    Returns
    -------
    Sweep
        As returned by `sweep`. All data are read; the file is closed.

    Raises
    ------
    InputError
        If it does not exist or is not a sweep.
    """
    file = existing_name(as_path("path", path))
    is_unfinished = is_unfinished_sweep(file)
    return Sweep(read_unfinished(file).table if is_unfinished else read_sweep(file), file)


def result_or_sweep(path: Path) -> Result | Sweep:
    """Read a file in HDF5.

    Raises
    ------
    InputError
        If it is neither the result of a run nor a sweep.
    """
    path = existing_name(path)
    content = read_any(path)
    return Sweep(content, path) if isinstance(content, SweepTable) else Result(content, path)


def incomplete_of(path: Path) -> Result | Sweep:
    """Read a file to resume, of a run or a sweep; without one, InputError names the way out."""
    return result_or_sweep(resumable_name(path))


def quantities_of(view: str | None) -> list[str]:
    """Return the quantities of a view of a sweep."""
    return [] if view is None else [name.strip() for name in view.split(",")]


MAX_GROUPS = 5  # of reasons, and of warnings
MAX_VALUES = 3  # of a key in a line
DESIGNS = {
    "grid": "all combinations of these keys",
    "zip": "these keys varied together",
    "sample": "a sample of these keys",
}
WORDS = {
    DONE: "done",
    FAILED: "failed",
    AUDIT_FAILED: "with a failed audit",
    NOT_RUN: "not run",
}


def _parts(table: SweepTable, path: Path | None) -> Document:
    """Yield the summary of a sweep and the path of its file."""
    attributes, number = table.attributes, counts(table)
    distributions, sampling = variation(table)
    independent = independent_runs(table, sampling).stop
    texts = {key: d.text for key, d in distributions.items()}
    failed, warnings = grouped(_reasons(table)), grouped(table.texts["warnings"])
    yield f"{attributes['title'] or attributes['kind']}: sweep {attributes['status']}"
    yield f"kind {attributes['kind']}, {DESIGNS.get(attributes['design'], attributes['design'])}"
    if overrides := set_line(attributes):
        yield overrides
    yield Table(
        ("key", ">values", "unit"),
        [
            (key, texts.get(key) or _range_text(coordinate.values), coordinate.unit)
            for key, coordinate in table.coordinates.items()
        ],
    )
    yield _counts_text(table, number)
    is_sample = attributes["design"] == SAMPLE
    yield from _sample_parts(table, sampling, independent) if is_sample else _extreme_parts(table)
    yield from _group_lines("failed", failed)
    yield from _group_lines("warnings", warnings)
    if attributes["reason"]:
        yield f"stopped: {attributes['reason']}"
    yield f"sweep: {path or 'none'}"
    yield Data(
        {
            "scenario": attributes["source"] or None,
            "overrides": origin_of(attributes).values,
            **{name: attributes[name] for name in ("kind", "title", "design", "status", "reason")},
            "runs": {"all": table.runs}
            | {word: number[status] for status, word in table.statuses if status in number},
            "varied": {
                key: {
                    "unit": coordinate.unit or None,
                    "distribution": texts.get(key),
                    "values": None if is_sample else list(map(plain, coordinate.values)),
                }
                for key, coordinate in table.coordinates.items()
            },
            "independent_runs": independent if is_sample else None,
            "sobol_indices": None if table.sobol is None else _sobol_json(table.sobol),
            "failures": [group._asdict() for group in failed],
            "warnings": [group._asdict() for group in warnings],
            "output": None if path is None else str(path),
        }
    )


def plain(value: Any) -> Any:
    """Return a value of a key as one of Python."""
    return value.item() if hasattr(value, "item") else value


def _reasons(table: SweepTable) -> dict[int, str]:
    """Return the reasons of failed runs and audits by run, in one line each."""
    failures, reasons = table.texts["failure"], table.texts["reason"]
    texts = {}
    for run in sorted({*failures, *reasons}):
        text = " ".join(reasons.get(run, "").split())
        kind = failures.get(run, "")
        texts[run] = f"{kind}: {text}" if kind and text else kind or text
    return texts


def _counts_text(table: SweepTable, number: dict[int, int]) -> str:
    parts = [f"{number[s]} {WORDS[s]}" for s in (FAILED, AUDIT_FAILED, NOT_RUN) if number[s]]
    runs = "run is" if table.runs == 1 else "runs are"
    text = f"{number[DONE]} of {table.runs} {runs} done"
    return f"{text}; {', '.join(parts)}: not in the table below" if parts else text


def _sample_parts(table: SweepTable, sampling: Sampling | None, independent: int) -> Document:
    """Yield the statistics of a sample and its Sobol indices."""
    statistics = sample_statistics(table)
    headings = ("quantity", ">mean", ">standard deviation", ">5 %", ">50 %", ">95 %", "unit")
    rows = [
        (name, *map(study_text, s[1:]), table.units[name], str(s.runs))
        for name, s in statistics.items()
    ]
    yield Table((*headings, ">defined in runs"), rows)
    if sampling is not None and sampling.indices:
        yield (
            f"the first {independent} runs are independent and make these numbers; the others are"
            " for Sobol indices"
        )
    yield from _sobol_parts(table)
    data = {name: _statistics_json(s, table.units[name]) for name, s in statistics.items()}
    yield Data({"quantities": data})


def _sobol_parts(table: SweepTable) -> Document:
    """Yield the Sobol indices, or why a quantity has none."""
    sobol = table.sobol
    if sobol is None:
        return
    rows = []
    for number, (name, basis) in enumerate(zip(sobol.quantities, sobol.basis, strict=True)):
        values = np.array([sobol.columns[column][number] for column in SOBOL])
        if np.isnan(values[0]).all():
            yield f"{name}: {basis}"
            continue
        rows += [
            (name, key, *(ratio_text(value) if value == value else "" for value in column), basis)
            for key, column in zip(sobol.keys, values.T, strict=True)
        ]
    ends = (">95 % from", ">to")
    yield Table(("Sobol indices of", "key", ">first-order", *ends, ">total", *ends, ""), rows)


def _range_text(values: Any) -> str:
    """Return the values of a key in short."""
    shown = [_value_text(plain(value)) for value in values]
    if len(shown) <= MAX_VALUES + 1:
        return ", ".join(shown)
    return f"{', '.join(shown[: MAX_VALUES - 1])} ... {shown[-1]} ({len(shown)} values)"


def _value_text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return study_text(value) if isinstance(value, float) else toml_value(value)


def _extreme_parts(table: SweepTable) -> Document:
    """Yield the least and largest values of a grid, and their data."""
    headings = ("quantity", ">least", ">in run", ">largest", ">in run", "unit", ">defined in runs")
    ranges = extremes(table)
    rows = []
    for name in table.values:
        e = ranges.get(name)
        if e is None:
            rows.append((name, "none", "", "none", "", table.units[name], "0"))
            continue
        places = (str(e.least_run), str(e.largest_run))
        least, largest = study_text(e.least), study_text(e.largest)
        if is_constant(sound_values(table, name)):  # which of equal runs is least is roundoff
            places = ("", "")
        rows.append((name, least, places[0], largest, places[1], table.units[name], str(e.runs)))
    yield Table(headings, rows)
    data = {name: _extreme_json(table, ranges.get(name), name) for name in table.values}
    yield Data({"quantities": data})


def _group_lines(word: str, groups: list[Group]) -> list[str]:
    lines = [
        f"{word}, {group.runs} runs: {group.text} (run {group.first_run})"
        if group.runs > 1
        else f"{word}, run {group.first_run}: {group.text}"
        for group in groups[:MAX_GROUPS]
    ]
    rest = groups[MAX_GROUPS:]
    if rest:
        lines.append(f"{word}: {len(rest)} more kinds, in {sum(g.runs for g in rest)} runs")
    return lines


def _sobol_json(sobol: SobolIndices) -> dict[str, Any]:
    return {
        name: {
            "basis": sobol.basis[i],
            "keys": {
                key: {
                    "first": finite(sobol.columns["sobol_first"][i, j]),
                    "first_interval": _interval_json(sobol, "sobol_first", i, j),
                    "total": finite(sobol.columns["sobol_total"][i, j]),
                    "total_interval": _interval_json(sobol, "sobol_total", i, j),
                }
                for j, key in enumerate(sobol.keys)
            },
        }
        for i, name in enumerate(sobol.quantities)
    }


def _interval_json(sobol: SobolIndices, name: str, i: int, j: int) -> list[Any] | None:
    ends = [finite(sobol.columns[f"{name}_{end}"][i, j]) for end in ("low", "high")]
    return None if None in ends else ends


def _statistics_json(s: Statistics, unit: str) -> dict[str, Any]:
    return {
        "unit": unit,
        "runs": s.runs,
        "mean": finite(s.mean),
        "standard_deviation": finite(s.deviation),
        "quantile_5": finite(s.low),
        "quantile_50": finite(s.median),
        "quantile_95": finite(s.high),
    }


def _extreme_json(table: SweepTable, e: Extremes | None, name: str) -> dict[str, Any]:
    data: dict[str, Any] = {"unit": table.units[name], "runs": e.runs if e else 0}
    for word, value, run in (
        ("least", e.least if e else None, e.least_run if e else None),
        ("largest", e.largest if e else None, e.largest_run if e else None),
    ):
        at = None
        if run is not None:
            at = {key: plain(given) for key, given in varied_values(table, run).items()}
        data[word] = {"value": finite(value), "run": run, "at": at}
    return data

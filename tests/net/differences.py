"""What differs between two folders of the net, and by how much."""

import json
from collections import defaultdict
from collections.abc import Iterator
from difflib import SequenceMatcher
from itertools import zip_longest
from math import inf, isfinite
from pathlib import Path
from typing import Any, NamedTuple

from tests.net.digests import SAMPLES

SCREEN = 40  # lines of differences
WIDTH = 150
CHANGED_LINES = 3  # of a text that are told; the others are counted
ABSENT = "<absent>"


class Difference(NamedTuple):
    """One place that differs; `relative` is infinite where it is no number."""

    place: str
    relative: float
    words: str


def compare(old: Path, new: Path, parts: tuple[str, ...], *, whole: bool) -> tuple[list[str], bool]:
    """Return the differences as lines, and whether there are none."""
    heads, groups = [], {}
    for part in parts:
        before, after = (json.loads((folder / f"{part}.json").read_text()) for folder in (old, new))
        places_by_name = {
            name: list(differences(before[name], after[name]))
            for name in before.keys() & after.keys()
        }
        different = {name: places for name, places in places_by_name.items() if places}
        lost, more = sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())
        heads.append(
            f"{part}: {len(places_by_name) - len(different)} same, {len(different)} different,"
            f" {len(lost)} missing, {len(more)} new"
        )
        sets = [f"missing: {name}" for name in lost] + [f"new: {name}" for name in more]
        if lines := [*_grouped(different), *sets]:
            groups[part] = lines
    lines = list(heads)
    for place, (part, said) in enumerate(groups.items()):
        share = len(said) if whole else max(3, (SCREEN - len(lines)) // (len(groups) - place))
        lines += ["", f"{part}:"] + [line if whole else line[:WIDTH] for line in said[:share]]
        if len(said) > share:
            lines.append(f"... and {len(said) - share} more (--all)")
    return lines, not groups


def differences(old: Any, new: Any, place: str = "") -> Iterator[Difference]:
    """Yield the places in which two data differ; 1, 1.0 and true do, NaN does not from itself."""
    if isinstance(old, dict) and isinstance(new, dict):
        if "hash" in old and "hash" in new:
            if old != new:
                yield from _of_arrays(old, new, place)
            return
        for key in [*old, *(key for key in new if key not in old)]:
            inner = old.get(key, ABSENT), new.get(key, ABSENT)
            yield from differences(*inner, f"{place}.{key}" if place else key)
    elif isinstance(old, list) and isinstance(new, list) and _are_data(old + new):
        for i, pair in enumerate(zip_longest(old, new, fillvalue=ABSENT)):
            yield from differences(*pair, f"{place}[{i}]")
    elif isinstance(old, list) and isinstance(new, list):
        yield from _of_texts(old, new, place)
    elif repr(old) == repr(new):  # which tells types, and gives all digits of a float
        return
    elif _are_numbers(old, new) and old != new:
        yield Difference(place, abs(new - old) / max(abs(old), abs(new)), f"{old!r} -> {new!r}")
    else:
        yield Difference(place, inf, f"{_brief(old)} -> {_brief(new)}")


def _are_numbers(old: Any, new: Any) -> bool:
    """Return whether both are finite numbers of one type, so that their difference has a size."""
    return type(old) is type(new) and type(old) in (int, float) and isfinite(old) and isfinite(new)


def _are_data(values: list[Any]) -> bool:
    return not all(isinstance(value, str) for value in values)


def _brief(value: Any) -> str:
    return _cut(value if isinstance(value, str) else json.dumps(value))


def _cut(said: str) -> str:
    return said if len(said) < WIDTH // 2 else f"{said[: WIDTH // 2]}..."


def _of_texts(old: list[str], new: list[str], place: str) -> Iterator[Difference]:
    """Yield the first lines that differ, and how many do."""
    changed = [
        (i1 + i, pair)
        for tag, i1, i2, j1, j2 in SequenceMatcher(None, old, new, autojunk=False).get_opcodes()
        if tag != "equal"
        for i, pair in enumerate(zip_longest(old[i1:i2], new[j1:j2], fillvalue=""))
    ]
    for at, (a, b) in changed[:CHANGED_LINES]:
        start = next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), 0)
        words = " -> ".join(f"'{_cut(line[max(0, start - 30) :])}'" for line in (a, b))
        yield Difference(f"{place} line {at + 1}" if len(old) > 1 else place, inf, words)
    if len(changed) > CHANGED_LINES:
        words = f"{len(changed)} lines differ of {len(old)} -> {len(new)}"
        yield Difference(place, inf, words)


def _of_arrays(old: dict[str, Any], new: dict[str, Any], place: str) -> Iterator[Difference]:
    """Yield how much two digests differ, relative to the largest value of the array."""
    for key in ("type", "shape", "unit"):
        if old.get(key) != new.get(key):
            yield Difference(place, inf, f"{key} {old.get(key)} -> {new.get(key)}")
            return
    if "texts" in old or "texts" in new:
        kept = old.get("texts", []), new.get("texts", [])
        if kept[0] == kept[1]:
            words = f"other texts after the first {len(kept[0])}, which are all that is kept"
            yield Difference(place, inf, words)
        yield from _of_texts(*kept, place)
        return
    by, where, scale = 0.0, "samples", 0.0
    for key in ("samples", "whole"):
        pairs = list(zip(_of_all(old, key), _of_all(new, key), strict=False))
        if any(a != b and str in (type(a), type(b)) for a, b in pairs):
            yield Difference(place, inf, "numbers that are not finite, or no longer")
            return
        sized = [(a, b) for a, b in pairs if not isinstance(a, str)]
        scale = max([scale, *(max(abs(a), abs(b)) for a, b in sized)])
        largest = max((abs(a - b) for a, b in sized), default=0.0)
        if largest > by:
            by, where = largest, key
    if by == 0.0:
        words = "other bytes; samples, extremes and means are the same"
        yield Difference(place, 0.0, words)
        return
    words = f"by {by:.2g} of {scale:.3g}" + ("" if where == "samples" else " (extreme or mean)")
    yield Difference(place, by / scale, words)


def _of_all(record: dict[str, Any], key: str) -> list[Any]:
    """Return samples, or extremes and means; of a constant only one sample is kept."""
    if record["whole"] or len(record["samples"]) != 1:
        return list(record[key])
    sample = record["samples"][0]
    return [sample] * SAMPLES if key == "samples" else [sample, sample, sample, abs(sample)]


def _grouped(different: dict[str, list[Difference]]) -> list[str]:
    """Return a line for each kind of difference: equal words once, then numbers by their size."""
    by_words: dict[str, list[str]] = defaultdict(list)
    numbers: list[tuple[float, str]] = []
    for name, places in sorted(different.items()):
        for place in places:
            if place.relative == inf:
                by_words[place.words].append(f"{name}: {place.place}")
        sized = [place for place in places if place.relative < inf]
        if sized:
            worst = max(sized, key=lambda place: place.relative)
            more = f"; {len(sized)} numbers or arrays in all" if len(sized) > 1 else ""
            line = f"{worst.relative:.1e} relative, {name}: {worst.place} {worst.words}{more}"
            numbers.append((worst.relative, line))
    texts = [
        f"{len(at)} x {at[0]}: {words}"
        for words, at in sorted(by_words.items(), key=lambda one: -len(one[1]))
    ]
    sizes = [line for _, line in sorted(numbers, key=lambda one: -one[0])]
    both = zip_longest(sizes, texts)
    return [line for pair in both for line in pair if line is not None]

"""What differs between two folders of the net, and by how much."""

import json
from collections import defaultdict
from collections.abc import Iterator
from itertools import zip_longest
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

from tests.net.digests import SAMPLES

SCREEN = 40  # lines of differences
WIDTH = 150
ABSENT = "<absent>"


class Difference(NamedTuple):
    """One place that differs; `relative` is infinite where it is no number."""

    place: str
    relative: float
    words: str


def compare(old: Path, new: Path, parts: tuple[str, ...], *, whole: bool) -> tuple[list[str], bool]:
    """Return what differs, as lines, and whether nothing does."""
    heads, groups = [], {}
    for part in parts:
        before, after = (json.loads((folder / f"{part}.json").read_text()) for folder in (old, new))
        found = {
            name: list(differences(before[name], after[name]))
            for name in before.keys() & after.keys()
        }
        different = {name: places for name, places in found.items() if places}
        lost, more = sorted(before.keys() - after.keys()), sorted(after.keys() - before.keys())
        heads.append(
            f"{part}: {len(found) - len(different)} same, {len(different)} different,"
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
    """Yield the places in which two data differ."""
    if old == new and type(old) is type(new):
        return
    if isinstance(old, dict) and isinstance(new, dict):
        if "hash" in old and "hash" in new:
            yield _of_arrays(old, new, place)
            return
        for key in [*old, *(key for key in new if key not in old)]:
            inner = old.get(key, ABSENT), new.get(key, ABSENT)
            yield from differences(*inner, f"{place}.{key}" if place else key)
    elif isinstance(old, list) and isinstance(new, list) and _are_data(old + new):
        for i, pair in enumerate(zip_longest(old, new, fillvalue=ABSENT)):
            yield from differences(*pair, f"{place}[{i}]")
    elif isinstance(old, list) and isinstance(new, list):
        yield _of_texts(old, new, place)
    elif _is_number(old) and _is_number(new):
        scale = max(abs(old), abs(new))
        yield Difference(place, abs(new - old) / scale, f"{old!r} -> {new!r}")
    else:
        yield Difference(place, inf, f"{_brief(old)} -> {_brief(new)}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _are_data(values: list[Any]) -> bool:
    return not all(isinstance(value, str) for value in values)


def _brief(value: Any) -> str:
    said = value if isinstance(value, str) else json.dumps(value)
    return said if len(said) < WIDTH // 2 else f"{said[: WIDTH // 2]}..."


def _of_texts(old: list[str], new: list[str], place: str) -> Difference:
    """Return the first lines that are not in the other text."""
    lost = [line for line in old if line not in new] or ["(other order or count)"]
    more = [line for line in new if line not in old] or ["(other order or count)"]
    for a, b in zip(lost, more, strict=False):
        start = max(
            0, next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), 0) - 30
        )
        return Difference(place, inf, f"'{_brief(a[start:])}' -> '{_brief(b[start:])}'")
    raise AssertionError("both have a line")


def _of_arrays(old: dict[str, Any], new: dict[str, Any], place: str) -> Difference:
    """Return how much two digests differ, relative to the largest value of the array."""
    for key in ("type", "shape", "unit"):
        if old.get(key) != new.get(key):
            return Difference(place, inf, f"{key} {old.get(key)} -> {new.get(key)}")
    if "texts" in old or "texts" in new:
        return _of_texts(old.get("texts", []), new.get("texts", []), place)
    by, where, scale = 0.0, "samples", 0.0
    for key in ("samples", "whole"):
        pairs = list(zip(_of_all(old, key), _of_all(new, key), strict=False))
        if any(a != b and str in (type(a), type(b)) for a, b in pairs):
            return Difference(place, inf, "numbers that are not finite, or no longer")
        sized = [(a, b) for a, b in pairs if not isinstance(a, str)]
        scale = max([scale, *(max(abs(a), abs(b)) for a, b in sized)])
        largest = max((abs(a - b) for a, b in sized), default=0.0)
        if largest > by:
            by, where = largest, key
    if by == 0.0:
        return Difference(place, 0.0, "other bytes; samples, extremes and means are the same")
    words = f"by {by:.2g} of {scale:.3g}" + ("" if where == "samples" else " (extreme or mean)")
    return Difference(place, by / scale, words)


def _of_all(found: dict[str, Any], key: str) -> list[Any]:
    """Return samples, or extremes and means; of a constant only one sample is kept."""
    if found["whole"] or len(found["samples"]) != 1:
        return list(found[key])
    sample = found["samples"][0]
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
        f"{len(at)} x {words} at {at[0]}"
        for words, at in sorted(by_words.items(), key=lambda one: -len(one[1]))
    ]
    sizes = [line for _, line in sorted(numbers, key=lambda one: -one[0])]
    both = zip_longest(sizes, texts)
    return [line for pair in both for line in pair if line is not None]

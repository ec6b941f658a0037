"""Retired words do not come back: one word for one thing in code, scenarios and pages."""

import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache

import pytest

from tests.support.scenarios import ROOT

pytestmark = pytest.mark.quick

# Retired identifiers, as regular expressions of whole names, and what to use instead.
NAMES = {
    r"_?(MOST|LARGEST|LONGEST|DEEPEST)_\w+": "MAX_...",
    r"_?(LEAST|SHORTEST|FEWEST)_\w+": "MIN_...",
    r"_(see|refuse)_\w+|refuse_\w+": "_check_...",
    r"\w*([sS]cene|SCENE)(s|_\w+|[A-Z]\w*)?": "scenario",
    r"\w*[cC]ourse(s|_\w+|InTime|OfSpeedOrTime)?": "signal (input), channel (recorded output)",
    r"\w*satellite\w*": "planet",
    r"\w*remark\w*": "warning",
    r"figures": "quantities",
    r"per_(mass|inertia|r)": "inv_mass, inv_inertia, inv_distance",
    r"per_tolerance": "inv_error_scale",
    r"per_impulse": "force_per_impulse",
    r"air_drag|AirDrag": "viscous_damping",
    r"room": "workspace",
    r"slots?|deal_slots|Slots": "contacts, find_contact_candidates",
    r"\w*([sS]torm|STORM)\w*": "chattering",
    r"CRAWL": "CREEP_WINDOW",
    r"blow_up|blows_up": "diverged",
    r"left_pulleys|LeftPulleys": "belt_off_pulleys",
    r"not_finite|NotFinite": "non_finite",
    r"unsound": "non_finite_tail",
    r"OneCoordinate": "SingleDofSimulation",
    r"go_on|can_go_on": "resume, resumable",
    r"next_kink": "next_discontinuity",
    r"next_turn": "next_extremum",
    r"Kink|kinks": "SwitchingSurface",
    r"revive": "scenario_from_result",
    r"misfit": "inconsistent",
    r"limits_of_rest|torques_of_rest": "impending_motion_...",
    r"Laboratory": "Benchmark",
    r"headline": "max_relative_error",
    r"rest_figures": "equilibrium_quantities",
    r"share_of_reference": "mesh_scale",
    r"share_friction": "project_friction",
    r"lay_coefficients": "assign_friction_coefficients",
    r"keep_in_mind": "update_contact_modes",
    r"WISH": "STICK_BIAS",
    r"go_to_middle": "predict_midpoint",
    r"expect_dampers": "add_predicted_damping",
    r"damp_and_strike": "solve_damping_and_friction",
    r"creep_share": "creep_ratio",
    r"turn_freely": "pulley_accelerations",
}

# Retired words of docstrings, comments, messages and pages.
WORDS = {
    r"scenes?": "scenario",
    r"(?<!of )courses?": "signal (input), channel (recorded output)",
    r"satellites?": "planet",
    r"remark(s|ed)?": "warning",
    r"event storms?": "chattering",
    r"blows? up": "diverges",
    r"right-hand sides with those": "evaluations of the right-hand side",
    r"not to be told": "below the reference uncertainty",
    r"defect of this program": "internal error",
    r"(are|is) spent": "limit ... reached",
}

# The marble machine has slots for its marbles.
ALLOWED = {("frictionsim/mechanisms/marble_machine/tables.py", "slots")}

# Files that still have retired words; delete an entry when they are gone.
NOT_YET = ("frictionsim/mechanisms/belt_drive/belt_simulation.py",)

Hit = tuple[int, str]


@cache
def _retired(name: str) -> str | None:
    return next((use for pattern, use in NAMES.items() if re.fullmatch(pattern, name)), None)


def names(source: str) -> Iterator[Hit]:
    """Yield line and text of each identifier."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NAME:
            yield token.start[0], token.string


def keys(source: str) -> Iterator[Hit]:
    """Yield line and text of each bare key of a TOML file."""
    for number, line in enumerate(source.splitlines(), start=1):
        for key in re.findall(r"[A-Za-z_]\w*(?=[\w.\"]*\s*[=\]])", line.partition("#")[0]):
            yield number, key


def retired_names(path: str, hits: Iterator[Hit]) -> list[str]:
    return [
        f"{path}:{line}: {name}: use {use}"
        for line, name in hits
        if (use := _retired(name)) and (path, name) not in ALLOWED
    ]


def retired_words(path: str, source: str) -> list[str]:
    return [
        f"{path}:{number}: {found[0]}: use {use}"
        for number, line in enumerate(source.splitlines(), start=1)
        for pattern, use in WORDS.items()
        if (found := re.search(rf"(?<![\w.]){pattern}(?!\w)", line, re.IGNORECASE))
    ]


def files(*patterns: str) -> list[str]:
    found = sorted(str(p.relative_to(ROOT)) for pattern in patterns for p in ROOT.glob(pattern))
    return [path for path in found if not path.startswith(NOT_YET)]


def test_no_retired_names_in_the_package() -> None:
    found: list[str] = []
    for path in files("frictionsim/**/*.py"):
        found += retired_names(path, names((ROOT / path).read_text(encoding="utf-8")))
    assert found == []


def test_no_retired_keys_in_the_scenarios() -> None:
    found: list[str] = []
    for path in files("scenarios/**/*.toml"):
        hits = [hit for hit in keys((ROOT / path).read_text(encoding="utf-8")) if hit[1] != "slots"]
        found += retired_names(path, iter(hits))
    assert found == []


def test_no_retired_words_in_code_scenarios_and_pages() -> None:
    found: list[str] = []
    for path in files("frictionsim/**/*.py", "scenarios/**/*.toml", "README.md", "docs/**/*.md"):
        if path != "docs/glossary.md":  # which may name retired words
            found += retired_words(path, (ROOT / path).read_text(encoding="utf-8"))
    assert found == []


def test_retired_names_are_recognised_and_others_accepted() -> None:
    for name in (
        *("MOST_STEPS", "_LEAST_FORCE", "_see_belt", "refuse_body", "Scene", "scene_of"),
        *("PulleyScene", "Course", "courses", "per_mass", "slots", "StormGuard", "draw_satellite"),
    ):
        assert retired_names("a.py", names(f"{name} = 1\n")), name
    for name in ("scenario", "mostly", "figure", "permanent", "MAX_STEPS", "seen"):
        assert retired_names("a.py", names(f"{name} = 1\n")) == [], name


def test_retired_words_are_recognised() -> None:
    assert retired_words("a.md", "The scene is solved.\nAn event storm.") == [
        "a.md:1: scene: use scenario",
        "a.md:2: event storm: use chattering",
    ]
    assert retired_words("a.md", "Of course, the scenario has channels.") == []


def test_retired_keys_are_recognised() -> None:
    source = "[effects.air_drag]\ncoefficient = 1.0  # of the room = 2\n"
    assert retired_names("a.toml", keys(source)) == ["a.toml:1: air_drag: use viscous_damping"]

"""Retired words do not come back: one word for one thing in code, scenarios and pages."""

import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache

import pytest

from tests.support.scenarios import ROOT

pytestmark = pytest.mark.quick

# Retired parts of identifiers, in lower case with underscores, and what to use instead.
NAMES = {
    r"^_?(see|refuse)_\w+": "check_...",
    r"scenes?": "scenario",
    r"courses?": "signal (input), channel (recorded output)",
    r"satellites?": "planet",
    r"remark(s|ed)?": "warning",
    r"figures": "quantities",
    r"per_(mass|inertia|r)": "inv_mass, inv_inertia, inv_distance",
    r"per_tolerance": "inv_error_scale",
    r"^_?per_impulse": "force_per_impulse",
    r"air_drag": "viscous_damping",
    r"storms?": "chattering",
    r"crawl": "creep_window",
    r"blows?_up": "diverged",
    r"left_pulleys": "belt_off_pulleys",
    r"not_finite|unsound": "non_finite",
    r"one_coordinate": "single_dof",
    r"go_on": "resume, resumable",
    r"next_turn": "next_extremum",
    r"kinks?": "discontinuity, switching_surface",
    r"revive": "scenario_from_result",
    r"misfits?": "residual, inconsistent",
    r"limits_of_rest|torques_of_rest": "impending_motion_...",
    r"laboratory": "benchmark",
    r"headline": "max_relative_error",
    r"rest_figures": "statics",
    r"share_of_reference": "mesh_scale",
    r"share_friction": "project_friction",
    r"lay_coefficients": "assign_friction_coefficients",
    r"keep_in_mind": "update_contact_modes",
    r"wish": "stick_bias",
    r"go_to_middle": "predict_midpoint",
    r"expect_dampers": "add_predicted_damping",
    r"damp_and_strike": "solve_damping_and_friction",
    r"creep_share": "creep_ratio",
    r"turn_freely": "pulley_accelerations",
    r"^_?found": "the noun it stands for",
}

# The same for constants; in lower case these are words of every day.
CONSTANTS = {r"MOST|LARGEST|LONGEST|DEEPEST": "MAX_...", r"LEAST|SHORTEST|FEWEST": "MIN_..."}

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

Hit = tuple[int, str]


@cache
def _retired(name: str) -> str | None:
    parts = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    for text, patterns in ((parts, NAMES), (name, CONSTANTS)):
        for pattern, use in patterns.items():
            if re.search(rf"(?:^|_)(?:{pattern})(?=_|$)", text):
                return use
    return None


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
    return [f"{path}:{line}: {name}: use {use}" for line, name in hits if (use := _retired(name))]


def retired_words(path: str, source: str) -> list[str]:
    return [
        f"{path}:{source.count(chr(10), 0, match.start()) + 1}: {match[0]}: use {use}"
        for pattern, use in WORDS.items()
        for match in re.finditer(rf"(?<![\w.])(?:{pattern})(?!\w)", source, re.IGNORECASE)
    ]


def files(*patterns: str) -> dict[str, str]:
    """Return the content of files by path, without those that name retired words."""
    paths = sorted(path for pattern in patterns for path in ROOT.glob(pattern))
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in paths}
    return {path: text for path, text in texts.items() if "glossary" not in path}


def test_no_retired_names_in_code() -> None:
    texts = files("frictionsim/**/*.py", "tests/**/*.py", "docs/_ext/*.py")
    hits = []
    for path, text in texts.items():
        # Names of strings and comments are none, but telling them apart takes long.
        if any(map(_retired, {*re.findall(r"[A-Za-z_]\w*", text)})):
            hits += retired_names(path, names(text))
    assert hits == []


def test_no_retired_keys_in_the_scenarios() -> None:
    texts = files("scenarios/**/*.toml")
    assert [hit for path in texts for hit in retired_names(path, keys(texts[path]))] == []


def test_no_retired_words_in_code_scenarios_and_pages() -> None:
    texts = files(
        *(
            "frictionsim/**/*.py",
            "tests/**/*.py",
            "scenarios/**/*.toml",
            "README.md",
            "docs/**/*.md",
        )
    )
    assert [hit for path in texts for hit in retired_words(path, texts[path])] == []


def test_retired_names_are_recognised_and_others_accepted() -> None:
    for name in (
        *("MOST_STEPS", "_LEAST_FORCE", "_see_belt", "refuse_body", "Scene", "scene_of"),
        *("PulleyScene", "Course", "per_mass", "StormGuard", "draw_satellite", "_NOT_FINITE"),
        *("ROPE_KINKS", "kinkOf", "test_a_kink_ends_a_step"),
    ):
        assert retired_names("a.py", names(f"{name} = 1\n")), name
    for name in ("scenario", "mostly", "figure", "permanent", "MAX_STEPS", "seen", "least_squares"):
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

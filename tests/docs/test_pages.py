"""The pages build without a warning, their links resolve, and the README is one page."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.pages import DOCS, PAGES, anchors, links
from tests.support.scenarios import ROOT

sys.path.insert(0, str(DOCS / "_ext"))
from generated import generated

README_LINES = 130


@pytest.mark.slow
def test_the_pages_build_without_a_warning(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", DOCS, tmp_path],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "index.html").exists()


@pytest.mark.parametrize("page", PAGES)
def test_generated_parts_are_those_of_the_code(page: str) -> None:
    text = PAGES[page].read_text(encoding="utf-8")
    assert generated(text) == text, "out of date; python docs/_ext/generated.py writes it again"


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page: str) -> None:
    for link in links(page):
        if "://" in link:
            continue
        name, _, anchor = link.partition("#")
        target = (PAGES[page].parent / name).resolve() if name else PAGES[page]
        assert target.exists(), f"{page}: {link}"
        if anchor:
            assert anchor in anchors(target), f"{page}: {link}"


def test_the_readme_is_one_page_with_a_short_scenario() -> None:
    text = PAGES["README.md"].read_text(encoding="utf-8")
    assert len(text.splitlines()) <= README_LINES
    scenario = text.split("```toml\n")[1].split("```")[0]
    assert len([line for line in scenario.splitlines() if line.strip()]) <= 12


def test_each_page_is_linked_from_another() -> None:
    linked = {
        (path.parent / link.partition("#")[0]).resolve()
        for page, path in PAGES.items()
        for link in links(page)
        if "://" not in link
    }
    index = PAGES["docs/index.md"].read_text(encoding="utf-8")
    for path in PAGES.values():
        in_contents = path.relative_to(ROOT).with_suffix("").name in index
        assert path in linked or in_contents or path == ROOT / "README.md", path

"""Parts of pages that are made from the code, so that pages can be read unbuilt as well.

What stands between `<!-- generated: NAME ARGUMENTS -->` and `<!-- end -->` of a page is what the
function of that name returns. `python docs/_ext/generated.py` writes them again; a test compares.
It also writes the JSON schemas beside the scenarios, which these name in their first line.
"""

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path

from channel_table import channels
from command_line import commands
from excerpt import excerpt
from gallery import gallery
from layout import layout
from method_table import methods
from papers import papers
from python_api import api, errors
from scenario_keys import keys, signal, units

from frictionsim.scenario.authoring import schema
from frictionsim.scenario.kinds import KINDS

DOCS = Path(__file__).parents[1]
SCHEMAS = DOCS.parent / "scenarios" / "schemas"
PARTS: Mapping[str, Callable[..., str]] = {
    "api": api,
    "channels": channels,
    "commands": commands,
    "errors": errors,
    "excerpt": excerpt,
    "gallery": gallery,
    "keys": keys,
    "layout": layout,
    "methods": methods,
    "papers": papers,
    "signal": signal,
    "units": units,
}
PART = re.compile(r"(<!-- generated: (\w+)((?: [\w.]+)*) -->\n).*?(<!-- end -->)", re.DOTALL)


def generated(page: str) -> str:
    """Return the text of a page with its parts made anew."""

    def part(match: "re.Match[str]") -> str:
        begin, name, arguments, end = match.groups()
        return f"{begin}\n{PARTS[name](*arguments.split())}\n\n{end}"

    return PART.sub(part, page)


def schemas() -> dict[Path, str]:
    """Return the JSON schema of each kind as text, by the file that has it."""
    return {SCHEMAS / f"{kind}.json": f"{json.dumps(schema(kind), indent=2)}\n" for kind in KINDS}


def main() -> None:
    """Write the parts of all pages, and the schemas."""
    SCHEMAS.mkdir(exist_ok=True)
    for path, text in schemas().items():
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            print(path)
    for path in sorted(DOCS.rglob("*.md")):
        page = path.read_text(encoding="utf-8")
        if generated(page) != page:
            path.write_text(generated(page), encoding="utf-8")
            print(path)


if __name__ == "__main__":
    main()

"""Parts of pages that are made from the code, so that pages can be read unbuilt as well.

What stands between `<!-- generated: NAME ARGUMENTS -->` and `<!-- end -->` of a page is what the
function of that name returns. `python docs/_ext/generated.py` writes them again; a test compares.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path

from command_line import commands
from excerpt import excerpt
from layout import layout
from method_table import methods
from scenario_keys import keys

DOCS = Path(__file__).parents[1]
PARTS: Mapping[str, Callable[..., str]] = {
    "commands": commands,
    "excerpt": excerpt,
    "keys": keys,
    "layout": layout,
    "methods": methods,
}
PART = re.compile(r"(<!-- generated: (\w+)((?: [\w.]+)*) -->\n).*?(<!-- end -->)", re.DOTALL)


def generated(page: str) -> str:
    """Return the text of a page with its parts made anew."""

    def part(found: "re.Match[str]") -> str:
        begin, name, arguments, end = found.groups()
        return f"{begin}\n{PARTS[name](*arguments.split())}\n\n{end}"

    return PART.sub(part, page)


def main() -> None:
    """Write the parts of all pages."""
    for path in sorted(DOCS.rglob("*.md")):
        page = path.read_text(encoding="utf-8")
        if generated(page) != page:
            path.write_text(generated(page), encoding="utf-8")
            print(path)


if __name__ == "__main__":
    main()

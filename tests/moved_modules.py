"""Which tests name an inside of the package, where they should talk to its public face.

    python -m tests.moved_modules

prints imports and patches of insides by file. What tests may name is `frictionsim` itself, its
`results` and `errors`, what authors of kinds import, the solvers, and the kernels of belts.
"""

import ast
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

TESTS = Path(__file__).parent
# Tools that are no tests.
TOOLS = ("benchmarks", "faults")
KERNELS = r"mechanisms\.belt_drive\.(kernels|moreau|rkf45)"
ROOMS = "api|cli|costs|fits|io|mechanisms|motion|plots|reports|scenario|simulation|sweeps"
PUBLIC = rf"\*|(?!({ROOMS}|display|document)\b)\w+"
WHOLE = rf"results|errors|solvers|mechanisms\.extension|{KERNELS}"
ALLOWED = re.compile(rf"frictionsim(\.({PUBLIC}|({WHOLE})(\..*)?))?$")


def main() -> None:
    """Print the imports and patches of insides."""
    count = 0
    for path in sorted(TESTS.rglob("*.py")):
        if path.parent.name not in TOOLS:
            for text in insides_of(ast.parse(path.read_text(encoding="utf-8"))):
                count += 1
                print(f"{path.relative_to(TESTS)}: {text}")
    print(f"{count} imports and patches name an inside")


def insides_of(tree: ast.AST) -> Iterator[str]:
    """Yield the imports and patches of a program that name an inside.

    Imports are statements, also those in programs that are kept as text. Patches are calls of
    `setattr` and `delattr` of what `patch` is called, whose target is named as text or was imported
    from the package.
    """
    own = set[str]()
    for node in sorted(ast.walk(tree), key=lambda node: getattr(node, "lineno", 0)):
        if isinstance(node, ast.ImportFrom | ast.Import):
            module = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            names = {alias.asname or alias.name: module + alias.name for alias in node.names}
            names = {key: name for key, name in names.items() if name.startswith("frictionsim")}
            own |= names.keys()
            if not all(map(ALLOWED.match, names.values())):
                yield ast.unparse(node)
        elif isinstance(node, ast.Constant) and "import frictionsim" in str(node.value).replace(
            "from", "import"
        ):
            with suppress(SyntaxError):
                yield from insides_of(ast.parse(str(node.value)))
        elif isinstance(node, ast.Call) and re.search(
            r"patch\w*\.(set|del)attr$", ast.unparse(node.func)
        ):
            target = ast.unparse(node.args[0])
            if "frictionsim." in target or target.partition(".")[0] in own:
                yield ast.unparse(node)


if __name__ == "__main__":
    main()

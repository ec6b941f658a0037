"""The scenarios that come with the package: examples of each kind, hard ones, benchmarks."""

from pathlib import Path

from frictionsim.errors import InputError

PACKAGE = Path(__file__).parents[1]
FOLDERS = "hard", "validation"  # beside the examples: hard for a solver, benchmarks of others


def shipped_folder() -> Path:
    """Return the folder of the shipped scenarios.

    A wheel has them inside the package, a source tree beside it.

    Raises
    ------
    InputError
        If the installation is without them.
    """
    folders = (PACKAGE / "scenarios", PACKAGE.parent / "scenarios")
    for folder in folders:
        # Another package may have a folder of this name beside ours.
        if (folder / "pulley.toml").is_file():
            return folder
    raise InputError(
        f"the scenarios that come with frictionsim are neither in {folders[0]} nor in {folders[1]};"
        " install the package again"
    )


def shipped_scenarios() -> dict[str, Path]:
    """Return the shipped scenarios by name: `pulley`, and with their folder, as `hard/jump`.

    Raises
    ------
    InputError
        If the installation is without them.
    """
    folder = shipped_folder()
    found = {path.stem: path for path in sorted(folder.glob("*.toml"))}
    for name in FOLDERS:
        found |= {f"{name}/{path.stem}": path for path in sorted((folder / name).glob("*.toml"))}
    return found

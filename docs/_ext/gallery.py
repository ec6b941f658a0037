"""The pictures of `gallery.toml`, and the page that shows them.

    python docs/_ext/gallery.py

makes all of `docs/pictures` anew, in some minutes; with words, as `path report`, those whose files
have such a word in their name. Screenshots of reports need a Chromium and Playwright.
"""

import shlex
import shutil
import subprocess
import sys
import tempfile
import tomllib
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1]
PICTURES = DOCS / "pictures"
GALLERY = tomllib.loads((DOCS / "gallery.toml").read_text(encoding="utf-8"))["picture"]


def gallery() -> str:
    """Return the body of the page: each picture with the command that draws it."""
    parts = []
    for group, pictures in groupby(GALLERY, itemgetter("group")):
        parts.append(f"## {group}")
        for picture in pictures:
            title = f"{picture['shows'][0].upper()}{picture['shows'][1:]}"
            parts.append(f"![{title}](pictures/{picture['file']})")
            parts.append(f"{title}: `{picture['commands'][-1]}`")
    return "\n\n".join(parts)


def make(pictures: list[dict[str, Any]]) -> None:
    """Make pictures in `docs/pictures`; each command is run once."""
    done: set[str] = set()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(DOCS.parent / "scenarios", folder / "scenarios")
        (folder / "results").mkdir()
        (folder / "docs" / "pictures").mkdir(parents=True)
        for picture in pictures:
            for command in picture["commands"]:
                if command not in done:
                    _run(command, folder)
                done.add(command)
            made = folder / picture["commands"][-1].split()[-1]
            target = PICTURES / picture["file"]
            if scheme := picture.get("scheme"):
                from screenshots import take

                take(made, target, scheme, picture.get("place", ""), picture.get("time"))
            else:
                shutil.copyfile(made, target)
            print(f"{target}: {target.stat().st_size} bytes", flush=True)


def _run(command: str, folder: Path) -> None:
    text, _, target = command.partition(" > ")
    program, *words = shlex.split(text)
    start = ["-m", program] if program == "frictionsim" else [str(DOCS.parent / program)]
    line = [sys.executable, *start, *words]
    done = subprocess.run(line, cwd=folder, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{command}: exit {done.returncode}")
    if target:
        (folder / target).write_text(done.stdout, encoding="utf-8")


if __name__ == "__main__":
    wanted = sys.argv[1:] or [""]
    make([picture for picture in GALLERY if any(word in picture["file"] for word in wanted)])
    for left in {*PICTURES.iterdir()} - {PICTURES / picture["file"] for picture in GALLERY}:
        left.unlink()

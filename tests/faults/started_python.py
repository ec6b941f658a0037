"""As `sitecustomize` in a copy of the sources: what the processes that tests start use of it.

`FAULTS_STARTED` is the file for the names of modules of the package that ran, and of files that
were read there, a line each, written at once, because tests end processes at any moment.
"""

import os
import sys
from typing import Any

DIGESTING = ("belt_drive/compilation.py", "hypothesis/internal/constants_ast.py")
PACKAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "frictionsim") + os.sep


def read_for_a_digest() -> bool:
    """Return whether a file is opened only to tell one text from another, or for drawn numbers."""
    frame = sys._getframe()
    while frame := frame.f_back:  # type: ignore[assignment]
        if frame.f_code.co_filename.endswith(DIGESTING):
            return True
    return False


def _look(event: str, arguments: tuple[Any, ...]) -> None:
    name = ""
    if event == "exec":
        name = getattr(arguments[0], "co_filename", "")
    elif event == "open" and isinstance(arguments[0], str):
        name = os.path.abspath(arguments[0])
    if name.startswith(PACKAGE) and not read_for_a_digest():
        os.write(_place, f"{name}\n".encode())


if "FAULTS_STARTED" in os.environ:
    _place = os.open(os.environ["FAULTS_STARTED"], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    sys.addaudithook(_look)

"""Journals of sweeps whose pages are changed."""

import sqlite3
import struct
from contextlib import closing
from pathlib import Path

from frictionsim.parameter_study.journal import SweepJournal, journal_name

HEADER = 100  # bytes of a SQLite file before its first page


def repeat_pages(part: Path, levels: int = 4, cells: int = 500) -> None:
    """Have all cells of the root of a journal's table refer to one page below, on some levels.

    In a whole record the ascending numbers show it; therefore their checksums are wrong.
    """
    SweepJournal(part).close(remove=False)
    with closing(sqlite3.connect(journal_name(part), isolation_level=None)) as database:
        database.execute("UPDATE blocks SET checksum = checksum + 1")
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        roots = dict(database.execute("SELECT name, rootpage FROM sqlite_schema"))
        (size,) = database.execute("PRAGMA page_size").fetchone()
    root = roots["blocks"]
    content = bytearray(journal_name(part).read_bytes())
    count, place = len(content) // size, slice((root - 1) * size, root * size)
    page, header = content[place], HEADER if root == 1 else 0
    (records,) = struct.unpack_from(">H", page, header + 5)  # where they start in the page
    content += page[header:records] + bytes(header) + page[records:]
    for child in range(count + 1, count + levels):
        content += _interior_page(child, size, cells)
    content[place] = _interior_page(count + levels, size, cells, page[:header])
    content[28:32] = struct.pack(">I", len(content) // size)
    journal_name(part).write_bytes(content)


def _interior_page(child: int, size: int, cells: int, header: bytes = b"") -> bytes:
    """Return an interior page of a table (SQLite file format, 1.6) with one child, many times."""
    page, start = bytearray(header.ljust(size, b"\0")), size - 5 * cells
    struct.pack_into(">BHHHBI", page, len(header), 5, 0, cells, start, 0, child)
    for cell in range(cells):
        struct.pack_into(">H", page, len(header) + 12 + 2 * cell, start + 5 * cell)
        struct.pack_into(">IB", page, start + 5 * cell, child, 0)
    return bytes(page)

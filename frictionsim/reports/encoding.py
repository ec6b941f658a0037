"""Data for the scripts of a page: JSON with arrays as base64, compressed."""

import gzip
import json
from base64 import b64encode
from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

ARRAY = "array"  # the key by which the scripts know an array


def packed(content: bytes) -> str:
    """Return bytes compressed, as base64; equal bytes give equal texts."""
    return b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def packed_data(data: Any) -> str:
    """Return data as compressed JSON in base64.

    Parameters
    ----------
    data : dict, list, NamedTuple, array, str, number or None
        A NamedTuple becomes an object with its fields and the name of its type as `type`. A number
        that is not finite becomes null.
    """
    return packed(json.dumps(plain(data), allow_nan=False, separators=(",", ":")).encode())


def plain(data: Any) -> Any:
    """Return data as JSON has it."""
    if isinstance(data, np.ndarray):
        return array(data)
    if isinstance(data, tuple) and hasattr(data, "_fields"):
        fields = zip(data._fields, data, strict=True)
        return {"type": type(data).__name__, **{name: plain(value) for name, value in fields}}
    if isinstance(data, Mapping):
        return {str(name): plain(value) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value) for value in data]
    if isinstance(data, np.generic):
        return plain(data.item())
    return None if isinstance(data, float) and not isfinite(data) else data


def array(values: Any) -> dict[str, Any]:
    """Return an array for the scripts: little-endian numbers, whatever machine wrote them."""
    kind = {"f": "<f4" if values.dtype == np.float32 else "<f8", "b": "|u1"}.get(
        values.dtype.kind, "<i4"
    )
    content = np.ascontiguousarray(values, dtype=kind).tobytes()
    return {ARRAY: b64encode(content).decode("ascii"), "of": kind[1:], "shape": values.shape}

"""Numbers of a JSON file as arrays of a known shape: true is no 1 there, and "0.7" no 0.7."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.io.entries import is_number

Shape = tuple[int | None, ...]  # () is one number, None any length


def array_of(path: Path, entry: Mapping[str, Any], key: str, shape: Shape, of: str = "") -> Array:
    """Return the finite numbers of a shape under `key`; raises BadFile, which says what they are `of` in words."""
    value = entry.get(key)
    if not _fits(value, shape):
        raise _unfit(path, key, of, f"{_counted(shape)} finite {_numbers(shape)}")
    return np.array(value, np.float64)


def array_or_none(path: Path, entry: Mapping[str, Any], key: str, shape: Shape) -> Array | None:
    """Return the same, None where the entry is missing or null, whole or in part."""
    value = entry.get(key)
    if value is None:
        return None
    if not _fits(value, shape, gaps=True):
        raise _unfit(path, key, "", f"{_counted(shape)} {_numbers(shape)} or null")
    return np.array(value, np.float64) if _fits(value, shape) else None


def object_of(path: Path, entry: Mapping[str, Any], key: str, of: str = "") -> Mapping[str, Any]:
    """Return the object under `key`, empty where it is missing or null; raises BadFile, which says what it is `of`."""
    value = entry.get(key) or {}
    if not isinstance(value, dict):
        raise BadFile(f'{path}: "{key}" must be one object{of}.')
    return value


def arrays_of(path: Path, entry: Mapping[str, Any], key: str, shape: Shape, of: str) -> dict[str, Array]:
    """Return the arrays of one shape that the object under `key` names; raises BadFile."""
    values = object_of(path, entry, key, of)
    return {str(name): array_of(path, values, name, shape, f" of {key}") for name in values}


def _fits(value: Any, shape: Shape, gaps: bool = False) -> bool:
    """Whether a value is lists of lists of finite numbers, or with `gaps` of null, as long as the shape says."""
    if not shape:
        return is_number(value) or (gaps and value is None)
    if not isinstance(value, list) or shape[0] not in (None, len(value)):
        return False
    return all(_fits(item, shape[1:], gaps) for item in value)


def _counted(shape: Shape) -> str:
    return " x ".join("n" if length is None else str(length) for length in shape) or "one"


def _numbers(shape: Shape) -> str:
    return "numbers" if shape else "number"


def _unfit(path: Path, key: str, of: str, wanted: str) -> BadFile:
    return BadFile(f'{path}: "{key}"{of} must be {wanted}; found something else.')

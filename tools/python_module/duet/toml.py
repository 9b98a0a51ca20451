"""Values of Python as TOML text."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np


def value_text(value: Any) -> str:
    """Returns a number, string, boolean, list, NumPy array or mapping as a TOML value in one line.

    Raises TypeError for anything else.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isfinite(value):
            return repr(value) if re.search("[.e]", repr(value)) else repr(value) + ".0"
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return "[" + ", ".join(value_text(one) for one in value) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key_text(k)} = {value_text(v)}" for k, v in value.items() if v is not None) + " }"
    raise TypeError(f"{value!r} is no value of a scene: give numbers, strings, booleans, lists or dicts")


def key_text(key: str) -> str:
    """Returns a key, in quotes if it needs them."""
    return key if re.fullmatch("[A-Za-z0-9_-]+", key) else json.dumps(key, ensure_ascii=False)


def document_text(document: Mapping[str, Any]) -> str:
    """Returns a scene given as nested dicts and lists as a TOML document. Values that are None are left out."""
    values, tables = [], []
    for key, value in document.items():
        if value is None:
            continue
        if isinstance(value, Mapping):
            tables.append(_table(key_text(key), value))
        elif isinstance(value, list | tuple) and value and all(isinstance(one, Mapping) for one in value):
            tables += [_lines(f"[[{key_text(key)}]]", one) for one in value]
        else:
            values.append(f"{key_text(key)} = {value_text(value)}\n")
    return "".join(values) + "".join("\n" + table for table in tables)


def _table(path: str, table: Mapping[str, Any]) -> str:
    # Tables of tables, such as [materials.NAME], get headings of their own, for places in messages.
    if table and all(isinstance(value, Mapping) for value in table.values()):
        return "\n".join(_table(f"{path}.{key_text(key)}", value) for key, value in table.items())
    return _lines(f"[{path}]", table)


def _lines(heading: str, table: Mapping[str, Any]) -> str:
    lines = [f"{key_text(key)} = {value_text(value)}\n" for key, value in table.items() if value is not None]
    return heading + "\n" + "".join(lines)

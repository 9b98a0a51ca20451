"""Errors of Duet. Every one is a :class:`Error`; none of them leaves a simulation in a broken state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Problem:
    """One problem of a scene. ``line`` and ``column`` count from 1; 0: the problem has no place in the file."""

    file: str
    line: int
    column: int
    key: str
    message: str
    remedy: str

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}: " if self.line else f"{self.file}: " if self.file else ""
        key = f"{self.key}: " if self.key else ""
        remedy = f" ({self.remedy})" if self.remedy else ""
        return f"{place}{key}{self.message}{remedy}"


class Error(Exception):
    """Base of all errors. ``status`` is the exit status that the program ``duet`` would end with."""

    def __init__(self, message: str, status: int = 2) -> None:
        super().__init__(message)
        self.status = status

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.status)


class SceneError(Error):
    """A scene that is wrong. ``problems`` lists all that was found; ``file``, ``line``, ``column``, ``key``,
    ``message`` and ``remedy`` are those of the first one."""

    def __init__(self, message: str, problems: list[Problem]) -> None:
        super().__init__(message)
        self.problems = problems
        first = problems[0] if problems else Problem("", 0, 0, "", message, "")
        self.file, self.line, self.column = first.file, first.line, first.column
        self.key, self.message, self.remedy = first.key, first.message, first.remedy

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.problems)


class FileError(Error):
    """A file or folder that cannot be read or written: ``path``."""

    def __init__(self, message: str, path: str = "") -> None:
        super().__init__(message, 4)
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.path)


class SimulationError(Error):
    """A simulation that failed; it holds the last good frame. ``fault`` is a dict with ``stage``, ``time`` (s),
    ``frame``, ``substep``, ``body``, ``element``, ``position`` (m), ``value``, ``bound``, ``cause`` and
    ``remedy``."""

    def __init__(self, message: str, fault: dict[str, Any]) -> None:
        super().__init__(message, 3)
        self.fault = fault

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.fault)

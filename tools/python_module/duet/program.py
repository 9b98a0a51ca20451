"""The program ``duet``, which comes with the package, and the scenes that ship with it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

from . import errors

_folder = Path(__file__).absolute().parent


def path() -> Path:
    """Returns the path of the program: that of the package, of the build that the package is part of, or the value
    of the environment variable DUET_PROGRAM. Raises FileError if there is none."""
    if given := os.environ.get("DUET_PROGRAM"):
        return Path(given)
    for candidate in (_folder / "bin" / "duet", _folder.parents[1] / "duet"):
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise errors.FileError("the program `duet` is not beside the package (set DUET_PROGRAM to its path)", "duet")


def shipped_scene(name: str) -> Path | None:
    """Returns the file of a scene that ships (``"stack"``, ``"hard/pile"``), or None if there is none."""
    if not name or name.startswith(("/", ".")):
        return None
    for folder in (_folder / "share" / "duet" / "scenes", _scenes_of_build()):
        if folder and (file := folder / f"{name}.toml").is_file():
            return file
    return None


def _scenes_of_build() -> Path | None:
    # build/python/duet/program.py is a link to tools/python_module/duet/program.py of the source tree.
    source = Path(__file__).resolve().parents[3] / "scenes"
    return source if source.is_dir() else None


def call(*arguments: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """Runs ``duet ARGUMENTS --json`` and returns the objects that it prints.

    Raises Error with its last message if the program fails, and KeyboardInterrupt if it was interrupted.
    """
    command = [str(path()), *(os.fspath(one) for one in arguments), "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        output, messages = process.communicate()
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)  # the program keeps what is whole
        process.communicate()
        raise
    if process.returncode == 130:
        raise KeyboardInterrupt
    objects = [json.loads(line) for line in output.splitlines() if line.startswith("{")]
    if process.returncode not in (0, 1):
        raise _error(process.returncode, objects, messages)
    return objects


def text(*arguments: str | os.PathLike[str]) -> str:
    """Runs ``duet ARGUMENTS`` and returns what it prints. Raises Error if it fails."""
    command = [str(path()), *(os.fspath(one) for one in arguments)]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    if process.returncode != 0:
        raise _error(process.returncode, [], process.stderr)
    return process.stdout


def _error(status: int, objects: list[dict[str, Any]], messages: str) -> errors.Error:
    outcome: dict[str, Any] = next((one for one in objects if one.get("event") == "outcome"), {})
    text = outcome.get("error") or messages.strip() or outcome.get("text") or f"the program ended with status {status}"
    if status == 4:
        return errors.FileError(text)
    if status == 3:
        return errors.SimulationError(text, {})
    return errors.Error(text, status)

"""Run directories, studies, and comparisons of pictures."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core, program, toml
from .errors import Error, FileError


class Run:
    """A run directory that ``duet run``, ``duet sim`` or :meth:`duet.Scene.run` has written.

    Raises FileError if `path` is no run.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._drawing = threading.local()
        self.manifest: dict[str, Any] = _json(self.path / "manifest.json")
        """Content of manifest.json: scene, fps, frames, bodies (name, kind, look, material, vertices, triangles),
        program and machine."""

    def __repr__(self) -> str:
        return f"<duet.Run {str(self.path)!r}, {len(self.frames)} frames>"

    @property
    def frames(self) -> list[int]:
        """Numbers of the frames that have values, in ascending order."""
        return sorted(int(file.stem) for file in self.path.glob("values/*.npy") if file.stem.isdigit())

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies: rigid ones, then deformable ones."""
        return [body["name"] for body in self.manifest["bodies"]]

    @cached_property
    def statistics(self) -> dict[str, NDArray[Any]]:
        """Statistics by name, each an array over the frames: ``statistics["kinetic"]`` has the shape (frames,),
        ``statistics["momentum"]`` (frames, 3). Names and units are those of stats.jsonl; what is missing in some
        frames is NaN there. ``hash`` holds strings. Seconds of a stage are ``statistics["seconds of II.1
        collisions"]``."""
        file = self.path / "stats.jsonl"
        try:
            lines = [json.loads(line) for line in file.read_text().splitlines()]
        except (OSError, ValueError) as error:
            raise FileError(f"{file}: {error}", os.fspath(file)) from None
        for line in lines:
            for stage, entry in line.pop("stages", {}).items():
                line[f"seconds of {stage}"] = entry["seconds"]
            for name in ("ledger", "pinched"):
                line.pop(name, None)
        names = list(dict.fromkeys(name for line in lines for name in line))
        return {name: np.array([np.nan if line.get(name) is None else line[name] for line in lines])
                for name in names}

    def values(self, frame: int) -> NDArray[np.void]:
        """Returns the record of a frame. Its fields are ``position`` (R, 3), ``orientation`` (R, 4), ``velocity``
        and ``angular_velocity`` (R, 3) of rigid bodies, and ``point``, ``point_velocity`` (n, 3) and ``strain``
        (n,) of the points of deformable bodies; in m, s and rad. Newer runs also have ``contact_force`` and
        ``contact_torque`` (R, 3), and ``stress``, ``energy_density``, ``contact_pressure`` (n,) and
        ``point_contact_force`` (n, 3); in N, N m, Pa and J/m^3."""
        return _record(self.path / "values" / f"{frame:04d}.npy")

    def mesh(self, frame: int, body: str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Returns points (n, 3), m, and triangles (m, 3) of a body at a frame, in double precision."""
        before = {"rigid": 0, "points": 0, "rest": 0, "corner": 0}
        for entry in self.manifest["bodies"]:
            if entry["name"] == body:
                break
            is_rigid = entry["kind"] != "deformable"
            before["rigid"] += is_rigid
            before["points"] += 0 if is_rigid else entry["vertices"]
            before["rest"] += entry["vertices"]
            before["corner"] += entry["triangles"]
        else:
            raise KeyError(f"there is no body `{body}`; there are {', '.join(self.bodies)}")
        values, rest = self.values(frame), self._rest
        corner = rest["corner"][before["corner"]:before["corner"] + entry["triangles"]]
        triangles = np.ascontiguousarray(corner.reshape(len(corner), 3, 3)[:, :, 0], dtype=np.int32)
        n = entry["vertices"]
        if entry["kind"] == "deformable":
            return np.array(values["point"][before["points"]:before["points"] + n]), triangles
        x = rest["rest"][before["rest"]:before["rest"] + n]
        w, *v = values["orientation"][before["rigid"]]
        turned = x + 2 * np.cross(v, np.cross(v, x) + w * x)
        return turned + values["position"][before["rigid"]], triangles

    @cached_property
    def _rest(self) -> NDArray[np.void]:
        return _record(self.path / "values" / "bodies.npy")

    def render(self, frame: int, overrides: Mapping[str, Any] | None = None) -> NDArray[np.uint8]:
        """Draws a frame: (height, width, 3), sRGB. `overrides` are keys of camera, lights, looks, sky and render,
        such as ``{"render.width": 640, "camera.position": [4, 2, 4]}``."""
        from .scene import require_picture_keys

        require_picture_keys(overrides or {})
        texts = tuple(f"{key}={toml.value_text(value)}" for key, value in (overrides or {}).items())
        if getattr(self._drawing, "texts", None) != texts:
            self._drawing.renderer = None
            self._drawing.renderer = _core.RunRenderer(os.fspath(self.path), list(texts))
            self._drawing.texts = texts
        picture: NDArray[np.uint8] = self._drawing.renderer.draw(frame)
        return picture

    def export(
        self,
        to: str,
        out: str | os.PathLike[str] | None = None,
        *,
        bodies: Sequence[str] = (),
        frames: tuple[int, int] | None = None,
        up: str = "y",
        scale: float = 1,
        overwrite: bool = False,
    ) -> Path:
        """Writes the run for another program and returns the file or folder.

        to
            ``"glb"``, ``"usd"``, ``"obj"``, ``"ply"``, ``"pc2"``, ``"mdd"``, ``"vtk"`` or ``"transforms"``.
        out
            File or folder; None: in ``export/`` of the run.
        bodies
            Names or patterns with ``*``; empty: all.
        frames
            First and last frame; None: all.
        """
        options = [f"--to={to}", f"--up={up}", f"--scale={scale!r}"] + [f"--bodies={one}" for one in bodies]
        options += [f"--frames={frames[0]}:{frames[1]}"] if frames else []
        options += ["--overwrite"] * overwrite
        out = out or self.path / "export" / ("run.glb" if to == "glb" else to)
        program.call("export", self.path, *options, f"--out={os.fspath(out)}")
        return Path(out)


def study(
    spec: str | os.PathLike[str], out: str | os.PathLike[str], *, jobs: int = 1, untimed: bool = False
) -> dict[str, Any]:
    """Runs a study (tests/PROTOCOL.md), a scene under many settings, and returns its results.json.

    ``rows`` has an entry for each setting, with ``errors`` by measure, ``seconds`` and ``steps``; ``units`` are
    those of the errors.
    """
    program.call("study", spec, f"--out={os.fspath(out)}", f"--jobs={jobs}", *(["--untimed"] * untimed))
    return _json(Path(out) / "results.json")


def compare(a: Any, b: Any, *, tolerance: int = 4) -> dict[str, Any]:
    """Measures how much two pictures differ, or the pictures of two folders or runs.

    a, b
        Arrays (height, width, 3) of bytes, as ``render()`` returns them; paths of pictures; runs; or folders.
    tolerance
        A pixel differs if one of its channels is off by more than this, in steps of 1/255.

    Returns ``same`` (within the bounds of ``duet compare``), ``maximum``, ``mean``, ``rmse`` (0 to 1), ``share``
    (fraction of pixels that differ), ``largest_patch`` (pixels) and ``ssim``: of the pair that differs most by
    ``rmse``. Raises Error if sizes differ.
    """
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        for one in (a, b):
            if one.dtype != np.uint8:
                raise Error(f"a picture of type {one.dtype} cannot be compared: give arrays of uint8")
        return _core.difference(a, b, tolerance)
    paths = [one.path if isinstance(one, Run) else one for one in (a, b)]
    pairs = [one for one in program.call("compare", *paths, f"--tolerance={tolerance}") if one["event"] == "pair"]
    worst = max(pairs, key=lambda one: float(one["rmse"]))
    worst["same"] = all(one["same"] for one in pairs)
    return {key: value for key, value in worst.items() if key != "event"}


def _json(file: Path) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(file.read_text())
    except FileNotFoundError:
        raise FileError(f"{file}: there is no such file, so {file.parent} is no run", os.fspath(file)) from None
    except (OSError, ValueError) as error:
        raise FileError(f"{file}: {error}", os.fspath(file)) from None
    return content


def _record(file: Path) -> NDArray[np.void]:
    try:
        record: NDArray[np.void] = np.load(file)
    except (OSError, ValueError) as error:
        raise FileError(f"{file}: {error} (`duet sim --stats-only` writes no values)", os.fspath(file)) from None
    return record

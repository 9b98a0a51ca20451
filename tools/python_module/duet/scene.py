"""Scenes: from a file, text or dict, with keys that are checked as those of a file."""

from __future__ import annotations

import os
import shutil
import tempfile
import threading
import tomllib
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, program, toml
from .errors import Error, FileError
from .run import Run
from .simulation import Simulation


@dataclass(frozen=True)
class Body:
    """A body of a scene. ``kind`` is ``"rigid"``, ``"kinematic"``, ``"static"`` or ``"deformable"``; ``material``
    and ``look`` are names, or empty."""

    name: str
    kind: str
    material: str
    look: str


class Scene:
    """A scene, checked when it is made and at each change: what is wrong raises :class:`duet.SceneError` with
    file, line, column, key and remedy.

    source
        Path of a TOML file; name of a scene that ships, such as ``"stack"``; or a dict of tables with the same
        keys (scenes/README.md), in which NumPy arrays may stand for lists.
    accuracy
        ``"draft"``, ``"standard"`` or ``"fine"``; None: as the scene says.

    ``scene["solver.cfl"] = 0.5`` sets a key as ``duet run --set solver.cfl=0.5`` does; elements of lists are
    addressed by their names: ``scene["rigid.ball.velocity"] = [0, 0, -9]``.
    """

    def __init__(
        self, source: str | os.PathLike[str] | Mapping[str, Any], *, accuracy: str | None = None
    ) -> None:
        if isinstance(source, Mapping):
            self._begin(toml.document_text(source), "scene.toml", accuracy)
        else:
            path = Path(source)
            if not path.is_file():
                path = program.shipped_scene(os.fspath(source)) or path
            try:
                text = path.read_text(encoding="utf-8")
            except OSError as error:
                hint = "" if path.suffix else ", and no scene of this name ships (`python3 -m duet list`)"
                raise FileError(f"{path}: {error.strerror}{hint}", os.fspath(path)) from None
            except UnicodeDecodeError:
                raise FileError(f"{path}: is no text in UTF-8", os.fspath(path)) from None
            self._begin(text, os.fspath(path), accuracy)

    @classmethod
    def from_text(cls, text: str, *, path: str | os.PathLike[str] = "scene.toml", accuracy: str | None = None) -> Scene:
        """Makes a scene from the text of a TOML document. Messages name `path`, and mesh files are looked for in
        its folder."""
        scene = cls.__new__(cls)
        scene._begin(text, os.fspath(path), accuracy)
        return scene

    def _begin(self, text: str, path: str, accuracy: str | None) -> None:
        self._text, self._path = text, path
        self._overrides: dict[str, str] = {}
        self._meshes: dict[str, str] = {}
        self._folder: str | None = None
        self._drawing = threading.local()
        if accuracy is not None:
            self._overrides["solver.accuracy"] = toml.value_text(accuracy)
        self._data = self._read(self._overrides)

    def _read(self, overrides: Mapping[str, str], meshes: bool = False) -> _core.SceneData:
        assignments = [f"{key}={value}" for key, value in overrides.items()]
        return _core.read_text(self._text, self._path, assignments, meshes, self._meshes)

    def _read_with_meshes(self) -> _core.SceneData:
        return self._read(self._overrides, meshes=True)

    def __repr__(self) -> str:
        return f"<duet.Scene {self.title or self._path!r}, {len(self.bodies)} bodies>"

    def __getstate__(self) -> dict[str, Any]:
        meshes = {name: Path(path).read_text() for name, path in self._meshes.items()}
        path = os.path.abspath(self._path)  # another process may work in another folder
        return {"text": self._text, "path": path, "overrides": self._overrides, "meshes": meshes}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._begin(state["text"], state["path"], None)
        for name, text in state["meshes"].items():
            self._keep_mesh(name, text)
        self._overrides = dict(state["overrides"])
        self._data = self._read(self._overrides)

    def copy(self) -> Scene:
        """Returns a scene of its own with the same text and keys."""
        other = Scene.__new__(Scene)
        other.__setstate__({**self.__getstate__(), "path": self._path})
        return other

    # Keys

    def __getitem__(self, key: str) -> Any:
        """Returns the value of a key: as the scene gives it, else its default (None: there is none).

        Raises SceneError with the most similar key if there is no such key.
        """
        value: Any = self.as_dict()
        parts = key.split(".")
        for part in parts:
            if isinstance(value, list):
                value = next((one for one in value if isinstance(one, dict) and one.get("name") == part), None)
            else:
                value = value.get(part) if isinstance(value, dict) else None
            if value is None:
                break
        if value is not None:
            return value
        try:
            return self._data.value(parts)
        except KeyError as error:
            self._read({**self._overrides, key: "0"})  # raises SceneError for keys that do not exist
            raise KeyError(f"{key}: {error.args[0]}") from None

    def __setitem__(self, key: str, value: Any) -> None:
        self.update({key: value})

    def update(self, values: Mapping[str, Any]) -> None:
        """Sets several keys at once, or none of them if one is wrong."""
        overrides = dict(self._overrides)
        for key, value in values.items():
            overrides.pop(key, None)  # the last one counts, as on the command line
            overrides[key] = toml.value_text(value)
        self._data = self._read(overrides)
        self._overrides = overrides

    # Content

    @property
    def text(self) -> str:
        """The scene as a TOML document, with all keys that were set."""
        return self._data.source

    def as_dict(self) -> dict[str, Any]:
        """Returns the document as nested dicts and lists."""
        return tomllib.loads(self.text)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the document to a file. Mesh files are looked for in its folder from then on."""
        Path(path).write_text(self.text, encoding="utf-8")

    @property
    def title(self) -> str:
        return self._data.title

    @property
    def frames(self) -> int:
        """Number of the last frame; frame 0 is the initial state."""
        return self._data.frames

    @property
    def fps(self) -> float:
        """Frames per simulated second, 1/s."""
        return self._data.fps

    @property
    def bodies(self) -> list[Body]:
        """Bodies, with copies of prefabs and repetitions: rigid ones, then deformable ones."""
        return [Body(*one) for one in self._data.bodies]

    @property
    def joints(self) -> list[str]:
        """Names of the joints."""
        return self._data.joints

    @property
    def materials(self) -> dict[str, dict[str, Any]]:
        """Materials by name, with all keys."""
        given = self.as_dict().get("materials", {})
        keys = _keys_of("materials")
        return {name: {**{key: self._data.value(["materials", name, key]) for key in keys}, **given.get(name, {})}
                for name in self._data.materials}

    @property
    def camera(self) -> dict[str, Any]:
        """The camera, with all keys: position (m), target (m), up, vertical_fov (degrees), keyframes."""
        given = self.as_dict().get("camera", {})
        return {**{key: self._data.value(["camera", key]) for key in _keys_of("camera")}, **given}

    @property
    def effects(self) -> dict[str, tuple[bool, str]]:
        """Effects: for each whether the scene calls for it, and why."""
        return {name: (active, reason) for name, active, reason in self._data.plan([])}

    # Meshes

    def add_mesh(self, name: str, points: ArrayLike, triangles: ArrayLike) -> str:
        """Makes a mesh that the scene can name as a file, ``shape = { mesh = NAME }``, and returns `name`.

        points
            (n, 3), m.
        triangles
            (m, 3), rows of `points`, counter-clockwise seen from outside.
        """
        x = np.asarray(points, dtype=float)
        t = np.asarray(triangles)
        if x.ndim != 2 or x.shape[1] != 3 or not np.isfinite(x).all():
            raise ValueError(f"points have the shape {x.shape}: give (n, 3) finite numbers")
        if t.ndim != 2 or t.shape[1] != 3 or not np.issubdtype(t.dtype, np.integer):
            raise ValueError(f"triangles have the shape {t.shape} and type {t.dtype}: give (m, 3) integers")
        if t.size and (t.min() < 0 or t.max() >= len(x)):
            raise ValueError(f"triangles name points {t.min()} to {t.max()}, and there are {len(x)}")
        if Path(name).suffix != ".obj" or Path(name).name != name:
            raise ValueError(f"{name!r} is no name of a mesh: give a file name that ends with .obj")
        lines = [f"v {a!r} {b!r} {c!r}\n" for a, b, c in x.tolist()]
        lines += [f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in t.tolist()]
        self._keep_mesh(name, "".join(lines))
        return name

    def _keep_mesh(self, name: str, text: str) -> None:
        if self._folder is None:
            self._folder = tempfile.mkdtemp(prefix="duet-")
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        file = Path(self._folder, name)
        file.write_text(text)
        self._meshes[name] = os.fspath(file)

    # Work

    def simulate(
        self, frames: int | None = None, *, threads: int | None = None, without: Sequence[str] = ()
    ) -> Simulation:
        """Returns an iterator of frames 0 to `frames`.

        frames
            Number of the last frame; None: that of the scene.
        threads
            Number of threads for all simulations of the process from now on; 0: one per core; None: as before.
            The results do not depend on it.
        without
            Names of effects that are left out.

        Raises SceneError, FileError or Error if the simulation cannot begin.
        """
        return Simulation(self.copy(), frames, threads, without)

    def run(
        self,
        out: str | os.PathLike[str],
        *,
        frames: int | None = None,
        threads: int | None = None,
        draw: bool = False,
        overwrite: bool = False,
        resume: bool = False,
    ) -> Run:
        """Simulates into the run directory `out` by the program ``duet``, and returns the run.

        draw
            Draw pictures, and encode a video if ffmpeg is there.
        overwrite, resume
            Replace a run that is there, or go on with it.
        """
        with tempfile.TemporaryDirectory() as folder:
            file = self._file_for_program(Path(folder))
            options = ["--out", os.fspath(out)]
            options += [f"--frames={frames}"] if frames is not None else []
            options += [f"--threads={threads}"] if threads else []
            options += ["--overwrite"] * overwrite + ["--resume"] * resume
            program.call("run" if draw else "sim", file, *options)
        return Run(out)

    def _file_for_program(self, folder: Path) -> Path:
        # Mesh files of the scene are looked for in its folder: relative paths become absolute ones.
        data = self._read_with_meshes()
        text = data.source
        for name, path in data.files.items():
            for quoted in (f'"{name}"', f"'{name}'"):
                text = text.replace(quoted, toml.value_text(os.path.abspath(path)))
        file = folder / (Path(self._path).stem + ".toml")
        file.write_text(text, encoding="utf-8")
        return file

    def explain(self) -> str:
        """Returns effects, sizes and warnings, as the program's command ``explain`` tells them."""
        with tempfile.TemporaryDirectory() as folder:
            return program.text("explain", self._file_for_program(Path(folder)))

    def _draw(self, data: _core.FrameData, overrides: Mapping[str, Any]) -> NDArray[np.uint8]:
        require_picture_keys(overrides)
        # A renderer belongs to its thread, and to the bodies and keys that it was made for.
        texts = {key: toml.value_text(value) for key, value in overrides.items()}
        key = (tuple(texts.items()), tuple(data.names))
        if getattr(self._drawing, "key", None) != key:
            self._drawing.renderer = None
            self._drawing.renderer = _core.Renderer(self._read({**self._overrides, **texts}), data)
            self._drawing.key = key
        picture: NDArray[np.uint8] = self._drawing.renderer.draw(data)
        return picture


def _keys_of(section: str) -> list[str]:
    """Returns the names of the keys of a table, from the reference."""
    heading = "[materials.NAME]" if section == "materials" else f"[{section}]"
    keys: list[str] = []
    inside = False
    for line in _core.reference().splitlines():
        if line and not line.startswith(" "):
            inside = line.startswith(heading + ":")
        elif inside and line[:3].strip() and not line.startswith("  key "):
            name = line.split()[0]
            if "." not in name and not name.startswith(("(", "-")):
                keys.append(name)
    return keys


def require_picture_keys(overrides: Mapping[str, Any]) -> None:
    """Raises Error unless all keys belong to pictures alone."""
    for key in overrides:
        if key.split(".")[0] not in ("camera", "lights", "looks", "sky", "render"):
            raise Error(f"{key}: changes no picture (keys of camera, lights, looks, sky and render do)")

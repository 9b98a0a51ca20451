"""A scene in motion, and its frames."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core

if TYPE_CHECKING:
    from .scene import Scene

Doubles = NDArray[np.float64]
Floats = NDArray[np.float32]
Integers = NDArray[np.int32]

os.register_at_fork(after_in_child=_core.forget_threads)


class Contacts:
    """The contacts of one frame that have an impulse, by columns; ``len()`` is their number n.

    positions
        (n, 3), m.
    normals
        (n, 3), unit vectors from the second body of a row to the first.
    impulses
        (n, 3), N s: on the first body, in the last step of the frame. Divide by ``statistics["dt_max"]``
        for a force if all steps of the frame are equally long.
    bodies
        (n, 2), indices into :attr:`Frame.names`; -1: the ground.
    """

    def __init__(self, data: _core.FrameData) -> None:
        self._data = data

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def positions(self) -> Doubles:
        return self._data.contact_positions

    @property
    def normals(self) -> Doubles:
        return self._data.contact_normals

    @property
    def impulses(self) -> Doubles:
        return self._data.contact_impulses

    @property
    def bodies(self) -> Integers:
        return self._data.contact_bodies


class Frame:
    """One frame of a simulation. ``frame["ball"]`` is one body of it (:class:`duet.BodyFrame`).

    All arrays are read-only views without a copy. They keep their values when the simulation goes on, and stay
    valid as long as they are used. Lengths are in m, times in s, velocities in m/s and rad/s, in world axes
    (y up). In the shapes, N counts points of the drawn surfaces of all bodies, T their triangles, P particles of
    deformable bodies, E tetrahedra, and R rigid bodies without the ground, in the order of the scene.
    """

    def __init__(self, data: _core.FrameData, scene: Scene) -> None:
        self._data = data
        self._scene = scene

    def __repr__(self) -> str:
        return f"<duet.Frame {self.number} at {self.time:.4g} s>"

    def __getitem__(self, name: str) -> _core.BodyFrame:
        """Returns the body called `name`. Raises KeyError if there is none."""
        try:
            return self._data.body(self.names.index(name))
        except ValueError:
            raise KeyError(f"there is no body `{name}`; there are {', '.join(self.names) or 'none'}") from None

    def __iter__(self) -> Iterator[_core.BodyFrame]:
        """Iterates over the bodies, rigid ones first, in the order of the scene."""
        return (self._data.body(number) for number in range(len(self.names)))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def names(self) -> list[str]:
        """Names of the bodies: rigid ones, then deformable ones, in the order of the scene."""
        return self._data.names

    @property
    def number(self) -> int:
        """Number of the frame; 0 is the initial state."""
        return self._data.number

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._data.time

    @property
    def points(self) -> Doubles:
        """(N, 3), m: points of the drawn surfaces of all bodies."""
        return self._data.points

    @property
    def velocities(self) -> Doubles:
        """(N, 3), m/s: velocities of the points."""
        return self._data.velocities

    @property
    def strain(self) -> Floats:
        """(N,): largest \\|principal stretch - 1\\| around each point; -1 where an element is inverted, 0 for rigid
        bodies, shells and rods."""
        return self._data.strain

    @property
    def stress(self) -> Floats:
        """(N,), Pa: von Mises' equivalent of the elastic stress around each point; 0 for rigid bodies, shells and
        rods."""
        return self._data.stress

    @property
    def energy_density(self) -> Floats:
        """(N,), J/m^3: elastic energy over the volume at rest around each point; 0 where `stress` is 0."""
        return self._data.energy_density

    @property
    def contact_force(self) -> Floats:
        """(N, 3), N: force of contact at each point of deformable bodies, friction included, as the mean over the
        time since the frame before; 0 for rigid bodies, which have `contact_forces`."""
        return self._data.contact_force

    @property
    def contact_pressure(self) -> Floats:
        """(N,), Pa: normal force of contact over the area around each point, the mean over the frame."""
        return self._data.contact_pressure

    @property
    def triangles(self) -> Integers:
        """(T, 3): rows of `points`, counter-clockwise seen from outside."""
        return self._data.triangles

    @property
    def particles(self) -> Doubles:
        """(P, 3), m: particles of all deformable bodies."""
        return self._data.particles

    @property
    def particle_velocities(self) -> Doubles:
        """(P, 3), m/s."""
        return self._data.particle_velocities

    @property
    def tetrahedra(self) -> Integers:
        """(E, 4): rows of `particles`."""
        return self._data.tetrahedra

    @property
    def transforms(self) -> Doubles:
        """(R, 4, 4): poses of rigid bodies as matrices from body space (center of mass, principal axes) to the
        world."""
        return self._data.transforms

    @property
    def contact_forces(self) -> Doubles:
        """(R, 3), N: force of contact on each rigid body, friction included, the mean over the frame."""
        return self._data.contact_forces

    @property
    def contact_torques(self) -> Doubles:
        """(R, 3), N m: torque of contact about the center of mass of each rigid body, the mean over the frame."""
        return self._data.contact_torques

    @property
    def positions(self) -> Doubles:
        """(R, 3), m: centers of mass of rigid bodies."""
        return self._data.positions

    @property
    def orientations(self) -> Doubles:
        """(R, 4): unit quaternions w, x, y, z of rigid bodies."""
        return self._data.orientations

    @property
    def linear_velocities(self) -> Doubles:
        """(R, 3), m/s: velocities of the centers of mass of rigid bodies."""
        return self._data.linear_velocities

    @property
    def angular_velocities(self) -> Doubles:
        """(R, 3), rad/s: angular velocities of rigid bodies."""
        return self._data.angular_velocities

    @property
    def contacts(self) -> Contacts:
        """Contacts that have an impulse."""
        return Contacts(self._data)

    @property
    def energies(self) -> dict[str, float]:
        """``kinetic``, ``potential`` (of gravity, zero at the origin), ``elastic`` and ``total``, J."""
        return self._data.energies

    @property
    def statistics(self) -> dict[str, Any]:
        """Numbers of the frame with the names of ``stats.jsonl`` (tools/README.md, Formats)."""
        return self._data.statistics

    @property
    def hash(self) -> str:
        """Hash of the whole state, 16 hexadecimal digits, as in ``stats.jsonl``."""
        return f"{self._data.hash:016x}"

    def render(self, overrides: Mapping[str, Any] | None = None) -> NDArray[np.uint8]:
        """Draws the frame with the camera, lights and looks of its scene.

        `overrides` are keys of camera, lights, looks, sky and render, such as ``{"render.width": 640}``.
        Returns (height, width, 3), sRGB. Raises FileError if no off-screen OpenGL library is there.
        """
        return self._scene._draw(self._data, overrides or {})


class Simulation:
    """A scene in motion: an iterator of its frames, made by :meth:`duet.Scene.simulate`.

    The first frame is frame 0, the initial state. The other methods act between two frames, on the next one.
    While it steps, other Python threads run; Ctrl-C ends the step at hand, and iterating again repeats it. One
    thread at a time may use a simulation.
    """

    def __init__(self, scene: Scene, frames: int | None, threads: int | None, without: Sequence[str]) -> None:
        if threads is not None:
            _core.set_thread_count(threads)
        self._scene = scene
        data = scene._read_with_meshes()
        self._core = _core.Simulation(data, list(without))
        self._joints = list(data.joints)
        self.last = data.frames if frames is None else int(frames)
        if self.last < 0:
            raise ValueError(f"frames is {frames}: give 0 or more")
        self._frame: Frame | None = None

    def __iter__(self) -> Simulation:
        return self

    def __next__(self) -> Frame:
        if self._frame is not None:
            if self._frame.number >= self.last:
                raise StopIteration
            if self._core.number == self._frame.number:  # else an interrupt came when it had arrived
                self._core.advance()
        self._frame = Frame(self._core.frame(), self._scene)
        return self._frame

    def __repr__(self) -> str:
        return f"<duet.Simulation of {self._scene!r}, {'not begun' if self._frame is None else self._frame}>"

    @property
    def scene(self) -> Scene:
        """The scene, as it was when the simulation was made."""
        return self._scene

    @property
    def joints(self) -> list[str]:
        """Names of the joints that have not been released."""
        return list(self._joints)

    @property
    def frame(self) -> Frame:
        """The current frame."""
        return self._frame or Frame(self._core.frame(), self._scene)

    def set_target(
        self,
        name: str,
        value: ArrayLike | None = None,
        *,
        position: ArrayLike | None = None,
        orientation: ArrayLike | None = None,
    ) -> None:
        """Moves the target of the controlled joint `name` over the next frame to `value`, or the kinematic body
        `name` to `position` and `orientation`.

        value
            angle, rad, or travel, m, of a joint with one free motion; else (3,): rotation vector in the joint's
            frame, rad. The target goes there linearly, and stays.
        position
            (3,), m, of the center of mass; None: as it is.
        orientation
            (4,), unit quaternion w, x, y, z of the principal axes, as :attr:`Frame.orientations` has it;
            None: as it is. The body moves with constant velocities, and stops there unless it gets another target.

        Raises Error if there is no such joint or body, or it has no target.
        """
        if value is not None:
            if position is not None or orientation is not None:
                raise TypeError("give `value` for a joint, or `position` and `orientation` for a body")
            self._core.aim_joint(name, np.atleast_1d(np.asarray(value, dtype=float)))
            return
        if position is None and orientation is None:
            raise TypeError("give `value` for a joint, or `position` and `orientation` for a body")
        if position is None or orientation is None:
            now = self.frame[name]
            position = now.position if position is None else position
            orientation = now.orientation if orientation is None else orientation
        self._core.aim_body(name, np.asarray(position, dtype=float), np.asarray(orientation, dtype=float))

    def add_force(
        self, name: str, force: ArrayLike, *, moment: ArrayLike = (0.0, 0.0, 0.0), at: ArrayLike | None = None
    ) -> None:
        """Adds a force to the body `name` during the next frame, and only then. Forces add up.

        force
            (3,), N, world axes: on the center of mass of a rigid body; on a deformable body, distributed by mass.
        moment
            (3,), N m, world axes: on a rigid body.
        at
            (3,), m, world: the point of a rigid body where the force acts; of a deformable body, its free particle
            nearest to that point.

        Raises Error if there is no such body, or it is not dynamic.
        """
        point = None if at is None else np.asarray(at, dtype=float)
        self._core.add_force(name, np.asarray(force, dtype=float), np.asarray(moment, dtype=float), point)

    def release(self, name: str, *, density: float | None = None) -> None:
        """Lets go of `name` from the next frame on.

        A joint is removed; a deformable body loses its pins and attachments; a static or kinematic rigid body
        becomes dynamic with `density`, kg/m^3. Positions and velocities stay as they are. It takes as long as
        making a simulation. Raises Error if nothing holds `name`.
        """
        self._core.release(name, density)
        self._joints = [joint for joint in self._joints if joint != name]
        if self._frame is not None:
            self._frame = Frame(self._core.frame(), self._scene)

    def save_state(self) -> bytes:
        """Returns all that the next step reads. What the methods above have changed is not part of it."""
        return self._core.save_state()

    def load_state(self, state: bytes) -> Frame:
        """Goes to the frame of a state of the same scene, and returns it; iterating goes on from there to the
        same bits. Raises Error if the state does not fit."""
        self._core.load_state(state)
        self._frame = Frame(self._core.frame(), self._scene)
        return self._frame

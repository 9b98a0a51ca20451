"""Duet: two-way coupled rigid and deformable bodies.

>>> import duet
>>> scene = duet.Scene("stack")
>>> for frame in scene.simulate(frames=24):
...     print(frame.time, frame.energies["kinetic"])

Lengths are in meters, times in seconds, masses in kilograms, angles in radians (in scenes: degrees); y is up.
"""

from ._core import BodyFrame, set_thread_count, thread_count
from .errors import Error, FileError, Problem, SceneError, SimulationError
from .program import path as program_path
from .run import Run, compare, study
from .scene import Body, Scene
from .simulation import Contacts, Frame, Simulation

__all__ = [
    "Body",
    "BodyFrame",
    "Contacts",
    "Error",
    "FileError",
    "Frame",
    "Problem",
    "Run",
    "Scene",
    "SceneError",
    "Simulation",
    "SimulationError",
    "compare",
    "program_path",
    "set_thread_count",
    "study",
    "thread_count",
]

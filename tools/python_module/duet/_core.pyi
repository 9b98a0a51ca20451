"""Types of the extension module, which tools/python_module/*.cpp make."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

numerics_version: int

class SceneData:
    source: str
    notes: list[str]
    files: dict[str, str]
    title: str
    path: str
    frames: int
    fps: float
    bodies: list[tuple[str, str, str, str]]
    joints: list[str]
    materials: list[str]
    lights: list[str]
    def plan(self, without: Sequence[str]) -> list[tuple[str, bool, str]]: ...
    def value(self, path: Sequence[str]) -> Any: ...

def read_text(
    text: str, path: str, overrides: Sequence[str], meshes: bool, files: Mapping[str, str]
) -> SceneData: ...
def reference() -> str: ...

class BodyFrame:
    """One body at one frame. All arrays are read-only views without a copy, in world axes."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str:
        """``"rigid"``, ``"kinematic"``, ``"static"`` or ``"deformable"``."""
    @property
    def points(self) -> NDArray[np.float64]:
        """(n, 3), m: points of the drawn surface."""
    @property
    def velocities(self) -> NDArray[np.float64]:
        """(n, 3), m/s: velocities of the points."""
    @property
    def strain(self) -> NDArray[np.float32]:
        """(n,): largest |principal stretch - 1| around each point; -1 where an element is inverted."""
    @property
    def stress(self) -> NDArray[np.float32]:
        """(n,), Pa: von Mises' equivalent of the elastic stress around each point."""
    @property
    def energy_density(self) -> NDArray[np.float32]:
        """(n,), J/m^3: elastic energy over the volume at rest around each point."""
    @property
    def contact_force(self) -> NDArray[np.float32]:
        """(n, 3), N: force of contact at each point of a deformable body, mean over the frame."""
    @property
    def contact_pressure(self) -> NDArray[np.float32]:
        """(n,), Pa: normal force of contact over area at each point, mean over the frame."""
    @property
    def triangles(self) -> NDArray[np.int32]:
        """(m, 3): rows of `points`."""
    @property
    def particles(self) -> NDArray[np.float64]:
        """(p, 3), m: particles; none of a rigid body."""
    @property
    def particle_velocities(self) -> NDArray[np.float64]:
        """(p, 3), m/s."""
    @property
    def tetrahedra(self) -> NDArray[np.int32]:
        """(t, 4): rows of `particles`."""
    @property
    def transform(self) -> NDArray[np.float64]:
        """(4, 4): from body space to the world. The poses and twists raise AttributeError for deformable bodies."""
    @property
    def position(self) -> NDArray[np.float64]:
        """(3,), m: center of mass."""
    @property
    def orientation(self) -> NDArray[np.float64]:
        """(4,): unit quaternion w, x, y, z."""
    @property
    def velocity(self) -> NDArray[np.float64]:
        """(3,), m/s: of the center of mass."""
    @property
    def angular_velocity(self) -> NDArray[np.float64]:
        """(3,), rad/s."""
    @property
    def net_contact_force(self) -> NDArray[np.float64]:
        """(3,), N: force of contact, mean over the frame."""
    @property
    def net_contact_torque(self) -> NDArray[np.float64]:
        """(3,), N m: torque of contact about the center of mass, mean over the frame."""

class FrameData:
    @property
    def number(self) -> int: ...
    @property
    def time(self) -> float: ...
    @property
    def hash(self) -> int: ...
    @property
    def energies(self) -> dict[str, float]: ...
    @property
    def statistics(self) -> dict[str, Any]: ...
    @property
    def names(self) -> list[str]: ...
    def body(self, number: int) -> BodyFrame: ...
    @property
    def points(self) -> NDArray[np.float64]: ...
    @property
    def velocities(self) -> NDArray[np.float64]: ...
    @property
    def strain(self) -> NDArray[np.float32]: ...
    @property
    def stress(self) -> NDArray[np.float32]: ...
    @property
    def energy_density(self) -> NDArray[np.float32]: ...
    @property
    def contact_force(self) -> NDArray[np.float32]: ...
    @property
    def contact_pressure(self) -> NDArray[np.float32]: ...
    @property
    def contact_forces(self) -> NDArray[np.float64]: ...
    @property
    def contact_torques(self) -> NDArray[np.float64]: ...
    @property
    def triangles(self) -> NDArray[np.int32]: ...
    @property
    def tetrahedra(self) -> NDArray[np.int32]: ...
    @property
    def particles(self) -> NDArray[np.float64]: ...
    @property
    def particle_velocities(self) -> NDArray[np.float64]: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def orientations(self) -> NDArray[np.float64]: ...
    @property
    def linear_velocities(self) -> NDArray[np.float64]: ...
    @property
    def angular_velocities(self) -> NDArray[np.float64]: ...
    @property
    def transforms(self) -> NDArray[np.float64]: ...
    @property
    def contact_positions(self) -> NDArray[np.float64]: ...
    @property
    def contact_normals(self) -> NDArray[np.float64]: ...
    @property
    def contact_impulses(self) -> NDArray[np.float64]: ...
    @property
    def contact_bodies(self) -> NDArray[np.int32]: ...

class Simulation:
    def __init__(self, scene: SceneData, without: Sequence[str]) -> None: ...
    @property
    def number(self) -> int: ...
    def advance(self) -> None: ...
    def frame(self) -> FrameData: ...
    def aim_joint(self, name: str, value: NDArray[np.float64]) -> None: ...
    def aim_body(self, name: str, position: NDArray[np.float64], orientation: NDArray[np.float64]) -> None: ...
    def add_force(
        self, name: str, force: NDArray[np.float64], moment: NDArray[np.float64], at: NDArray[np.float64] | None
    ) -> None: ...
    def release(self, name: str, density: float | None) -> None: ...
    def save_state(self) -> bytes: ...
    def load_state(self, state: bytes) -> None: ...

class Renderer:
    def __init__(self, scene: SceneData, frame: FrameData) -> None: ...
    def draw(self, frame: FrameData) -> NDArray[np.uint8]: ...

class RunRenderer:
    def __init__(self, root: str, overrides: Sequence[str]) -> None: ...
    def draw(self, frame: int) -> NDArray[np.uint8]: ...

def difference(a: NDArray[np.uint8], b: NDArray[np.uint8], tolerance: int) -> dict[str, Any]: ...
def thread_count() -> int:
    """Returns the number of threads that all simulations of the process use."""

def set_thread_count(count: int) -> None:
    """Sets the number of threads that all simulations of the process use; 0: one per core.

    Raises RuntimeError while a simulation steps in another thread. Results do not depend on it.
    """

def forget_threads() -> None: ...

"""What the robots of a unit see: one launch of the depth camera for all that live; and the same with the errors of real
cameras: late, mounted a little off, noisy, with holes."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from vinl.robot.aliengo import CONTROL_DT
from vinl.robot.cameras import Camera
from vinl.robot.rotation import matrix_of
from vinl.sensing.depth import DepthCamera, Mesh, PreparedRender
from vinl.sensing.sensor import DepthSensor, mount_errors
from vinl.sensing.sensor_config import SensorConfig
from vinl.world.boxes import Blocks
from vinl.world.floorplan import FloorPlan
from vinl.world.mesh import floor_mesh, join_meshes, seen_box_mesh

_OVER_CAMERA = 1.2
"""The cameras of a robot of 0.5 m stay below this [m]."""


class DepthCameras:
    """A depth camera on each of n robots, on the CPU. The robots do not see each other, nor themselves.

    Args:
        meshes: the worlds, vertices (v, 3) [m] and faces (f, 3).
        worlds: (n,) the world that each robot is in.
        floor: height of a level floor that the meshes leave out [m]; None: they have it.

    Attributes:
        age: (n,) of the images [s]: none.
    """

    def __init__(
        self, meshes: Sequence[Mesh], worlds: Sequence[int], camera: Camera, floor: float | None = None
    ) -> None:
        self.camera = camera
        self._depth = DepthCamera(meshes, camera, floor=floor)
        self._mount, self._turn = np.array(camera.position), camera.rotation()
        self._worlds, self.age = np.asarray(worlds, dtype=np.int32), np.zeros(len(worlds))
        self._renders: dict[int, PreparedRender] = {}
        self._images = torch.full((len(worlds), camera.height, camera.width), camera.far)

    def look(
        self, qpos: Float[np.ndarray, "n 19"], rows: Sequence[int] | None = None
    ) -> Float[torch.Tensor, "n height width"]:
        """Depth [m] along the optical axis, the far limit where nothing is hit.

        Args:
            qpos: (n, 19) generalised position of every robot; only the trunk's pose is read.
            rows: the robots that look; the others keep their last image. All of them by default.

        Returns:
            (n, height, width), overwritten by the next call.
        """
        chosen = list(range(len(self._worlds)) if rows is None else rows)
        if chosen:
            self._images[torch.as_tensor(chosen)] = self.render(chosen, *self.place(qpos[chosen]))
        return self._images

    def render(
        self, chosen: Sequence[int], position: Float[np.ndarray, "k 3"], rotation: Float[np.ndarray, "k 3 3"]
    ) -> Float[torch.Tensor, "k height width"]:
        """Depth [m] that the cameras of the chosen robots see from given poses; overwritten by the next call."""
        n = len(chosen)
        if n not in self._renders:
            self._renders[n] = PreparedRender(self._depth, n)
        return self._renders[n](self._worlds[list(chosen)], position, rotation)

    def place(self, qpos: Float[np.ndarray, "n 19"]) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3 3"]]:
        """Position and orientation of the cameras. Written out, not as matrix products: a library's product may round
        otherwise for another number of robots, and an image must depend on its own robot alone."""
        trunk = matrix_of(np, qpos[:, 3:7])
        columns = [trunk[:, :, k] for k in range(3)]
        at = qpos[:, :3] + sum(column * self._mount[k] for k, column in enumerate(columns))
        turned = sum(column[:, :, None] * self._turn[k] for k, column in enumerate(columns))
        return at, np.asarray(turned)


def open_depth_cameras(
    plan: FloorPlan, blocks: Sequence[Blocks], camera: Camera, ceiling: float | None = None
) -> DepthCameras:
    """The cameras of robots in their homes: walls, furniture, floor and the clutter of each episode.

    Args:
        blocks: the clutter, one for each robot. Robots without any share one mesh.
        ceiling: height of a ceiling [m]; none by default.
    """
    first_bare = next((k for k, some in enumerate(blocks) if not len(some)), 0)
    owners = [k if len(some) else first_bare for k, some in enumerate(blocks)]
    kept = list(dict.fromkeys(owners))
    meshes = [seen_mesh(plan, blocks[k], ceiling) for k in kept]
    return DepthCameras(meshes, [kept.index(k) for k in owners], camera, floor=0.0)


def seen_mesh(plan: FloorPlan, blocks: Blocks, ceiling: float | None = None) -> Mesh:
    """What a camera on the robot can see of a home, without its floor.

    Left out: bottoms that lie on the floor, and tops that are higher than any camera gets. Fewer triangles make quicker
    rays.
    """
    home = seen_box_mesh(plan.boxes + blocks.boxes(), _OVER_CAMERA)
    return home if ceiling is None else join_meshes(home, floor_mesh(plan.frame, ceiling, up=False))


_BETWEEN_IMAGES = 7919
"""Keys of a robot's images lie so far apart; any number does, they are hashed."""


class CameraErrors:
    """What all cameras of n robots share: the poses of the last moments, and the keys of their random numbers.

    Args:
        keys: (n,) of the episodes; the same key gives the same errors whichever others are run with it.
    """

    def __init__(self, config: SensorConfig, keys: Sequence[int]) -> None:
        self._config, self._keys = config, np.asarray(keys, np.int64)
        self._poses: deque[np.ndarray] = deque(maxlen=round(config.delay[1] / CONTROL_DT) + 1)

    def note(self, qpos: Float[np.ndarray, "n 19"]) -> None:
        """Where the robots are; once in every control step."""
        self._poses.append(qpos.copy())

    def restart(self, qpos: Float[np.ndarray, "n 19"]) -> None:
        """The robots begin anew, where they are: older poses are forgotten."""
        self._poses.clear()
        self.note(qpos)

    def before(self, steps: np.ndarray) -> Float[np.ndarray, "n 19"]:
        """Where each robot was so many control steps ago, or at the start."""
        latest = len(self._poses) - 1
        return np.stack([self._poses[max(latest - ago, 0)][k] for k, ago in enumerate(steps)])

    def put_on(self, cameras: DepthCameras) -> RealCameras:
        """The cameras of these robots with their errors; each camera of a robot has its own."""
        return RealCameras(cameras, self._config, self._keys + zlib.crc32(cameras.camera.name.encode()), self)


class RealCameras:
    """What ``DepthCameras`` see, as real cameras give it.

    Args:
        keys: (n,) that the random numbers follow from.
        errors: notes where the robots were.

    Attributes:
        age: (n,) of the images when they come [s]. An image's time stamp tells it, so that it is no secret.
    """

    def __init__(self, cameras: DepthCameras, config: SensorConfig, keys: np.ndarray, errors: CameraErrors) -> None:
        n, self.camera = len(keys), cameras.camera
        self._cameras, self._keys, self._errors = cameras, keys, errors
        self._sensor = DepthSensor(config, self.camera, n)
        self._sensor.restart(_as_keys(keys), torch.ones(n, dtype=torch.bool))
        self._delay = np.round(self._sensor.drawn["delay"].numpy() / CONTROL_DT).astype(int)
        self.age = self._delay * CONTROL_DT
        roll, pitch, height = self._sensor.drawn["offset"].numpy().astype(np.float64).T
        self._raised, self._turned = height, mount_errors(np, roll, pitch)
        self._images = torch.full((n, self.camera.height, self.camera.width), self.camera.far)
        self._taken = 0

    def look(
        self, qpos: Float[np.ndarray, "n 19"], rows: Sequence[int] | None = None
    ) -> Float[torch.Tensor, "n height width"]:
        """Depth [m] as the cameras give it, 0 or the far limit without a return, see ``DepthSensor.spoil``.

        Args:
            qpos: (n, 19) of every robot now; images are of where they were when the cameras took them.
            rows: the robots that look; the others keep their last image. All of them by default.

        Returns:
            (n, height, width), overwritten by the next call.
        """
        chosen = list(range(len(qpos)) if rows is None else rows)
        self._taken += 1
        if not chosen:
            return self._images
        at, turned = self._cameras.place(self._errors.before(self._delay)[chosen])
        at[:, 2] += self._raised[chosen]
        # written out, as in DepthCameras.place: an image must depend on its own robot alone
        off = self._turned[chosen]
        turned = sum(turned[:, :, k, None] * off[:, None, k] for k in range(3))
        ideal = self._cameras.render(chosen, at, np.asarray(turned))
        self._images[torch.as_tensor(chosen)] = self._sensor.spoil(
            ideal,
            torch.as_tensor(chosen, dtype=torch.int32),
            _as_keys(self._keys[chosen] + _BETWEEN_IMAGES * self._taken),
            torch.as_tensor(at, dtype=torch.float32),
            torch.as_tensor(np.asarray(turned), dtype=torch.float32),
        )
        return self._images


def _as_keys(numbers: np.ndarray) -> torch.Tensor:
    return torch.from_numpy((numbers % 2**31).astype(np.int32))

"""The depth cameras of a unit's robots with the errors of real ones: late, mounted a little off, noisy, with holes."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float

from vinl.chain.depth_cameras import DepthCameras
from vinl.robot.aliengo import CONTROL_DT
from vinl.sensing.sensor import DepthSensor, mount_errors
from vinl.sensing.sensor_config import SensorConfig

_BETWEEN_IMAGES = 7919
"""Keys of a robot's images lie so far apart; any number does, they are hashed."""


class CameraErrors:
    """What all cameras of n robots share: the poses of the last moments, and the keys of their random numbers.

    Args:
        config: errors of each camera.
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
        cameras: the ideal cameras.
        config: their errors.
        keys: (n,) that the random numbers follow from.
        errors: notes where the robots were.

    Attributes:
        camera: the record of the ideal camera.
    """

    def __init__(self, cameras: DepthCameras, config: SensorConfig, keys: np.ndarray, errors: CameraErrors) -> None:
        n, self.camera = len(keys), cameras.camera
        self._cameras, self._keys, self._errors = cameras, keys, errors
        self._sensor = DepthSensor(config, self.camera, n)
        self._sensor.restart(_as_keys(keys), torch.ones(n, dtype=torch.bool))
        self._delay = np.round(self._sensor.drawn["delay"].numpy() / CONTROL_DT).astype(int)
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

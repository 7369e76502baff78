"""A depth camera with the errors of a real one, in the place of an ideal one: the same kernels on CPU and GPU."""

from __future__ import annotations

from typing import Any

import torch
import warp as wp
from jaxtyping import Bool, Float, Int
from torch import Tensor

from vinl.robot.cameras import Camera
from vinl.sensing.sensor_config import SensorConfig
from vinl.sensing.sensor_kernels import PATCHES, Cameras, SensorRules, draw_cameras, draw_patches, spoil_depth
from vinl.sensing.torch_warp import allocate_struct, fill_struct, launch


def mount_errors(xp: Any, roll: Any, pitch: Any) -> Any:
    """How cameras are turned that are mounted a little off, (n, 3, 3), for numpy and torch (``xp``): by pitch [rad]
    about the camera's own left (nose down is positive), then by roll [rad] about its optical axis (right side down)."""
    cp, sp, cr, sr, zero, one = xp.cos(pitch), xp.sin(pitch), xp.cos(roll), xp.sin(roll), 0 * roll, 0 * roll + 1
    down = xp.stack([cp, zero, sp, zero, one, zero, -sp, zero, cp], -1).reshape(-1, 3, 3)
    side = xp.stack([one, zero, zero, zero, cr, -sr, zero, sr, cr], -1).reshape(-1, 3, 3)
    return down @ side


class DepthSensor:
    """The depth cameras of n robots: what is drawn for each of them, and what becomes of their images. ``drawn`` is
    what an episode keeps, tensors (n, ...) by the names of ``sensor_kernels.Cameras``; ``cameras`` is the same memory
    as kernels read it."""

    def __init__(self, config: SensorConfig, camera: Camera, n: int, device: torch.device | str = "cpu") -> None:
        self.config, self._camera, self._device = config, camera, torch.device(device)
        self.cameras, self.drawn = allocate_struct(Cameras, n, device)
        self.drawn["scale"].fill_(1.0)
        self._rules = fill_struct(SensorRules, vars(config))
        self._lost = camera.far if camera.missing == "as_is" else 0.0

    def restart(self, key: Int[Tensor, " n"], chosen: Bool[Tensor, " n"]) -> None:
        """Draw the chosen cameras anew, each from its key alone."""
        if not self.config.is_ideal:
            inputs = [self._rules, wp.from_torch(key), wp.from_torch(chosen), self.cameras]
            launch(draw_cameras, len(key), inputs, self._device)

    def spoil(
        self,
        images: Float[Tensor, "k height width"],
        rows: Int[Tensor, " k"],
        key: Int[Tensor, " k"],
        position: Float[Tensor, "k 3"],
        rotation: Float[Tensor, "k 3 3"],
        unit: float = 1.0,
    ) -> Float[Tensor, "k height width"]:
        """Depth images, float16 or float32, as the cameras of ``rows`` give them, in new tensors; the very same tensor
        from an ideal camera. A pixel without a return reads 0, or the far limit where the camera's record leaves images
        as they are (``Camera.missing``).

        The random numbers of each image follow from its ``key``; both are int32. Optical centres are in the world [m],
        rotations camera to world; ``unit`` metres are 1 in an image.
        """
        if not self.config.spoils or not len(images):
            return images
        spoilt, shape = torch.empty_like(images), (len(images), int(PATCHES))
        patches = wp.from_torch(torch.empty(*shape, 3, device=self._device), dtype=wp.vec3)
        if self.config.patches > 0:
            aspect = self._camera.height / self._camera.width
            drawn = [self._rules, self.cameras, wp.from_torch(rows), wp.from_torch(key), aspect, patches]
            launch(draw_patches, shape, drawn, self._device)
        inputs = [
            self._rules,
            self.cameras,
            wp.from_torch(rows),
            wp.from_torch(key),
            wp.from_torch(position.contiguous(), dtype=wp.vec3),
            wp.from_torch(rotation.contiguous(), dtype=wp.mat33),
            wp.vec2(*self._camera.tan_half),
            self._camera.far,
            unit,
            self._lost / unit,
            patches,
            wp.from_torch(images.contiguous()),
            wp.from_torch(spoilt),
        ]
        launch(spoil_depth, images.shape, inputs, self._device)
        return spoilt

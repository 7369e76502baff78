"""A launch of the depth camera that is made ready once and repeated: on the CPU, for the few images of some robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
import warp as wp
from jaxtyping import Float

from vinl.sensing.depth import DepthCamera


class PreparedRender:
    """``DepthCamera.render_poses`` of always n images, into the same place.

    For one image of 64 x 36 pixels, wrapping arrays and checking arguments takes as long as the rays themselves.

    Args:
        depth: what is looked through; it must be on the CPU, with float32 depth.
        n: images.
    """

    def __init__(self, depth: DepthCamera, n: int) -> None:
        if depth.device.type != "cpu" or depth.dtype != torch.float32:
            raise ValueError(f"renders float32 on the CPU are prepared, not {depth.dtype} on {depth.device}")
        self._depth = depth  # its meshes must live as long as the launch
        camera = depth.camera
        self._world, self._position = np.zeros(n, np.int32), np.zeros((n, 3), np.float32)
        self._rotation = np.zeros((n, 3, 3), np.float32)
        self._tan_half = np.tile(np.array(camera.tan_half, np.float32), (n, 1))
        self._images = np.zeros((n, camera.height, camera.width), np.float32)
        self._answer = torch.from_numpy(self._images)
        self._launch: Any = depth.launch(
            _share(self._world, wp.int32),
            _share(self._position, wp.vec3),
            _share(self._rotation, wp.mat33),
            _share(self._tan_half, wp.vec2),
            _share(self._images, wp.float32),
            record_cmd=True,
        )

    def __call__(
        self,
        world: Sequence[int] | np.ndarray,
        position: Float[np.ndarray, "n 3"],
        rotation: Float[np.ndarray, "n 3 3"],
    ) -> Float[torch.Tensor, "n height width"]:
        """What cameras see from given poses.

        Args:
            world: (n,) numbers of meshes; whether there are so many is not checked.
            position: (n, 3) of the optical centre in the world [m].
            rotation: (n, 3, 3) camera to world: columns are forward, left and up.

        Returns:
            Depth [m], overwritten by the next call.
        """
        self._world[:], self._position[:], self._rotation[:] = world, position, rotation
        self._launch.launch()
        return self._answer


def _share(values: np.ndarray, kind: type) -> wp.array:
    return wp.array(values, dtype=kind, device="cpu", copy=False)

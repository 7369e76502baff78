"""From the image of a robot's depth camera to the image that a policy takes: numpy alone."""

import numpy as np


class DepthPreparation:
    """Samples a robot's depth image as the policy's camera would see it.

    Both cameras have to look from the same place in the same direction. What the robot's camera does not cover, and
    what it could not measure (0 or NaN), becomes a pixel without a return, as `image_preparation` says.

    Args:
        camera: `camera` of the policy's metadata.
        fx, fy, cx, cy: focal lengths and middle of the robot's camera [pixels], as in a ROS CameraInfo's K.
        width, height: of its image [pixels].
    """

    def __init__(self, camera, fx, fy, cx, cy, width, height):
        shape, self.missing = (
            (camera["height"], camera["width"]),
            camera["far"] if camera["missing"] == "as_is" else 0.0,
        )
        half = np.tan([camera["vfov"] / 2, camera["hfov"] / 2])
        up, left = (h * (1 - (2 * np.arange(n) + 1) / n) for h, n in zip(half, shape, strict=True))
        row, column = np.rint(cy - fy * up).astype(int), np.rint(cx - fx * left).astype(int)
        covered = ((row >= 0) & (row < height))[:, None] & ((column >= 0) & (column < width))
        self.covered, self.row, self.column = covered, row.clip(0, height - 1), column.clip(0, width - 1)

    def __call__(self, image, unit=1.0):
        """Depth [m] as the policy's `depth`, from an image (height, width) in a unit [m]: 0.001 for millimetres."""
        depth = image[self.row[:, None], self.column] * float(unit)
        measured = self.covered & np.isfinite(depth) & (depth > 0)
        return np.where(measured, depth, self.missing)

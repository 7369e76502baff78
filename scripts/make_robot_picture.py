"""Draw ``docs/images/aliengo.png``: the robot in its default pose beside a block."""

from __future__ import annotations

import math
from pathlib import Path

import imageio.v3 as iio
import numpy as np

from vinl.robot.aliengo import home_qpos
from vinl.sensing.raytrace import RayRenderer, look_at
from vinl.sensing.robot_shape import RobotShape
from vinl.sensing.scene import BLOCK, plain_scene
from vinl.world.boxes import Boxes
from vinl.world.grid import GridFrame


def main() -> None:
    """Render and write the picture."""
    block = Boxes(np.array([[0.30, 0.62, 0.6, 0.42, 0.2, 0.0, 0.16]]))
    scene = plain_scene(block, [BLOCK], GridFrame(-20.0, -20.0, 1.0, (41, 41)), floor=(0.86, 0.85, 0.83), checker=0.5)
    shape = RobotShape()
    positions, rotations = shape.place(home_qpos(z=0.3765, yaw=0.0))
    renderer = RayRenderer(scene, shape.bodies, shape.names)
    view = look_at((1.22, -1.12, 0.64), (0.04, 0.02, 0.2))
    picture = renderer.render(view, 1200, 800, positions, rotations, hfov=math.radians(40), shadows=2, samples=3)
    path = Path(__file__).resolve().parent.parent / "docs" / "images" / "aliengo.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    iio.imwrite(path, picture)
    print(path)


if __name__ == "__main__":
    main()

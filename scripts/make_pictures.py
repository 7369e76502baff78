"""Draw the pictures of ``docs/robot.md``: the robot, and what its cameras see in a home.

Run ``python scripts/make_pictures.py``; the same seed gives the same pictures.
"""

from __future__ import annotations

import math
from pathlib import Path

import imageio.v3 as iio
import matplotlib as mpl
import numpy as np

from vinl.render.raytrace import ChaseCamera, RayRenderer, look_at
from vinl.render.scene import BLOCK, RobotShape, plain_scene, plan_scene
from vinl.robot.aliengo import home_qpos
from vinl.robot.cameras import LOCOMOTION_CAMERA, NAVIGATION_CAMERA
from vinl.sensing.depth import DepthCamera
from vinl.world.boxes import Boxes
from vinl.world.clutter import CLUTTER, scatter_blocks
from vinl.world.grid import GridFrame
from vinl.world.mesh import floorplan_mesh
from vinl.world.readers import load_floorplan

IMAGES = Path(__file__).resolve().parent.parent / "docs" / "images"
FEET_DOWN = 0.3765
"""Height of the trunk at which the default pose touches the floor [m]."""


def draw_robot() -> np.ndarray:
    """The robot in its default pose beside a block."""
    block = Boxes(np.array([[0.02, 0.72, 0.6, 0.42, 0.2, 0.0, 0.16]]))
    ground = GridFrame(-20.0, -20.0, 1.0, (41, 41))
    shape = RobotShape()
    renderer = RayRenderer(plain_scene(block, [BLOCK], ground, floor=(0.86, 0.85, 0.83)), shape.bodies, shape.names)
    view = look_at((1.22, -1.12, 0.64), (0.06, 0.02, 0.2))
    placed = shape.place(home_qpos(z=FEET_DOWN))
    return renderer.render(view, 1200, 800, *placed, hfov=math.radians(43), shadows=2, samples=3)


def draw_senses(x: float, y: float, yaw: float) -> np.ndarray:
    """The robot in a cluttered home, and below the picture what its two cameras see."""
    plan = load_floorplan("harbour_flat")
    behind = np.array([[x - 0.9 * math.cos(yaw), y - 0.9 * math.sin(yaw)]])  # where no block may lie, 1.5 m around
    blocks = scatter_blocks(plan, CLUTTER["paper"], np.random.default_rng(4), behind)
    shape = RobotShape()
    renderer = RayRenderer(plan_scene(plan, blocks), shape.bodies, shape.names)
    positions, rotations = shape.place(home_qpos(x, y, FEET_DOWN, yaw))
    view = ChaseCamera(renderer, distance=3.2).follow(positions[0], yaw)
    picture = renderer.render(view, 1200, 640, positions, rotations, hfov=math.radians(65), shadows=2, samples=3)
    mesh = floorplan_mesh(plan, blocks, ceiling=2.5)
    seen = []
    for camera, scale in ((LOCOMOTION_CAMERA, 6), (NAVIGATION_CAMERA, 5)):
        depth = DepthCamera([mesh], camera).render([0], positions[:1], rotations[:1])[0].numpy()
        coloured = mpl.colormaps["viridis_r"](camera.normalise(depth), bytes=True)[..., :3]
        image = np.kron(coloured, np.ones((scale, scale, 1), np.uint8))
        tile = np.full((352, 600, 3), 255, np.uint8)
        top, left = (352 - image.shape[0]) // 2, (600 - image.shape[1]) // 2
        tile[top : top + image.shape[0], left : left + image.shape[1]] = image
        seen.append(tile)
    return np.concatenate([picture, np.concatenate(seen, 1)])


def main() -> None:
    """Render and write the pictures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name, picture in (("aliengo", draw_robot()), ("senses", draw_senses(3.2, 1.6, 1.45))):
        iio.imwrite(IMAGES / f"{name}.png", picture)
        print(IMAGES / f"{name}.png")


if __name__ == "__main__":
    main()

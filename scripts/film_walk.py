"""Film the robot from close by while it crosses clutter: the moving picture of the README.

    python scripts/film_walk.py docs/images/walk.gif --plan harbour_flat --episode 7 --seed 0 --start 4 --stop 9

takes the episode that ``vinl.walk`` walks under these numbers and writes the part between start and stop [s] as a GIF.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import vinl
from vinl.render.panels import colour_depth
from vinl.render.raytrace import ChaseCamera, RayRenderer
from vinl.render.scene import RobotShape, plan_scene
from vinl.render.video import POSE_DT
from vinl.robot.rotation import yaw_of

SIZE, INSET = (600, 360), (144, 84)
"""Width and height of the picture and of what the locomotion camera sees [pixels]."""

EVERY = 2
"""Every second pose: 12.5 pictures a second."""


def draw_frames(walk: vinl.Walk, start: float, stop: float) -> list[Image.Image]:
    """The robot from behind; below left, what its locomotion camera sees."""
    shape, goal = RobotShape(), walk.route.goal
    scene = plan_scene(walk.plan, walk.blocks, (float(goal[0]), float(goal[1])))
    renderer = RayRenderer(scene, shape.bodies, shape.names)
    chase = ChaseCamera(renderer, distance=1.9, elevation=math.radians(27))
    font, frames = ImageFont.load_default(11), []
    for k in range(round(start / POSE_DT), min(round(stop / POSE_DT), len(walk.trace.poses)), EVERY):
        pose = walk.trace.poses[k]
        view = chase.follow(pose[:3], float(yaw_of(np, pose[None, 3:7])[0]))
        picture = Image.fromarray(renderer.render(view, *SIZE, *shape.place(pose), samples=2))
        seen = colour_depth(walk.see(k * POSE_DT), vinl.LOCOMOTION_CAMERA.far)
        corner = (8, SIZE[1] - INSET[1] - 8)
        picture.paste(Image.fromarray(seen).resize(INSET, Image.Resampling.NEAREST), corner)
        pen = ImageDraw.Draw(picture)
        pen.rectangle([corner[0] - 1, corner[1] - 1, corner[0] + INSET[0], corner[1] + INSET[1]], outline="white")
        pen.text((corner[0] + 4, corner[1] + 2), "locomotion camera", fill="white", font=font)
        frames.append(picture)
    return frames


def save_gif(frames: list[Image.Image], out: Path, colours: int) -> None:
    """All frames with one palette, so that what does not move costs nothing."""
    sheet = Image.fromarray(np.concatenate([np.asarray(frame) for frame in frames[:: max(len(frames) // 6, 1)]]))
    palette = sheet.quantize(colours)
    small = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    out.parent.mkdir(parents=True, exist_ok=True)
    small[0].save(out, save_all=True, append_images=small[1:], duration=1000 * EVERY * POSE_DT, loop=0, optimize=True)


def main() -> None:
    """Walk, draw and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--plan", default="harbour_flat")
    parser.add_argument("--loco", default="loco")
    parser.add_argument("--nav", default="oracle")
    parser.add_argument("--obstacles", default="paper")
    parser.add_argument("--episode", type=int, default=7)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=float, default=4.0, help="[s]")
    parser.add_argument("--stop", type=float, default=9.0, help="[s]")
    parser.add_argument("--colours", type=int, default=96)
    options = parser.parse_args()
    walk = vinl.walk(options.plan, options.loco, options.nav, options.obstacles, options.episode, options.seed)
    frames = draw_frames(walk, options.start, options.stop)
    save_gif(frames, options.out, options.colours)
    record = walk.record
    print(f"{record.end_reason}: {record.distance_m:.1f} m in {record.time_s:.1f} s, {record.foot_steps} foot steps")
    print(f"{options.out}: {len(frames)} pictures, {options.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()

"""What films are made of: panels (map, false-coloured depth, captions), how they stand together, and the file, which is
written whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont, ImageOps

from vinl.chain.records import EpisodeRecord
from vinl.robot.aliengo import LENGTH, WIDTH
from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import BODY_HEIGHT, FloorPlan

SIZE = (1280, 720)
"""Width and height of a film [pixels]."""

_ROOM = 2**20
"""Where less is free, the disk is full for a film [bytes]."""

_SIDE, _EYE, _BAR = 480, (236, 142), 80
_INK, _PAPER, _MUTED = (230, 232, 235), (24, 26, 30), (150, 155, 163)
_FLOOR, _WALL, _FURNITURE, _BLOCK = (52, 56, 64), (205, 208, 214), (112, 120, 132), (214, 126, 68)
_PATH, _START, _GOAL, _ROBOT = (96, 165, 250), (250, 204, 21), (74, 222, 128), (255, 255, 255)
_TOUCH = ((248, 113, 113), (232, 121, 249), (251, 191, 36), (251, 191, 36), (244, 63, 94), (244, 63, 94))
"""Colour of each kind of contact, in the order of ``contact.KINDS``."""


@cache
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


@cache
def _palette() -> UInt8[np.ndarray, "256 3"]:
    from matplotlib import colormaps

    return (colormaps["magma_r"](np.linspace(0.05, 1, 256))[:, :3] * 255).astype(np.uint8)


def colour_depth(depth: Float[np.ndarray, "h w"], far: float) -> UInt8[np.ndarray, "h w 3"]:
    """Depth [m] in colours: bright is near, black is the far limit."""
    return _palette()[np.clip(np.sqrt(np.clip(depth / far, 0, 1)) * 255, 0, 255).astype(np.uint8)]


class MapPanel:
    """The floor plan from above with the path so far. Drawn once, then added to."""

    def __init__(self, plan: FloorPlan, blocks: Blocks, record: EpisodeRecord, radius: float) -> None:
        width, height = _SIDE, SIZE[1] - _BAR - _EYE[1] - 26
        cells = np.argwhere(plan.inside)
        low, high = plan.frame.xy(cells.min(0)) - 0.3, plan.frame.xy(cells.max(0)) + 0.3
        self._scale = min(width / (high[0] - low[0]), height / (high[1] - low[1]))
        self._middle, self._centre = (low + high) / 2, np.array([width / 2, height / 2])
        self._image = Image.new("RGB", (width, height), _PAPER)
        self._pen = ImageDraw.Draw(self._image)
        x, y = plan.frame.centres()
        mask = Image.fromarray((plan.inside[::-1] * 255).astype(np.uint8))
        half = plan.frame.resolution / 2
        corner = self._at(np.array([x[0] - half, y[-1] + half]))
        size = (round(mask.width * 2 * half * self._scale), round(mask.height * 2 * half * self._scale))
        self._image.paste(_FLOOR, tuple(np.rint(corner).astype(int).tolist()), mask.resize(size))
        for boxes, colour in (
            (plan.furniture.below(BODY_HEIGHT), _FURNITURE),
            (plan.walls.below(BODY_HEIGHT), _WALL),
            (blocks.boxes(), _BLOCK),
        ):
            for corners in self._at(boxes.corners()) if len(boxes) else []:
                self._pen.polygon([tuple(p) for p in corners.tolist()], fill=colour)
        self._disc(np.array(record.start), 0.15, _START)
        self._disc(np.array(record.goal), radius, _GOAL)
        self._drawn, self._touched = 0, 0

    def draw(
        self, path: Float[np.ndarray, "k 2"], contacts: Float[np.ndarray, "m 4"], xy: Float[np.ndarray, "2"], yaw: float
    ) -> Image.Image:
        """The map with path and contacts so far, which only grow, and the robot where it is."""
        if len(path) > max(self._drawn, 1):
            line = self._at(path[max(self._drawn - 1, 0) :])
            self._pen.line([tuple(p) for p in line.tolist()], fill=_PATH, width=3)
            self._drawn = len(path)
        for _, kind, x, y in contacts[self._touched :]:
            self._disc(np.array([x, y]), 2.5 / self._scale, _TOUCH[int(kind)])
        self._touched = len(contacts)
        now = self._image.copy()
        corners = Boxes(np.array([[xy[0], xy[1], yaw, LENGTH, WIDTH, 0, 1]])).corners()[0]
        pen = ImageDraw.Draw(now)
        pen.polygon([tuple(p) for p in self._at(corners).tolist()], outline=_ROBOT, fill=(70, 90, 130))
        nose = xy + 0.5 * LENGTH * np.array([np.cos(yaw), np.sin(yaw)])
        pen.line([tuple(p) for p in self._at(np.stack([xy, nose])).tolist()], fill=_ROBOT, width=2)
        return now

    def _at(self, xy: np.ndarray) -> np.ndarray:
        return self._centre + (xy - self._middle) * [self._scale, -self._scale]

    def _disc(self, xy: np.ndarray, radius: float, colour: tuple[int, int, int]) -> None:
        (x, y), r = self._at(xy), radius * self._scale
        self._pen.ellipse([x - r, y - r, x + r, y + r], fill=colour)


def compose(
    robot: UInt8[np.ndarray, "height width 3"],
    eyes: Sequence[UInt8[np.ndarray, "_ _ 3"]],
    plan: Image.Image,
    captions: Sequence[str],
) -> UInt8[np.ndarray, "720 1280 3"]:
    """One picture of the film: robot left, what locomotion and navigation camera see and the map right."""
    frame = Image.new("RGB", SIZE, _PAPER)
    frame.paste(Image.fromarray(robot).resize((SIZE[0] - _SIDE, SIZE[1] - _BAR), Image.Resampling.LANCZOS), (0, 0))
    pen = ImageDraw.Draw(frame)
    left = SIZE[0] - _SIDE
    for k, (eye, title) in enumerate(zip(eyes, ("locomotion camera", "navigation camera"), strict=True)):
        x = left + 8 + k * (_EYE[0] + 4)
        room = (_EYE[0] - 8, _EYE[1])
        frame.paste(ImageOps.pad(Image.fromarray(eye), room, Image.Resampling.NEAREST, _PAPER), (x, 22))
        pen.text((x, 4), title, fill=_MUTED, font=_font(13))
    frame.paste(plan, (left, _EYE[1] + 26))
    y = SIZE[1] - _BAR
    pen.rectangle([0, y, SIZE[0], SIZE[1]], fill=(16, 17, 20))
    for text, x in zip(captions, (24, 150, 480, 660, 1080), strict=True):
        pen.text((x, y + 27), text, fill=_INK, font=_font(20))
    return np.asarray(frame)


def write_caption(frame: UInt8[np.ndarray, "height width 3"], text: str) -> UInt8[np.ndarray, "height width 3"]:
    """The picture with a line of text in its upper left corner."""
    picture = Image.fromarray(frame)
    ImageDraw.Draw(picture).text((12, 8), text, fill=(30, 30, 30), font=_font(18))
    return np.asarray(picture)


def write_film(frames: Iterable[UInt8[np.ndarray, "height width 3"]], path: Path, rate: float) -> None:
    """Write a film, ``.mp4`` or ``.gif``, of so many pictures a second, all of one size; width and height are multiples
    of 16. Raises ``OSError`` if the disk is full, or nothing can be written there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch, writer = path.with_name(f".{path.name}"), None
    try:
        if path.suffix == ".gif":
            pictures = [Image.fromarray(frame).quantize(128) for frame in frames]
            pause = round(1000 / rate)
            pictures[0].save(scratch, "GIF", save_all=True, append_images=pictures[1:], duration=pause, loop=0)
        else:
            import imageio_ffmpeg  # only here: all but films do without ffmpeg

            for frame in frames:
                if writer is None:
                    size = (frame.shape[1], frame.shape[0])
                    writer = imageio_ffmpeg.write_frames(
                        str(scratch),
                        size,
                        fps=rate,  # type: ignore[arg-type]
                        quality=6,
                        ffmpeg_log_level="fatal",
                    )
                    writer.send(None)
                writer.send(np.ascontiguousarray(frame))
            if writer is not None:
                writer.close()
        scratch.replace(path)
    except OSError as error:
        # all that is known of an ffmpeg that has died is that it takes no more pictures
        if shutil.disk_usage(path.parent).free > _ROOM:
            raise
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path)) from error
    finally:
        if writer is not None:
            writer.close()
        scratch.unlink(missing_ok=True)

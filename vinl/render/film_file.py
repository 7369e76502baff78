"""Pictures to a film on disk, whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

_ROOM = 2**20
"""Where less is free, the disk is full for a film [bytes]."""


def write_caption(frame: UInt8[np.ndarray, "height width 3"], text: str) -> UInt8[np.ndarray, "height width 3"]:
    """The picture with a line of text in its upper left corner."""
    picture = Image.fromarray(frame)
    ImageDraw.Draw(picture).text((12, 8), text, fill=(30, 30, 30), font=ImageFont.load_default(18))
    return np.asarray(picture)


def write_film(frames: Iterable[UInt8[np.ndarray, "height width 3"]], path: Path, rate: float) -> None:
    """Write a film.

    Args:
        frames: pictures, all of one size; width and height are multiples of 16.
        path: ``.mp4`` or ``.gif``.
        rate: pictures a second.

    Raises:
        OSError: the disk is full, or nothing can be written there.
    """
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

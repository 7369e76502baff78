"""What a real depth camera does to an image, as a frozen record whose values live in ``configs/sensors/*.yaml``."""

from __future__ import annotations

from dataclasses import dataclass

from vinl.config.limits import Range, check_limits
from vinl.config.loader import load_config

_LIMITS = {
    "noise": (0.0, 1.0),
    "scale": (0.0, 0.5),
    "pixels": (0.0, 1.0),
    "patches": (0.0, 1.0),
    "edges": (0.0, 1.0),
    "edge_step": (0.01, 10.0),
    "surfaces": (0.0, 1.0),
    "surface_size": (0.05, 10.0),
    "patch_size": (0.01, 1.0),
    "range": (0.0, 1000.0),
    "delay": (0.0, 0.4),
    "roll": (-1.0, 1.0),
    "pitch": (-1.0, 1.0),
    "height": (-0.2, 0.2),
    "amplitude": (0.0, 10.0),
}
"""Of ``SensorConfig``. A delay stays below the 0.5 s between two decisions."""


@dataclass(frozen=True)
class SensorConfig:
    """Errors of a depth camera; the defaults are an ideal one. A pixel without a return reads 0 [librealsense].

    What differs from camera to camera is drawn once for each robot at the start of an episode: ``amplitude``,
    ``scale``, ``roll``, ``pitch``, ``height``, ``delay``, and which surfaces return nothing.

    Attributes:
        noise: standard deviation of a pixel's depth as a multiple of the depth squared [1/m]; of a stereo camera
            sub-pixel error / (focal length in pixels x baseline).
        scale: all depths are off by a factor, uniform within 1 +- this.
        pixels: fraction of the pixels without a return, each by itself.
        patches: fraction of the image without a return in round patches, expected.
        patch_size: range of their diameter, as a fraction of the image's width.
        edges: fraction of the pixels beside a step in depth without a return: one of the two imagers does not see them.
        edge_step: a neighbour that is nearer by more than this, relative to the pixel's own depth, makes such a step.
        surfaces: fraction of the surfaces that never return anything: glass, mirrors, dark cloth. They stay where they
            are while the robot moves.
        surface_size: side of such a surface [m].
        range: nearer and from the far end on nothing returns [m].
        delay: range of the age of an image when the policy gets it [s].
        roll, pitch: range of the angles by which the camera is mounted off, uniform; right side down and nose down are
            positive [rad].
        height: range by which it is mounted too high, uniform [m].
        amplitude: range of a factor on ``noise``, ``pixels``, ``patches``, ``edges`` and ``surfaces``, uniform.
    """

    noise: float = 0.0
    scale: float = 0.0
    pixels: float = 0.0
    patches: float = 0.0
    patch_size: Range = (0.05, 0.25)
    edges: float = 0.0
    edge_step: float = 0.3
    surfaces: float = 0.0
    surface_size: float = 0.5
    range: Range = (0.0, 1000.0)
    delay: Range = (0.0, 0.0)
    roll: Range = (0.0, 0.0)
    pitch: Range = (0.0, 0.0)
    height: Range = (0.0, 0.0)
    amplitude: Range = (1.0, 1.0)

    def __post_init__(self) -> None:
        check_limits(self, "sensors.", **_LIMITS)

    @property
    def is_ideal(self) -> bool:
        """Whether images come out as they go in, and from where the camera is."""
        return not (self.spoils or self.moves)

    @property
    def spoils(self) -> bool:
        """Whether depths change."""
        errors = (self.noise, self.scale, self.pixels, self.patches, self.edges, self.surfaces)
        return any(errors) or self.range != SensorConfig.range

    @property
    def moves(self) -> bool:
        """Whether images are taken from another place or at another time than the ideal camera's."""
        return any((*self.roll, *self.pitch, *self.height)) or self.delay[1] > 0


def load_sensors(name: str) -> SensorConfig:
    """The errors of a camera by the name of a config in ``configs/sensors``, or from a YAML file. Raises ``InputError``
    if there is no such config, or it cannot be used."""
    return load_config(SensorConfig, name if name.endswith((".yaml", ".yml")) else f"sensors/{name}")


@dataclass(frozen=True)
class OdometryConfig:
    """Errors of dead reckoning; the defaults are an exact one [paper].

    Attributes:
        drift: range of the relative error of distances, drawn for an episode; too long or too short alike.
        yaw_bias: the heading is off by up to this times the drift for each metre more, to either side [rad/m]. At 0.1 a
            drift of 2 % turns the robot's idea of its heading by up to 0.11 deg a metre, and after 20 m it is off by
            as much again to the side as along the path.
    """

    drift: Range = (0.0, 0.0)
    yaw_bias: float = 0.1

    def __post_init__(self) -> None:
        check_limits(self, "odometry.", drift=(0.0, 0.5), yaw_bias=(0.0, 1.0))

    @property
    def is_exact(self) -> bool:
        """Whether robots know where they are."""
        return self.drift[1] == 0.0

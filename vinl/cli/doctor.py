"""``vinl doctor``: versions, devices, and a one-second check of each part."""

from __future__ import annotations

import json
import os
import platform
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from vinl.cli.app import TRAIN_HINT
from vinl.cli.options import parse_options

PACKAGES = ("mujoco", "torch", "warp-lang", "numpy", "trimesh", "shapely")
TRAIN_PACKAGES = ("jax", "mujoco-mjx", "rsl-rl-lib", "gymnasium", "tensorboard")
ABSENT = "not installed"


@dataclass(frozen=True)
class Options:
    """Check that every part of vinl works here. Exit code 1 if a part fails."""

    json: bool = False
    """Print JSON instead of tables."""


@dataclass(frozen=True)
class Result:
    """Outcome of a check: ``state`` is "ok", "failed" or "not installed"; ``seconds`` it took."""

    part: str
    state: str
    detail: str
    seconds: float


def main(argv: list[str]) -> int:
    """Print versions, devices and checks."""
    options = parse_options(Options, argv, "doctor")
    versions = {"python": platform.python_version()} | {name: _version(name) for name in ("vinl", *PACKAGES)}
    extra = {name: _version(name) for name in TRAIN_PACKAGES}
    results = [_check(part, function, needs) for part, function, needs in CHECKS]
    devices = _devices()  # after the checks: once JAX runs, starting a process (the video's encoder) draws a warning
    failed = any(result.state == "failed" for result in results)
    if options.json:
        report = {"versions": versions | extra, "devices": devices, "checks": [asdict(r) for r in results]}
        print(json.dumps(report, indent=2))
    else:
        _print(versions, extra, devices, results)
    return 1 if failed else 0


def _check(part: str, function: Callable[[], str], needs: tuple[str, ...]) -> Result:
    missing = [name for name in needs if _version(name) == ABSENT]
    if missing:
        return Result(part, ABSENT, f"{', '.join(missing)} missing: {TRAIN_HINT}", 0.0)
    start = time.perf_counter()
    try:
        state, detail = "ok", function()
    except Exception as error:  # a check reports whatever went wrong and lets the others run
        state, detail = "failed", f"{type(error).__name__}: {error}"
    return Result(part, state, " ".join(detail.split()), round(time.perf_counter() - start, 2))


def _devices() -> dict[str, str]:
    found = {}
    for name, function in (("torch", torch_devices), ("warp", warp_devices), ("jax", jax_devices)):
        try:
            found[name] = function()
        except ModuleNotFoundError:
            found[name] = ABSENT
        except Exception as error:  # a broken driver is what this command is there to show
            found[name] = f"{type(error).__name__}: {error}"
    return found


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ABSENT


_MARKS = {"ok": ("✓", "green"), "failed": ("✗", "bold red"), ABSENT: ("-", "yellow")}


def _print(versions: dict[str, str], extra: dict[str, str], devices: dict[str, str], results: list[Result]) -> None:
    console = Console()
    main_versions = ", ".join(f"{name} {versions[name]}" for name in ("vinl", "python", "mujoco", "torch"))
    console.print(main_versions, highlight=False, soft_wrap=True)
    missing = [name for name, version in {**versions, **extra}.items() if version == ABSENT]
    if missing:
        console.print(f"not installed: {', '.join(missing)} (training needs {TRAIN_HINT})", soft_wrap=True)
    for name, device in devices.items():
        console.print(f"{name:<6}{device}", highlight=False, soft_wrap=True)
    for result in results:
        mark, style = _MARKS[result.state]
        line = Text(f"{mark} ", style).append(f"{result.part:<14}", "default").append(result.detail, "default")
        console.print(line, soft_wrap=True)
    failed = [result.part for result in results if result.state == "failed"]
    console.print(f"failed: {', '.join(failed)}" if failed else "all parts work")


def torch_devices() -> str:
    """Devices that torch sees."""
    import torch

    names = [torch.cuda.get_device_name(k) for k in range(torch.cuda.device_count())]
    return ", ".join([f"cpu ({torch.get_num_threads()} threads)", *names])


def warp_devices() -> str:
    """Devices that Warp sees."""
    from vinl.sensing.warp_start import start_warp

    start_warp()
    import warp as wp

    return ", ".join(f"{device.alias} ({device.name or 'processor'})" for device in wp.get_devices())


def jax_devices() -> str:
    """Devices that JAX sees."""
    os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # leaves a GPU's memory to torch and Warp
    import jax

    return f"{jax.default_backend()}: " + ", ".join(str(device) for device in jax.devices())


def check_configs() -> str:
    """Every shipped config can be read, with what it extends."""
    from vinl.config.loader import list_configs, read_config

    names = list_configs()
    if not names:
        raise RuntimeError("no config is installed")
    for name in names:
        read_config(name)
    return f"{len(names)} shipped, all can be read"


def check_plans() -> str:
    """Every shipped floor plan loads and has floor to stand on."""
    from vinl.world.readers import load_floorplan, shipped_floorplans

    names = shipped_floorplans()
    if not names:
        raise RuntimeError("no floor plan is installed")
    areas = {name: load_floorplan(name).area_m2 for name in names}
    bare = [name for name, area in areas.items() if area < 1]
    if bare:
        raise RuntimeError(f"{bare[0]} has no free floor")
    return f"{len(names)} shipped, {min(areas.values()):.0f} to {max(areas.values()):.0f} m2 of free floor"


def check_depth() -> str:
    """A wall 1.5 m in front of the navigation camera reads 1.5 m."""
    from vinl.robot.cameras import NAVIGATION_CAMERA as CAMERA
    from vinl.sensing.depth import DepthCamera

    wall = np.array([[0.0, -50, -50], [0, 50, -50], [0, 50, 50], [0, -50, 50]], np.float32)
    eye, axis = np.array(CAMERA.position), CAMERA.rotation()
    vertices = (wall + np.array([1.5, 0, 0])) @ axis.T + eye
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    camera = DepthCamera([(vertices.astype(np.float32), faces)], CAMERA)
    image = camera.render(np.zeros(1, int), np.zeros((1, 3)), np.eye(3)[None])[0].float()
    if abs(image - 1.5).max() > 0.01:
        raise RuntimeError(f"a wall at 1.5 m reads {image.min():.3f} to {image.max():.3f} m")
    return f"{image.shape[1]} x {image.shape[0]} pixels, a wall at 1.5 m reads {image.mean():.3f} m"


def check_physics() -> str:
    """The robot stands in its default pose for a second."""
    import mujoco

    from vinl.robot.aliengo import DEFAULT_POSE, home_qpos
    from vinl.robot.model import robot_spec

    spec = robot_spec("primitives")
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[10, 10, 0.1], contype=1)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:] = home_qpos()
    data.ctrl[:] = DEFAULT_POSE
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    height = float(data.qpos[2])
    if not 0.25 < height < 0.45:
        raise RuntimeError(f"the trunk of the standing robot is at {height:.2f} m, not between 0.25 and 0.45 m")
    return f"the robot stands, trunk at {height:.2f} m"


def check_policy() -> str:
    """Every shipped policy loads and acts; without one, a fresh network does."""
    from vinl.policies.card import locomotion_card
    from vinl.policies.io import list_policies, load_policy
    from vinl.policies.networks import StepActor
    from vinl.policies.policy import LocomotionPolicy

    names = list_policies()
    network = StepActor()
    policies = [load_policy(name) for name in names] or [
        LocomotionPolicy(network, locomotion_card("untrained", network.describe(), gait={}))
    ]
    for policy in policies:
        zeros, camera = np.zeros((2, policy.card.observation_size), np.float32), policy.camera
        action = policy.act(zeros, None if camera is None else np.ones((2, camera.height, camera.width), np.float32))
        if not np.isfinite(action).all():
            raise RuntimeError(f"{policy.card.name} acts {action}")
    return f"{len(names)} shipped, all act" if names else "none is shipped; an untrained network acts"


def check_video() -> str:
    """An MP4 can be written."""
    from vinl.render.panels import write_film

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trial.mp4"
        write_film((np.full((64, 64, 3), level, np.uint8) for level in (0, 255)), path, 10.0)
        return f"MP4 written ({path.stat().st_size} bytes)"


def check_training() -> str:
    """MJX takes a step with the robot."""
    os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")
    import jax
    import rsl_rl  # noqa: F401  (that it imports is the check)
    from mujoco import mjx

    from vinl.robot.model import robot_spec

    model = robot_spec("spheres").compile()
    data = jax.jit(mjx.kinematics)(mjx.put_model(model), mjx.make_data(model))
    return f"MJX on {jax.default_backend()}, {data.xpos.shape[0]} bodies"


CHECKS: tuple[tuple[str, Callable[[], str], tuple[str, ...]], ...] = (
    ("configs", check_configs, ()),
    ("floor plans", check_plans, ()),
    ("depth camera", check_depth, ()),
    ("physics", check_physics, ()),
    ("policy", check_policy, ()),
    ("video", check_video, ()),
    ("training", check_training, TRAIN_PACKAGES),
)
"""Name of the part, its check, and the packages of the train extra that it needs."""

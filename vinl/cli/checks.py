"""A quick trial of each part, for ``vinl doctor``. A check returns what it saw and raises if that is wrong."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import numpy as np


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
    from vinl.policies.networks import MapActor
    from vinl.policies.policy import LocomotionPolicy

    names = list_policies()
    network = MapActor()
    policies = [load_policy(name) for name in names] or [
        LocomotionPolicy(network, locomotion_card("untrained", network.describe()))
    ]
    for policy in policies:
        zeros, camera = np.zeros((2, policy.card.observation_size), np.float32), policy.camera
        action = policy.act(zeros, None if camera is None else np.ones((2, camera.height, camera.width), np.float32))
        if not np.isfinite(action).all():
            raise RuntimeError(f"{policy.card.name} acts {action}")
    return f"{len(names)} shipped, all act" if names else "none is shipped; an untrained network acts"


def check_video() -> str:
    """An MP4 can be written."""
    from vinl.render.film_file import write_film

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

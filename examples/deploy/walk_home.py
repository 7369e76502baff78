"""Two exported policies walk a simulated robot through a home: docs/deploy.md says how to make the files."""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np
from controllers import Locomotion, Navigation


class DepthCamera:
    """A depth camera on the trunk, by MuJoCo's rays; they meet geoms of group 0, which is everything but the robot."""

    def __init__(self, camera):
        self.far, self.mount, self.shape = camera["far"], camera["position"], (camera["height"], camera["width"])
        half = np.tan([camera["vfov"] / 2, camera["hfov"] / 2])
        up, left = (h * (1 - (2 * np.arange(n) + 1) / n) for h, n in zip(half, self.shape, strict=True))
        rays = np.stack([np.ones(self.shape), *np.meshgrid(left, up)], -1).reshape(-1, 3)
        self.along = 1 / np.linalg.norm(rays, axis=1)  # how far a ray of 1 m leads along the optical axis
        self.rays = (rays * self.along[:, None]) @ np.array(camera["rotation"]).T
        self.geoms, self.hits = np.zeros(len(rays), np.int32), np.zeros(len(rays))

    def look(self, model, data):
        """Depth [m], (height, width); the far limit where nothing is hit."""
        turn, groups = data.body("trunk").xmat.reshape(3, 3), np.array([1, 0, 0, 0, 0, 0], np.uint8)
        eye, rays = data.body("trunk").xpos + turn @ self.mount, (self.rays @ turn.T).ravel()
        rest = self.geoms, self.hits, None, len(self.rays), mujoco.mjMAXVAL
        mujoco.mj_multiRay(model, data, eye, rays, groups, True, -1, *rest)
        return np.where(self.hits < 0, self.far, np.minimum(self.hits * self.along, self.far)).reshape(self.shape)


def build_home(scene, episode, about):
    """The home with the clutter of an episode and the joint gains of the policy; the robot stands at its start."""
    spec = mujoco.MjSpec.from_file(str(scene / "home.xml"))
    for x, y, yaw, *size in episode["blocks"]:
        place = {"pos": [x, y, size[2] / 2], "quat": [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]}
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": np.array(size) / 2, "contype": 1, "conaffinity": 0}
        spec.body("blocks").add_geom(**place, **shape)
    model = spec.compile()
    model.actuator_gainprm[:, 0], model.actuator_biasprm[:, 1:3] = about["kp"], (-about["kp"], -about["kd"])
    data, yaw, z = mujoco.MjData(model), episode["yaw"], model.qpos0[2]
    data.qpos = [*episode["start"], z, np.cos(yaw / 2), 0, 0, np.sin(yaw / 2), *episode["joints"]]
    return model, data


def walk(scene, episode, locomotion, navigation, time_limit):
    """One episode: how it ended, after what time [s] and path [m]."""
    model, data = build_home(scene, episode, locomotion.about)
    near, ahead = DepthCamera(locomotion.about["camera"]), DepthCamera(navigation.about["camera"])
    period, goal, path = locomotion.about["period"], np.array(episode["goal"]), 0.0
    between, substeps = round(navigation.about["period"] / period), round(period / model.opt.timestep)
    for step in range(round(time_limit / period)):
        mujoco.mj_kinematics(model, data)
        before, turn = data.qpos[:2].copy(), data.body("trunk").xmat.reshape(3, 3)
        if step % between == 0:
            pose = np.array([*before, np.arctan2(turn[1, 0], turn[0, 0])])  # a robot has it from odometry
            command = navigation.step(pose, goal, ahead.look(model, data))
        gravity, depth = -turn[2], near.look(model, data)  # IMU, camera
        data.ctrl = locomotion.step(data.qvel[3:6], gravity, data.qpos[7:], data.qvel[6:], command, depth)
        mujoco.mj_step(model, data, substeps)
        path += np.linalg.norm(data.qpos[:2] - before)
        if np.linalg.norm(data.qpos[:2] - goal) < navigation.about["success_radius"]:
            return "success", data.time, path
        if turn[2, 2] < np.cos(1.25):
            return "fall", data.time, path
    return "timeout", data.time, path


def main(scene, *files):
    """Walk all episodes of a scene."""
    tasks, reached = json.loads((scene / "episodes.json").read_text()), 0
    for number, episode in enumerate(tasks["episodes"]):
        end, seconds, path = walk(scene, episode, Locomotion(files[0]), Navigation(files[1]), tasks["time_limit"])
        print(f"{number:3} {end:8} {seconds:6.2f} s {path:6.2f} m, shortest {episode['shortest_m']:.2f} m", flush=True)
        reached += end == "success"
    print(f"{reached} of {len(tasks['episodes'])} goals reached")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])

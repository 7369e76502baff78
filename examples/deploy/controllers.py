"""The two exported policies as a robot runs them: numpy and onnxruntime, everything else is read from the files."""

import json

import numpy as np
import onnxruntime


class OnnxPolicy:
    """A file of `vinl export`: one step of the network, and the memory that is carried on."""

    def __init__(self, path):
        one_core = onnxruntime.SessionOptions()
        one_core.intra_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(path, one_core, providers=["CPUExecutionProvider"])
        self.about = {k: json.loads(v) for k, v in self.session.get_modelmeta().custom_metadata_map.items()}
        self.rows, self.clip = self.about["observation"], self.about.get("observation_clip", np.inf)
        self.scale = np.concatenate([np.broadcast_to(row["scale"], row["size"]) for row in self.rows])
        self.reset()

    def reset(self):
        """An episode begins."""
        self.memory = {s["input"]: np.full(s["shape"], s["start"], np.float32) for s in self.about["states"]}
        self.last, self.before = np.zeros(self.session.get_outputs()[0].shape[1], np.float32), None

    def act(self, values, depth, age=0.0):
        """The action for the rows of the observation table, in SI units, and depth [m] that is so old [s]."""
        observation = self.scale * np.concatenate([values[row["name"]] for row in self.rows])
        inputs = {"observation": np.float32(np.clip(observation, -self.clip, self.clip))[None], **self.memory}
        seen = (("depth", "camera", depth), ("age", "image_age", age))
        inputs |= {name: np.float32([value]) for name, key, value in seen if key in self.about}
        action, *memory = self.session.run(None, inputs)
        self.memory = dict(zip(self.memory, memory, strict=True))
        return action[0]


class Locomotion(OnnxPolicy):
    """50 times a second: joint targets [rad]."""

    def step(self, gyro, gravity, joints, joint_speeds, command, depth, age=0.0):
        """From angular velocity and the direction of gravity in the trunk frame, all in SI units, and an image."""
        pose, limit = np.array(self.about["default_pose"]), self.about["action_clip"]
        state = {"base_angular_velocity": gyro, "projected_gravity": gravity, "command": command}
        legs = {"joint_position": joints - pose, "joint_velocity": joint_speeds, "previous_action": self.last}
        self.last = self.act({**state, **legs}, depth, age)
        return pose + self.about["action_scale"] * np.clip(self.last, -limit, limit)


class Navigation(OnnxPolicy):
    """Twice a second: a command (forward [m/s], left, yaw rate [rad/s])."""

    def __init__(self, path):
        super().__init__(path)
        ranges = np.array([self.about["forward_speed"], self.about["yaw_rate"]])
        self.middle, self.half = ranges.mean(1), np.ptp(ranges, 1) / 2

    def step(self, pose, goal, depth):
        """From the pose (x, y [m], yaw [rad]) and the goal (x, y) in odometry, and depth [m]."""
        (x, y), step = goal - pose[:2], np.zeros(3)
        bearing = np.arctan2(y, x) - pose[2]
        if self.before is not None:  # forward, left and turned since the last decision, as the robot stood then
            (dx, dy), turn, heading = pose[:2] - self.before[:2], pose[2] - self.before[2], self.before[2]
            c, s = np.cos(heading), np.sin(heading)
            step = np.array([c * dx + s * dy, c * dy - s * dx, (turn + np.pi) % (2 * np.pi) - np.pi])
        self.before = np.array(pose)
        where = {"goal_distance": [np.hypot(x, y)], "goal_direction": [np.cos(bearing), np.sin(bearing)]}
        self.last = np.clip(self.act({**where, "previous_action": self.last, "previous_step": step}, depth), -1, 1)
        return np.insert(self.middle + self.half * self.last, 1, 0.0)

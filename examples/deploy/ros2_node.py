"""A ROS 2 node around the two policies. A skeleton: written against rclpy's documentation, run on no robot yet.

Topics in:  depth_near, depth_ahead  sensor_msgs/Image, 16UC1 [mm] or 32FC1 [m], with *_info  sensor_msgs/CameraInfo
            odom                     nav_msgs/Odometry: pose in odom, twist in the trunk frame, from a state estimator
            joint_states             sensor_msgs/JointState
            goal                     geometry_msgs/PoseStamped in odom
Topics out: joint_targets            sensor_msgs/JointState, positions [rad]; or, if the parameter locomotion is empty,
            cmd_vel                  geometry_msgs/Twist for a robot that walks by a controller of its own
"""

import numpy as np
import rclpy
from controllers import Locomotion, Navigation
from depth_image import DepthPreparation
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import CameraInfo, Image, JointState


class VinlNode(Node):
    """Navigation twice a second, locomotion 50 times; without a goal, or with old images, the command is to stand."""

    def __init__(self):
        super().__init__("vinl")
        files = {name: self.declare_parameter(name, f"{name}.onnx").value for name in ("locomotion", "navigation")}
        self.odom, self.joints, self.goal = None, None, None
        self.images, self.preparations, self.command = {}, {}, np.zeros(3)
        self.navigation = Navigation(files["navigation"])
        self.locomotion = Locomotion(files["locomotion"]) if files["locomotion"] else None
        self.create_subscription(Odometry, "odom", lambda message: setattr(self, "odom", message), 1)
        self.create_subscription(JointState, "joint_states", lambda message: setattr(self, "joints", message), 1)
        self.create_subscription(PoseStamped, "goal", self.take_goal, 1)
        for name, policy in (("depth_ahead", self.navigation), ("depth_near", self.locomotion)):
            if policy is not None:
                self.subscribe_camera(name, policy.about["camera"])
        self.velocities = self.create_publisher(Twist, "cmd_vel", 1)
        self.targets = self.create_publisher(JointState, "joint_targets", 1)
        self.create_timer(self.navigation.about["period"], self.navigate)
        if self.locomotion is not None:
            self.create_timer(self.locomotion.about["period"], self.walk)

    def subscribe_camera(self, name, camera):
        """Keep the newest image of a camera, prepared for the policy."""

        def take_info(info):
            fx, _, cx, _, fy, cy, *_ = info.k
            self.preparations[name] = DepthPreparation(camera, fx, fy, cx, cy, info.width, info.height)

        def take_image(image):
            if name in self.preparations:
                kind, unit = (np.uint16, 0.001) if image.encoding == "16UC1" else (np.float32, 1.0)
                pixels = np.frombuffer(image.data, kind).reshape(image.height, -1)[:, : image.width]
                self.images[name] = self.preparations[name](pixels, unit), Time.from_msg(image.header.stamp)

        self.create_subscription(CameraInfo, name + "_info", take_info, 1)
        self.create_subscription(Image, name, take_image, 1)

    def see(self, name):
        """The newest prepared image and how old it is [s], None if that is more than 0.2 s."""
        image, taken = self.images.get(name, (None, None))
        age = (self.get_clock().now() - taken).nanoseconds / 1e9 if taken else np.inf
        return (image, age) if age < 0.2 else None

    def take_goal(self, message):
        """A new episode: the memory of the navigation policy begins anew."""
        self.goal = np.array([message.pose.position.x, message.pose.position.y])
        self.navigation.reset()

    def navigate(self):
        """Choose the command; stand where something is missing or the goal is reached."""
        seen, self.command = self.see("depth_ahead"), np.zeros(3)
        if self.goal is not None and self.odom is not None and seen is not None:
            at, turn = self.odom.pose.pose.position, self.trunk_rotation()
            pose = np.array([at.x, at.y, np.arctan2(turn[1, 0], turn[0, 0])])
            if np.linalg.norm(self.goal - pose[:2]) > self.navigation.about["success_radius"]:
                self.command = self.navigation.step(pose, self.goal, seen[0])
        if self.locomotion is None:
            message = Twist()
            message.linear.x, message.linear.y, message.angular.z = map(float, self.command)
            self.velocities.publish(message)

    def walk(self):
        """Publish joint targets; the driver holds them with the gains kp and kd of the metadata."""
        seen = self.see("depth_near")
        if self.odom is None or self.joints is None or seen is None:
            return
        names, twist = self.locomotion.about["joint_names"], self.odom.twist.twist
        order = [self.joints.name.index(name) for name in names]
        gyro = np.array([twist.angular.x, twist.angular.y, twist.angular.z])
        joints, speeds = np.array(self.joints.position)[order], np.array(self.joints.velocity)[order]
        target = self.locomotion.step(gyro, -self.trunk_rotation()[2], joints, speeds, self.command, *seen)
        message = JointState(name=names, position=target.tolist())
        message.header.stamp = self.get_clock().now().to_msg()
        self.targets.publish(message)

    def trunk_rotation(self):
        """(3, 3) trunk to odom."""
        q = self.odom.pose.pose.orientation
        w, x, y, z = q.w, q.x, q.y, q.z
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )


def main():
    """Run until Ctrl-C."""
    rclpy.init()
    rclpy.spin(VinlNode())


if __name__ == "__main__":
    main()

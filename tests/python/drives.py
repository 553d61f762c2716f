"""A drive, and writers of it: LCM logs by LCM's own package, bags by rosbags, CARMEN by hand."""
import dataclasses
import importlib.util
import math
import pathlib
import zlib

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

import gpom

T0_US = 1_700_000_000_000_000
SCAN_US, POSE_US = 200_000, 50_000


@dataclasses.dataclass
class Drive:
    stamps_us: list
    ranges_m: list  # float32 arrays
    angle_min_rad: float  # both are float32 numbers, as messages have them
    angle_step_rad: float
    range_max_m: float
    poses: list  # (stamp_us, x, y, (w, x, y, z))


def quaternion(yaw_rad):
    return (math.cos(0.5 * yaw_rad), 0.0, 0.0, math.sin(0.5 * yaw_rad))


def simulated(n_scans=40, n_beams=91):
    """A drive along a street, poses between those of the scans by straight lines. The robot
    turns to and fro, so that yaw is interpolated, too."""
    scans = gpom.simulate_street(seed=3, n_scans=n_scans, n_beams=n_beams, step_m=1.0,
                                 range_max_m=30.0).scans
    stamps_us = [T0_US + i * SCAN_US for i in range(n_scans)]
    rows = np.array([scan.pose for scan in scans])
    rows[:, 2] = np.unwrap(rows[:, 2]) + 0.2 * np.sin(np.arange(n_scans) / 4.0)
    pose_us = np.arange(T0_US, stamps_us[-1] + POSE_US, POSE_US) - 20_000
    poses = []
    for stamp_us in [*pose_us, stamps_us[-1] + 30_000]:
        x_m, y_m, yaw_rad = (float(np.interp(stamp_us - T0_US, np.arange(n_scans) * SCAN_US,
                                             rows[:, i])) for i in range(3))
        poses.append((int(stamp_us), x_m, y_m, quaternion(yaw_rad)))
    return Drive(stamps_us, [scan.ranges_m for scan in scans],
                 float(np.float32(scans[0].angle_min_rad)),
                 float(np.float32(scans[0].angle_step_rad)), 30.0, poses)


def _merged(drive):
    """(stamp_us, index of a scan or None, pose or None), in order of time."""
    items = [(stamp_us, i, None) for i, stamp_us in enumerate(drive.stamps_us)]
    items += [(pose[0], None, pose) for pose in drive.poses]
    return sorted(items, key=lambda item: (item[0], item[1] is not None))


# --- LCM ----------------------------------------------------------------------------------------

def write_lcm(drive, path, family="bot_core"):
    """An event log by the package lcm, of messages by lcm-gen."""
    import lcm
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for stamp_us, i_scan, pose in _merged(drive):
        channel, message = (scan_message(drive, i_scan, family) if pose is None else
                            pose_message(pose, family))
        if message is not None:
            log.write_event(stamp_us, channel, message)
    log.close()
    return path


def scan_message(drive, i, family):
    import bot_core
    import mbot_lcm_msgs
    ranges_m = [float(r) for r in drive.ranges_m[i]]
    if family == "gpom":
        return "GPOM_SCAN", gpom_scan(drive, i)
    if family == "bot_core":
        scan = bot_core.planar_lidar_t()
        scan.utime, scan.nranges, scan.ranges = drive.stamps_us[i], len(ranges_m), ranges_m
        scan.nintensities, scan.intensities = 0, []
        scan.rad0, scan.radstep = drive.angle_min_rad, drive.angle_step_rad
        return "LIDAR", scan.encode()
    scan = mbot_lcm_msgs.lidar_t()
    n = len(ranges_m)
    scan.utime, scan.num_ranges, scan.ranges = drive.stamps_us[i], n, ranges_m
    scan.thetas = [drive.angle_min_rad + k * drive.angle_step_rad for k in range(n)]
    scan.times = [drive.stamps_us[i]] * n
    scan.intensities = [0.0] * n
    return "LIDAR", scan.encode()


def scan_t():
    """gpom.scan_t of lcm-gen. Its package has the name of the package under test, so it is loaded
    by its file."""
    found = importlib.util.find_spec("bot_core")
    path = pathlib.Path(found.origin).parents[1] / "gpom" / "scan_t.py"
    spec = importlib.util.spec_from_file_location("lcm_gpom_scan_t", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.scan_t()


def gpom_scan(drive, i, crc=True):
    """A gpom.scan_t with the pose of the exact stamp; the CRC as lcmtypes/README.md says."""
    scan = scan_t()
    pose = next(p for p in drive.poses if p[0] >= drive.stamps_us[i])
    w, _, _, z = pose[3]
    scan.utime, scan.sequence, scan.sensor_id = drive.stamps_us[i], i, 0
    scan.pose = [pose[1], pose[2], math.atan2(2 * w * z, 1 - 2 * z * z)]
    scan.pose_cov = [0.0] * 9
    scan.angle_min, scan.angle_step = drive.angle_min_rad, drive.angle_step_rad
    scan.ranges = [float(r) for r in drive.ranges_m[i]]
    scan.n_ranges, scan.crc32 = len(scan.ranges), 0
    data = scan.encode()
    return data[:-4] + zlib.crc32(data[:-4]).to_bytes(4, "big") if crc else data


def pose_message(pose, family):
    import bot_core
    import mbot_lcm_msgs
    stamp_us, x_m, y_m, q = pose
    if family == "gpom":
        return "", None
    if family == "bot_core":
        message = bot_core.pose_t()
        message.utime, message.pos, message.orientation = stamp_us, [x_m, y_m, 0.0], list(q)
        message.vel = message.rotation_rate = message.accel = [0.0] * 3
        return "POSE", message.encode()
    message = mbot_lcm_msgs.pose2D_t()
    message.utime, message.x, message.y = stamp_us, x_m, y_m
    message.theta = 2.0 * math.atan2(q[3], q[0])
    return "SLAM_POSE", message.encode()


# --- ROS ----------------------------------------------------------------------------------------

class Messages:
    """Messages of ROS 1 or ROS 2 by rosbags' types."""

    def __init__(self, is_ros1):
        self.is_ros1 = is_ros1
        self.store = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
        self.types = self.store.types

    def header(self, stamp_us, frame):
        stamp = self.types["builtin_interfaces/msg/Time"](
            sec=stamp_us // 1_000_000, nanosec=stamp_us % 1_000_000 * 1000)
        first = {"seq": 0} if self.is_ros1 else {}
        return self.types["std_msgs/msg/Header"](**first, stamp=stamp, frame_id=frame)

    def scan(self, drive, i, frame="laser", time_increment=0.0):
        empty = np.zeros(0, np.float32)
        n = len(drive.ranges_m[i])
        return self.types["sensor_msgs/msg/LaserScan"](
            header=self.header(drive.stamps_us[i], frame), angle_min=drive.angle_min_rad,
            angle_max=drive.angle_min_rad + (n - 1) * drive.angle_step_rad,
            angle_increment=drive.angle_step_rad, time_increment=time_increment, scan_time=0.2,
            range_min=0.02, range_max=drive.range_max_m, ranges=drive.ranges_m[i],
            intensities=empty)

    def echoes(self, drive, i):
        scan = vars(self.scan(drive, i)).copy()
        echo = self.types["sensor_msgs/msg/LaserEcho"]
        scan["ranges"] = [echo(echoes=np.array([r, r + 1.0], np.float32))
                          for r in drive.ranges_m[i]]
        scan["intensities"] = []
        scan.pop("__msgtype__", None)
        return self.types["sensor_msgs/msg/MultiEchoLaserScan"](**scan)

    def pose(self, x_m, y_m, q, z_m=0.0):
        return self.types["geometry_msgs/msg/Pose"](
            position=self.types["geometry_msgs/msg/Point"](x=x_m, y=y_m, z=z_m),
            orientation=self.types["geometry_msgs/msg/Quaternion"](w=q[0], x=q[1], y=q[2], z=q[3]))

    def pose_stamped(self, pose):
        return self.types["geometry_msgs/msg/PoseStamped"](
            header=self.header(pose[0], "map"), pose=self.pose(*pose[1:]))

    def odometry(self, pose):
        vector = self.types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
        with_cov = self.types["geometry_msgs/msg/PoseWithCovariance"]
        return self.types["nav_msgs/msg/Odometry"](
            header=self.header(pose[0], "odom"), child_frame_id="base_link",
            pose=with_cov(pose=self.pose(*pose[1:]), covariance=np.zeros(36)),
            twist=self.types["geometry_msgs/msg/TwistWithCovariance"](
                twist=self.types["geometry_msgs/msg/Twist"](linear=vector, angular=vector),
                covariance=np.zeros(36)))

    def transform(self, stamp_us, parent, child, translation, q):
        t = self.types["geometry_msgs/msg/Transform"](
            translation=self.types["geometry_msgs/msg/Vector3"](
                x=translation[0], y=translation[1], z=translation[2]),
            rotation=self.types["geometry_msgs/msg/Quaternion"](w=q[0], x=q[1], y=q[2], z=q[3]))
        each = self.types["geometry_msgs/msg/TransformStamped"](
            header=self.header(stamp_us, parent), child_frame_id=child, transform=t)
        return self.types["tf2_msgs/msg/TFMessage"](transforms=[each])


def drive_messages(drive, messages):
    """(topic, stamp_us, message) of scans and PoseStamped."""
    for stamp_us, i_scan, pose in _merged(drive):
        if pose is None:
            yield "/scan", stamp_us, messages.scan(drive, i_scan)
        else:
            yield "/pose", stamp_us, messages.pose_stamped(pose)


def write_rows(path, rows, messages, plugin=rosbag2.StoragePlugin.SQLITE3):
    """Write a bag of (topic, stamp_us, message)."""
    writer = (rosbag1.Writer(path) if messages.is_ros1 else
              rosbag2.Writer(path, version=9, storage_plugin=plugin))
    with writer:
        topics = {}
        for topic, stamp_us, message in rows:
            kind = message.__msgtype__
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=messages.store)
            raw = (messages.store.serialize_ros1(message, kind) if messages.is_ros1 else
                   messages.store.serialize_cdr(message, kind))
            writer.write(topics[topic], 1000 * stamp_us, raw)
    return path


def write_bag(drive, folder, kind):
    """The drive as a bag: ros1, sqlite3, mcap (a folder), or one mcap file."""
    folder = pathlib.Path(folder)
    messages = Messages(kind == "ros1")
    rows = drive_messages(drive, messages)
    if kind == "ros1":
        return write_rows(folder / "drive.bag", rows, messages)
    plugin = rosbag2.StoragePlugin.SQLITE3 if kind == "sqlite3" else rosbag2.StoragePlugin.MCAP
    path = write_rows(folder / "drive", rows, messages, plugin)
    return next(path.glob("*.mcap")) if kind == "one mcap file" else path


# --- CARMEN -------------------------------------------------------------------------------------

def write_carmen(scans, path):
    """ROBOTLASER1 lines with 6 or more digits behind the point."""
    lines = []
    for scan in scans:
        ranges_m = np.where(np.isfinite(scan.ranges_m), scan.ranges_m, scan.sensor.range_max_m)
        x_m, y_m, yaw_rad = scan.pose
        n = len(ranges_m)
        fov_rad = scan.angle_step_rad * (n - 1)
        t_s = 1e-6 * scan.stamp_us
        words = ["ROBOTLASER1", "0", f"{scan.angle_min_rad:.9f}", f"{fov_rad:.9f}",
                 f"{scan.angle_step_rad:.9f}", f"{scan.sensor.range_max_m:.4f}", "0.01", "0",
                 str(n), *(f"{r:.6f}" for r in ranges_m), "0",
                 *(f"{v:.7f}" for v in (x_m, y_m, yaw_rad) * 2),
                 "0", "0", "0.3", "0.3", "0", f"{t_s:.6f}", "robot", f"{t_s:.6f}"]
        lines.append(" ".join(words))
    path.write_text("\n".join(lines) + "\n")
    return path

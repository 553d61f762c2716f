"""MCAP files of ROS 2 messages, for Foxglove and ROS 2: a map, or scans with their poses."""
import math

import numpy as np

from ..grid import UNKNOWN
from ..scan import laser_pose
from .recording import replace_file

GRID, SCAN, TF = "nav_msgs/msg/OccupancyGrid", "sensor_msgs/msg/LaserScan", "tf2_msgs/msg/TFMessage"


class _Messages:
    """Makes messages by rosbags' types."""

    def __init__(self):
        from rosbags.typesys import Stores, get_typestore  # only who writes waits for the import
        self.store = get_typestore(Stores.ROS2_HUMBLE)

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def stamp(self, stamp_us):
        return self.make("builtin_interfaces/msg/Time", sec=stamp_us // 1_000_000,
                         nanosec=stamp_us % 1_000_000 * 1000)

    def header(self, stamp_us, frame):
        return self.make("std_msgs/msg/Header", stamp=self.stamp(stamp_us), frame_id=frame)

    def quaternion(self, yaw_rad):
        return self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(0.5 * yaw_rad),
                         w=math.cos(0.5 * yaw_rad))


def _write(path, messages, rows):
    """Write (topic, type, stamp_us, message) to a file, either whole or not at all."""
    from mcap.writer import Writer

    def write(staged):
        with open(staged, "wb") as file:
            writer = Writer(file)
            writer.start(profile="ros2", library="gpom")
            channels = {}
            for topic, kind, stamp_us, message in rows:
                if topic not in channels:
                    text, _ = messages.store.generate_msgdef(kind, ros_version=2)
                    schema = writer.register_schema(kind, "ros2msg", text.encode())
                    channels[topic] = writer.register_channel(topic, "cdr", schema)
                data = bytes(messages.store.serialize_cdr(message, kind))
                writer.add_message(channels[topic], 1000 * stamp_us, data, 1000 * stamp_us)
            writer.finish()
    replace_file(path, write)


def occupancy(grid):
    """ny x nx values of nav_msgs/OccupancyGrid: percent of the probability, -1 unknown, int8."""
    percent = np.rint(100.0 * grid.probability).astype(np.int8)
    return np.where(grid.cls == UNKNOWN, -1, percent).astype(np.int8)


def write_mcap(path, grid, topic="/map", frame="map"):
    """Write an MCAP file with one nav_msgs/OccupancyGrid."""
    messages = _Messages()
    corner = messages.make(
        "geometry_msgs/msg/Pose", orientation=messages.quaternion(0.0),
        position=messages.make("geometry_msgs/msg/Point", x=float(grid.x0_m), y=float(grid.y0_m),
                               z=0.0))
    ny, nx = grid.shape
    info = messages.make("nav_msgs/msg/MapMetaData", map_load_time=messages.stamp(grid.stamp_us),
                         resolution=grid.cell_m, width=nx, height=ny, origin=corner)
    message = messages.make(GRID, header=messages.header(grid.stamp_us, frame), info=info,
                            data=occupancy(grid).ravel())
    _write(path, messages, [(topic, GRID, grid.stamp_us, message)])


def _laser_scan(messages, scan):
    _, _, _, _, angle_min_rad, step_rad, range_max_m, ranges_m = scan.laser_tuple()
    n = len(ranges_m)
    return messages.make(
        SCAN, header=messages.header(scan.stamp_us, "laser"), angle_min=angle_min_rad,
        angle_max=angle_min_rad + step_rad * max(n - 1, 0), angle_increment=step_rad,
        time_increment=0.0, scan_time=0.0, range_min=0.0, range_max=range_max_m, ranges=ranges_m,
        intensities=np.zeros(0, np.float32))


def _transform(messages, scan):
    x_m, y_m, yaw_rad = laser_pose(scan.pose, scan.sensor)
    transform = messages.make(
        "geometry_msgs/msg/Transform", rotation=messages.quaternion(yaw_rad),
        translation=messages.make("geometry_msgs/msg/Vector3", x=x_m, y=y_m, z=0.0))
    each = messages.make("geometry_msgs/msg/TransformStamped", child_frame_id="laser",
                         header=messages.header(scan.stamp_us, "map"), transform=transform)
    return messages.make(TF, transforms=[each])


def write_scans_mcap(path, scans):
    """Write scans as LaserScan on /scan, and the poses of the laser as /tf from map to laser.
    Angles become float32, as the message has them. Sweeps become the nearest even scan."""
    messages = _Messages()

    def rows():
        for scan in scans:
            yield "/tf", TF, scan.stamp_us, _transform(messages, scan)
            yield "/scan", SCAN, scan.stamp_us, _laser_scan(messages, scan)
    _write(path, messages, rows())

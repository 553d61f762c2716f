"""ROS 1 and ROS 2 bags by rosbags, and MCAP files by mcap."""
import contextlib
import math
import pathlib

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from .._core import Sensor
from ..scan import Scan
from .poses import FrameTree, PoseTrack, is_rotation, yaw_of
from .recording import FileError, Recording, Row, choose

SCANS = {"sensor_msgs/msg/LaserScan", "sensor_msgs/msg/MultiEchoLaserScan"}
POSES = {"nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped",
         "geometry_msgs/msg/PoseWithCovarianceStamped"}
TRANSFORMS = {"tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"}
#: Frames of a map, and of a robot, in the order in which they are looked for.
FIXED_FRAMES = ("map", "odom")
ROBOT_FRAMES = ("base_link", "base_footprint")
#: A laser whose plane is tilted more than this is no planar scanner any more [rad].
TILT_MAX_RAD = math.radians(20.0)
MCAP_MAGIC = b"\x89MCAP0\r\n"


def use_of(message_type):
    """What a message type is used for."""
    return ("scans" if message_type in SCANS else "poses" if message_type in POSES else
            "transforms" if message_type in TRANSFORMS else "")


@contextlib.contextmanager
def _one_line_errors(path, topic="the file"):
    """The readers' own errors, of any type, become FileError: a damaged file raises what it likes
    in them, from AssertionError to errors of the database."""
    try:
        yield
    except FileError:
        raise
    except Exception as error:
        text = " ".join(str(error).split()) or type(error).__name__
        remedy = {".bag": "rosbag reindex", ".mcap": "mcap recover"}.get(
            pathlib.Path(path).suffix, "ros2 bag reindex")
        raise FileError(f"{path}: {topic}: cannot be read ({text}); it is cut or damaged: try "
                        f"{remedy}, or record again") from None


class _Bag:
    """A bag of ROS 1 or ROS 2."""

    def __init__(self, path, stack):
        store = get_typestore(Stores.ROS2_HUMBLE)
        self._reader = stack.enter_context(AnyReader([pathlib.Path(path)],
                                                     default_typestore=store))

    def rows(self):
        return [Row(name, info.msgtype or "several types", info.msgcount, use_of(info.msgtype))
                for name, info in self._reader.topics.items()]

    def messages(self, topics):
        wanted = [c for c in self._reader.connections if c.topic in topics]
        for connection, _, raw in self._reader.messages(connections=wanted) if wanted else ():
            yield (connection.topic, connection.msgtype,
                   self._reader.deserialize(raw, connection.msgtype))


class _Mcap:
    """One MCAP file, of ROS 1 or ROS 2 messages."""

    def __init__(self, path, stack):
        from mcap.reader import make_reader  # only who reads such a file waits for its import
        self._file = stack.enter_context(open(path, "rb"))
        self._reader = make_reader(self._file)
        self._stores = {}

    def rows(self):
        summary = self._reader.get_summary()
        if summary is None:
            raise ValueError("the file has no summary at its end")
        counts = summary.statistics.channel_message_counts if summary.statistics else {}
        rows = {}
        for i, channel in summary.channels.items():
            kind = _type_name(summary.schemas[channel.schema_id].name
                              if channel.schema_id in summary.schemas else "")
            row = rows.setdefault(channel.topic, Row(channel.topic, kind, 0, use_of(kind)))
            row.n_messages += counts.get(i, 0)
        return list(rows.values())

    def messages(self, topics):
        for schema, channel, message in self._reader.iter_messages(topics=list(topics)):
            kind = _type_name(schema.name)
            yield channel.topic, kind, self._decode(schema, channel, kind, message.data)

    def _decode(self, schema, channel, kind, data):
        if schema.id not in self._stores:
            store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(schema.data.decode(), kind))
            self._stores[schema.id] = store
        store = self._stores[schema.id]
        if channel.message_encoding == "ros1":
            return store.deserialize_ros1(data, kind)
        return store.deserialize_cdr(data, kind)


def _type_name(name):
    """sensor_msgs/LaserScan of ROS 1 as rosbags calls it."""
    package, _, kind = name.partition("/")
    return name if not kind or "/" in kind else f"{package}/msg/{kind}"


@contextlib.contextmanager
def opened(path):
    """The topics and messages of a file."""
    with contextlib.ExitStack() as stack:
        with _one_line_errors(path):
            is_mcap = pathlib.Path(path).is_file() and pathlib.Path(path).suffix != ".bag"
            bag = (_Mcap if is_mcap else _Bag)(path, stack)
        yield bag


def contents(path):
    """Rows of the topics."""
    with opened(path) as bag, _one_line_errors(path):
        return bag.rows()


def _stamp_us(header):
    return header.stamp.sec * 1_000_000 + header.stamp.nanosec // 1000


def _frame(name):
    return name.lstrip("/")


class _Drive:
    """Scan messages, poses and transforms of a bag."""

    def __init__(self, recording):
        self.recording = recording
        self.scans = []
        self.track = PoseTrack()
        self.tree = FrameTree()
        self.robot_frame = ""

    def take(self, kind, message, is_static):
        if kind in SCANS:
            self.scans.append(message)
        elif kind in TRANSFORMS:
            for each in message.transforms:
                self._take_transform(each, is_static)
        else:
            self._take_pose(kind, message)

    def _take_transform(self, each, is_static):
        t, q = each.transform.translation, each.transform.rotation
        if not is_rotation(q.w, q.x, q.y, q.z):
            self.recording.drop("transforms whose quaternion is not of unit length")
            return
        self.tree.add(_frame(each.header.frame_id), _frame(each.child_frame_id),
                      _stamp_us(each.header), ((t.x, t.y, t.z), (q.w, q.x, q.y, q.z)), is_static)

    def _take_pose(self, kind, message):
        pose = message.pose if kind == "geometry_msgs/msg/PoseStamped" else message.pose.pose
        p, q = pose.position, pose.orientation
        if not is_rotation(q.w, q.x, q.y, q.z):
            self.recording.drop("poses whose quaternion is not of unit length")
            return
        self.track.push(_stamp_us(message.header), p.x, p.y, yaw_of(q.w, q.x, q.y, q.z))
        self.robot_frame = _frame(getattr(message, "child_frame_id", ""))


def _planar(transform):
    """(x, y, yaw, is_upside_down, tilt) of a transform of a laser."""
    (x_m, y_m, _), (w, x, y, z) = transform
    up = 1.0 - 2.0 * (x * x + y * y)  # the laser's z axis along the map's
    return x_m, y_m, yaw_of(w, x, y, z), up < 0.0, math.acos(min(1.0, abs(up)))


class _Placing:
    """Finds the pose of each scan: by tf, or by a topic of poses."""

    def __init__(self, path, drive, options, pose_topic):
        self._drive, self._options = drive, options
        self._sensors = {}
        self._path = None if pose_topic else self._tf_path(path)
        self._mount = (0.0, 0.0, 0.0, False)
        if pose_topic:
            self._find_mount(drive)

    def _tf_path(self, path):
        tree, frame = self._drive.tree, _frame(self._drive.scans[0].header.frame_id)
        wanted = self._options.fixed_frame
        for fixed in (wanted,) if wanted else FIXED_FRAMES:
            found = tree.path(fixed, frame)
            if found is not None:
                self._drive.recording.notes.append(
                    f"poses by tf: {' <- '.join([fixed, *reversed(found)])}")
                return found
        known = ", ".join(sorted(tree.frames())) or "none"
        raise FileError(
            f"{path}: /tf: no transform from {wanted or ' or '.join(FIXED_FRAMES)} to the scans' "
            f"frame {frame} (frames: {known}); give the frame with --fixed-frame, or a topic of "
            "poses with --pose")

    def _find_mount(self, drive):
        frame = _frame(drive.scans[0].header.frame_id)
        for robot in (drive.robot_frame, *ROBOT_FRAMES):
            found = drive.tree.path(robot, frame) if robot else None
            if found is not None:
                transform, _ = drive.tree.at(found, 0, self._options.gap_max_us)
                if transform is not None:
                    self._mount = _planar(transform)[:4]
                    return
        drive.recording.notes.append(
            f"no transform from the robot to {frame}: the laser is taken to be at its centre")

    def scan_of(self, message):
        """(Scan, ""), or (None, cause)."""
        stamp_us = _stamp_us(message.header)
        ranges_m = self._ranges(message)
        last_us = stamp_us
        if self._options.is_sweep:
            last_us += int(round(1e6 * message.time_increment * max(len(ranges_m) - 1, 0)))
        first, cause = self._pose_at(stamp_us)
        last, late_cause = (first, cause) if last_us == stamp_us else self._pose_at(last_us)
        if first is None or last is None:
            return None, f"scans {cause or late_cause}"
        sensor = self._sensor(message, first[3])
        scan = Scan(stamp_us, ranges_m, message.angle_min, message.angle_increment, first[:3],
                    sensor)
        return (_swept(scan, last[:3]) if self._options.is_sweep else scan), ""

    def _ranges(self, message):
        if not hasattr(message.ranges[0] if len(message.ranges) else None, "echoes"):
            return np.asarray(message.ranges, np.float32)
        i = 0 if self._options.echo == "first" else -1
        return np.array([each.echoes[i] if len(each.echoes) else np.nan
                         for each in message.ranges], np.float32)

    def _pose_at(self, stamp_us):
        """((x, y, yaw, is_upside_down), "") or (None, cause)."""
        if self._path is None:
            poses, cause = self._drive.track.at(stamp_us, self._options.gap_max_us)
            return (None, cause) if poses is None else ((*poses[0].tolist(), self._mount[3]), "")
        transform, cause = self._drive.tree.at(self._path, stamp_us, self._options.gap_max_us)
        if transform is None:
            return None, cause
        *pose, tilt_rad = _planar(transform)
        if tilt_rad > TILT_MAX_RAD:
            return None, "of a laser that is tilted by more than 20 degrees"
        return tuple(pose), ""

    def _sensor(self, message, is_upside_down):
        options = self._options
        low_m = message.range_min if options.range_min_m is None else options.range_min_m
        high_m = message.range_max if options.range_max_m is None else options.range_max_m
        key = (low_m, high_m, is_upside_down)
        if key not in self._sensors:
            x_m, y_m, yaw_rad = self._mount[:3] if self._path is None else (0.0, 0.0, 0.0)
            self._sensors[key] = Sensor(
                x_m, y_m, yaw_rad, range_min_m=low_m, range_max_m=high_m,
                upside_down=is_upside_down, zero_is_no_return=options.zero_is_no_return)
        return self._sensors[key]


def _swept(scan, last):
    """A sweep whose beams have poses between the first one's and the last one's."""
    n = len(scan.ranges_m)
    part = np.linspace(0.0, 1.0, n)[:, None] if n else np.zeros((0, 1))
    first = np.array(scan.pose)
    step = np.array(last) - first
    step[2] = math.remainder(step[2], 2.0 * math.pi)
    return Scan(scan.stamp_us, scan.ranges_m, scan.angle_min_rad, scan.angle_step_rad, scan.pose,
                scan.sensor, None, scan.bearings().astype(np.float32), first + part * step)


def _pose_topic(path, options, rows):
    """The topic of poses; None: tf."""
    found = {row.name for row in rows if row.use == "poses"}
    has_tf = any(row.use == "transforms" for row in rows)
    if options.pose is None and (options.fixed_frame or has_tf and not found):
        return None
    if options.pose is None and has_tf:
        return None
    if options.pose is None and not found:
        raise FileError(f"{path}: neither /tf nor a topic of poses (Odometry, PoseStamped); "
                        "record one of them with the scans")
    return choose(path, options.pose, found, "poses", "--pose")


def read(path, options):
    """Recording of a bag or an MCAP file."""
    recording = Recording()
    drive = _Drive(recording)
    with opened(path) as bag:
        with _one_line_errors(path):
            rows = bag.rows()
        topic = choose(path, options.scan, {row.name for row in rows if row.use == "scans"},
                       "scans", "--scan")
        pose_topic = _pose_topic(path, options, rows)
        tf = {row.name for row in rows if row.use == "transforms"}
        wanted = {topic, *tf} | ({pose_topic} if pose_topic else set())
        with _one_line_errors(path, topic):
            n_left = sum(row.n_messages for row in rows if row.name in wanted)
            for name, kind, message in bag.messages(wanted):
                drive.take(kind, message, is_static="static" in name)
                n_left -= 1
            if n_left > 0:
                recording.n_dropped["messages of the file's own list that are not in it"] = n_left
    if not drive.scans:
        raise FileError(f"{path}: {topic}: no message of this topic is in the file; record again")
    placing = _Placing(path, drive, options, pose_topic)
    for message in drive.scans:
        scan, cause = placing.scan_of(message)
        if scan is None:
            recording.drop(cause)
        else:
            recording.scans.append(scan)
    return recording.finish(path, topic)

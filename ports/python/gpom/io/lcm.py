"""LCM event logs of every message that gpomd takes."""
import dataclasses
import gzip
import struct
import zlib

import numpy as np

from .._core import Sensor
from ..scan import Scan
from .poses import PoseTrack, is_rotation, yaw_of
from .recording import FileError, Recording, Row, choose

MAGIC = 0xEDA1DA01
_HEAD = struct.Struct(">IqqII")  # magic, number, time, bytes of the channel's name, of the message

#: Fingerprints, the first 8 bytes of a message (lcmtypes/ has the types).
TYPES = {0x1543F68F9B5F9666: "gpom.scan_t", 0xE3D17423180B5E8D: "bot_core.planar_lidar_t",
         0x89DC5B879A5056CF: "mbot_lcm_msgs.lidar_t", 0x2E16EFB052B0105E: "bot_core.pose_t",
         0x1F317AF1246276AC: "mbot_lcm_msgs.pose2D_t", 0x428375DAA5A20B5C: "gpom.map_t",
         0xDBECC97130AF3FA6: "gpom.query_t", 0xEFC9F7A58845FAC3: "gpom.answer_t",
         0x9C14D72B736BF503: "gpom.status_t", 0xD5447E494A66CC92: "mbot_lcm_msgs.occupancy_grid_t"}
SCANS = {"gpom.scan_t", "bot_core.planar_lidar_t", "mbot_lcm_msgs.lidar_t"}
POSES = {"bot_core.pose_t", "mbot_lcm_msgs.pose2D_t"}
RANGES_MAX = 65536


@dataclasses.dataclass
class LcmSensor:
    """A sensor as gpomd.toml has it."""
    sensor: Sensor
    latency_us: int = 0
    is_far_ignored: bool = False  # a reading at or beyond range_max_m failed


def use_of(message_type):
    """What a message type is used for."""
    return "scans" if message_type in SCANS else "poses" if message_type in POSES else ""


def is_log(head):
    """True if a file begins like an event log."""
    return len(head) >= 4 and int.from_bytes(head[:4], "big") == MAGIC


def events(path):
    """(channel, message) of each event. A log that is cut in its last event is read up to there, as
    a logger that was killed leaves it; the last item is then (None, bytes that are left)."""
    with open(path, "rb") as file:
        is_packed = file.read(2) == b"\x1f\x8b"
    with (gzip.open if is_packed else open)(path, "rb") as file:
        n_read = 0
        try:
            while head := file.read(_HEAD.size):
                if len(head) < _HEAD.size:
                    yield None, head
                    return
                magic, _, _, n_channel, n_message = _HEAD.unpack(head)
                if magic != MAGIC:
                    raise FileError(f"{path}: damaged after its first {n_read} bytes: no event "
                                    "begins there; cut the file there, or record again")
                body = file.read(n_channel + n_message)
                if len(body) < n_channel + n_message:
                    yield None, body
                    return
                n_read += len(head) + len(body)
                yield body[:n_channel].decode(errors="replace"), body[n_channel:]
        except (EOFError, zlib.error, gzip.BadGzipFile):
            yield None, b""


def type_of(message):
    """Name of a message's type; empty: not known."""
    return TYPES.get(int.from_bytes(message[:8], "big"), "") if len(message) >= 8 else ""


def contents(path):
    """Rows of the channels. A channel with several types has a row for each."""
    rows = {}
    for channel, message in events(path):
        if channel is None:
            continue
        kind = type_of(message)
        row = rows.setdefault((channel, kind), Row(channel, kind or "not known", 0, use_of(kind)))
        row.n_messages += 1
    return list(rows.values())


class _Bytes:
    """Reads a message from its front. Raises struct.error where it is too short."""

    def __init__(self, message):
        self._bytes, self._at = message, 8

    def get(self, layout):
        values = struct.unpack_from(">" + layout, self._bytes, self._at)
        self._at += struct.calcsize(">" + layout)
        return values if len(values) > 1 else values[0]

    def array(self, dtype, n):
        if not 0 <= n <= RANGES_MAX:
            raise struct.error("a count that is out of range")
        dtype = np.dtype(dtype)
        if len(self._bytes) < self._at + n * dtype.itemsize:
            raise struct.error("the message is too short")
        values = np.frombuffer(self._bytes, dtype, n, self._at)
        self._at += n * dtype.itemsize
        return values.astype(dtype.newbyteorder("="))

    def is_at_end(self, n_left=0):
        return self._at == len(self._bytes) - n_left


def _decode_scan(kind, message):
    """Fields of a scan: stamp_us, ranges, and what this type has beside them."""
    data = _Bytes(message)
    fields = {"stamp_us": data.get("q")}
    if kind == "gpom.scan_t":
        _, fields["sensor_id"] = data.get("ih")
        fields["pose"] = data.get("3d")
        cov = data.array(">f4", 9)
        fields["cov"] = cov.reshape(3, 3) if cov.any() else None
        fields["angle_min_rad"], fields["angle_step_rad"] = data.get("2d")
        fields["ranges_m"] = data.array(">f4", data.get("i"))
        if not data.is_at_end(4) or data.get("I") != zlib.crc32(message[:-4]):
            raise struct.error("a wrong length or CRC")
        return fields
    n = data.get("i")
    fields["ranges_m"] = data.array(">f4", n)
    if kind == "bot_core.planar_lidar_t":
        data.array(">f4", data.get("i"))
        fields["angle_min_rad"], fields["angle_step_rad"] = data.get("2f")
    else:
        fields["bearings_rad"] = data.array(">f4", n)
        fields["stamps_us"] = data.array(">i8", n)
        data.array(">f4", n)
    if not data.is_at_end():
        raise struct.error("a wrong length")
    return fields


def _take_pose(track, kind, message, recording):
    data = _Bytes(message)
    if kind == "mbot_lcm_msgs.pose2D_t":
        stamp_us, x_m, y_m, yaw_rad = data.get("q3f")
    else:
        stamp_us, x_m, y_m = data.get("q2d")
        data.get("d3d")
        quaternion = data.get("4d")
        if not is_rotation(*quaternion):
            recording.drop("poses whose quaternion is not of unit length")
            return
        yaw_rad = yaw_of(*quaternion)
    track.push(stamp_us, x_m, y_m, yaw_rad)


class _Reader:
    def __init__(self, path, options):
        self.path, self.options = path, options
        self.recording = Recording()
        self.scans = []  # (kind, channel, fields)
        self.track = PoseTrack()
        default = LcmSensor(Sensor(
            range_min_m=0.02 if options.range_min_m is None else options.range_min_m,
            range_max_m=30.0 if options.range_max_m is None else options.range_max_m,
            zero_is_no_return=options.zero_is_no_return))
        self._sensor_of = lambda channel, i: (
            default if options.sensors is None else options.sensors.get((channel, i)) or
            options.sensors.get((channel, None)))

    def channels(self):
        """(channels of scans, channel of poses or None)."""
        rows = contents(self.path)
        scans = {row.name for row in rows if row.use == "scans"}
        if self.options.sensors is not None:
            scans &= {channel for channel, _ in self.options.sensors}
        if self.options.scan is not None or not scans:
            scans = {choose(self.path, self.options.scan, scans, "scans", "--scan")}
        needs_pose = {row.name for row in rows if row.use == "scans" and
                      row.type != "gpom.scan_t" and row.name in scans}
        poses = {row.name for row in rows if row.use == "poses"}
        if not needs_pose:
            return scans, None
        if not poses:
            raise FileError(f"{self.path}: {min(needs_pose)}: its scans need poses and the log has "
                            "none (bot_core.pose_t, mbot_lcm_msgs.pose2D_t); record them, too")
        return scans, choose(self.path, self.options.pose, poses, "poses", "--pose")

    def take(self, channel, message, scan_channels, pose_channel):
        kind = type_of(message)
        is_scan = channel in scan_channels
        if not is_scan and channel != pose_channel:
            return
        if kind not in (SCANS if is_scan else POSES):
            self.recording.drop(f"messages of another type ({kind or 'not known'})")
            return
        try:
            if is_scan:
                self.scans.append((kind, channel, _decode_scan(kind, message)))
            else:
                _take_pose(self.track, kind, message, self.recording)
        except struct.error as error:
            self.recording.drop(f"malformed messages of {channel}: {error}")

    def place(self, kind, channel, fields):
        """Add a scan, or count why not."""
        setting = self._sensor_of(channel, fields.get("sensor_id"))
        if setting is None:
            self.recording.drop(f"scans of a sensor_id that [[sensor]] does not have: "
                                f"{fields.get('sensor_id')}")
            return
        ranges_m = fields["ranges_m"]
        if setting.is_far_ignored:
            ranges_m = np.where(ranges_m >= np.float32(setting.sensor.range_max_m), np.nan,
                                ranges_m).astype(np.float32)
        stamp_us = fields["stamp_us"] - setting.latency_us
        pose, poses = fields.get("pose"), None
        if pose is None:
            beams_us = fields.get("stamps_us", np.zeros(0, np.int64)) - setting.latency_us
            found, cause = self.track.at([stamp_us, *beams_us], self.options.gap_max_us)
            if found is None:
                self.recording.drop(f"scans {cause}")
                return
            pose, poses = tuple(found[0].tolist()), found[1:] if len(beams_us) else None
        self.recording.scans.append(Scan(
            stamp_us, ranges_m, fields.get("angle_min_rad", 0.0), fields.get("angle_step_rad", 0.0),
            pose, setting.sensor, fields.get("cov"), fields.get("bearings_rad"), poses))


def read(path, options):
    """Recording of an event log."""
    reader = _Reader(path, options)
    scan_channels, pose_channel = reader.channels()
    for channel, message in events(path):
        if channel is None:
            reader.recording.notes.append("the log is cut in its last event, which is left out")
        else:
            reader.take(channel, message, scan_channels, pose_channel)
    for scan in reader.scans:
        reader.place(*scan)
    return reader.recording.finish(path, ", ".join(sorted(scan_channels)))

"""gpomd on a CAN bus of the kernel's own (vcan), in a network of its own, with independent peers:
python-can and cantools on the bus, liblcm beside it.

Where the kernel has no vcan, tests/run.py runs these in a guest (tests/can/guest.py).
"""
import contextlib
import ctypes
import importlib.util
import math
import os
import pathlib
import socket
import subprocess
import sys
import time

import can
import cantools
import pytest
from cantools.database.namedsignalvalue import NamedSignalValue

ROOT = pathlib.Path(__file__).resolve().parents[2]


def module_at(name, path):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


peers = module_at("lcm_peers", ROOT / "tests" / "linux" / "conftest.py")
from gpom_watch import Watch  # noqa: E402  the path is lcm_peers'

peer, start = peers.peer, peers.start  # fixtures
DBC = cantools.database.load_file(ROOT / "ports" / "can" / "gpom.dbc")
PATIENCE_S = peers.PATIENCE_S
N_BEAMS = 61

# What a vehicle sends: speed and yaw rate, protected, Intel and Motorola in one frame.
SENDER = cantools.database.load_string("""VERSION ""
NS_ :
BS_:
BU_: Car
BO_ 416 Motion: 8 Car
 SG_ Crc : 0|8@1+ (1,0) [0|255] "" Car
 SG_ Alive : 8|4@1+ (1,0) [0|14] "" Car
 SG_ Speed : 16|16@1- (0.01,0) [-327|327] "m/s" Car
 SG_ YawRate : 39|16@0- (0.001,0) [-32|32] "rad/s" Car
""", "dbc")
MOTION = SENDER.get_message_by_name("Motion")
DATA_ID = 0x1234
ODOMETRY = """
[can]
interface = "vcan0"
{can}
[can.odometry]
speed = {{ id = 0x1A0, start = 16, length = 16, signed = true, factor = 0.01 }}
yaw_rate = {{ id = 416, start = 39, length = 16, order = "motorola", signed = true, factor = 1e-3 }}
timeout_s = {timeout_s}
carry_s = 60.0
[[can.odometry.message]]
id = 0x1A0
bytes = 8
crc = "j1850"
crc_byte = 0
data_id = 0x1234
counter = {{ start = 8, length = 4, max = 14 }}
[can.publish]
{publish}
[pose]
type = "bot_core.pose_t"
wait_max_s = {wait_max_s}
sd = [0.05, 0.05, 0.01]
"""
SENSOR = '[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 34.0'


def crc8(data):
    """CRC-8 SAE-J1850, bit by bit."""
    rest = 0xFF
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = (rest << 1 ^ 0x1D if rest & 0x80 else rest << 1) & 0xFF
    return rest ^ 0xFF


def motion(alive, speed=0.0, yaw_rate=0.0):
    """Bytes of a frame of the vehicle's."""
    data = MOTION.encode({"Crc": 0, "Alive": alive % 15, "Speed": speed, "YawRate": yaw_rate})
    return bytes([crc8(DATA_ID.to_bytes(2, "little") + data[1:])]) + data[1:]


def link(*words):
    subprocess.run(["ip", "link", *words], check=True)


def add_vcan(mtu=72):
    link("add", "vcan0", "type", "vcan")
    link("set", "vcan0", "mtu", str(mtu), "up")


@pytest.fixture(autouse=True)
def network():
    before, libc = peers.own_network()
    try:
        link("set", "lo", "up")
        subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)
        if subprocess.run(["ip", "link", "add", "vcan0", "type", "vcan"], check=False,
                          capture_output=True).returncode != 0:
            pytest.skip("this kernel has no vcan: make test-can runs these in a guest")
        link("set", "vcan0", "mtu", "72", "up")
        yield
    finally:
        assert libc.setns(before, peers.CLONE_NEWNET) == 0
        os.close(before)


def decoded(identifier, data):
    """Fields of a message of gpomd's: numbers, or words where the DBC has one."""
    fields = DBC.decode_message(identifier, bytes(data))
    return {name: str(value) if isinstance(value, NamedSignalValue) else value
            for name, value in fields.items()}


SO_RCVBUFFORCE = 33  # beyond the system's limit, for root


class Bus:
    """The other end: python-can, with room for a minute of frames that are not read yet."""

    def __init__(self):
        self.bus = can.Bus(interface="socketcan", channel="vcan0", fd=True)
        with contextlib.suppress(PermissionError):
            self.bus.socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, 4 << 20)
        self.alive = 0

    def send(self, data, identifier=0x1A0, **more):
        more.setdefault("is_extended_id", False)
        self.bus.send(can.Message(arbitration_id=identifier, data=data, **more))

    def drive(self, speed=0.0, yaw_rate=0.0, n=1):
        for _ in range(n):
            self.send(motion(self.alive, speed, yaw_rate))
            self.alive += 1

    def error(self, error_class):
        self.bus.send(can.Message(arbitration_id=error_class, is_error_frame=True,
                                  is_extended_id=False, data=bytes(8)))

    def take(self, name, n, seconds=PATIENCE_S):
        """The next n frames of gpomd with a name; fewer if they do not come in time."""
        identifier = DBC.get_message_by_name(name).frame_id
        deadline = time.monotonic() + seconds
        frames = []
        while len(frames) < n and time.monotonic() < deadline:
            frame = self.bus.recv(0.2)
            if frame is not None and frame.arbitration_id == identifier:
                frames.append(frame)
        return frames

    def next(self, name, holds=lambda fields: True, seconds=PATIENCE_S):
        """The next message of gpomd with a name for which something holds; its fields."""
        deadline = time.monotonic() + seconds
        last = None
        while frames := self.take(name, 1, deadline - time.monotonic()):
            last = decoded(frames[0].arbitration_id, frames[0].data)
            if holds(last):
                return last
        raise AssertionError(f"no such {name}; the last: {last}")

    def frames_so_far(self):
        """Those that came before now, and perhaps one more: on a slow machine they may come faster
        than they are read."""
        now_s = time.time()
        while (frame := self.bus.recv(0)) is not None:
            yield frame
            if frame.timestamp > now_s:
                break

    def flush(self):
        for _ in self.frames_so_far():
            pass


@pytest.fixture
def bus(network):
    bus = Bus()
    yield bus
    bus.bus.shutdown()


@pytest.fixture
def watch(network):
    watch = Watch(peers.URL)
    yield watch


@pytest.fixture(scope="session")
def library():
    """The C code of ports/can."""
    return ctypes.CDLL(str(peers.BUILD / "libgpom_can.so"))


def now_us():
    return int(time.time() * 1e6)


def can_text(publish="", extra="", timeout_s=10.0, wait_max_s=60.0):
    """Times that no slow machine exceeds, unless a test is about them."""
    return ODOMETRY.format(can=extra, publish=publish, timeout_s=timeout_s, wait_max_s=wait_max_s)


class World:
    """A sensor in the middle of a round wall, over LCM."""

    def __init__(self, peer, watch):
        self.peer, self.watch = peer, watch
        self.poses = {}
        watch.bus.subscribe("GPOM_MAP", lambda _, data: self.note(
            peer.type("gpom.map_t").decode(data)))

    def note(self, tile):
        self.poses.setdefault(tile.utime, list(tile.pose))

    def scan(self, stamp_us=None, range_m=8.0):
        """Send a scan; its stamp."""
        stamp_us = stamp_us or now_us()
        self.watch.bus.publish("LIDAR", self.peer(
            "bot_core.planar_lidar_t", utime=stamp_us, nranges=N_BEAMS, ranges=[range_m] * N_BEAMS,
            rad0=-math.pi, radstep=2 * math.pi / N_BEAMS).encode())
        return stamp_us

    def pose_at(self, stamp_us):
        """The robot's pose in the first tile with the stamp of a scan."""
        assert self.watch.collect(PATIENCE_S, lambda: stamp_us in self.poses), (
            self.poses, self.watch.status["counts"])
        return self.poses[stamp_us]

    def pose(self, x_m=20.0, y_m=80.0, yaw_rad=0.0, stamp_us=None):
        self.watch.bus.publish("POSE", self.peer(
            "bot_core.pose_t", utime=stamp_us or now_us(), pos=[x_m, y_m, 0.0],
            orientation=[math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)]).encode())


@pytest.fixture
def world(peer, watch):
    return World(peer, watch)


def counts_of(watch):
    """Counters of a status that was sent from now on."""
    return peers.fresh_status(watch)["counts"]


def rise(watch, before):
    """What rose since, of CAN."""
    return {name: n - before[name] for name, n in watch.status["counts"].items()
            if name.startswith("can") and name != "can_sent" and n != before[name]}


def wait_for_rise(watch, before, **expected):
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before) == expected), (
        expected, rise(watch, before))

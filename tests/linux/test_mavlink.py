"""gpomd and an autopilot: what pymavlink reads must be what the map says, or no reading."""
import contextlib
import math
import os
import random
import socket
import time
import tty

import pytest
from conftest import (PATIENCE_S, URL, encoded, fresh_status, replay, scan, wait_for_status,
                      wait_until)
from gpom_watch import Watch
from pymavlink.dialects.v20 import common as mavlink
from sectors_oracle import NO_READING, World, allowed_distances, clockwise_from_forward

PORT = 14550
RANGE_M, RADIUS_M = 20.0, 0.4
CELL_M, CORNER_M, N_CELLS = 0.25, (5.0, 65.0), 120  # 30 m about the robot
RASTER = f"cell_m = {CELL_M}\nnx = {N_CELLS}\nny = {N_CELLS}\ncorner = [5.0, 65.0]"
FOREVER = f"stale_s = {20 * PATIENCE_S}"
POSE = [20.1234, 80.2345, 0.3]
MAPPING, STALE, STARTING, STOPPING = 4, 5, 1, 7  # MAV_STATE


def now_us():
    return int(1e6 * time.time())


def mavlink_text(**values):
    values = {"rate_hz": 20.0, "range_m": RANGE_M, "radius_m": RADIUS_M, **values}
    return "[mavlink]\n" + "".join(f"{key} = {value!r}\n".replace("'", '"')
                                   for key, value in values.items())


class Autopilot:
    """Takes bytes with pymavlink's parser, which refuses any that are no message."""

    def __init__(self):
        self.parser = mavlink.MAVLink(None)
        self.last = {}

    def take(self, data):
        messages = self.parser.parse_buffer(data) or []
        for message in messages:
            self.last[message.get_type()] = message
        return messages

    def next(self, kind, holds=lambda message: True, seconds=PATIENCE_S):
        """The next message of a kind for which something holds."""
        end = time.monotonic() + seconds
        last = None
        while time.monotonic() < end:
            for message in self.take(self.receive()):
                if message.get_type() == kind:
                    last = message
                    if holds(message):
                        return message
        raise AssertionError(f"no such {kind}; the last: {last}")

    def obstacles(self, holds=lambda message: True):
        return self.next("OBSTACLE_DISTANCE", holds)

    def state(self, state):
        return self.next("HEARTBEAT", lambda message: message.system_status == state)


class UdpAutopilot(Autopilot):
    def __init__(self, port=PORT):
        super().__init__()
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.settimeout(0.2)

    def receive(self):
        try:
            return self.socket.recv(2048)
        except TimeoutError:
            return b""

    def flush(self):
        self.socket.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while True:
                self.socket.recv(2048)
        self.socket.settimeout(0.2)


class SerialAutopilot(Autopilot):
    """The other end of a serial line, which is at a path that stays."""

    def __init__(self, path):
        super().__init__()
        self.path = path
        self.plug_in()

    def plug_in(self):
        self.end, line = os.openpty()
        tty.setraw(line)
        with contextlib.suppress(FileNotFoundError):
            self.path.unlink()
        self.path.symlink_to(os.ttyname(line))
        os.close(line)
        os.set_blocking(self.end, False)

    def unplug(self):
        os.close(self.end)

    def receive(self):
        try:
            return os.read(self.end, 4096)
        except (BlockingIOError, OSError):  # OSError: gpomd has not opened its end
            time.sleep(0.02)
            return b""


@pytest.fixture
def autopilot(network):
    return UdpAutopilot()


def room(i):
    """Ranges of a scan all around in a room with corners, and a pillar."""
    return [min(abs(6.0 / math.cos(a)) if abs(math.cos(a)) > 1e-9 else 99.0,
                abs(4.0 / math.sin(a)) if abs(math.sin(a)) > 1e-9 else 99.0,
                2.5 if abs(a - 0.8) < 0.15 else 99.0)
            for a in (-math.pi + 2 * math.pi * k / 361 + 0.001 * i for k in range(361))]


def room_scan(peer, i, stamp_us=None, **fields):
    fields = {"utime": stamp_us or now_us(), "pose": POSE, "angle_min": -math.pi,
              "angle_step": 2 * math.pi / 361, "n_ranges": 361, "ranges": room(i), **fields}
    return encoded(scan(peer, i, **fields))


def in_room(start, watch, peer, text, publish=FOREVER):
    """A daemon that has mapped the room."""
    daemon = start(raster=RASTER, rest=text, publish=publish)
    for i in range(5):
        watch.bus.publish("GPOM_SCAN", room_scan(peer, i))
    wait_for_status(watch, scans_inserted=5)
    return daemon


# ---- the map ------------------------------------------------------------------------------------

@pytest.mark.parametrize("n", [72, 36])
def test_every_distance_is_that_of_the_map(start, peer, n):
    """Read by pymavlink's own UDP peer, and compared with a brute force of the cells that gpomd
    publishes: exactly, but for the rounding that gpom_sectors() documents."""
    from pymavlink import mavutil
    connection = mavutil.mavlink_connection(f"udpin:127.0.0.1:{PORT}", dialect="common")
    watch = Watch(URL)
    in_room(start, watch, peer, mavlink_text(sectors=n, system_id=7, sensor="radar"))
    wait_until(watch, lambda: fresh_status(watch)["n_cells_dirty"] == 0)
    watch.request_keyframe()
    wait_until(watch, lambda: watch.map.tile is not None and watch.map.is_whole)
    pose = list(watch.map.tile.pose)
    assert pose == pytest.approx(POSE)
    world = World(watch.map.classes(), CORNER_M, CELL_M, RANGE_M, RADIUS_M)
    wanted = allowed_distances(world, pose, n)
    while connection.recv_match(blocking=False) is not None:  # those of the map before
        pass
    message = connection.recv_match(type="OBSTACLE_DISTANCE", blocking=True, timeout=PATIENCE_S)
    values = clockwise_from_forward(message, n)
    assert [(v, w) for v, w in zip(values, wanted) if v not in w] == []
    known = [v for v in values if v < NO_READING]
    assert len(known) > n / 2 and 200 < min(known) < 260 and max(known) > 500  # pillar, corners
    assert (message.min_distance, message.max_distance) == (1, round(100 * RANGE_M))
    assert message.sensor_type == mavlink.MAV_DISTANCE_SENSOR_RADAR
    assert (message.get_srcSystem(), message.get_srcComponent()) == (7, 196)
    assert message.time_usec == watch.map.tile.stamp_us
    connection.close()


def test_an_obstacle_to_the_left_is_on_the_left(start, peer, autopilot):
    """Ours are counter-clockwise, the message's clockwise: a mirror image would steer into it."""
    watch = Watch(URL)
    start(raster=RASTER, rest=mavlink_text(), publish=FOREVER)
    ranges = [2.0 if 80 <= k <= 100 else 10.0 for k in range(361)]  # about 90 degrees of 0 .. 361
    for i in range(3):
        watch.bus.publish("GPOM_SCAN", room_scan(
            peer, i, angle_min=0.0, angle_step=math.radians(1), ranges=ranges))
    wait_for_status(watch, scans_inserted=3)
    wait_until(watch, lambda: fresh_status(watch)["n_cells_dirty"] == 0)
    autopilot.flush()  # those of the map before
    message = autopilot.obstacles()
    values = clockwise_from_forward(message, 72)
    near = [i for i, d in enumerate(values) if d < 400]
    assert min(values) < 210
    assert all(270 - 15 < 5 * i < 270 + 15 for i in near), near  # clockwise: the left


def test_no_more_messages_come_than_the_rate_says(start, autopilot):
    start(raster=RASTER, rest=mavlink_text(rate_hz=10.0))
    autopilot.obstacles()
    begin = time.monotonic()
    for _ in range(12):
        autopilot.obstacles()
    elapsed = time.monotonic() - begin
    assert 12 <= 10 * elapsed + 2, elapsed
    assert autopilot.last["HEARTBEAT"].type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER


# ---- nothing known is never "clear" --------------------------------------------------------------

def test_before_the_first_scan_no_sector_has_a_reading(start, autopilot):
    start(raster=RASTER, rest=mavlink_text())
    message = autopilot.obstacles()
    assert set(message.distances) == {NO_READING} and message.time_usec == 0
    assert autopilot.state(STARTING).autopilot == mavlink.MAV_AUTOPILOT_INVALID


def test_a_stale_map_gives_no_reading_and_a_fresh_one_readings_again(start, peer, autopilot):
    watch = Watch(URL)
    in_room(start, watch, peer, mavlink_text(), "stale_s = 0.5")
    for _ in range(2):
        end = time.monotonic() + PATIENCE_S
        while True:  # a slow machine may make it stale in between
            assert time.monotonic() < end
            watch.bus.publish("GPOM_SCAN", room_scan(peer, round(1e3 * time.monotonic())))
            autopilot.flush()
            if min(autopilot.obstacles().distances) < NO_READING:
                break
        last_us = now_us()
        stale = autopilot.obstacles(lambda m: min(m.distances) == NO_READING)
        assert stale.time_usec <= last_us
        end = time.monotonic() + 0.3
        while time.monotonic() < end:
            assert set(autopilot.obstacles().distances) == {NO_READING}
        autopilot.state(STALE)


def test_a_lost_pose_gives_no_reading(start, peer, autopilot):
    """Scans go on, poses stop: the map is of a place where the robot no longer is."""
    watch = Watch(URL)
    start(raster=RASTER, sensors='[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 34.0',
          rest='[pose]\ntype = "bot_core.pose_t"\n' + mavlink_text(), publish="stale_s = 0.5")

    def lidar():
        watch.bus.publish("LIDAR", peer(
            "bot_core.planar_lidar_t", utime=now_us(), nranges=361, ranges=room(0),
            rad0=-math.pi, radstep=2 * math.pi / 361).encode())

    def pose():
        watch.bus.publish("POSE", peer(
            "bot_core.pose_t", utime=now_us(), pos=[POSE[0], POSE[1], 0.0],
            orientation=[1.0, 0.0, 0.0, 0.0]).encode())
    end = time.monotonic() + PATIENCE_S
    while min(autopilot.obstacles().distances) == NO_READING:
        assert time.monotonic() < end
        pose()
        lidar()
        pose()
    before = fresh_status(watch)["counts"]["scans_received"]
    while min(autopilot.obstacles().distances) < NO_READING:
        assert time.monotonic() < end
        lidar()
    assert fresh_status(watch)["counts"]["scans_received"] > before


def test_outside_of_the_raster_no_sector_has_a_reading(start, peer, autopilot):
    watch = Watch(URL)
    start(raster=RASTER, rest=mavlink_text(), publish=FOREVER)
    watch.bus.publish("GPOM_SCAN", room_scan(peer, 0, pose=[-300.0, 80.0, 0.0]))
    wait_for_status(watch, scans_inserted=1)
    autopilot.state(MAPPING)
    assert set(autopilot.obstacles().distances) == {NO_READING}


def test_the_last_message_of_a_daemon_that_stops_has_no_reading(start, peer, autopilot):
    daemon = in_room(start, Watch(URL), peer, mavlink_text())
    autopilot.obstacles(lambda m: min(m.distances) < NO_READING)
    assert daemon.stop() == 0
    autopilot.state(STOPPING)
    assert set(autopilot.last["OBSTACLE_DISTANCE"].distances) == {NO_READING}


# ---- the line -----------------------------------------------------------------------------------

def test_over_a_serial_line_every_byte_belongs_to_a_message(start, peer, tmp_path):
    autopilot, watch = SerialAutopilot(tmp_path / "line"), Watch(URL)
    in_room(start, watch, peer, mavlink_text(to=str(tmp_path / "line"), baud=115200))
    autopilot.obstacles(lambda m: min(m.distances) < NO_READING)
    autopilot.state(MAPPING)
    n_before = autopilot.parser.total_receive_errors
    for _ in range(20):
        autopilot.obstacles()
    assert n_before == autopilot.parser.total_receive_errors == 0
    assert fresh_status(watch)["counts"]["mavlink_not_sent"] == 0


def test_a_serial_line_that_is_removed_is_opened_again(start, peer, tmp_path):
    autopilot, watch = SerialAutopilot(tmp_path / "line"), Watch(URL)
    daemon = in_room(start, watch, peer, mavlink_text(to=str(tmp_path / "line")))
    autopilot.obstacles()
    autopilot.unplug()
    wait_until(watch, lambda: watch.status["counts"]["mavlink_not_sent"] > 0)
    autopilot.plug_in()
    autopilot.parser = mavlink.MAVLink(None)
    autopilot.obstacles(lambda m: min(m.distances) < NO_READING)
    assert daemon.stop() == 0
    said = "\n".join(daemon.lines)
    assert said.count("line was removed, or failed") == 1
    assert said.count("line is open: MAVLink messages are sent") == 2
    assert "MAVLink messages not sent" in said


def test_a_line_that_is_not_there_is_named_with_the_reason(start, tmp_path):
    for path, reason in ((tmp_path / "none", "No such file"), ("/dev/null", "is no serial port")):
        daemon = start(rest=mavlink_text(to=str(path)))
        wait_until(watch := Watch(URL), lambda: watch.status is not None
                   and watch.status["counts"]["mavlink_not_sent"] > 0)
        assert daemon.stop() == 0
        said = "\n".join(daemon.lines)
        assert f"{path} cannot be opened; gpomd tries again: {reason}" in said


def test_where_nobody_listens_it_is_told_and_counted_until_somebody_does(start, network):
    watch = Watch(URL)
    daemon = start(rest=mavlink_text(to="udp:127.0.0.1:14999", rate_hz=100.0))
    wait_until(watch, lambda: watch.status is not None
               and watch.status["counts"]["mavlink_not_sent"] > 3)
    assert any(problem.startswith("mavlink:") for problem in watch.status["problems"])
    autopilot = UdpAutopilot(14999)
    for _ in range(60):
        autopilot.obstacles()
    n = fresh_status(watch)["counts"]["mavlink_not_sent"]
    autopilot.obstacles()
    assert fresh_status(watch)["counts"]["mavlink_not_sent"] == n
    assert daemon.stop() == 0
    said = "\n".join(daemon.lines)
    assert "udp:127.0.0.1:14999 refuses MAVLink messages: no program listens there" in said
    assert "udp:127.0.0.1:14999 takes MAVLink messages again" in said


def test_a_line_that_takes_nothing_holds_up_no_scan(start, street, tmp_path):
    """Its other end is open and never read."""
    line = SerialAutopilot(tmp_path / "line")
    watch = Watch(URL)
    daemon = start(rest=mavlink_text(to=str(tmp_path / "line"), rate_hz=100.0))
    wait_until(watch, lambda: watch.status is not None
               and watch.status["counts"]["mavlink_not_sent"] > 20)
    replay(street)
    wait_for_status(watch, scans_inserted=40)
    assert daemon.stop() == 0
    assert "takes fewer MAVLink messages than are sent" in "\n".join(daemon.lines)
    line.unplug()


def test_whatever_comes_back_over_the_line_does_no_harm(start, peer, autopilot, tmp_path):
    """An autopilot sends its own messages; they are not read."""
    chance = random.Random(int(os.environ.get("GPOM_SEED") or 1))
    serial, watch = SerialAutopilot(tmp_path / "line"), Watch(URL)
    in_room(start, watch, peer, mavlink_text(to=str(tmp_path / "line")))
    for _ in range(60):
        with contextlib.suppress(BlockingIOError):
            os.write(serial.end, chance.randbytes(500))
        serial.take(serial.receive())
    serial.obstacles(lambda m: min(m.distances) < NO_READING)
    assert fresh_status(watch)["counts"]["mavlink_not_sent"] == 0

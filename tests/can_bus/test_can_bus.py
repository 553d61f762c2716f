"""gpomd on a real CAN stack: what comes in must be used or counted, what goes out must be true."""
import ctypes
import math
import os
import pathlib
import re
import signal
import subprocess
import threading
import time

import pytest
from conftest import (DBC, PATIENCE_S, ROOT, SENSOR, add_vcan, can_text, counts_of, decoded, link,
                      motion, now_us, peers, rise, wait_for_rise)

CAN_ERR_BUSOFF, CAN_ERR_CRTL, CAN_ERR_RESTARTED = 0x40, 0x04, 0x100
STALE_S = 1.0
N_TILES = 81
STATUS_ID = DBC.get_message_by_name("GPOM_Status").frame_id


def begin(start, publish="", extra="", **parts):
    return start(sensors=SENSOR, rest=can_text(publish, extra), **parts)


def output_of(daemon):
    """All that the daemon has said, after its end."""
    assert daemon.stop() == 0
    return "\n".join(daemon.lines)


# ---- in -----------------------------------------------------------------------------------------

def test_every_fault_of_a_frame_raises_its_counter_alone(start, bus, watch):
    daemon = begin(start)
    counts_of(watch)
    good = motion(0, 1.0)

    def faults(*frames, **expected):
        before = dict(counts_of(watch))
        for frame in frames:
            frame()
            time.sleep(0.002)
        wait_for_rise(watch, before, **expected)
    faults(lambda: bus.drive(1.0), can_received=1)
    faults(lambda: bus.drive(1.0), lambda: bus.drive(-1.0), can_received=2)
    faults(lambda: bus.send(bytes([good[0] ^ 1]) + good[1:]), can_received=1, can_bad_crc=1)
    faults(lambda: bus.send(motion(bus.alive - 1)), can_received=1, can_bad_counter=1)
    faults(lambda: bus.send(motion(bus.alive)[:7]), lambda: bus.send(b""), can_received=2,
           can_bad_length=2)
    bus.alive += 3
    faults(bus.drive, can_received=1, can_lost=3)
    faults(lambda: bus.drive(200.0), can_received=1, can_bad_value=1)
    # what the filters must keep away: remote, extended, other identifiers
    faults(lambda: bus.send(None, is_remote_frame=True, dlc=8),
           lambda: bus.send(good, is_extended_id=True), lambda: bus.send(good, 0x1A1),
           lambda: bus.send(good, 0x5A0), bus.drive, can_received=1)
    faults(lambda: bus.error(CAN_ERR_CRTL), can_errors=1)
    assert "CAN frames with a wrong CRC" in output_of(daemon)


def test_a_daemon_that_says_ready_takes_the_next_frame(start, bus, watch):
    begin(start)
    bus.drive(1.0)
    assert watch.collect(PATIENCE_S, lambda: watch.status is not None and
                         watch.status["counts"]["can_received"] == 1), watch.status
    assert watch.status["counts"]["can_lost"] == 0


def test_bus_off_is_told_with_its_remedy_and_shown_in_the_status(start, bus, watch):
    """vcan has no controller: its error frames are put onto the bus by hand."""
    daemon = begin(start)
    before = dict(counts_of(watch))
    assert bus.next("GPOM_Status")["FaultCan"] == 0
    bus.error(CAN_ERR_BUSOFF)
    wait_for_rise(watch, before, can_errors=1, can_bus_offs=1)
    assert bus.next("GPOM_Status", lambda fields: fields["FaultCan"] == 1)
    time.sleep(1.2)  # longer than a fault is shown: it lasts
    bus.flush()
    assert bus.next("GPOM_Status")["FaultCan"] == 1
    bus.error(CAN_ERR_RESTARTED)
    assert bus.next("GPOM_Status", lambda fields: fields["FaultCan"] == 0)
    said = output_of(daemon)
    assert "bus-off" in said and "restart-ms 100" in said and "was restarted" in said


def test_a_flood_loses_nothing_that_is_not_counted(start, bus, watch):
    """5000 frames as fast as can be, others between them: all received, or counted by the kernel,
    which tells with the next frame."""
    begin(start, extra="receive_bytes = 65536")
    before = dict(counts_of(watch))
    flood = subprocess.Popen(["cangen", "vcan0", "-g", "0", "-n", "20000", "-I", "2F0"])
    frames = [motion(i, 1.0) for i in range(15)]
    for i in range(5000):
        while True:
            try:
                bus.send(frames[i % 15])
                break
            except OSError:
                time.sleep(0.001)
    bus.alive = 5000
    flood.wait(2 * PATIENCE_S)
    for n_sent in range(5001, 5021):  # one tells of those before it, unless it finds no room either
        bus.drive(1.0)
        counts_of(watch)
        rose = rise(watch, before)
        if rose["can_received"] + rose.get("can_overflows", 0) == n_sent:
            break
    assert rose["can_received"] + rose.get("can_overflows", 0) == n_sent, rose
    # by the counter in the frames as many are missing, modulo 15 at each hole
    assert rose.get("can_lost", 0) <= rose.get("can_overflows", 0)
    assert "can_bad_crc" not in rose


def test_a_recorded_candump_log_is_counted_to_the_frame(start, watch):
    """drive.log: 300 frames of the vehicle's recorded by candump, of which 3 have a wrong CRC, 2 a
    frozen counter and 1 is short, 4 are missing; 100 of others; 2 error frames."""
    begin(start)
    before = dict(counts_of(watch))
    log = pathlib.Path(__file__).parent / "drive.log"
    subprocess.run(["canplayer", "-I", str(log), "-g", "1"], check=True, timeout=60)
    wait_for_rise(watch, before, can_received=300, can_bad_crc=3, can_bad_counter=2,
                  can_bad_length=1, can_lost=4 + 3 + 1, can_errors=2)


# ---- odometry -----------------------------------------------------------------------------------

class Wheels:
    """Odometry at a steady rate, from a thread of its own."""

    def __init__(self, bus, speed, yaw_rate):
        self.bus, self.speed, self.yaw_rate = bus, speed, yaw_rate
        self.stopped = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self):
        while not self.stopped.wait(0.02):
            self.bus.drive(self.speed, self.yaw_rate)

    def stop(self):
        self.stopped.set()
        self.thread.join()


def wait_for_frames(watch, n):
    """Until gpomd has received so many more."""
    before = counts_of(watch)["can_received"]
    peers.wait_until(watch, lambda: watch.status["counts"]["can_received"] >= before + n)


@pytest.fixture
def turn_wheels(bus, watch):
    """turn_wheels(speed, yaw rate): odometry, which gpomd hears, until stop() or the test's end."""
    turning = []

    def begin_turning(speed, yaw_rate):
        turning.append(Wheels(bus, speed, yaw_rate))
        wait_for_frames(watch, 10)
        return turning[-1]
    yield begin_turning
    for wheels in turning:
        wheels.stop()


def test_a_pose_is_carried_on_to_scans_that_come_between_poses(start, turn_wheels, watch, world):
    """One pose, then odometry alone, on a circle: the map's pose is on it."""
    begin(start)
    wheels = turn_wheels(2.0, 0.4)
    t0_us = now_us()
    world.pose(20.0, 80.0, 0.3, t0_us)
    for _ in range(15):
        time.sleep(0.1)
        stamp_us = world.scan()
    pose = world.pose_at(stamp_us)
    wheels.stop()
    assert counts_of(watch)["scans_inserted"] == 15
    t = 1e-6 * (stamp_us - t0_us)
    assert t > 1.4
    yaw, r = 0.3 + 0.4 * t, 2.0 / 0.4
    expected = [20.0 + r * (math.sin(yaw) - math.sin(0.3)),
                80.0 - r * (math.cos(yaw) - math.cos(0.3)), yaw]
    assert pose == pytest.approx(expected, abs=0.02)


def test_frames_have_the_kernel_s_time_not_that_of_reading(start, turn_wheels, watch, world):
    """While gpomd stands still frames pile up; read at once, they are a second of odometry."""
    daemon = begin(start)
    wheels = turn_wheels(2.0, 0.0)
    os.kill(daemon.process.pid, signal.SIGSTOP)
    t0_us = now_us()
    world.pose(20.0, 80.0, 0.0, t0_us)
    time.sleep(1.0)
    stamp_us = world.scan()
    time.sleep(0.2)
    os.kill(daemon.process.pid, signal.SIGCONT)
    pose = world.pose_at(stamp_us)
    wheels.stop()
    assert pose[0] == pytest.approx(20.0 + 2e-6 * (stamp_us - t0_us), abs=0.02)
    assert stamp_us - t0_us > 900_000


def test_without_odometry_scans_wait_and_are_counted_and_a_new_pose_helps(
        start, bus, turn_wheels, watch, world):
    start(sensors=SENSOR, rest=can_text(timeout_s=4.0, wait_max_s=8.0))  # both are waited for
    wheels = turn_wheels(1.0, 0.0)
    world.pose()
    time.sleep(0.1)
    world.scan()
    assert watch.collect(PATIENCE_S, lambda: watch.status["counts"]["scans_inserted"] == 1)
    before = dict(counts_of(watch))
    wheels.stop()
    assert watch.collect(PATIENCE_S, lambda: watch.status["counts"]["odometry_gaps"] >
                         before["odometry_gaps"])
    world.scan()
    assert watch.collect(PATIENCE_S, lambda: watch.status["counts"]["scans_no_pose"] == 1), (
        watch.status["counts"])
    assert bus.next("GPOM_Status", lambda fields: fields["FaultPose"] == 1)
    stamp_us = now_us()
    world.pose(stamp_us=stamp_us)  # two poses about a scan need no odometry
    world.scan(stamp_us + 50_000)
    time.sleep(0.1)
    world.pose(stamp_us=stamp_us + 100_000)
    assert watch.collect(PATIENCE_S, lambda: watch.status["counts"]["scans_inserted"] == 2)


def test_wheel_speeds_give_speed_and_yaw_rate(start, bus, watch, world):
    """Right faster than left turns left: 2.2 and 1.8 m/s over 1.0 m are 2.0 m/s and 0.4 rad/s."""
    start(sensors=SENSOR, rest="""
[can]
interface = "vcan0"
[can.odometry]
left = { id = 0x18FF1234, start = 7, length = 12, order = "motorola", factor = 0.01, absent = 4095 }
right = { id = 0x18FF1235, start = 4, length = 12, factor = 0.01, offset = -10.0 }
track_m = 1.0
timeout_s = 10.0
carry_s = 60.0
[pose]
type = "bot_core.pose_t"
wait_max_s = 60.0
""")
    before = dict(counts_of(watch))
    left = (180 << 4).to_bytes(2, "big")  # 1.8 m/s
    right = (1220 << 4).to_bytes(2, "little")  # 2.2 m/s after the offset
    stopped = threading.Event()

    def run():
        while not stopped.wait(0.02):
            bus.send(left, 0x18FF1234, is_extended_id=True)
            bus.send(right, 0x18FF1235, is_extended_id=True)
    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    wait_for_frames(watch, 20)
    t0_us = now_us()
    world.pose(20.0, 80.0, 0.0, t0_us)
    time.sleep(1.0)
    stamp_us = world.scan()
    pose = world.pose_at(stamp_us)
    stopped.set()
    thread.join()
    t = 1e-6 * (stamp_us - t0_us)
    assert pose == pytest.approx(
        [20.0 + 5.0 * math.sin(0.4 * t), 80.0 + 5.0 * (1 - math.cos(0.4 * t)), 0.4 * t], abs=0.03)
    bus.send(b"\xff\xf0", 0x18FF1234, is_extended_id=True)  # no value
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before).get("can_bad_value") == 1)


# ---- out ----------------------------------------------------------------------------------------

def fresh_map(world, watch, n=4):
    """The robot stands at (20, 80), forward is +y, a wall round it at 8 m."""
    for _ in range(n):
        stamp_us = now_us()
        world.pose(yaw_rad=math.pi / 2, stamp_us=stamp_us - 10_000)
        world.pose(yaw_rad=math.pi / 2, stamp_us=stamp_us)
        world.scan(stamp_us - 5_000)
        time.sleep(0.02)
    assert watch.collect(PATIENCE_S, lambda: watch.status is not None and
                         watch.status["counts"]["scans_inserted"] >= n), watch.status


FINE = {"raster": "cell_m = 0.25\nnx = 128\nny = 128\ncorner = [4.0, 64.0]"}


def retry(attempt):
    """Until an attempt has a result."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if result := attempt():
            return result
    raise AssertionError("never")


def keep_fresh(world, watch, holds):
    """Scans and poses until something holds."""
    def attempt():
        fresh_map(world, watch, 1)
        return holds()
    return retry(attempt)


def all_sectors(bus):
    """The sectors of one whole picture, and its state; None if it is not whole: a slow machine may
    lose frames between two parts."""
    parts = [bus.next("GPOM_Clearance", lambda fields: fields["Part"] == 0)]
    parts += [bus.next("GPOM_Clearance") for _ in range(2)]
    alive = [(part["Alive"] - parts[0]["Alive"]) % 15 for part in parts]
    is_whole = [part["Part"] for part in parts] == alive == [0, 1, 2]
    if not is_whole or len({part["Sequence"] for part in parts}) != 1:
        return None
    return [part[f"Distance{k:02}"] for part in parts for k in range(15)
            if f"Distance{k:02}" in part], parts[0]["State"]


def test_clearance_tells_the_wall(start, bus, watch, world):
    start(sensors=SENSOR, rest=can_text("clearance_hz = 20\nstatus_hz = 20"),
          publish=f"stale_s = {10 * PATIENCE_S}", **FINE)
    sectors, state = retry(lambda: all_sectors(bus))
    assert set(sectors) == {"Unknown"} and state == "Starting"
    assert bus.next("GPOM_Status")["Age"] == "Unknown"

    def walled():
        bus.flush()
        sectors, state = all_sectors(bus) or ([], None)
        known = [sector for sector in sectors if not isinstance(sector, str)]
        return sectors if state == "Mapping" and len(known) == 15 and min(known) > 5 else None
    sectors = keep_fresh(world, watch, walled)
    assert all(5.0 < sector <= 8.0 for sector in sectors), sectors


def test_clearance_that_was_known_is_unknown_once_the_map_is_stale(start, bus, watch, world):
    start(sensors=SENSOR, rest=can_text("clearance_hz = 20\nstatus_hz = 20"),
          publish=f"stale_s = {STALE_S}", **FINE)

    def is_known(status):
        return status["State"] == "Mapping" and status["MinClearance"] != "Unknown"

    def known():
        """The first such status of those so far; what came after it stays to be read."""
        statuses = (decoded(frame.arbitration_id, frame.data) for frame in bus.frames_so_far()
                    if frame.arbitration_id == STATUS_ID)
        return next(filter(is_known, statuses), None)
    status = keep_fresh(world, watch, known)
    while status["State"] == "Mapping":  # never so with a map that is older
        assert status["Age"] <= STALE_S + 0.01
        status = bus.next("GPOM_Status")
    assert status["State"] == "Stale" and status["FaultScan"] == 1
    assert status["Age"] == "AtLeast" or status["Age"] > STALE_S
    assert status["MinClearance"] == "Unknown"
    stale = bus.next("GPOM_Clearance", lambda fields: fields["Part"] == 0)
    assert stale["State"] == "Stale"
    assert {value for name, value in stale.items() if name.startswith("Dist")} == {"Unknown"}


def test_fd_frames_agree_with_the_classic_ones_and_tiles_with_the_published_map(start, bus, watch,
                                                                                world):
    start(sensors=SENSOR, rest=can_text("clearance_fd_hz = 10\ntile_hz = 1\ntiles_beside = 4",
                                        "fd = true"),
          publish=f"stale_s = {10 * PATIENCE_S}", **FINE)  # a stale map sends no tiles
    counts_of(watch)
    fresh_map(world, watch)

    def walled():
        bus.flush()
        fields = bus.next("GPOM_ClearanceFd")
        distances = [fields[f"Distance{k:02}"] for k in range(28)]
        is_walled = not {"Unknown", "Clear"} & set(distances)
        return fields if is_walled and min(distances) > 5 else None
    fields = keep_fresh(world, watch, walled)
    assert fields["State"] == "Mapping"
    assert all(5.0 < fields[f"Distance{k:02}"] <= 8.0 for k in range(28))
    assert fields["Stamp"] == pytest.approx(now_us() // 1000 % 2**32, abs=1000 * PATIENCE_S)

    def tiles_of_settled_map():
        watch.request_keyframe()
        is_held = watch.collect_settled(PATIENCE_S) and watch.map.is_whole
        return is_held and take_tiles(bus)
    tiles = retry(tiles_of_settled_map)
    assert n_levels_that_agree(tiles, watch.map.probability) > 3
    for tile in tiles.values():
        assert tile["CellSize"] == pytest.approx(0.25) and tile["Tiles"] == N_TILES
        assert (tile["ReferenceX"], tile["ReferenceY"]) == (20 // 2, 80 // 2)


def n_levels_that_agree(tiles, codes):
    """How many different levels the tiles have, each that of the published map's code: both are
    rounded up."""
    seen = set()
    for (tx, ty), tile in tiles.items():
        for i in range(64):
            column = (tile["ReferenceX"] + tx) * 8 + i % 8 - 16  # the raster begins at cell 16,
            row = (tile["ReferenceY"] + ty) * 8 + i // 8 - 256  # and at 256
            code, level = int(codes[row, column]), tile[f"Probability{i % 8}{i // 8}"]
            assert (code == 255) == (level == "Unknown"), (row, column, code, level)
            if code != 255:
                seen.add(round(14 * level))
                low, high = (math.ceil(14 * (code + by) / 254) for by in (-1, 0))
                assert low <= round(14 * level) <= high, (row, column, code, level)
    return len(seen)


def take_tiles(bus):
    """The tiles of one whole picture by their places; none if a frame was lost. All are received
    before any is decoded: on a slow machine that takes longer than to the next picture."""
    bus.flush()
    pictures = {}
    for frame in bus.take("GPOM_Tile", 2 * N_TILES - 1):
        tile = decoded(frame.arbitration_id, frame.data)
        pictures.setdefault(tile["Sequence"], {})[tile["TileX"], tile["TileY"]] = tile
    return next((tiles for tiles in pictures.values() if len(tiles) == N_TILES), {})


def test_the_stop_example_goes_beside_gpomd_and_stops_when_it_hangs(start, bus, watch, world,
                                                                    library):
    class Config(ctypes.Structure):
        _fields_ = [("timeout_ms", ctypes.c_uint32), ("sectors", ctypes.c_uint16),
                    ("distance_min", ctypes.c_uint8), ("n_good_min", ctypes.c_uint8),
                    ("n_missing_max", ctypes.c_uint8)]
    daemon = start(sensors=SENSOR, rest=can_text("clearance_hz = 20"),
                   publish=f"stale_s = {10 * PATIENCE_S}", **FINE)
    stop = ctypes.create_string_buffer(256)
    library.gpom_stop_init(stop, ctypes.byref(Config(1000, 0x4003, 50, 4, 3)))
    library.gpom_stop_may_go.restype = ctypes.c_bool
    clock_ms = lambda: ctypes.c_uint32(time.monotonic_ns() // 10**6 % 2**32)  # noqa: E731

    def goes():
        for frame in bus.frames_so_far():
            if frame.arbitration_id == 0x6A1:
                library.gpom_stop_on_frame(stop, bytes(frame.data), ctypes.c_size_t(frame.dlc),
                                           clock_ms())
        return library.gpom_stop_may_go(stop, clock_ms())
    assert not goes()
    keep_fresh(world, watch, goes)
    os.kill(daemon.process.pid, signal.SIGSTOP)
    try:
        deadline = time.monotonic() + PATIENCE_S
        while goes() and time.monotonic() < deadline:
            time.sleep(0.01)
        assert not goes()
    finally:
        os.kill(daemon.process.pid, signal.SIGCONT)
    keep_fresh(world, watch, goes)
    assert daemon.stop() == 0
    assert not goes(), "its last word is that it stops"


# ---- the interface ------------------------------------------------------------------------------

def test_an_interface_that_goes_down_up_away_and_comes_back_is_survived(start, bus, watch):
    daemon = begin(start, "status_hz = 20")
    before = dict(counts_of(watch))
    bus.drive(1.0)
    wait_for_rise(watch, before, can_received=1)
    link("set", "vcan0", "down")
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before).get("can_downs") == 1 and
                         rise(watch, before).get("can_not_sent", 0) > 0), rise(watch, before)
    link("set", "vcan0", "up")
    assert bus_again().next("GPOM_Status")
    link("del", "vcan0")
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before).get("can_downs", 0) >= 2)
    time.sleep(0.5)
    add_vcan()
    again = bus_again()
    assert again.next("GPOM_Status")
    received = counts_of(watch)["can_received"]
    again.alive = 5
    again.drive(1.0)
    assert watch.collect(PATIENCE_S, lambda: watch.status["counts"]["can_received"] == received + 1)
    said = output_of(daemon)
    assert re.search("vcan0 is down(.|\n)*vcan0 is up again(.|\n)*vcan0 was removed", said), said


def test_bus_off_is_over_when_the_interface_was_down_and_up(start, bus, watch):
    """The recovery by hand, on a bus where nobody sends but the daemon."""
    begin(start)
    before = dict(counts_of(watch))
    bus.error(CAN_ERR_BUSOFF)
    assert bus.next("GPOM_Status", lambda fields: fields["FaultCan"] == 1)
    link("set", "vcan0", "down")
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before).get("can_downs") == 1)
    link("set", "vcan0", "up")
    assert bus_again().next("GPOM_Status", lambda fields: fields["FaultCan"] == 0)


def bus_again():
    from conftest import Bus
    return Bus()


def test_an_interface_that_comes_later_is_found(start, watch):
    link("del", "vcan0")
    daemon = begin(start, "status_hz = 20")
    counts_of(watch)
    add_vcan()
    assert bus_again().next("GPOM_Status")["State"] == "Starting"
    said = output_of(daemon)
    assert "vcan0 is not there" in said and "vcan0 is there" in said


def test_fd_on_an_interface_without_it_is_told_and_counted(start, watch):
    link("del", "vcan0")
    add_vcan(16)
    daemon = begin(start, "clearance_fd_hz = 20", "fd = true")
    before = dict(counts_of(watch))
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before).get("can_not_sent", 0) > 3)
    assert "carries no CAN FD" in output_of(daemon)


def test_a_full_queue_is_backed_off_and_counted(start, bus, watch):
    """A bucket of 100 bytes that refills slowly: the kernel answers ENOBUFS."""
    begin(start, "status_hz = 50\nclearance_hz = 50")
    before = dict(counts_of(watch))
    subprocess.run(["tc", "qdisc", "add", "dev", "vcan0", "root", "tbf", "rate", "400bit", "burst",
                    "100", "limit", "200"], check=True)
    assert watch.collect(PATIENCE_S, lambda: rise(watch, before).get("can_not_sent", 0) > 50), (
        rise(watch, before))
    subprocess.run(["tc", "qdisc", "del", "dev", "vcan0", "root"], check=True)
    n_sent = counts_of(watch)["can_sent"]
    bus.flush()
    assert bus.next("GPOM_Status")
    assert watch.collect(PATIENCE_S, lambda: watch.status["counts"]["can_sent"] > n_sent + 50)


def test_identifiers_are_configured(start, bus):
    begin(start, "status_id = 0x18FFA0B1\nclearance_hz = 0")
    frame = bus.bus.recv(PATIENCE_S)
    assert frame is not None
    assert frame.arbitration_id == 0x18FFA0B1 and frame.is_extended_id
    assert DBC.decode_message("GPOM_Status", bytes(frame.data))["State"] == "Starting"
    assert peers.ROOT == ROOT

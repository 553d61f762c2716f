"""Bytes of ports/mavlink against pymavlink's, and what autopilots make of them."""
import ctypes
import math
import os
import pathlib
import random

import autopilots
import pytest
from pymavlink.dialects.v20 import common as mavlink

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = (ROOT / os.environ.get("GPOM_BUILD", "build/host-release")).resolve()
N_MAX = 72
NO_READING = 65535
COUNTS = [n for n in range(8, N_MAX + 1) if 360 % n == 0]
STATES = {1: mavlink.MAV_STATE_BOOT, 4: mavlink.MAV_STATE_ACTIVE, 5: mavlink.MAV_STATE_CRITICAL,
          7: mavlink.MAV_STATE_POWEROFF}


class Sender(ctypes.Structure):
    _fields_ = [("system_id", ctypes.c_uint8), ("component_id", ctypes.c_uint8),
                ("sequence", ctypes.c_uint8)]


class Sector(ctypes.Structure):
    """gpom_sector_t."""
    _fields_ = [("free_m", ctypes.c_float), ("distance_m", ctypes.c_float),
                ("probability", ctypes.c_uint16), ("variance", ctypes.c_uint8),
                ("cls", ctypes.c_uint8), ("flags", ctypes.c_uint8)]


FREE, OCCUPIED, UNKNOWN, NOTHING_KNOWN = 0, 2, 3, 1  # classes, and the flag of a sector


def free(range_m=25.0):
    return Sector(range_m, range_m, 0, 0, FREE, 0)


def blocked(distance_m):
    return Sector(distance_m, distance_m, 60000, 10, OCCUPIED, 0)


def unknown():
    return Sector(0.0, 0.3, 0, 255, UNKNOWN, NOTHING_KNOWN)


class Obstacles(ctypes.Structure):
    _fields_ = [("stamp_us", ctypes.c_int64), ("distance_cm", ctypes.c_uint16 * N_MAX),
                ("n_sectors", ctypes.c_uint8), ("range_cm", ctypes.c_uint16),
                ("sensor", ctypes.c_uint8)]


@pytest.fixture(scope="module")
def library():
    library = ctypes.CDLL(str(BUILD / "libgpom_mavlink.so"))
    library.gpom_mavlink_obstacles_init.argtypes = [ctypes.c_void_p, ctypes.c_uint32,
                                                    ctypes.c_float]
    library.gpom_mavlink_set_sectors.argtypes = [ctypes.c_void_p, ctypes.POINTER(Sector)]
    library.gpom_mavlink_is_sector_count.restype = ctypes.c_bool
    library.gpom_mavlink_heartbeat.restype = ctypes.c_size_t
    library.gpom_mavlink_obstacle_distance.restype = ctypes.c_size_t
    return library


@pytest.fixture
def sender():
    return Sender(7, 196, 0)


def obstacles(library, n=N_MAX, range_m=25.0, sectors=None):
    message = Obstacles()
    library.gpom_mavlink_obstacles_init(ctypes.byref(message), n, range_m)
    if sectors is not None:
        library.gpom_mavlink_set_sectors(ctypes.byref(message), (Sector * len(sectors))(*sectors))
    return message


def written(library, sender, message):
    """Bytes of an OBSTACLE_DISTANCE."""
    data = ctypes.create_string_buffer(179)
    n = library.gpom_mavlink_obstacle_distance(ctypes.byref(sender), ctypes.byref(message), data)
    return data.raw[:n]


def decoded(data):
    """The one message in these bytes, by pymavlink."""
    messages = mavlink.MAVLink(None).parse_buffer(data)
    assert len(messages) == 1 and messages[0].get_msgbuf() == data
    return messages[0]


def test_every_byte_is_pymavlinks(library, sender):
    """Random distances, stamps, ids and sensors; the numbers of messages go on over 255."""
    chance = random.Random(int(os.environ.get("GPOM_SEED") or 1))
    peer = mavlink.MAVLink(None, srcSystem=7, srcComponent=196)
    for i in range(300):
        n = chance.choice(COUNTS)
        before = int(22.5 // (360 / n))  # elements to the left of the one that is forward
        range_cm = chance.randrange(100, 65500)
        sectors, values = [], [NO_READING] * N_MAX
        for k in range(n):
            cm = chance.randrange(range_cm)
            sector, value = chance.choice([(blocked((cm + 0.5) / 100), max(cm, 1)),
                                           (free(), range_cm + 1), (unknown(), NO_READING)])
            sectors.append(sector)
            values[(before - k) % n] = value
        message = obstacles(library, n, (range_cm + 0.5) / 100, sectors)
        assert message.range_cm == range_cm
        message.stamp_us = chance.randrange(2**chance.randrange(1, 63))
        message.sensor = chance.randrange(5)
        wanted = mavlink.MAVLink_obstacle_distance_message(
            message.stamp_us, message.sensor, values, 360 // n, 1, message.range_cm, 360 / n,
            -before * 360 / n, mavlink.MAV_FRAME_BODY_FRD)
        assert written(library, sender, message) == bytes(wanted.pack(peer)), i
        peer.seq = (peer.seq + 1) % 256
    assert sender.sequence == 300 % 256


def test_a_heartbeat_is_that_of_an_onboard_controller(library, sender):
    data = ctypes.create_string_buffer(179)
    for i, (state, status) in enumerate(STATES.items()):
        n = library.gpom_mavlink_heartbeat(ctypes.byref(sender), state, data)
        message = decoded(data.raw[:n])
        assert message.get_type() == "HEARTBEAT" and message.system_status == status
        assert message.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER
        assert message.autopilot == mavlink.MAV_AUTOPILOT_INVALID and message.base_mode == 0
        assert (message.get_srcSystem(), message.get_srcComponent()) == (7, 196)
        assert message.get_seq() == i and message.mavlink_version == 3


def test_nothing_is_a_reading_until_it_is_set(library, sender):
    for n in [*COUNTS, 0, 7, 71, 73, 80, 2**32 - 1]:
        is_good = n in COUNTS
        assert library.gpom_mavlink_is_sector_count(n) == is_good
        message = obstacles(library, n, sectors=None if is_good else [free()] * N_MAX)
        fields = decoded(written(library, sender, message))
        assert fields.distances == [NO_READING] * N_MAX
        assert autopilots.ardupilot_points(fields) == []
        assert autopilots.px4_bins_of_36(fields) == [None] * 36
        assert autopilots.px4_bins_of_72(fields) == [None] * 72
    for range_m in (0.0, -1.0, math.nan, math.inf, 656.0):
        message = obstacles(library, N_MAX, range_m, [free()] * N_MAX)
        assert decoded(written(library, sender, message)).distances == [NO_READING] * N_MAX


@pytest.mark.parametrize("distance_m, cm", [
    (0.0, 1), (0.004, 1), (0.019, 1), (0.02, 2), (-1.0, 1), (7.999, 799), (8.0, 800),
    (24.999, 2499), (25.0, 2500), (25.1, NO_READING), (math.nan, NO_READING),
    (math.inf, NO_READING), (1e30, NO_READING)])
def test_distances_are_rounded_down_and_never_free(library, sender, distance_m, cm):
    sectors = [unknown()] * N_MAX
    sectors[3] = blocked(distance_m)
    fields = decoded(written(library, sender, obstacles(library, sectors=sectors)))
    assert fields.distances == [cm if i == 4 - 3 else NO_READING for i in range(N_MAX)]


def test_a_stamp_before_1970_is_sent_as_0(library, sender):
    message = obstacles(library)
    message.stamp_us = -5
    assert decoded(written(library, sender, message)).time_usec == 0


def with_one_obstacle(library, sender, n, i):
    """OBSTACLE_DISTANCE with sector i blocked, the others free."""
    sectors = [free()] * n
    sectors[i] = blocked(5.005)
    return decoded(written(library, sender, obstacles(library, n, sectors=sectors)))


@pytest.mark.parametrize("n", COUNTS)
def test_ardupilot_sees_each_obstacle_in_its_direction(library, sender, n):
    """And nothing where all is free."""
    for i in range(n):
        message = with_one_obstacle(library, sender, n, i)
        angle = -i * 360 / n % 360  # ours are counter-clockwise
        assert autopilots.ardupilot_points(message) == [(angle, 500)]
        face = int((angle + 22.5) % 360 / 45)
        assert autopilots.ardupilot_faces(message) == [500 if k == face else None
                                                       for k in range(8)]


@pytest.mark.parametrize("n", COUNTS)
def test_ardupilot_keeps_the_least_distance_of_each_of_its_sectors(library, sender, n):
    """A message that began forward would lose what is ahead to the right: ArduPilot would replace
    it by what is ahead to the left."""
    chance = random.Random(int(os.environ.get("GPOM_SEED") or 1))
    for _ in range(30):
        distances, least = [chance.randrange(1, 2500) for _ in range(n)], [None] * 8
        for i, cm in enumerate(distances):
            face = int((-i * 360 / n + 22.5) % 360 / 45)
            least[face] = min(cm, least[face] or cm)
        message = obstacles(library, n, sectors=[blocked((cm + 0.5) / 100) for cm in distances])
        assert autopilots.ardupilot_faces(decoded(written(library, sender, message))) == least


def test_px4_with_36_sectors_takes_each_of_36_and_every_second_of_72(library, sender):
    for n, is_read in ((36, lambda i: True), (72, lambda i: i % 2 == 0)):
        for i in range(n):
            bins = autopilots.px4_bins_of_36(with_one_obstacle(library, sender, n, i))
            wanted = [2501] * 36
            if is_read(i):
                wanted[round(-i * 36 / n) % 36] = 500
            assert bins == wanted, (n, i)


def test_px4_with_72_sectors_takes_each_of_72(library, sender):
    for i in range(72):
        bins = autopilots.px4_bins_of_72(with_one_obstacle(library, sender, 72, i))
        assert bins == [500 if k == -i % 72 else 2501 for k in range(72)], i

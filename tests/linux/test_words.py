"""What is set up wrongly is said in one sentence, at once: channel, type, value and what to do.

The status carries it as a bit, for which gpom-watch has a text."""
import math
import re
import time

import pytest
from conftest import N_BEAMS, URL, encoded, scan, wait_until
from gpom_watch import Watch
from test_links import wait_for_line

PLANAR = '[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 34.0'
POSES = '[pose]\ntype = "bot_core.pose_t"\nwait_max_s = 0.2'
MBOT = '[[sensor]]\ntype = "mbot_lcm_msgs.lidar_t"\nrange_max_m = 34.0'
MBOT_POSES = '[pose]\ntype = "mbot_lcm_msgs.pose2D_t"'
FOREIGN = {"sensors": PLANAR, "rest": POSES}


def now_us(offset_us=0):
    return int(time.time() * 1e6) + offset_us


def boot_us():
    return int(time.monotonic() * 1e6)


def lidar(peer, **fields):
    return "LIDAR", encoded(peer("bot_core.planar_lidar_t", **{
        "utime": now_us(), "nranges": N_BEAMS, "ranges": [8.0] * N_BEAMS, "rad0": -1.5,
        "radstep": 0.1, **fields}))


def mbot(peer, **fields):
    n = N_BEAMS
    stamp_us = fields.get("utime", now_us())
    return "LIDAR", encoded(peer("mbot_lcm_msgs.lidar_t", **{
        "utime": stamp_us, "num_ranges": n, "ranges": [8.0] * n, "intensities": [0.0] * n,
        "thetas": [0.1 * i for i in range(n)], "times": [stamp_us] * n, **fields}))


def pose(peer, **fields):
    return "POSE", encoded(peer("bot_core.pose_t", **{
        "utime": now_us(), "pos": [20.0, 80.0, 0.0], "orientation": [1, 0, 0, 0], **fields}))


def own(peer, i=0, channel="GPOM_SCAN", **fields):
    return channel, encoded(scan(peer, i, **{"utime": now_us(), **fields}))


def typed(message):
    """As lcm-gen's publish sends it: nobody computes its CRC-32."""
    message.crc32 = 0
    return message.encode()


def says(daemon, watch, messages, line, problem):
    """The first thing that the log says after these messages is this line, and the status has its
    bit. They are sent again until the status has it, as the first may be early."""
    seen = []

    def is_shown():
        for channel, data in messages():
            watch.bus.publish(channel, data)
        watch.collect(0.05)
        seen[:] = watch.status["problems"] if watch.status else []
        return any(text.startswith(problem + ": ") for text in seen)
    wait_until(watch, is_shown)
    wait_for_line(daemon, line.split("…")[0])
    told = daemon.lines[-1].removeprefix("gpomd: ").rstrip("\n")
    pattern = "[^ ]*".join(map(re.escape, line.split("…")))
    assert re.fullmatch(pattern, told), told
    assert not any("dropped:" in other for other in daemon.lines)  # that comes every ten seconds


SCANS = [
    ("bot_core.planar_lidar_t on a channel of gpom.scan_t",
     lambda peer: [("GPOM_SCAN", lidar(peer)[1])], "scan_type",
     'GPOM_SCAN carries bot_core.planar_lidar_t, but sensor[0].type is gpom.scan_t: set '
     'sensor[0].type = "bot_core.planar_lidar_t"'),
    ("an unknown type", lambda peer: [("GPOM_SCAN", bytes(range(1, 80)))], "scan_type",
     "GPOM_SCAN carries a type that gpomd does not know (fingerprint 0x0102030405060708), but "
     "sensor[0].type is gpom.scan_t: set sensor[0].channel to that of the scans; `gpom-watch "
     "--channels` lists what there is"),
    ("no crc32", lambda peer: [("GPOM_SCAN", typed(scan(peer, 0)))], "scan_crc_zero",
     "gpom.scan_t on GPOM_SCAN: crc32 is 0, so the sender has not computed it: crc32 must be the "
     "CRC-32 of all bytes before it, once the message is encoded (lcmtypes/README.md)"),
    ("damaged", lambda peer: [("GPOM_SCAN", own(peer)[1][:-1] + b"?")], "scan_corrupt",
     "gpom.scan_t on GPOM_SCAN: crc32 does not fit the bytes: the message was damaged, or the "
     "sender does not compute it as lcmtypes/README.md says"),
    ("many ranges", lambda peer: [own(peer, n_ranges=3000, ranges=[1.0] * 3000, angle_step=1e-3)],
     "scan_ranges", "gpom.scan_t on GPOM_SCAN: more ranges than intake.ranges_max = 2048: raise "
     "that"),
    ("sensor_id", lambda peer: [own(peer, sensor_id=7)], "scan_sensor_id",
     "gpom.scan_t on GPOM_SCAN: sensor_id is 7, and no [[sensor]] of this channel has that id: set "
     "sensor[0].id = 7, or add a [[sensor]]"),
    ("degrees", lambda peer: [own(peer, angle_min=-90.0, angle_step=6.0)], "scan_angles",
     "gpom.scan_t on GPOM_SCAN: its bearings go from -90 to 90 rad, which is 28.6 turns: are they "
     "degrees? Multiply them by pi / 180"),
    ("bearings that are NaN", lambda peer: [own(peer, angle_min=math.nan)], "scan_angles",
     "gpom.scan_t on GPOM_SCAN: its bearings go from nan to nan rad, which is nan turns: they must "
     "be finite"),
    ("seconds", lambda peer: [own(peer, utime=now_us() // 10**6)], "stamp_unit",
     "gpom.scan_t on GPOM_SCAN: utime … is the time of day in seconds: multiply it by 1000000; "
     "utime must be in microseconds since 1970"),
    ("milliseconds", lambda peer: [own(peer, utime=now_us() // 1000)], "stamp_unit",
     "gpom.scan_t on GPOM_SCAN: utime … is the time of day in milliseconds: multiply it by 1000; "
     "utime must be in microseconds since 1970"),
    ("nanoseconds", lambda peer: [own(peer, utime=now_us() * 1000)], "stamp_unit",
     "gpom.scan_t on GPOM_SCAN: utime … is the time of day in nanoseconds: divide it by 1000; "
     "utime must be in microseconds since 1970"),
    ("negative", lambda peer: [own(peer, utime=-5)], "stamp_range",
     "gpom.scan_t on GPOM_SCAN: utime -5 is no time: it must be in microseconds since 1970"),
    ("an hour ahead", lambda peer: [own(peer, utime=now_us(3600 * 10**6))], "scan_too_new",
     "gpom.scan_t on GPOM_SCAN: stamped 3… s ahead of this machine's clock: set the clocks of both "
     "(chrony, ntpd), or raise intake.ahead_max_s"),
    ("all NaN", lambda peer: [own(peer, ranges=[math.nan] * N_BEAMS)], "scan_unusable",
     'GPOM_SCAN: all readings of a scan are NaN: the sensor is covered, or its driver means "no '
     'return" by it'),
    ("all 0", lambda peer: [own(peer, ranges=[0.0] * N_BEAMS)], "scan_unusable",
     'GPOM_SCAN: all readings of a scan are 0 or negative: the sensor is covered; if 0 is "no '
     'return", set zero = "no_return"'),
    ("no ranges", lambda peer: [own(peer, n_ranges=0, ranges=[])], "scan_unusable",
     "GPOM_SCAN: all readings of a scan are missing, there are none: does the driver send empty "
     "scans?"),
    ("a pose that is NaN", lambda peer: [own(peer, pose=[math.nan, 0.0, 0.0])], "scan_bad_pose",
     "GPOM_SCAN: the pose of a scan is refused: x, y or yaw is not finite, x or y is beyond 1e8 m, "
     "or pose_cov is no covariance; x is nan m"),
    ("a pose nowhere on Earth", lambda peer: [own(peer, pose=[1e21, 0.0, 0.0])], "scan_bad_pose",
     "GPOM_SCAN: the pose of a scan is refused: x, y or yaw is not finite, x or y is beyond 1e8 m, "
     "or pose_cov is no covariance; x is 1e+21 m"),
    ("far away", lambda peer: [own(peer, pose=[9000.0, 0.0, 0.0])], "scan_out_of_reach",
     "GPOM_SCAN: a scan was taken 9000 m from map.origin, more than 8000 m: set map.origin near "
     "the robot, or map.rebase_m"),
    ("one number", lambda peer: [own(peer, 3), own(peer, 3)], "scan_repeated",
     "gpom.scan_t on GPOM_SCAN: number 3 or utime … came before: two senders share the channel, or "
     "utime does not change from scan to scan"),
    ("missing numbers", lambda peer: [own(peer, 3), own(peer, 13)], "scan_lost",
     "gpom.scan_t on GPOM_SCAN: 9 numbers are missing before number 13: the network or this "
     "machine loses scans; does datagrams_lost rise, too?"),
    ("a query of another type", lambda peer: [("GPOM_QUERY", own(peer)[1])], "query_refused",
     "gpom.query_t on GPOM_QUERY: another type: fingerprint or magic number differs"),
]


@pytest.mark.parametrize("messages, problem, line", [case[1:] for case in SCANS],
                         ids=[case[0] for case in SCANS])
def test_a_wrong_message_is_named_with_channel_value_and_remedy(messages, problem, line, start,
                                                                peer):
    daemon, watch = start(), Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    says(daemon, watch, lambda: messages(peer), line, problem)


OTHERS = [
    ("seconds on POSE", lambda peer: [pose(peer, utime=now_us() // 10**6)], "stamp_unit",
     "bot_core.pose_t on POSE: utime … is the time of day in seconds: multiply it by 1000000; "
     "utime must be in microseconds since 1970"),
    ("quaternion 0", lambda peer: [pose(peer, orientation=[0, 0, 0, 0])], "pose_quaternion",
     "bot_core.pose_t on POSE: orientation has length 0 instead of 1: the sender leaves it at 0; "
     "without a turn it is (1, 0, 0, 0)"),
    ("poses of another type",
     lambda peer: [("POSE", encoded(peer("mbot_lcm_msgs.pose2D_t", utime=now_us())))], "pose_type",
     "POSE carries mbot_lcm_msgs.pose2D_t, but pose.type is bot_core.pose_t: set pose.type = "
     '"mbot_lcm_msgs.pose2D_t"'),
    ("a pose that is NaN", lambda peer: [pose(peer, pos=[math.nan, 0, 0])], "pose_not_finite",
     "bot_core.pose_t on POSE: a coordinate is NaN or infinite: the localiser is lost"),
    ("poses that stand still", lambda peer: [pose(peer, utime=10**15)] * 2, "pose_order",
     "bot_core.pose_t on POSE: utime 1000000000000000 is not later than that of the pose before, "
     "by 0.000 s: two localisers share the channel, or utime does not change"),
    ("a wild pose", lambda peer: [pose(peer, utime=10**15),
                                  pose(peer, utime=10**15 + 1, pos=[3000.0, 80.0, 0.0])],
     "pose_wild", "bot_core.pose_t on POSE: a pose is 2980.0 m and 0.000 s from the one before, "
     "more than [jump] allows: a wild pose, two localisers, or jump.speed_mps is too low"),
    ("no poses", lambda peer: [lidar(peer)], "scan_no_pose",
     "LIDAR: scans wait for a pose, and none came on POSE so far: is the localiser running, is "
     "pose.channel right?"),
    ("scans by the time since the start", lambda peer: [pose(peer), lidar(peer, utime=boot_us())],
     "two_clocks", "two clocks: LIDAR is stamped … s, the time since this machine started, while "
     "POSE is stamped … s, the time of day, at the same time: give both the same clock"),
    ("poses by the time since the start",
     lambda peer: [pose(peer, utime=boot_us()), lidar(peer)], "two_clocks",
     "two clocks: LIDAR is stamped … s, the time of day, while POSE is stamped … s, the time since "
     "this machine started, at the same time: give both the same clock"),
    ("scans by a clock of their own", lambda peer: [pose(peer), lidar(peer, utime=10**14)],
     "two_clocks", "two clocks: LIDAR is stamped 100000000.000 s while POSE is stamped … s, the "
     "time of day, at the same time: give both the same clock"),
]


@pytest.mark.parametrize("messages, problem, line", [case[1:] for case in OTHERS],
                         ids=[case[0] for case in OTHERS])
def test_scans_and_poses_that_come_apart_are_named_likewise(messages, problem, line, start, peer):
    daemon, watch = start(**FOREIGN), Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    says(daemon, watch, lambda: messages(peer), line, problem)


def test_bearings_and_times_of_single_beams_are_named_likewise(start, peer):
    daemon, watch = start(sensors=MBOT, rest=MBOT_POSES), Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    says(daemon, watch, lambda: [mbot(peer, thetas=[3.0 * i for i in range(N_BEAMS)])],
         "mbot_lcm_msgs.lidar_t on LIDAR: its bearings go from 0 to 90 rad, which is 14.3 turns: "
         "are they degrees? Multiply them by pi / 180", "scan_angles")
    says(daemon, watch, lambda: [mbot(peer, times=[0] * N_BEAMS)],
         "mbot_lcm_msgs.lidar_t on LIDAR: a beam's time is over 1 s from its scan's: are `times` "
         "in microseconds?", "scan_beam_times")


def test_scans_on_another_channel_are_found(start, peer):
    daemon, watch = start(), Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    says(daemon, watch, lambda: [own(peer, channel="LASER")],
         'nothing came on GPOM_SCAN for 4 s, but gpom.scan_t comes on LASER: set sensor[0].channel '
         '= "LASER"', "other_channel")


def test_scans_and_poses_of_another_family_are_found(start, peer):
    """The nearest thing is told, with the type that it needs."""
    daemon, watch = start(), Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    says(daemon, watch, lambda: [lidar(peer), pose(peer)],
         "nothing came on GPOM_SCAN for 4 s, but bot_core.planar_lidar_t comes on LIDAR: set "
         'sensor[0].channel = "LIDAR" and sensor[0].type = "bot_core.planar_lidar_t"',
         "other_channel")


def test_a_silent_channel_is_told(start):
    daemon, watch = start(), Watch(URL)
    says(daemon, watch, lambda: [], "nothing came on GPOM_SCAN for 4 s: is its sender running, on "
         "this network? `gpom-watch --channels` lists what there is", "silent")


def test_a_second_gpomd_is_told_by_both(start, peer, tmp_path):
    first, watch = start(), Watch(URL)
    second = start()
    line = ("another program, at … port …, sends GPOM_STATUS, too: a second gpomd, or a log that "
            "is played; subscribers mix both maps: stop one, or give it other channels ([publish])")
    for daemon in (first, second):
        says(daemon, watch, lambda: [own(peer)], line, "two_mappers")


def test_one_gpomd_is_not_told_of_itself(start, peer):
    """Nor is anything else that is right."""
    daemon, watch = start(), Watch(URL)
    for i in range(30):
        watch.bus.publish(*own(peer, i))
        watch.collect(0.1)
    assert watch.status["counts"]["scans_inserted"] > 20 and watch.status["problems"] == []
    assert daemon.stop() == 0
    assert len(daemon.lines) == 3, daemon.lines  # configuration, ready, stopped


def test_a_kind_of_problem_is_told_once_however_often_it_comes(start, peer):
    daemon, watch = start(), Watch(URL)
    for i in range(300):
        watch.bus.publish("GPOM_SCAN", own(peer, i, sensor_id=7)[1])
        watch.collect(0.005)
    assert daemon.stop() == 0
    assert len([line for line in daemon.lines if "sensor_id is 7" in line]) == 1

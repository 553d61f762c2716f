"""Scans and poses that come apart: what gpomd makes of a localiser that is silent or late."""
import math
import re

import pytest
from conftest import N_BEAMS, T0_US, URL, encoded, scan, wait_for_status, wait_until
from gpom_watch import Watch

PLANAR = '[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 34.0'


def lidar(peer, stamp_us):
    return encoded(peer("bot_core.planar_lidar_t", utime=stamp_us, nranges=N_BEAMS,
                        ranges=[8.0] * N_BEAMS, rad0=-1.5, radstep=0.1))


def pose(peer, stamp_us, x_m=20.0):
    return encoded(peer("bot_core.pose_t", utime=stamp_us, pos=[x_m, 80.0, 0.0],
                        orientation=[1, 0, 0, 0]))


@pytest.mark.parametrize("hold_s, n_held", [(0.0, 0), (5.0, 2), (100.0, 3)])
def test_the_last_pose_holds_for_as_long_as_is_configured(hold_s, n_held, start, peer):
    """A localiser is silent while the robot stands: scans 1, 4 and 20 s after its last pose."""
    start(sensors=PLANAR, rest=f'[pose]\ntype = "bot_core.pose_t"\nwait_max_s = 0.1\n'
                               f"hold_s = {hold_s}")
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    watch.bus.publish("POSE", pose(peer, T0_US))
    for i, late_s in enumerate((1, 4, 20)):
        watch.bus.publish("LIDAR", lidar(peer, T0_US + late_s * 1_000_000))
        wait_until(watch, lambda n=i + 1: watch.status["counts"]["scans_received"] == n)
    wait_for_status(watch, scans_inserted=n_held, scans_no_pose=3 - n_held)


def test_the_pose_before_a_silence_holds_when_the_next_one_comes(start, peer):
    """The robot begins to move as the localiser speaks again: nothing is interpolated across."""
    start(sensors=PLANAR, rest='[pose]\ntype = "bot_core.pose_t"\nwait_max_s = 60.0\n'
                               "hold_s = 5.0")
    watch, places = Watch(URL), []
    watch.bus.subscribe("GPOM_MAP", lambda _, data: places.append(
        peer.type("gpom.map_t").decode(data).pose[0]))
    wait_until(watch, lambda: watch.status is not None)
    watch.bus.publish("POSE", pose(peer, T0_US))
    watch.bus.publish("LIDAR", lidar(peer, T0_US + 2_000_000))
    wait_until(watch, lambda: watch.status["counts"]["scans_received"] == 1)
    watch.bus.publish("POSE", pose(peer, T0_US + 4_000_000, 21.0))
    wait_for_status(watch, scans_inserted=1)
    wait_until(watch, lambda: places and places[-1] == 20.0)


def turning(t_s):
    """Yaw of a robot that turns to and fro [rad]."""
    return 0.5 * (math.sin(0.7 * t_s) + 0.5 * math.sin(1.9 * t_s))


def room(t_s):
    """What it sees of a room of 12 m by 9 m, in a circle of 181 beams."""
    ranges = []
    for i in range(181):
        direction = turning(t_s) + i * math.pi / 90
        c, s = math.cos(direction), math.sin(direction)
        along_x = (7 if c > 0 else -5) / c if c else 1e9
        along_y = (4 if s > 0 else -5) / s if s else 1e9
        ranges.append(min(along_x, along_y))
    return ranges


def drive(watch, peer, latency_s, family):
    """A minute of ten scans and fifty poses a second, as fast as they are taken."""
    for i in range(600):
        t_s = 0.1 * i
        stamp_us = T0_US + round(1e6 * (t_s + latency_s))
        if family == "gpom":
            watch.bus.publish("GPOM_SCAN", encoded(scan(
                peer, i, utime=stamp_us, pose=[20.0, 80.0, turning(t_s + latency_s)], angle_min=0.0,
                angle_step=math.pi / 90, n_ranges=181, ranges=room(t_s))))
        else:
            for k in range(5):
                yaw_rad = turning(t_s + 0.02 * k)
                watch.bus.publish("POSE", encoded(peer(
                    "bot_core.pose_t", utime=T0_US + round(1e6 * (t_s + 0.02 * k)),
                    pos=[20.0, 80.0, 0.0],
                    orientation=[math.cos(yaw_rad / 2), 0, 0, math.sin(yaw_rad / 2)])))
            watch.bus.publish("LIDAR", encoded(peer(
                "bot_core.planar_lidar_t", utime=stamp_us, nranges=181, ranges=room(t_s), rad0=0.0,
                radstep=math.pi / 90)))
        if i % 10 == 9:
            wait_until(watch, lambda n=i + 1: watch.status is not None
                       and watch.status["counts"]["scans_received"] == n)


LATENCY = {
    "gpom": ({}, r"GPOM_SCAN: the poses in its scans are ([\d.]+) s newer than the ranges, by how "
             "the robot turns in both: the sender must take the pose of when the ranges were "
             "measured"),
    "bot_core": ({"sensors": PLANAR, "rest": '[pose]\ntype = "bot_core.pose_t"\nwait_max_s = 60.0'},
                 r"LIDAR: its stamps are ([\d.]+) s later than those of the poses, by how the "
                 r"robot turns in both: set sensor\[0\].latency_s = 0.2\d \(it is 0.00\)")}


@pytest.mark.campaign
@pytest.mark.parametrize("family", LATENCY)
def test_a_constant_latency_is_told_within_a_minute_to_30_ms(family, start, peer):
    parts, line = LATENCY[family]
    daemon, watch = start(**parts), Watch(URL)
    drive(watch, peer, 0.25, family)
    wait_until(watch, lambda: any(text.startswith("latency: ")
                                  for text in watch.status["problems"]))
    assert daemon.stop() == 0
    told = [match for match in (re.search(line, text) for text in daemon.lines) if match]
    assert len(told) == 1 and abs(float(told[0][1]) - 0.25) < 0.03, daemon.lines


@pytest.mark.campaign
@pytest.mark.parametrize("family", LATENCY)
def test_no_latency_is_told_where_there_is_none(family, start, peer):
    daemon, watch = start(**LATENCY[family][0]), Watch(URL)
    drive(watch, peer, 0.0, family)
    wait_for_status(watch, scans_received=600)
    assert watch.status["problems"] == [] and daemon.stop() == 0
    assert not any("robot turns" in text for text in daemon.lines), daemon.lines

"""The localiser's map frame jumps: a new epoch by rule, seen by subscribers; wild poses cost
nothing but themselves."""
import math

import numpy as np
import pytest
from conftest import (N_BEAMS, PATIENCE_S, T0_US, URL, cells_of, encoded, fresh_status, scan,
                      wait_for_status, wait_until)
from gpom_watch import Watch

STEP_US = 100_000
BLIND = [math.nan] * N_BEAMS
# Three places, 40 m or more from each other; what is seen of each is nearer than 4 m.
BEFORE, AFTER, FAR = (30.0, 58.0), (60.0, 95.0), (10.0, 100.0)
X0_M, Y0_M = 0.0, 50.0  # of the raster in conftest.py, cells of 1 m


class Robot:
    """Sends scans that carry their poses, one a tenth of a second."""

    def __init__(self, watch, peer):
        self.watch, self.peer, self.n = watch, peer, 0

    def see(self, place, yaw_rad=0.3, ranges=3.0, seconds=0.1, **fields):
        """A scan at a place, so long after the last one."""
        at_us = STEP_US if self.n == 0 else self.last_us + round(1e6 * seconds)
        values = ranges if isinstance(ranges, list) else [ranges] * N_BEAMS
        self.watch.bus.publish("GPOM_SCAN", encoded(scan(
            self.peer, self.n, utime=T0_US + at_us, pose=[*place, yaw_rad], ranges=values,
            **fields)))
        self.last_us, self.n = at_us, self.n + 1


def is_known(watch, place):
    """Is the cell two metres ahead of a robot at this place known? Free it is, then."""
    ix, iy = int(place[0] + 2.0 * math.cos(0.3) - X0_M), int(place[1] + 2.0 * math.sin(0.3) - Y0_M)
    return watch.map.classes()[iy, ix] != 3


def settled_epoch(watch):
    """Frame epoch of the map when no cell changes any more."""
    wait_until(watch, lambda: watch.map.tile is not None and watch.map.is_whole)
    assert watch.collect_settled(PATIENCE_S, 1.0)
    return watch.map.tile.epoch


@pytest.mark.parametrize("jump, epoch, known", [
    ("", 1, {BEFORE, AFTER, FAR}), ('rule = "none"', 0, {BEFORE, AFTER, FAR}),
    ('rule = "keep"', 1, {BEFORE, AFTER, FAR}), ('rule = "forget"\nforget_m = 8.0', 1, {FAR}),
    ('rule = "clear"', 1, set())])
def test_a_jump_starts_an_epoch_and_the_rule_says_what_stays(jump, epoch, known, start, peer):
    """The robot visits three places, then is taken from one to another; it sees nothing there, so
    that what is known is from before. Subscribers get the whole map of the new epoch at once."""
    daemon = start(publish="keyframe_s = 1000", rest="[jump]\n" + jump if jump else "")
    watch = Watch(URL)
    robot = Robot(watch, peer)
    for place in (FAR, AFTER, BEFORE):
        for seconds in (5.0, 0.1):
            robot.see(place, seconds=seconds)
    wait_for_status(watch, scans_inserted=6, frame_jumps=0)
    assert settled_epoch(watch) == 0
    assert all(is_known(watch, place) for place in (FAR, AFTER, BEFORE))
    for _ in range(2):
        robot.see(AFTER, ranges=BLIND)
    n_dropped = min(epoch, 1)  # it takes two poses that agree
    status = wait_for_status(watch, scans_inserted=8 - n_dropped, scans_at_jump=n_dropped,
                             frame_jumps=epoch)
    assert status["frame_epoch"] == epoch
    wait_until(watch, lambda: watch.map.tile.epoch == epoch and watch.map.is_whole
               and watch.map.tile.stamp_us == T0_US + robot.last_us)
    assert settled_epoch(watch) == epoch
    assert {place for place in (FAR, AFTER, BEFORE) if is_known(watch, place)} == known
    assert list(watch.map.tile.pose[:2]) == list(AFTER)
    assert daemon.stop() == 0
    told = [line for line in daemon.lines if "the map frame jumped (1 until now): robot before at "
            "30.000 m, 58.000 m, 0.300 rad; after at 60.000 m, 95.000 m, 0.300 rad" in line]
    assert len(told) == epoch, daemon.lines


def test_a_wild_pose_wipes_nothing(start, peer):
    """One, and one after the other that do not agree. One that is not finite is another fault."""
    start(rest='[jump]\nrule = "clear"')
    watch = Watch(URL)
    robot = Robot(watch, peer)
    for _ in range(3):
        robot.see(BEFORE)
    wait_for_status(watch, scans_inserted=3)
    assert settled_epoch(watch) == 0
    before = cells_of(watch.map)
    for wild in ((0.0, 0.0), BEFORE, AFTER, FAR, (1e5, 1e5), (math.nan, 0.0), BEFORE):
        robot.see(wild, ranges=BLIND)
    status = wait_for_status(watch, scans_received=10, scans_inserted=5, scans_at_jump=4,
                             scans_bad_pose=1, frame_jumps=0)
    assert status["frame_epoch"] == 0
    assert settled_epoch(watch) == 0 and cells_of(watch.map) == before


UTM = (500_000.0, 5_400_000.0)


@pytest.mark.parametrize("rule, n_inserted", [("none", 7), ("keep", 15), ("forget", 15),
                                              ("clear", 15)])
def test_a_wild_first_pose_keeps_no_later_scan_out(rule, n_inserted, start, peer):
    """A localiser that begins at (0, 0) before it knows. Without looking for jumps the map believes
    the tenth scan out of reach; otherwise only the one is lost that the next one had to confirm."""
    start(map="beam_max = 8000\nrebase_m = 500.0", raster="cell_m = 1.0\nnx = 70\nny = 60",
          rest=f'[jump]\nrule = "{rule}"')
    watch = Watch(URL)
    robot = Robot(watch, peer)
    robot.see((0.0, 0.0))
    for i in range(15):
        robot.see((UTM[0] + i, UTM[1]))
    n_lost = 16 - n_inserted
    wait_for_status(watch, scans_inserted=n_inserted,
                    **{"scans_out_of_reach" if rule == "none" else "scans_at_jump": n_lost})
    if rule != "none":
        assert settled_epoch(watch) == 1
        assert watch.status["n_beams"] > 0
        assert (watch.map.classes() == 0).any()  # about the robot, which the raster follows
        assert math.dist(watch.map.tile.corner_m, UTM) < 100.0


def test_a_frame_out_of_reach_of_a_fixed_origin_wipes_nothing(start, peer):
    """No scan of it can be inserted; the next frame begins with the first that can."""
    start(rest='[jump]\nrule = "clear"')
    watch = Watch(URL)
    robot = Robot(watch, peer)
    for _ in range(3):
        robot.see(BEFORE)
    wait_for_status(watch, scans_inserted=3)
    assert settled_epoch(watch) == 0
    before = cells_of(watch.map)
    for _ in range(3):
        robot.see((1e5, 1e5))
    wait_for_status(watch, scans_at_jump=1, scans_out_of_reach=2, frame_jumps=0)
    assert settled_epoch(watch) == 0 and cells_of(watch.map) == before
    for _ in range(2):
        robot.see(AFTER)
    wait_for_status(watch, scans_inserted=4, scans_at_jump=2, frame_jumps=1)
    assert settled_epoch(watch) == 1
    assert is_known(watch, AFTER) and not is_known(watch, BEFORE)


def test_a_place_of_the_old_frame_is_not_told_in_the_new_one(start, peer):
    """The scan that begins it is refused for its covariance: the robot's place is not known."""
    start()
    watch = Watch(URL)
    robot = Robot(watch, peer)
    for place in (BEFORE, BEFORE, AFTER):
        robot.see(place)
    robot.see(AFTER, pose_cov=[-1.0] * 9)
    wait_for_status(watch, scans_inserted=2, scans_at_jump=1, scans_bad_pose=1, frame_jumps=1)
    assert settled_epoch(watch) == 1 and math.isnan(watch.map.tile.pose[0])
    robot.see(AFTER)
    wait_until(watch, lambda: list(watch.map.tile.pose[:2]) == list(AFTER))


def test_a_fast_drive_with_turns_is_no_jump(start, peer):
    """38 m/s at ten scans a second, 5 rad/s in turn; and a stop of a minute at the end."""
    start(raster="cell_m = 4.0\nnx = 70\nny = 60",
          rest='[jump]\nrule = "clear"\nturn_rad = 0.2\nturn_radps = 6.0')
    watch = Watch(URL)
    robot = Robot(watch, peer)
    place, yaw_rad = np.array([20.0, 80.0]), 0.0
    for i in range(60):
        robot.see(place.tolist(), yaw_rad, ranges=8.0)
        yaw_rad = math.remainder(yaw_rad + 0.5 * (1 if i % 20 < 10 else -1), 2 * math.pi)
        place += 3.8 * np.array([math.cos(yaw_rad), math.sin(yaw_rad)])
    robot.see(place.tolist(), yaw_rad + 3.0, seconds=60.0)
    status = wait_for_status(watch, scans_inserted=61, scans_at_jump=0, frame_jumps=0)
    assert status["frame_epoch"] == 0


def test_a_turn_in_place_that_cannot_be_is_a_jump(start, peer):
    start(rest='[jump]\nrule = "clear"\nturn_rad = 0.5')
    watch = Watch(URL)
    robot = Robot(watch, peer)
    for yaw_rad in (0.0, 0.5, 3.0, 3.1):
        robot.see(BEFORE, yaw_rad)
    status = wait_for_status(watch, scans_inserted=3, scans_at_jump=1, frame_jumps=1)
    assert status["frame_epoch"] == 1


def test_scans_whose_pose_comes_apart_are_not_placed_across_a_jump(start, peer):
    """Of three scans between poses, the one between two frames is dropped, with its own cause."""
    start(sensors='[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 34.0',
          rest='[pose]\ntype = "bot_core.pose_t"\nwait_max_s = 60.0\n[jump]\nrule = "clear"')
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)

    def pose(i, place):
        watch.bus.publish("POSE", peer("bot_core.pose_t", utime=T0_US + i * STEP_US,
                                       pos=[*place, 0.0], orientation=[1.0, 0, 0, 0]).encode())

    def lidar(i):
        watch.bus.publish("LIDAR", peer(
            "bot_core.planar_lidar_t", utime=T0_US + i * STEP_US + STEP_US // 2, nranges=N_BEAMS,
            ranges=[3.0] * N_BEAMS, rad0=-1.5, radstep=0.1).encode())
    pose(0, BEFORE)
    lidar(0)
    pose(1, BEFORE)
    wait_for_status(watch, scans_inserted=1)
    lidar(1)
    pose(2, AFTER)
    lidar(2)
    wait_for_status(watch, scans_received=3, poses_at_jump=1)
    assert fresh_status(watch)["counts"]["scans_at_jump"] == 0  # it may still be a wild pose
    pose(3, AFTER)
    lidar(3)
    pose(4, AFTER)
    status = wait_for_status(watch, scans_inserted=2, scans_at_jump=2, frame_jumps=1,
                             poses_at_jump=1, scans_no_pose=0, scans_too_old=0)
    assert status["frame_epoch"] == 1 and settled_epoch(watch) == 1
    middle = ((BEFORE[0] + AFTER[0]) / 2, (BEFORE[1] + AFTER[1]) / 2)
    assert not is_known(watch, middle) and not is_known(watch, BEFORE)
    assert is_known(watch, AFTER)


def test_after_a_restart_the_first_pose_is_believed(start, peer, tmp_path):
    """The epoch goes on from the snapshot's; where the robot is now is no jump."""
    parts = {"rest": f'[jump]\nrule = "clear"\n[snapshot]\npath = "{tmp_path}/map"'}
    daemon, watch = start(**parts), Watch(URL)
    robot = Robot(watch, peer)
    for place in (BEFORE, AFTER, AFTER, AFTER):
        robot.see(place)
    wait_for_status(watch, scans_inserted=3, frame_jumps=1)
    assert daemon.stop() == 0
    start(**parts)
    watch = Watch(URL)
    robot.watch = watch
    for _ in range(2):
        robot.see(BEFORE)
    status = wait_for_status(watch, scans_inserted=2, frame_jumps=0, scans_at_jump=0)
    assert status["frame_epoch"] == 1 and settled_epoch(watch) == 1
    assert is_known(watch, AFTER) and is_known(watch, BEFORE)

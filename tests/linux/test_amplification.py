"""Little that comes from the bus must not become much: on the bus, in the log, or in a counter."""
import itertools
import time

from conftest import N_BEAMS, URL, encoded, fresh_status, scan, wait_for_status, wait_until
from gpom_watch import Watch
from test_gpomd import check_counts

RASTER = "cell_m = 0.5\nnx = 60\nny = 55\ncorner = [12.0, 70.5]"


def whole_maps(watch, peer):
    """Numbers of publications that hold all tiles, as they come."""
    numbers = set()

    def note(_, data):
        tile = peer.type("gpom.map_t").decode(data)
        if tile.keyframe:
            numbers.add(tile.map_sequence)
    watch.bus.subscribe("GPOM_MAP", note).set_queue_capacity(0)
    return numbers


def test_keyframes_that_are_asked_for_are_a_second_apart(start, peer):
    """However often they are asked for; the last request is not forgotten."""
    start(raster=RASTER, publish="map_hz = 50\nkeyframe_s = 1000")
    watch = Watch(URL)
    numbers, start_s = whole_maps(watch, peer), time.monotonic()
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: watch.map.is_whole)
    n_asked = 0
    for n_asked in range(200):
        watch.request_keyframe()
        watch.collect(0.01)
    assert 1 < len(numbers) <= 3 + time.monotonic() - start_s < n_asked / 4
    n_before = len(numbers)
    watch.request_keyframe()
    wait_until(watch, lambda: len(numbers) > n_before)


def test_a_pose_that_jumps_to_and_fro_fills_neither_the_log_nor_the_bus(start, peer):
    """Each jump is counted; a line tells of some, and a keyframe comes once a second."""
    daemon = start(raster=RASTER, publish="map_hz = 50\nkeyframe_s = 1000",
                   rest="[jump]\nspeed_mps = 1")
    watch = Watch(URL)
    numbers, start_s = whole_maps(watch, peer), time.monotonic()
    for i in range(300):
        pose = [20.0 if i // 2 % 2 == 0 else 30.0, 80.0, 0.3]
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i, pose=pose)))
        watch.collect(0.01)
    n_jumps = wait_for_status(watch, scans_received=300)["counts"]["frame_jumps"]
    assert n_jumps > 100
    elapsed_s = time.monotonic() - start_s
    assert 0 < len(numbers) <= 2 + elapsed_s < n_jumps / 4
    assert daemon.stop() == 0, daemon.lines
    lines = [line for line in daemon.lines if "the map frame jumped" in line]
    assert 0 < len(lines) <= 2 + elapsed_s / 10
    assert any(f"({n_jumps} until now)" in line for line in lines)


def test_scans_from_the_future_keep_no_others_out(start, peer):
    """One in nine is stamped almost a second ahead, which is let in."""
    start()
    watch, n_inserted, number = Watch(URL), 0, itertools.count()
    wait_until(watch, lambda: watch.status is not None)
    for i in range(90):
        ahead_us = 950_000 if i % 9 == 8 else 0
        stamp_us = int(time.time() * 1e6) + ahead_us
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, next(number), utime=stamp_us)))
        n_inserted += 1
        watch.collect(0.01)
    counts = wait_for_status(watch, scans_received=90)["counts"]
    assert counts["scans_inserted"] + counts["scans_at_jump"] == 90, counts


def test_poses_from_the_future_keep_no_others_out(start, peer):
    """Likewise: each scan finds its pose."""
    start(sensors='[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 34.0',
          rest='[pose]\ntype = "bot_core.pose_t"\nwait_max_s = 60.0\ngap_max_s = 60.0')
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)

    def send_pose(stamp_us):
        watch.bus.publish("POSE", encoded(peer("bot_core.pose_t", utime=stamp_us,
                                               pos=[20.0, 80.0, 0.0], orientation=[1, 0, 0, 0])))
    for i in range(60):
        send_pose(int(time.time() * 1e6))
        watch.bus.publish("LIDAR", encoded(peer(
            "bot_core.planar_lidar_t", utime=int(time.time() * 1e6), nranges=N_BEAMS,
            ranges=[8.0] * N_BEAMS, rad0=-1.5, radstep=0.1)))
        watch.collect(0.005)
        if i % 9 == 8:
            send_pose(int(time.time() * 1e6) + 950_000)
    send_pose(int(time.time() * 1e6))
    counts = wait_for_status(watch, scans_inserted=60, poses_received=67)["counts"]
    assert counts["poses_refused"] <= 6  # those of the future that gave way


def test_a_forged_number_is_no_loss_of_two_thousand_million_scans(start, peer):
    """It is that of a sender which counts anew; so is the true one that comes next."""
    start()
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    numbers = [0, 2**31 - 1, 1, 2, 5]
    check_counts(watch, [("GPOM_SCAN", encoded(scan(peer, i, sequence=number)))
                         for i, number in enumerate(numbers)], 5, scans_inserted=5, scans_lost=2)
    assert fresh_status(watch)["state"] == "mapping"

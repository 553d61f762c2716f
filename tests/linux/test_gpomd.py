"""gpomd over real LCM: what goes in must come out, whatever is lost must be counted."""
import math
import random
import re
import subprocess
import time

import numpy as np
import pytest
from conftest import (N_BEAMS, PATIENCE_S, ROOT, T0_US, URL, URL_WITH_ROOM, encoded, fresh_status,
                      library_cells, replay, run, scan, stalled, tool, wait_for_map,
                      wait_for_settled_map, wait_for_status, wait_until)
from gpom_watch import Watch

PARAMS = ROOT / "tools" / "params" / "street.toml"

# ---- the way through ----------------------------------------------------------------------------

def test_the_published_map_is_the_library_s_to_the_last_code(start, street, tmp_path):
    daemon, watch = start(), Watch(URL)
    replay(street)
    cells, _ = library_cells(daemon, street, tmp_path)
    wait_for_map(watch, cells)
    counts = wait_for_status(watch, scans_inserted=40)["counts"]
    assert counts["scans_received"] == 40
    assert watch.map.n_bad == 0 and len(set(cells)) > 50
    assert daemon.stop() == 0 and "stopped after 40 scans" in daemon.lines[-1]


def snapshots_of(daemon, folder, name):
    """Stop a daemon; the bytes of what it wrote at its end."""
    assert daemon.stop() == 0
    return [(folder / f"{name}.{slot}").read_bytes() for slot in (0, 1)]


def players(log):
    yield [tool("gpom-replay"), log, "--channel", "GPOM_SCAN", "--rate", "4"]
    yield ["lcm-logplayer", "--speed=4", "--regexp=GPOM_SCAN", log]


def test_a_recorded_log_rebuilds_the_map_bit_for_bit(start, street, tmp_path):
    """Recorded by lcm-logger, played by gpom-replay and by lcm-logplayer; also when the map was
    full and beams made room for others."""
    def begin(name):
        return start(rest=f'[snapshot]\npath = "{name}"\nperiod_s = 1e6', map="beam_max = 800")

    def n_recorded(channel):
        return log.read_bytes().count(channel) if log.exists() else 0

    def call_logger():
        watch.bus.publish("CALL", b"")
        return n_recorded(b"CALL") > 0
    log, watch = tmp_path / "bus.log", Watch(URL)
    daemon = begin("live")
    logger = subprocess.Popen(["lcm-logger", "--quiet", "--force", "--flush-interval=50",
                               f"--lcm-url={URL_WITH_ROOM}", log],
                              stdout=subprocess.DEVNULL)
    wait_until(watch, call_logger)  # it does not tell when it listens
    replay(street, rate=4)  # the logger's buffer may be small, and must not lose any
    cells, _ = library_cells(daemon, street, tmp_path)
    wait_for_map(watch, cells)
    assert wait_for_status(watch, scans_inserted=40)["counts"]["kept_evicted"] > 0
    wait_until(watch, lambda: n_recorded(b"GPOM_SCAN") == 40)
    logger.terminate()
    logger.wait(PATIENCE_S)
    first = snapshots_of(daemon, tmp_path, "live")
    assert max(map(len, first)) > 36 * 800
    for i, player in enumerate(players(log)):
        again, watch = begin(f"again{i}"), Watch(URL)
        subprocess.run(player, check=True, stdout=subprocess.DEVNULL, timeout=PATIENCE_S)
        wait_for_status(watch, scans_inserted=40)
        assert snapshots_of(again, tmp_path, f"again{i}") == first


def test_the_map_is_what_gpom_query_makes_of_the_same_scans(start, street, tmp_path):
    """gpom-watch tells so, cell by cell; and tells when it is not so."""
    start()
    replay(street)
    answers = tmp_path / "answers.csv"

    def ask(*options):
        done = run("gpom-query", "--live", "--scans", street, "--params", PARAMS, "--beam-max",
                   8000, "--out", answers, *options)
        assert done.returncode == 0, done.stderr
        return run("gpom-watch", "--settled", "--compare", answers)
    same = ask("--keep", 0.1, "--raster", "0,50,1,70,60")
    assert same.returncode == 0 and same.stdout.startswith("4200 of 4200 cells"), same
    other = ask("--raster", "0,50,1,70,60", "--keep", "0.5")
    assert other.returncode == 1 and "differ" in other.stdout, other
    moved = ask("--raster", "0.5,50,1,70,60")
    assert moved.returncode == 2 and "run gpom-query with --raster 0,50,1,70,60" in moved.stderr


def test_tiles_carry_corner_keyframe_and_order(start, peer):
    """Half a cell or a tile in the wrong place would show here."""
    start(raster="cell_m = 0.5\nnx = 60\nny = 55\ncorner = [12.0, 70.5]")
    watch, tiles = Watch(URL), []
    watch.bus.subscribe("GPOM_MAP", lambda _, data: tiles.append(
        peer.type("gpom.map_t").decode(data)))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: watch.map.is_whole)
    first = tiles[:9]
    assert [tile.i_tile for tile in first] == list(range(9))
    assert {(tile.map_sequence, tile.n_tiles, tile.keyframe) for tile in first} == {(0, 9, 1)}
    assert sum(tile.n_cells for tile in first) == 60 * 55
    for tile in first:
        assert list(tile.corner) == [12.0 + 0.5 * tile.ix0, 70.5 + 0.5 * tile.iy0]
    ix, iy = int((20 - 12) / 0.5), int((80 - 70.5) / 0.5)
    wait_until(watch, lambda: watch.map.classes()[iy, ix] == 0)  # the robot stands on free ground


def test_the_map_stays_fresh_when_nothing_changes_and_keyframes_come_on_request(start, peer):
    start(publish="keyframe_s = 1000")
    watch, keyframes = Watch(URL), []
    watch.bus.subscribe("GPOM_MAP", lambda _, data: keyframes.append(
        peer.type("gpom.map_t").decode(data).keyframe))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_for_status(watch, scans_inserted=1)
    wait_for_settled_map(watch)
    del keyframes[:]
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 1, ranges=[math.nan] * N_BEAMS)))
    wait_until(watch, lambda: watch.map.tile.stamp_us == T0_US + 100_000)
    assert 1 not in keyframes
    watch.request_keyframe()
    wait_until(watch, lambda: 1 in keyframes)


# ---- what is dropped ----------------------------------------------------------------------------

def counted(watch, before):
    """What rose since, but for scans received."""
    after = watch.status["counts"]
    return {name: after[name] - before[name] for name in before
            if name.startswith(("scans", "poses", "time", "frame")) and after[name] != before[name]}


def check_counts(watch, messages, received, **expected):
    """Send messages; exactly these counters rise, by so much."""
    before = fresh_status(watch)["counts"]
    for channel, data in messages:
        watch.bus.publish(channel, data)
        time.sleep(0.002)  # in order, one by one
    expected = {**({"scans_received": received} if received else {}), **expected}
    assert watch.collect(PATIENCE_S, lambda: counted(watch, before) == expected), (
        expected, counted(watch, before))


def test_every_fault_of_own_scans_raises_its_counter_alone(start, peer):
    start(rest='[jump]\nrule = "none"')
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)

    def send(*scans):
        return [("GPOM_SCAN", data if isinstance(data, bytes) else encoded(data))
                for data in scans]
    now_us = int(time.time() * 1e6)
    damaged = bytearray(encoded(scan(peer, 1)))
    damaged[40] ^= 1
    cases = [
        ([scan(peer, 0)], 1, {"scans_inserted": 1}),
        ([bytes(damaged)], 1, {"scans_corrupt": 1}),
        ([b"", b"short", encoded(scan(peer, 1))[:-1]], 3,
         {"scans_malformed": 2, "scans_corrupt": 1}),
        ([encoded(peer("bot_core.pose_t"))], 1, {"scans_other_type": 1}),
        ([scan(peer, 1, sensor_id=7)], 1, {"scans_malformed": 1}),
        ([scan(peer, 1, angle_min=math.nan)], 1, {"scans_malformed": 1}),
        ([scan(peer, 1, n_ranges=3000, ranges=[1.0] * 3000)], 1, {"scans_malformed": 1}),
        ([scan(peer, 1), scan(peer, 1)], 2, {"scans_inserted": 1, "scans_repeated": 1}),
        ([scan(peer, 5)], 1, {"scans_inserted": 1, "scans_lost": 3}),
        ([scan(peer, 3)], 1, {"scans_reordered": 1}),
        ([scan(peer, 6, utime=T0_US)], 1, {"scans_jumped_back": 1}),
        ([scan(peer, 7, utime=now_us + 3600 * 10**6)], 1, {"scans_too_new": 1}),
        ([scan(peer, 8, pose=[math.nan, 0, 0])], 1, {"scans_bad_pose": 1}),
        ([scan(peer, 9, pose_cov=[-1.0] * 9)], 1, {"scans_bad_pose": 1}),
        ([scan(peer, 10, pose=[1e5, 0, 0])], 1, {"scans_out_of_reach": 1}),
        ([scan(peer, 0, utime=T0_US + 2_000_000)], 1, {"scans_inserted": 1}),  # sender restarted
        ([scan(peer, 1, utime=T0_US + 2_100_000)], 1, {"scans_inserted": 1}),
        # the sender's clock was set back: followed at the tenth in order
        ([scan(peer, 2 + i, utime=1000 * (i + 1)) for i in range(11)], 11,
         {"scans_jumped_back": 9, "scans_inserted": 2}),
    ]
    for messages, received, expected in cases:
        check_counts(watch, send(*messages), received, **expected)


def test_scans_older_than_allowed_are_refused(start, peer):
    start(intake="age_max_s = 60")
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    check_counts(watch, [("GPOM_SCAN", encoded(scan(peer, 0)))], 1, scans_too_old=1)
    fresh = scan(peer, 1, utime=int(time.time() * 1e6) - 1_000_000)
    check_counts(watch, [("GPOM_SCAN", encoded(fresh))], 1, scans_inserted=1)


@pytest.mark.parametrize("no_return, counter", [("free", "beams_no_return"),
                                                ("ignore", "beams_nan")])
def test_what_no_return_means_is_configured(no_return, counter, start, peer):
    start(sensors='[[sensor]]\ntype = "gpom.scan_t"\nrange_max_m = 34.0\n'
                  f'no_return = "{no_return}"')
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    ranges = [8.0] * (N_BEAMS - 2) + [34.0, math.inf]
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0, ranges=ranges)))
    counts = wait_for_status(watch, scans_inserted=1, beams_hit=N_BEAMS - 2)["counts"]
    assert [counts["beams_no_return"], counts["beams_nan"]].count(2) == 1 and counts[counter] == 2


def test_every_range_of_an_inserted_scan_is_in_one_counter_of_beams(start, peer):
    """Returns that are new, known, behind a wall or too many; readings of every useless kind."""
    start(map="beam_max = 200\nkeep_m = 0.5", sensors='[[sensor]]\ntype = "gpom.scan_t"\n'
          "range_max_m = 34.0\nrange_min_m = 0.2\nmasks = [[1.4, 1.6]]")
    watch, rng = Watch(URL), random.Random(1)
    kinds = [8.0, 8.0, 8.0, 20.0, 3.0, math.inf, math.nan, 0.0, -math.inf, 0.1]
    for i in range(60):
        ranges = [rng.choice(kinds) for _ in range(N_BEAMS)] if i > 5 else [8.0] * N_BEAMS
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i, ranges=ranges)))
        time.sleep(0.002)  # in order, one by one
    counts = wait_for_status(watch, scans_inserted=60)["counts"]
    beams = {name: n for name, n in counts.items() if name.startswith("beams_")}
    assert sum(beams.values()) == 60 * N_BEAMS, beams
    assert [name for name, n in beams.items() if n == 0] == ["beams_ids_spent"]
    assert 0 < counts["kept_evicted"] < counts["beams_hit"]


@pytest.mark.parametrize("fields, no_return, nan, not_positive, too_near", [
    ("", 0, 0, 1, 1),
    ('zero = "no_return"', 1, 0, 0, 1),
    ('too_near = "no_return"', 1, 0, 1, 0),
    ('zero = "no_return"\ntoo_near = "no_return"\nno_return = "ignore"', 0, 0, 1, 1)])
def test_what_readings_of_0_and_near_ones_mean_is_configured(
        fields, no_return, nan, not_positive, too_near, start, peer):
    start(sensors='[[sensor]]\ntype = "gpom.scan_t"\nrange_max_m = 34.0\n' + fields)
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    ranges = [8.0] * (N_BEAMS - 2) + [0.0, 0.007]
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0, ranges=ranges)))
    counts = wait_for_status(watch, scans_inserted=1, beams_hit=N_BEAMS - 2)["counts"]
    assert [counts[f"beams_{name}"] for name in ("no_return", "nan", "not_positive", "too_near")
            ] == [no_return, nan, not_positive, too_near]


def test_each_sensor_of_a_channel_has_its_mount_masks_and_latency(start, peer):
    """A wall 8 m ahead of one at the front that looks left, and of one upside down at the back."""
    sensor = '[[sensor]]\ntype = "gpom.scan_t"\nrange_max_m = 34.0\n'
    start(sensors=sensor + 'id = 1\nmount = [2.0, 0.0, 1.5707963]\nlatency_s = 0.25\n'
                  'masks = [[0.45, 1.0], [3.0, -3.0]]\n'
                  + sensor + 'id = 2\nmount = [-3.0, 0.0, 3.1415927]\nrange_min_m = 1.0\n'
                  'upside_down = true',
          raster="cell_m = 0.5\nnx = 120\nny = 60\ncorner = [0.0, 65.0]")
    watch = Watch(URL)

    def send(sensor_id, i, bearings, ranges):
        """Two scans, since a single witness may wait for a second."""
        for k in (0, 1):
            watch.bus.publish("GPOM_SCAN", encoded(scan(
                peer, 2 * i + k, sensor_id=sensor_id, pose=[20.0, 80.0, 0.0],
                angle_min=bearings[0], angle_step=bearings[1], n_ranges=len(ranges),
                ranges=ranges)))
    send(1, 0, (-0.1, 0.1), [8.0, 8.0, 8.0, 8.0, 8.0, 8.0, 8.0, 8.0])  # up to 0.6: two masked
    send(2, 1, (0.25, 0.05), [0.5, 8.0, 8.0, 8.0])  # the first is too near
    counts = wait_for_status(watch, scans_inserted=4)["counts"]
    assert (counts["beams_masked"], counts["beams_too_near"]) == (4, 2)

    def cls(x_m, y_m):
        if watch.map.tile is None:
            return None
        return watch.map.classes()[int((y_m - 65.0) / 0.5), int(x_m / 0.5)]
    # looks along +y from (22, 80)
    wait_until(watch, lambda: cls(22.0, 88.1) == 2 and cls(22.0, 84.0) == 0)
    # looks along -x from (17, 80); its bearings run clockwise, up from there
    x_m, y_m = 17.0 - 8.0 * math.cos(0.35), 8.0 * math.sin(0.35)
    wait_until(watch, lambda: cls(x_m, 80.0 + y_m) == 2)
    assert cls(x_m, 80.0 - y_m) != 2
    assert watch.status["scan_stamp_us"] == T0_US + 3 * 100_000  # of the second, without latency
    send(1, 2, (0.0, 0.1), [8.0])
    wait_for_status(watch, scans_inserted=6)
    assert watch.status["scan_stamp_us"] == T0_US + 5 * 100_000 - 250_000


FAMILIES = {
    "bot_core": ("bot_core.planar_lidar_t", 'type = "bot_core.pose_t"'),
    "mbot": ("mbot_lcm_msgs.lidar_t", 'type = "mbot_lcm_msgs.pose2D_t"\nchannel = "SLAM_POSE"'),
}


def foreign(family, wait_max_s=60.0):
    """Parts of the configuration for another family's scans. They wait for poses for longer than
    any machine takes, unless a test is about those that do not come."""
    scans, poses = FAMILIES[family]
    return {"sensors": f'[[sensor]]\ntype = "{scans}"\nrange_max_m = 34.0',
            "rest": f"[pose]\n{poses}\nwait_max_s = {wait_max_s}"}


def lidar(peer, stamp_us, **fields):
    fields = {"utime": stamp_us, "nranges": N_BEAMS, "ranges": [8.0] * N_BEAMS, "rad0": -1.5,
              "radstep": 0.1, **fields}
    return "LIDAR", peer("bot_core.planar_lidar_t", **fields).encode()


def pose(peer, stamp_us, **fields):
    fields = {"utime": stamp_us, "pos": [20.0, 80.0, 0.0], "orientation": [1.0, 0.0, 0.0, 0.0],
              **fields}
    return "POSE", peer("bot_core.pose_t", **fields).encode()


def test_every_fault_of_foreign_scans_and_poses_raises_its_counter_alone(start, peer):
    start(**foreign("bot_core"))
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    ms = 1000
    cases = [
        ([pose(peer, T0_US)], 0, {"poses_received": 1}),
        ([lidar(peer, T0_US)], 1, {"scans_inserted": 1}),
        ([lidar(peer, T0_US)], 1, {"scans_repeated": 1}),
        ([lidar(peer, T0_US - 1)], 1, {"scans_jumped_back": 1}),
        ([lidar(peer, T0_US + 50 * ms), pose(peer, T0_US + 100 * ms)], 1,
         {"scans_inserted": 1, "poses_received": 1}),  # the pose comes later
        ([lidar(peer, T0_US + 200 * ms), pose(peer, T0_US + 900 * ms)], 1,
         {"scans_no_pose": 1, "poses_received": 1}),  # too far from the one before
        ([pose(peer, T0_US), pose(peer, T0_US + 1000 * ms, pos=[math.nan, 0, 0]),
          ("POSE", b"nonsense")], 0, {"poses_received": 3, "poses_refused": 3}),
        ([pose(peer, T0_US + 1000 * ms, orientation=q)
          for q in ([0.0] * 4, [2.0, 0.0, 0.0, 2.0], [1.02, 0.0, 0.0, 0.0],
                    [0.98, 0.0, 0.0, 0.0], [math.nan, 0.0, 0.0, 1.0])],
         0, {"poses_received": 5, "poses_refused": 5}),  # no rotations
        ([pose(peer, T0_US + 1000 * ms, orientation=[0.705, 0.0, 0.0, 0.705])], 0,
         {"poses_received": 1}),  # a rounded one
        ([pose(peer, T0_US + 3000 * ms), lidar(peer, T0_US + 3000 * ms)], 1,
         {"scans_inserted": 1, "poses_received": 1, "time_gaps": 1}),
        ([("LIDAR", encoded(scan(peer, 0)))], 1, {"scans_other_type": 1}),
        ([("LIDAR", lidar(peer, T0_US)[1] + b"more")], 1, {"scans_malformed": 1}),
        ([lidar(peer, T0_US + 3100 * ms, rad0=math.inf)], 1, {"scans_malformed": 1}),
    ]
    for messages, received, expected in cases:
        check_counts(watch, messages, received, **expected)


def test_a_scan_whose_pose_does_not_come_in_time_is_counted(start, peer):
    start(**foreign("bot_core", wait_max_s=1.0))
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    check_counts(watch, [pose(peer, T0_US)], 0, poses_received=1)
    check_counts(watch, [lidar(peer, T0_US + 50_000)], 1, scans_no_pose=1)


@pytest.mark.parametrize("family", FAMILIES)
def test_garbage_of_other_families_is_accounted_for(family, start, street, peer):
    """Without a checksum some of it passes for scans; every one ends in one counter."""
    daemon, watch = start(**foreign(family, wait_max_s=5.0)), Watch(URL)
    replay(street, "--family", family)
    wait_for_status(watch, scans_inserted=40)
    stamp_us = T0_US + 10_000_000
    good = [lidar(peer, stamp_us), pose(peer, stamp_us)] if family == "bot_core" else [
        ("LIDAR", peer("mbot_lcm_msgs.lidar_t", utime=stamp_us, num_ranges=N_BEAMS,
                       times=[stamp_us] * N_BEAMS, ranges=[8.0] * N_BEAMS, thetas=[0.1] * N_BEAMS,
                       intensities=[0.0] * N_BEAMS).encode()),
        ("SLAM_POSE", peer("mbot_lcm_msgs.pose2D_t", utime=stamp_us).encode())]
    publish_garbage(watch, good, 400)
    wait_until(watch, lambda: watch.status["counts"]["scans_received"] > 40 + 400 / 4)
    wait_until(watch, lambda: is_every_scan_accounted_for(watch))
    assert daemon.stop() == 0


def test_a_scan_from_before_the_oldest_pose_is_too_old(start, peer):
    start(**foreign("bot_core"))
    watch = Watch(URL)
    wait_until(watch, lambda: watch.status is not None)
    check_counts(watch, [pose(peer, T0_US), lidar(peer, T0_US - 1)], 1, poses_received=1,
                 scans_too_old=1)


def test_more_scans_than_can_be_mapped_are_counted_not_queued(start, peer):
    start(intake="queue_scans = 2", map="beam_max = 60000\nkeep_m = 0.01")
    watch = Watch(URL)
    rng = random.Random(1)
    for i in range(800):
        watch.bus.publish("GPOM_SCAN", encoded(scan(
            peer, i, n_ranges=1500, angle_step=0.004,
            ranges=[rng.uniform(1, 30) for _ in range(1500)])))
        if i % 8 == 7 and watch.collect(0.02, lambda: watch.status is not None
                                        and watch.status["counts"]["scans_overrun"] > 0):
            break

    def is_accounted_for():
        counts = watch.status["counts"]
        return counts["scans_received"] == counts["scans_inserted"] + counts["scans_overrun"]
    wait_until(watch, is_accounted_for)
    assert watch.status["counts"]["scans_overrun"] > 0


def publish_garbage(watch, good, n):
    """Random bytes, and good messages with wrong bits or cut short, on their channels."""
    rng = random.Random(2)
    for i in range(n):
        channel, message = rng.choice(good)
        data = bytearray(rng.randbytes(rng.randrange(0, 300)) if i % 2 else message)
        for _ in range(rng.randrange(1, 8)):
            if data:
                data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        watch.bus.publish(channel, bytes(data[:rng.randrange(len(data) + 1)] if i % 3 else data))
        if i % 20 == 0:
            time.sleep(0.01)


SCAN_ENDS = ("inserted", "bad_pose", "out_of_reach", "other_type", "corrupt", "malformed",
             "repeated", "reordered", "too_old", "too_new", "jumped_back", "no_pose", "overrun",
             "at_jump")


def is_every_scan_accounted_for(watch):
    counts = watch.status["counts"]
    return counts["scans_received"] == sum(counts[f"scans_{end}"] for end in SCAN_ENDS)


def test_garbage_on_every_channel_changes_no_cell(start, street, peer, tmp_path):
    daemon, watch = start(), Watch(URL)
    replay(street)
    cells, _ = library_cells(daemon, street, tmp_path)
    wait_for_map(watch, cells)
    query = peer("gpom.query_t", n_points=1, points=[peer("gpom.point_t")])
    good = [("GPOM_SCAN", encoded(scan(peer, 1000))), ("GPOM_QUERY", encoded(query)),
            ("GPOM_MAP_REQUEST", b"please")]
    publish_garbage(watch, good, 400)
    wait_until(watch, lambda: watch.status is not None
               and watch.status["counts"]["scans_received"] > 40 + 400 / 4)
    wait_until(watch, lambda: is_every_scan_accounted_for(watch))
    counts = watch.status["counts"]
    assert counts["scans_inserted"] == 40
    bad = ("other_type", "corrupt", "malformed")
    assert counts["scans_received"] == 40 + sum(counts[f"scans_{name}"] for name in bad)
    wait_for_map(watch, cells)
    assert daemon.stop() == 0
    assert re.search(r"dropped: \d+ of another type, \d+ corrupt, \d+ malformed, \d+ queries",
                     "".join(daemon.lines)), daemon.lines


def test_what_the_system_refuses_to_send_is_counted(start, peer):
    """Without a route; no publication is counted that nobody could see."""
    daemon, seen = start(publish="keyframe_s = 0.05\nmap_hz = 100"), set()
    watch = Watch(URL_WITH_ROOM)
    watch.bus.subscribe("GPOM_MAP", lambda _, data: seen.add(
        peer.type("gpom.map_t").decode(data).map_sequence)).set_queue_capacity(0)
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: seen)
    assert fresh_status(watch)["counts"]["messages_not_sent"] == 0

    def has_refused_tiles():
        return fresh_status(watch)["counts"]["messages_not_sent"] > 20
    for _ in range(PATIENCE_S):
        subprocess.run(["ip", "route", "del", "224.0.0.0/4", "dev", "lo"], check=True)
        time.sleep(0.5)
        subprocess.run(["ip", "route", "add", "224.0.0.0/4", "dev", "lo"], check=True)
        if has_refused_tiles():
            break
    assert has_refused_tiles()
    assert watch.status["counts"]["maps_published"] <= len(seen)
    assert daemon.stop() == 0
    assert re.search(r"dropped: .*\d+ messages not sent", "".join(daemon.lines)), daemon.lines


# ---- other families ------------------------------------------------------------------------------

@pytest.mark.parametrize("family", FAMILIES)
def test_other_families_scans_give_the_same_map(family, start, street, tmp_path):
    """Their angles are float32, their poses quaternions or float32: what is near an edge may tip.
    The cap on points of one scan (scan_points_max) holds for beams with times of their own, too."""
    assert "scan_points_max = 3" in PARAMS.read_text()
    daemon = start(**foreign(family))
    watch = Watch(URL)
    replay(street, "--family", family)
    wait_for_status(watch, scans_inserted=40)
    assert watch.status["counts"]["poses_received"] == 40
    cells, _ = library_cells(daemon, street, tmp_path)
    expected = np.frombuffer(cells, np.uint8).reshape(2, 60, 70)[0]

    def is_near():
        if not watch.map.is_whole:
            return False
        gap = np.abs(watch.map.probability.astype(int) - expected)
        return np.mean(gap > 2) < 0.01
    wait_until(watch, is_near)


def test_beams_with_times_of_their_own_are_placed_where_the_robot_was(start, peer):
    """A robot drives at 10 m/s past a wall at y = 85: straight only if each beam has its pose."""
    start(**foreign("mbot"), raster="cell_m = 0.25\nnx = 160\nny = 40\ncorner = [10.0, 77.0]")
    watch, duration_us, n = Watch(URL), 500_000, 101
    for i in range(61):
        t_us = T0_US + 10_000 * i
        watch.bus.publish("SLAM_POSE", peer("mbot_lcm_msgs.pose2D_t", utime=t_us,
                                            x=20.0 + 10e-6 * (t_us - T0_US), y=80.0).encode())
    times = [T0_US + duration_us * k // (n - 1) for k in range(n)]
    for stamp_us in (T0_US, T0_US + 1):
        watch.bus.publish("LIDAR", peer(
            "mbot_lcm_msgs.lidar_t", utime=stamp_us, num_ranges=n, times=times,
            ranges=[5.0] * n, thetas=[math.pi / 2] * n, intensities=[0.0] * n).encode())
    wait_for_status(watch, scans_inserted=2)
    iy, ix0, ix1 = round((85 - 77) / 0.25), int((20.5 - 10) / 0.25), int((24.5 - 10) / 0.25)
    wait_until(watch, lambda: watch.map.tile is not None
               and (watch.map.classes()[iy, ix0:ix1] == 2).all()
               and (watch.map.classes()[iy - 4, ix0:ix1] == 0).all())


def test_other_families_maps_keep_their_conventions(start, street, peer):
    """mbot: corner of cell 0, sign by class; libbot: centre of cell 0, probability."""
    start(publish='grid = "SLAM_MAP"\npixels = "PIXEL_MAP"\ngrid_s = 0.1')
    watch, grids, pixels = Watch(URL), [], []
    watch.bus.subscribe("SLAM_MAP", lambda _, data: grids.append(data))
    watch.bus.subscribe("PIXEL_MAP", lambda _, data: pixels.append(data))
    replay(street)
    wait_for_status(watch, scans_inserted=40)
    wait_for_settled_map(watch)
    del grids[:], pixels[:]
    wait_until(watch, lambda: grids and pixels)
    grid = peer.type("mbot_lcm_msgs.occupancy_grid_t").decode(grids[-1])
    assert (grid.origin_x, grid.origin_y, grid.meters_per_cell) == (0.0, 50.0, 1.0)
    assert (grid.width, grid.height, grid.num_cells) == (70, 60, 70 * 60)
    odds = np.array(grid.cells).astype(np.int8).reshape(60, 70).astype(int)
    classes = watch.map.classes()
    assert ((odds < 0) == (classes == 0)).all()
    assert (odds[classes == 2] > 0).all() and (odds[classes == 3] == 0).all()
    pixel = peer.type("occ_map.pixel_map_t").decode(pixels[-1])
    assert list(pixel.dimensions) == [70, 60] and list(pixel.xy0) == [0.5, 50.5]
    assert pixel.mpp == 1.0 and (pixel.compressed, pixel.data_type) == (0, 1)
    chance = np.frombuffer(pixel.mapData, "<f4").reshape(60, 70)
    known = classes != 3
    code = watch.map.probability[known].astype(float)
    assert (np.ceil(254 * chance[known].astype(float) - 1e-4) == code).mean() > 0.999
    assert (chance[~known] == 0.5).all()


# ---- questions ----------------------------------------------------------------------------------

def ask(watch, peer, **fields):
    """The answer to a query."""
    answers = []
    subscription = watch.bus.subscribe("GPOM_ANSWER", lambda _, data: answers.append(
        peer.type("gpom.answer_t").decode(data)))
    points = [peer("gpom.point_t", x=x, y=y) for x, y in fields.pop("points")]
    query = peer("gpom.query_t", client=77, sequence=5, n_points=len(points), points=points,
                 **fields)
    watch.bus.publish("GPOM_QUERY", encoded(query))
    wait_until(watch, lambda: answers)
    watch.bus.unsubscribe(subscription)
    assert (answers[0].client, answers[0].sequence) == (77, 5)
    return answers[0]


def test_answers_are_the_library_s(start, street, peer, tmp_path):
    daemon, watch = start(), Watch(URL)
    replay(street)
    wait_for_status(watch, scans_inserted=40)
    corners = [(5.0, 93.0), (30.0, 93.5), (30.0, 88.0)]
    arcs = [*np.arange(0, 30.5, 2.0), 25 + 5.5 + 0.005]  # the first leg is 25.005 m long
    leg = math.hypot(25.0, 0.5)
    along = [(5 + 25 * s / leg, 93 + 0.5 * s / leg) if s < leg else (30.0, 93.5 - (s - leg))
             for s in arcs[:-1]] + [corners[-1]]
    for kind, places, asked in ((0, corners, corners), (1, along, corners)):
        numbers = [repr(float(number)) for place in places for number in place]
        _, expected = library_cells(daemon, street, tmp_path, *numbers)
        answer = ask(watch, peer, kind=kind, step_m=2.0 * kind, points=asked)
        got = [[p.mean, p.variance, p.probability, p.cls] for p in answer.points]
        assert answer.status == 0 and len(got) == len(expected)
        got, expected = np.float32(got), np.float32(expected)
        assert np.allclose(got, expected, rtol=0, atol=2e-5 if kind else 0)
    assert answer.map_utime == round(1e6 * float(street.read_text().splitlines()[-1].split(",")[0]))


def test_queries_that_come_at_once_are_answered_one_after_the_other(start, peer):
    """On an idle map, in their order, and without the sleep of 0.1 s between two that an idle map
    has: most answers are stamped less than half of that after the one before."""
    daemon, watch, answers, statuses, n = start(), Watch(URL), [], [], 24
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: statuses.append(data))
    watch.bus.subscribe("GPOM_ANSWER", lambda _, data: answers.append(
        peer.type("gpom.answer_t").decode(data)))
    wait_until(watch, lambda: statuses)
    with stalled(daemon.process, "mapping"):  # all are queued when it looks
        for i in range(n):
            watch.bus.publish("GPOM_QUERY", encoded(peer("gpom.query_t", sequence=i)))
        del statuses[:]
        wait_until(watch, lambda: len(statuses) > 2)
        assert not answers
    wait_until(watch, lambda: len(answers) == n)
    assert [answer.sequence for answer in answers] == list(range(n))
    gaps_s = 1e-6 * np.diff([answer.utime for answer in answers])
    assert np.median(gaps_s) < 0.05, gaps_s


@pytest.mark.parametrize("status, step_m, points", [
    (1, 0.1, [(0, 60), (50, 60)]), (2, 0.0, [(0, 60), (1, 60)]), (2, math.nan, [(0, 60), (1, 60)]),
    (3, 1.0, [(1e6, 60)]), (0, 1.0, [(3, 60)])])
def test_a_path_that_cannot_be_answered_is_refused_by_cause(status, step_m, points, start, peer):
    start()
    answer = ask(Watch(URL), peer, kind=1, step_m=step_m, points=points)
    assert answer.status == status
    assert answer.n_points == {0: 1, 3: 1}.get(status, 0)
    assert all(point.cls == 3 for point in answer.points) or status != 3

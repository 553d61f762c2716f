"""One drive in every kind of file gives one map; poses between messages are where an independent
interpolation has them."""
import gzip
import math
import pathlib
import re

import drives
import gpom
import numpy as np
import pytest
from gpom.io import lcm as lcm_log
from gpom.io.poses import FrameTree, PoseTrack
from rosbags.highlevel import AnyReader

ROOT = pathlib.Path(__file__).resolve().parents[2]


def map_bytes(scans):
    return gpom.map_of(scans, gpom.preset("indoor")).snapshot()


@pytest.fixture(scope="module")
def expected(log):
    """The map of the LCM log."""
    return map_bytes(gpom.io.read(log).scans)


def test_a_log_and_a_bag_of_one_drive_give_the_same_map_to_the_bit(bag, expected, drive):
    recording = gpom.io.read(bag)
    assert len(recording.scans) == len(drive.stamps_us)
    assert map_bytes(recording.scans) == expected


def test_a_gzipped_log_is_the_log(log, expected, tmp_path):
    path = tmp_path / "drive.lcmlog.gz"
    path.write_bytes(gzip.compress(log.read_bytes()))
    assert map_bytes(gpom.io.read(path).scans) == expected


def test_a_carmen_text_has_the_same_probabilities(log, tmp_path):
    """Six digits of each number: within 1e-3."""
    scans = gpom.io.read(log).scans
    text = gpom.io.read(drives.write_carmen(scans, tmp_path / "drive.log"), range_max_m=30.0)
    params = gpom.preset("indoor")
    maps = [gpom.map_of(each, params, live=False) for each in (scans, text.scans)]
    x_m, y_m = np.array([scan.pose[:2] for scan in scans]).T
    points = np.random.default_rng(5).uniform((x_m.min() - 20, y_m.min() - 20),
                                              (x_m.max() + 20, y_m.max() + 20), (5000, 2))
    probabilities = [each.query(points)["probability"].astype(float) for each in maps]
    assert np.ptp(probabilities[0]) > 0.9  # there is something to tell apart
    assert np.abs(probabilities[0] - probabilities[1]).max() <= 1e-3


@pytest.mark.parametrize("name", ["scans.csv", "scans.npz"])
def test_written_scans_are_read_back_to_the_bit(log, expected, name, tmp_path):
    gpom.io.write_scans(tmp_path / name, gpom.io.read(log).scans)
    assert map_bytes(gpom.io.read(tmp_path / name).scans) == expected


def test_scans_written_as_mcap_are_read_by_rosbags_and_by_the_package(log, tmp_path):
    """Quaternions round a yaw by its last bit; ranges stay as they are."""
    scans = gpom.io.read(log).scans
    gpom.io.write_scans(tmp_path / "scans.mcap", scans)
    with AnyReader([tmp_path / "scans.mcap"]) as reader:
        assert {c.topic for c in reader.connections} == {"/scan", "/tf"}
        assert reader.message_count == 2 * len(scans)
    for scan, other in zip(gpom.io.read(tmp_path / "scans.mcap").scans, scans, strict=True):
        assert np.array_equal(scan.ranges_m, other.ranges_m)
        assert np.allclose(scan.pose[:2], other.pose[:2], atol=1e-9)
        assert abs(math.remainder(scan.pose[2] - other.pose[2], 2 * math.pi)) < 1e-9


def test_scans_of_gpomds_own_type_have_their_pose(drive, tmp_path):
    path = drives.write_lcm(drive, tmp_path / "own.lcmlog", "gpom")
    scans = gpom.io.read(path).scans
    for scan, stamp_us in zip(scans, drive.stamps_us, strict=True):
        pose = next(p for p in drive.poses if p[0] >= stamp_us)
        assert scan.stamp_us == stamp_us and scan.pose[:2] == pose[1:3]
        turn = scan.pose[2] - 2 * math.atan2(pose[3][3], pose[3][0])
        assert abs(math.remainder(turn, 2 * math.pi)) < 1e-9


def test_scans_of_mbot_have_a_pose_for_each_beam(drive, tmp_path):
    path = drives.write_lcm(drive, tmp_path / "mbot.lcmlog", "mbot")
    scans = gpom.io.read(path).scans
    assert len(scans) == len(drive.stamps_us) and all(scan.is_sweep for scan in scans)
    exact = gpom.io.read(drives.write_lcm(drive, tmp_path / "bot.lcmlog")).scans
    for scan, other in zip(scans, exact):
        x_m, y_m, yaw_rad = scan.poses.T
        assert np.allclose([x_m, y_m], np.reshape(other.pose[:2], (2, 1)), atol=1e-4)
        assert np.allclose(np.exp(1j * yaw_rad), np.exp(1j * other.pose[2]), atol=1e-5)
    assert gpom.map_of(scans, gpom.preset("indoor")).n_beams > 100


def test_a_sweep_written_as_a_scan_keeps_its_ends(drive, tmp_path):
    """The ends of the beams stay where they were, but for the step of the even bearings."""
    path = drives.write_lcm(drive, tmp_path / "mbot.lcmlog", "mbot")
    scan = gpom.io.read(path).scans[4]
    _, x_m, y_m, yaw_rad, angle_min_rad, step_rad, range_max_m, ranges_m = scan.laser_tuple()
    fan = yaw_rad + angle_min_rad + step_rad * np.arange(len(ranges_m))
    ends = np.stack([x_m + ranges_m * np.cos(fan), y_m + ranges_m * np.sin(fan)], axis=1)
    ends = ends[np.isfinite(ranges_m) & (ranges_m < range_max_m)]
    bearings = scan.pose[2] + scan.bearings()
    is_hit = scan.ranges_m < scan.sensor.range_max_m
    true = np.stack([scan.poses[:, 0] + scan.ranges_m * np.cos(bearings),
                     scan.poses[:, 1] + scan.ranges_m * np.sin(bearings)], axis=1)[is_hit]
    nearest_m = np.sqrt(((ends[:, None] - true[None]) ** 2).sum(axis=2)).min(axis=1)
    assert len(ends) > 10
    reach_m = ranges_m[np.isfinite(ranges_m) & (ranges_m < range_max_m)]
    assert np.all(nearest_m <= 0.5 * step_rad * reach_m + 1e-3)
    assert step_rad < 1.1 * drive.angle_step_rad and len(ends) >= 0.9 * len(true)


# --- ROS ----------------------------------------------------------------------------------------

def tf_rows(drive, messages, mount=((0.2, 0.1, 0.3), (1.0, 0.0, 0.0, 0.0))):
    """map <- odom <- base_link <- laser: the robot where the drive's poses are."""
    yield "/tf_static", drives.T0_US, messages.transform(drives.T0_US, "base_link", "laser", *mount)
    q = drives.quaternion(0.5)
    for stamp_us, x_m, y_m, pose_q in drive.poses:
        # odom in the map: turned by 0.5, moved; base_link in odom: the rest
        yaw = 2 * math.atan2(pose_q[3], pose_q[0]) - 0.5
        c, s = math.cos(-0.5), math.sin(-0.5)
        dx, dy = x_m - 3.0, y_m + 2.0
        yield "/tf", stamp_us, messages.transform(stamp_us, "map", "odom", (3.0, -2.0, 0.0), q)
        yield "/tf", stamp_us, messages.transform(
            stamp_us, "odom", "base_link", (c * dx - s * dy, s * dx + c * dy, 0.0),
            drives.quaternion(yaw))


def test_tf_gives_the_place_of_the_laser(drive, log, tmp_path):
    """Three frames and a mount, against the poses of the log and the mount by hand."""
    messages = drives.Messages(False)
    rows = [(t, s, m) for t, s, m in drives.drive_messages(drive, messages) if t == "/scan"]
    path = drives.write_rows(tmp_path / "tf", [*tf_rows(drive, messages), *rows], messages)
    recording = gpom.io.read(path)
    robot = gpom.io.read(log).scans
    assert any("map <- odom <- base_link <- laser" in note for note in recording.notes)
    for scan, other in zip(recording.scans, robot, strict=True):
        x_m, y_m, yaw_rad = other.pose
        c, s = math.cos(yaw_rad), math.sin(yaw_rad)
        assert np.allclose(scan.pose[:2], (x_m + c * 0.2 - s * 0.1, y_m + s * 0.2 + c * 0.1),
                           atol=2e-3)  # translation and turn are interpolated apart in each frame
        assert abs(math.remainder(scan.pose[2] - yaw_rad, 2 * math.pi)) < 1e-6


def test_a_laser_that_hangs_upside_down_turns_clockwise(drive, log, tmp_path):
    messages = drives.Messages(False)
    rows = [(t, s, m) for t, s, m in drives.drive_messages(drive, messages) if t == "/scan"]
    hanging = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0))  # half a turn about x
    path = drives.write_rows(tmp_path / "tf", [*tf_rows(drive, messages, hanging), *rows], messages)
    scan, other = gpom.io.read(path).scans[5], gpom.io.read(log).scans[5]
    assert scan.sensor.upside_down and not other.sensor.upside_down
    assert abs(math.remainder(scan.pose[2] - other.pose[2], 2 * math.pi)) < 1e-6


def test_odometry_with_a_static_mount(drive, log, tmp_path):
    messages = drives.Messages(False)
    rows = [("/scan", t, messages.scan(drive, i)) for i, t in enumerate(drive.stamps_us)]
    rows += [("/odom", pose[0], messages.odometry(pose)) for pose in drive.poses]
    rows.append(("/tf_static", drives.T0_US,
                 messages.transform(drives.T0_US, "base_link", "laser", (0.4, 0.0, 0.2),
                                    drives.quaternion(0.1))))
    path = drives.write_rows(tmp_path / "odom", rows, messages)
    scans = gpom.io.read(path, pose="/odom").scans
    assert [scan.pose for scan in scans] == [scan.pose for scan in gpom.io.read(log).scans]
    assert scans[0].sensor.x_m == 0.4 and math.isclose(scans[0].sensor.yaw_rad, 0.1)


@pytest.mark.parametrize("echo, offset_m", [("first", 0.0), ("last", 1.0)])
def test_one_of_several_echoes(drive, tmp_path, echo, offset_m):
    messages = drives.Messages(False)
    rows = [("/echoes", t, messages.echoes(drive, i)) for i, t in enumerate(drive.stamps_us)]
    rows += [("/pose", pose[0], messages.pose_stamped(pose)) for pose in drive.poses]
    path = drives.write_rows(tmp_path / "echoes", rows, messages)
    scans = gpom.io.read(path, echo=echo).scans
    assert np.array_equal(scans[2].ranges_m, drive.ranges_m[2] + np.float32(offset_m))


def test_a_sweep_takes_poses_at_the_times_of_its_beams(drive, tmp_path):
    messages = drives.Messages(False)
    n = len(drive.ranges_m[0])
    rows = [("/scan", t, messages.scan(drive, i, time_increment=0.1 / n))
            for i, t in enumerate(drive.stamps_us[:-1])]
    rows += [("/pose", pose[0], messages.pose_stamped(pose)) for pose in drive.poses]
    path = drives.write_rows(tmp_path / "sweep", rows, messages)
    still, moving = gpom.io.read(path).scans[3], gpom.io.read(path, is_sweep=True).scans[3]
    assert not still.is_sweep and moving.is_sweep
    assert np.allclose(moving.poses[0], still.pose)
    far_m = math.dist(moving.poses[-1][:2], still.pose[:2])
    assert 0.3 < far_m < 0.7  # 1 m in 0.2 s, for 0.1 s


def test_interpolation_of_a_frame_is_scipys():
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    slerp = pytest.importorskip("scipy.spatial.transform").Slerp
    random = np.random.default_rng(6)
    turns = rotation.random(20, random_state=7)
    stamps = np.cumsum(random.integers(1000, 90_000, 20))
    places = random.normal(size=(20, 3))
    tree = FrameTree()
    for stamp, place, (x, y, z, w) in zip(stamps, places, turns.as_quat()):
        tree.add("map", "laser", int(stamp), (tuple(place), (w, x, y, z)), False)
    for stamp in random.integers(stamps[0], stamps[-1], 200):
        (place, (w, x, y, z)), _ = tree.at(["laser"], int(stamp), 10**9)
        expected = slerp(stamps, turns)([stamp])
        assert np.allclose(rotation.from_quat([x, y, z, w]).as_matrix(), expected.as_matrix()[0])
        assert np.allclose(place, [np.interp(stamp, stamps, places[:, k]) for k in range(3)])


def test_yaw_goes_the_shorter_way_round():
    track = PoseTrack()
    track.push(0, 0.0, 0.0, 3.1)
    track.push(100, 1.0, 0.0, -3.1)
    poses, _ = track.at([50], 1000)
    assert math.isclose(abs(math.remainder(poses[0][2], 2 * math.pi)), math.pi)


def test_poses_are_not_interpolated_over_a_gap_nor_beyond_the_ends():
    track = PoseTrack()
    for stamp_us in (100, 200, 900):
        track.push(stamp_us, 0.0, 0.0, 0.0)
    causes = [track.at([t], 100)[1] for t in (99, 150, 500, 901)]
    assert causes[1] == "" and causes[0].startswith("before") and causes[3].startswith("after")
    assert causes[2].startswith("between poses")


# --- LCM ----------------------------------------------------------------------------------------

def test_fingerprints_are_those_of_the_codec():
    text = "".join(path.read_text() for path in (ROOT / "ports/codec").glob("*.h"))
    known = {int(number, 16) for number in re.findall(r"FINGERPRINT UINT64_C\((\w+)\)", text)}
    assert known and set(lcm_log.TYPES) <= known


CONFIG = """
[pose]
channel = "POSE"
gap_max_s = 0.3
[[sensor]]
type = "bot_core.planar_lidar_t"
channel = "LIDAR"
range_max_m = 20.0
no_return = "ignore"
range_sd_m = 0.03
zero = "no_return"
mount = [0.5, 0.25, 0.1]
upside_down = true
masks = [[2.8, -2.8]]
latency_s = 0.02
"""


def test_a_log_is_read_as_gpomd_toml_says(log, tmp_path):
    from gpom.io.gpomd_config import apply_config
    (tmp_path / "gpomd.toml").write_text(CONFIG)
    options = gpom.io.ReadOptions()
    apply_config(tmp_path / "gpomd.toml", options)
    scan, plain = gpom.io.read(log, options).scans[4], gpom.io.read(log).scans[4]
    sensor = scan.sensor
    assert (sensor.x_m, sensor.y_m, sensor.yaw_rad) == (0.5, 0.25, 0.1)
    assert sensor.upside_down and sensor.zero_is_no_return and not sensor.too_near_is_no_return
    assert math.isclose(sensor.range_var_m2, 9e-4, rel_tol=1e-6) and sensor.range_max_m == 20.0
    assert np.allclose(sensor.masks, [[2.8, -2.8]])
    assert scan.stamp_us == plain.stamp_us - 20_000 and scan.pose != plain.pose
    assert np.all(np.isnan(scan.ranges_m) == (plain.ranges_m >= 20.0))


def test_the_list_says_what_a_file_holds(log, ros2, drive):
    for path, scans, poses in (log, "LIDAR", "POSE"), (ros2, "/scan", "/pose"):
        rows = {row.name: row for row in gpom.io.contents(path)}
        assert rows[scans].use == "scans" and rows[poses].use == "poses"
        assert (rows[scans].n_messages, rows[poses].n_messages) == (len(drive.stamps_us),
                                                                    len(drive.poses))

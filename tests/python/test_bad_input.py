"""What cannot be read is told in one line that names file, topic and remedy."""
import re
import shutil

import drives
import gpom
import numpy as np
import pytest
from gpom.io import convert


def refused(path, **words):
    """The one line."""
    with pytest.raises(gpom.FileError) as error:
        gpom.io.read(path, **words)
    text = str(error.value)
    assert "\n" not in text and text.startswith(str(path)) and len(text) < 500, text
    return text


def rewritten(path, folder, n_bytes):
    """A copy of a bag whose data file has only its first bytes."""
    copy = folder / path.name
    (shutil.copytree if path.is_dir() else shutil.copyfile)(path, copy)
    data = copy if copy.is_file() else max(copy.iterdir(), key=lambda p: p.stat().st_size)
    data.write_bytes(data.read_bytes()[:n_bytes])
    return copy


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.6, 0.95])
def test_a_truncated_bag_is_named_with_a_remedy(bag, tmp_path, share):
    size = max(p.stat().st_size for p in ([bag] if bag.is_file() else bag.iterdir()))
    path = rewritten(bag, tmp_path, int(share * size))
    try:
        assert re.search("record again|reindex|recover|list the file|give", refused(path))
    except pytest.fail.Exception:
        # a database may have lost nothing but its last page
        assert share == 0.95


def test_each_cut_of_a_log_is_read_up_to_there_or_named(log, tmp_path):
    """Cut in an event: all scans before it. Nothing that could be read is lost."""
    data = log.read_bytes()
    whole = gpom.io.read(log)
    random = np.random.default_rng(8)
    for n_bytes in random.integers(len(data) // 2, len(data), 40):
        path = tmp_path / "cut.lcmlog"
        path.write_bytes(data[:n_bytes])
        part = gpom.io.read(path)
        is_whole = data[n_bytes:n_bytes + 4] == b"\xed\xa1\xda\x01"
        assert is_whole or any("cut in its last event" in note for note in part.notes)
        n = len(part.scans)
        assert 0 < n < len(whole.scans) + 1
        assert [scan.stamp_us for scan in part.scans] == [s.stamp_us for s in whole.scans[:n]]


def test_a_log_that_is_damaged_inside_says_where(log, tmp_path):
    data = bytearray(log.read_bytes())
    at = data.index(b"\xed\xa1\xda\x01", len(data) // 2)
    data[at] ^= 1
    path = tmp_path / "damaged.lcmlog"
    path.write_bytes(data)
    assert f"damaged after its first {at} bytes" in refused(path)


def scan_rows(drive, messages, frame="laser"):
    return [("/scan", t, messages.scan(drive, i, frame)) for i, t in enumerate(drive.stamps_us)]


def test_missing_tf_names_the_frames_and_the_options(drive, tmp_path):
    messages = drives.Messages(False)
    tf = messages.transform(drives.T0_US, "odom", "base_link", (0.0, 0.0, 0.0), (1.0, 0, 0, 0))
    rows = [*scan_rows(drive, messages), ("/tf", drives.T0_US, tf)]
    path = drives.write_rows(tmp_path / "bag", rows, messages)
    text = refused(path)
    assert "/tf: no transform from map or odom to the scans' frame laser" in text
    assert "base_link, odom" in text and "--fixed-frame" in text and "--pose" in text


def test_scans_without_any_pose_say_what_to_record(drive, tmp_path):
    messages = drives.Messages(False)
    path = drives.write_rows(tmp_path / "bag", scan_rows(drive, messages), messages)
    assert "neither /tf nor a topic of poses" in refused(path)


def test_tf_of_another_time_is_counted_by_cause(drive, tmp_path):
    messages = drives.Messages(False)
    late = [("/tf", t + 10**9, messages.transform(t + 10**9, "map", "laser", (0.0, 0.0, 0.0),
                                                  (1.0, 0.0, 0.0, 0.0)))
            for t in drive.stamps_us]
    path = drives.write_rows(tmp_path / "bag", [*scan_rows(drive, messages), *late], messages)
    assert "/scan: no scan is left: 40 scans before the transform of laser begins" in refused(path)


@pytest.mark.parametrize("words, text", [
    ({"scan": "/lidar"}, "/lidar: no scans on this topic; topics with scans are: /scan"),
    ({"scan": "/pose"}, "/pose: no scans on this topic"),
    ({"pose": "/scan"}, "/scan: no poses on this topic; topics with poses are: /pose"),
    ({"fixed_frame": "world"}, "/tf: no transform from world"),
])
def test_a_topic_of_another_type_is_told_with_those_that_fit(ros2, words, text):
    assert text in refused(ros2, **words)


def test_two_topics_of_scans_must_be_chosen_from(drive, tmp_path):
    messages = drives.Messages(False)
    rows = scan_rows(drive, messages) + [("/other", t, m) for _, t, m in scan_rows(drive, messages)]
    rows += [("/pose", pose[0], messages.pose_stamped(pose)) for pose in drive.poses]
    path = drives.write_rows(tmp_path / "bag", rows, messages)
    assert "2 topics with scans (/other, /scan); give one with --scan" in refused(path)
    assert len(gpom.io.read(path, scan="/other").scans) == 40


def test_a_bag_without_scans_points_to_the_list(drive, tmp_path):
    messages = drives.Messages(False)
    rows = [("/pose", pose[0], messages.pose_stamped(pose)) for pose in drive.poses]
    path = drives.write_rows(tmp_path / "bag", rows, messages)
    assert "0 topics with scans (none); list the file" in refused(path)


def test_quaternions_of_zero_are_counted(drive, tmp_path):
    messages = drives.Messages(False)
    rows = scan_rows(drive, messages)
    rows += [("/pose", p[0], messages.pose_stamped((*p[:3], (0.0, 0.0, 0.0, 0.0))))
             for p in drive.poses]
    path = drives.write_rows(tmp_path / "bag", rows, messages)
    assert "158 poses whose quaternion is not of unit length" in refused(path)


def test_damaged_lcm_messages_are_counted_and_the_others_read(drive, tmp_path):
    import lcm
    path = tmp_path / "log"
    log = lcm.EventLog(str(path), "w", overwrite=True)
    for i, stamp_us in enumerate(drive.stamps_us):
        data = drives.gpom_scan(drive, i, crc=i != 3)
        log.write_event(stamp_us, "GPOM_SCAN", data[:-5] if i == 5 else data)
    log.write_event(drives.T0_US, "GPOM_SCAN", b"another type")
    log.close()
    recording = gpom.io.read(path)
    assert len(recording.scans) == 38
    assert sum(recording.n_dropped.values()) == 3
    assert any("CRC" in cause for cause in recording.n_dropped)
    assert any("another type" in cause for cause in recording.n_dropped)


def test_no_bytes_of_an_lcm_message_do_harm(drive):
    """Each truncation and random damage of each message is decoded or refused by struct.error."""
    import struct

    from gpom.io import lcm as reader
    random = np.random.default_rng(9)
    for family in "gpom", "bot_core", "mbot":
        _, message = drives.scan_message(drive, 0, family)
        kind = reader.type_of(message)
        for n_bytes in range(8, len(message), 7):
            with pytest.raises(struct.error):
                reader._decode_scan(kind, message[:n_bytes])
        for _ in range(200):
            damaged = bytearray(message)
            damaged[int(random.integers(8, len(damaged)))] = int(random.integers(256))
            try:
                reader._decode_scan(kind, bytes(damaged))
            except struct.error:
                pass


def test_scans_that_need_poses_and_have_none(drive, tmp_path):
    import dataclasses
    blind = dataclasses.replace(drive, poses=[])
    path = drives.write_lcm(blind, tmp_path / "log")
    assert "LIDAR: its scans need poses and the log has none" in refused(path)


def test_a_million_lines_of_text_are_refused_at_the_first(tmp_path):
    path = tmp_path / "text.csv"
    path.write_text("a line, of words, and commas\n" * 1_000_000)
    assert re.match(rf"{path}:1: ", refused(path))


def test_an_npz_of_something_else(tmp_path):
    np.savez(tmp_path / "other.npz", a=1)
    assert "stamps_us: no such array" in refused(tmp_path / "other.npz")
    np.savez(tmp_path / "short.npz", stamps_us=[1, 2], poses=np.zeros((1, 3)), angle_min_rad=0.0,
             angle_step_rad=0.1, range_max_m=10.0, ranges_m=np.zeros((2, 5)))
    assert "poses: has the shape (1, 3)" in refused(tmp_path / "short.npz")


@pytest.mark.parametrize("content", [b"", b"\x1f\x8b", b"PK\x03\x04", b"#ROSBAG V2.0\n",
                                     b"\x89MCAP0\r\n", b"\xed\xa1\xda\x01", b"\xff" * 1000])
def test_a_file_that_only_begins_like_one(content, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(content)
    refused(path)


def test_an_empty_folder(tmp_path):
    (tmp_path / "bag").mkdir()
    refused(tmp_path / "bag")


@pytest.mark.parametrize("words, text", [
    (["no_such", "--scans", "s.csv"], "no_such: cannot be read"),
    (["LOG"], "nothing to write"),
    (["LOG", "--map", "map.yaml"], "needs --params"),
    (["LOG", "--map", "map.tif", "--params", "indoor"], "ends in"),
    (["LOG", "--map", "map.png", "--params", "nothing.toml"], "nothing.toml"),
    (["LOG", "--scans", "scans.txt"], "ends in .csv, .mcap, .npz"),
    (["LOG", "--scan", "NO", "--scans", "s.csv"], "NO: no scans"),
    (["LOG", "--config", "none.toml", "--scans", "s.csv"], "none.toml"),
    (["LOG", "--map", "map.png", "--params", "indoor", "--cell", "0"], "cell_m must be over 0"),
    (["LOG", "--snapshot", "--map", "map.png", "--params", "indoor"], "whole snapshot|damaged"),
])
def test_the_command_says_it_in_one_line(log, tmp_path, capsys, monkeypatch, words, text):
    monkeypatch.chdir(tmp_path)
    assert convert.main([str(log) if word == "LOG" else word for word in words]) == 2
    told = [line for line in capsys.readouterr().err.splitlines() if "gpom-convert:" in line]
    assert len(told) == 1 and re.search(text, told[0])

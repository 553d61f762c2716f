"""All threads of gpomd at once. `make test-all` runs this with gpomd built for ThreadSanitizer too:
what that finds is the daemon's exit code."""
import os
import subprocess

from conftest import URL, encoded, tool, wait_until
from gpom_watch import Watch

SENSORS = "\n".join(f'[[sensor]]\ntype = "{kind}"\nrange_max_m = 34.0'
                    for kind in ("gpom.scan_t", "bot_core.planar_lidar_t"))
REST = """
[pose]
type = "bot_core.pose_t"
wait_max_s = 30.0
[snapshot]
path = "{folder}/map"
period_s = 0.1
[can]
interface = "none0"
[can.odometry]
speed = {{ id = 0x1A0, start = 16, length = 16, signed = true, factor = 0.01 }}
yaw_rate = {{ id = 0x1A0, start = 32, length = 16, signed = true, factor = 1e-3 }}
[can.publish]
clearance_hz = 50
status_hz = 50
[mavlink]
to = "udp:127.0.0.1:14550"
rate_hz = 50
"""
PUBLISH = 'grid = "SLAM_MAP"\npixels = "PIXEL_MAP"\ngrid_s = 0.1\nkeyframe_s = 0.2'


def test_all_threads_work_at_once_and_lose_nothing(start, street, peer, tmp_path):
    """Scans of two families, poses, questions, keyframes, grids, snapshots without a pause, a CAN
    interface that is not there, and an autopilot that does not listen: each scan ends in one
    counter, each thread ends in time."""
    environment = {"TSAN_OPTIONS": "exitcode=66 " + os.environ.get("TSAN_OPTIONS", "")}
    daemon = start(environment=environment, sensors=SENSORS, publish=PUBLISH,
                   rest=REST.format(folder=tmp_path))
    watch = Watch(URL)
    points = [peer("gpom.point_t", x=x, y=80.0) for x in (20.0, 28.0, 60.0)]
    query = encoded(peer("gpom.query_t", client=1, n_points=3, points=points))
    wait_until(watch, lambda: watch.status is not None)
    players = [subprocess.Popen([tool("gpom-replay"), street, "--rate", "4", "--family", family],
                                stdout=subprocess.DEVNULL) for family in ("gpom", "bot_core")]
    while any(player.poll() is None for player in players):
        watch.bus.publish("GPOM_QUERY", query)
        watch.request_keyframe()
        watch.collect(0.02)
    assert [player.returncode for player in players] == [0, 0]

    def is_all_done():
        counts = watch.status["counts"]
        ends = counts["scans_inserted"] + counts["scans_overrun"] + counts["scans_no_pose"]
        return counts["scans_received"] == ends == 80 and counts["snapshots_written"] > 3
    wait_until(watch, is_all_done)
    counts = watch.status["counts"]
    assert counts["queries_answered"] > 10 and counts["maps_published"] > 10
    assert counts["can_not_sent"] > 10 and counts["mavlink_not_sent"] > 10
    assert counts["snapshots_failed"] == 0
    assert daemon.stop() == 0, "\n".join(daemon.lines)

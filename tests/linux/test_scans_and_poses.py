"""Scans and poses that come apart: what gpomd makes of a localiser that is silent or late."""
import pytest
from conftest import N_BEAMS, T0_US, URL, encoded, wait_for_status, wait_until
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

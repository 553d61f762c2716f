"""What gpomd says of how fresh its map is."""
import itertools
import math
import struct
import time

import lcm
import pytest
from conftest import (DEFAULTS, N_BEAMS, PATIENCE_S, URL, config_text, encoded, fresh_status, scan,
                      wait_until)
from gpom_watch import Watch

TILE_HEAD = struct.Struct(">QqIhhbi3d")  # of gpom.map_t, up to its pose


@pytest.mark.campaign
def test_a_rare_status_tells_how_old_the_map_is_when_it_is_sent(start, peer):
    """The only scan comes right after a status: at the next one, seconds later, the map is stale,
    whether or not somebody looked in between."""
    start(text=config_text(publish="stale_s = 0.5").replace("status_s = 0.1", "status_s = 4.0"))
    watch, states = Watch(URL), []
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: states.append(
        peer.type("gpom.status_t").decode(data).state))
    wait_until(watch, lambda: states)
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: states[-1] != 0)
    assert states[-1] == 2


@pytest.mark.parametrize("blind", [
    {"n_ranges": 0, "ranges": []}, {"ranges": [math.nan] * N_BEAMS}, {"ranges": [0.0] * N_BEAMS},
    {"ranges": [0.1] * N_BEAMS}, {"angle_min": 0.5, "angle_step": 0.001}],
    ids=["none", "nan", "zero", "near", "masked"])
def test_scans_without_a_usable_reading_do_not_keep_a_map_fresh(blind, start, peer):
    """A covered lidar goes on sending. Its scans are counted, and the map is stale all the same;
    with the first reading that says something it is not."""
    start(publish="stale_s = 1.0", sensors=DEFAULTS["sensors"] +
          "\nrange_min_m = 0.2\nmasks = [[0.4, 0.6]]")
    watch, i = Watch(URL), itertools.count()

    def send_until(state, **fields):
        def holds():
            watch.bus.publish("GPOM_SCAN", encoded(scan(peer, next(i), **fields)))
            return fresh_status(watch)["state"] == state
        wait_until(watch, holds)
    send_until("mapping")
    send_until("stale", **blind)
    n_inserted = watch.status["counts"]["scans_inserted"]
    send_until("stale", **blind)
    wait_until(watch, lambda: watch.status["counts"]["scans_inserted"] > n_inserted)
    send_until("mapping", ranges=[math.nan] * (N_BEAMS - 1) + [8.0])


def jumping(bus, peer, seconds):
    """A localiser that jumps to and fro, and so long a wait after each scan that confirms it."""
    for i in itertools.count():
        x_m = 20.0 if i // 3 % 2 == 0 else 60.0
        bus.publish("GPOM_SCAN", encoded(scan(peer, i, pose=[x_m, 80.0, 0.3], n_ranges=1,
                                              ranges=[1.0])))
        if i % 3 == 2:
            end = time.monotonic() + seconds
            while bus.handle_timeout(1) > 0 or time.monotonic() < end:
                pass
            yield


@pytest.mark.campaign
def test_no_place_of_one_frame_is_told_in_another(start, peer):
    """Tiles are copied while the frame jumps to and fro: in even epochs the robot is at the one
    place, in odd ones at the other. A large raster is long in copying, so that jumps come
    meanwhile; the queue is so long that each gets its epoch."""
    start(raster="cell_m = 0.05\nnx = 1600\nny = 1600\ncorner = [0.0, 0.0]",
          intake=f"ranges_max = {N_BEAMS}\nqueue_scans = 4096", map="beam_max = 2000",
          publish="map_hz = 200\nkeyframe_s = 1000", rest="[jump]\nspeed_mps = 1")
    bus, places = lcm.LCM(URL), set()

    def note(_, data):
        *_, epoch, x_m, _, _ = TILE_HEAD.unpack_from(data)
        if not math.isnan(x_m):
            places.add((epoch, x_m))
    bus.subscribe("GPOM_MAP", note)
    start_s = time.monotonic()
    for _ in jumping(bus, peer, 0.01):
        seconds = time.monotonic() - start_s
        if seconds > PATIENCE_S or (seconds > 15.0 and len(places) > 5):
            break
    assert len(places) > 5
    assert [place for place in places if place[1] != (20.0, 60.0)[place[0] % 2]] == []


@pytest.mark.campaign
def test_the_frame_epoch_of_the_status_never_falls(start, peer):
    """Not even while the raster changes under the hand that reads it."""
    start(text=config_text(raster="cell_m = 0.05\nnx = 3000\nny = 3000\ncorner = [0.0, 0.0]",
                           publish="map_hz = 0.01", map="beam_max = 2000",
                           rest='[jump]\nrule = "clear"\nspeed_mps = 1'
                           ).replace("status_s = 0.1", "status_s = 0.05"))
    watch, epochs = Watch(URL), [0]
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: epochs.append(
        peer.type("gpom.status_t").decode(data).frame_epoch))
    end = time.monotonic() + PATIENCE_S
    for _ in jumping(watch.bus, peer, 0.02):
        if epochs[-1] > 100 or time.monotonic() > end:
            break
    assert epochs[-1] > 100 and epochs == sorted(epochs)

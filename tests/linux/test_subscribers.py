"""Subscribers made by lcm-gen, in C, C++ and Python, read everything that gpomd publishes."""
import os
import struct
import subprocess
import sys
import time

import pytest
from conftest import (BUILD, PATIENCE_S, ROOT, T0_US, URL, URL_WITH_ROOM, encoded, scan, tool,
                      wait_until)
from gpom_watch import Watch

PUBLISHED = {"GPOM_MAP": "gpom.map_t", "GPOM_STATUS": "gpom.status_t",
             "GPOM_ANSWER": "gpom.answer_t", "SLAM_MAP": "mbot_lcm_msgs.occupancy_grid_t",
             "PIXEL_MAP": "occ_map.pixel_map_t"}
COMPILER_S = 5 * PATIENCE_S
PEERS = ROOT / "tests" / "linux" / "peers"


def hear_all(watch):
    """Messages that come from now on, by channel."""
    messages = {channel: [] for channel in PUBLISHED}
    for channel in PUBLISHED:
        subscription = watch.bus.subscribe(channel, lambda name, data: messages[name].append(data))
        subscription.set_queue_capacity(0)  # all of them
    return messages


def provoke_all(watch, peer, is_enough):
    """Send a scan and questions until there is enough of everything."""
    points = [peer("gpom.point_t", x=x, y=80.0) for x in (20.0, 28.0, 60.0)]
    query = encoded(peer("gpom.query_t", client=1, n_points=3, points=points))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    end = time.monotonic() + PATIENCE_S
    while not is_enough() and time.monotonic() < end:
        watch.bus.publish("GPOM_QUERY", query)
        watch.collect(0.2)


def test_fields_mean_what_the_schema_says(start, peer):
    """Tiles and status by lcm-gen's code, against what gpom-watch reads and what was sent."""
    start()
    watch, tiles, states = Watch(URL), [], []
    watch.bus.subscribe("GPOM_MAP", lambda _, data: tiles.append(data))
    watch.bus.subscribe("GPOM_STATUS", lambda _, data: states.append(data))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    wait_until(watch, lambda: tiles and states and watch.map.is_whole
               and watch.status["counts"]["scans_inserted"] == 1)
    tile = peer.type("gpom.map_t").decode(tiles[-1])
    assert (tile.map_nx, tile.map_ny) == (watch.map.tile.map_nx, watch.map.tile.map_ny)
    assert tile.utime == T0_US and list(tile.pose) == [20.0, 80.0, 0.3]
    assert len(tile.probability) == tile.nx * tile.ny == tile.n_cells
    status = peer.type("gpom.status_t").decode(states[-1])
    assert status.version == 100 and status.beam_max == 8000
    assert status.map_bytes > 61 * 8000
    for message, data in ((tile, tiles[-1]), (status, states[-1])):
        assert message.crc32 == struct.unpack(">i", data[-4:])[0]


PUBLISH = 'grid = "SLAM_MAP"\npixels = "PIXEL_MAP"\ngrid_s = 1.0\nkeyframe_s = 0.2'


def test_python_reads_all_that_is_published_to_the_last_byte(start, peer):
    start(publish=PUBLISH)
    watch = Watch(URL_WITH_ROOM)
    messages = hear_all(watch)
    provoke_all(watch, peer, lambda: all(messages.values()))
    for channel, name in PUBLISHED.items():
        assert messages[channel], channel
        for data in messages[channel]:
            assert peer.type(name).decode(data).encode() == data, channel


def c_subscriber(folder):
    types = sorted(map(str, (ROOT / "lcmtypes").glob("*.lcm")))
    subprocess.run(["lcm-gen", "-c", "--c-cpath", folder, "--c-hpath", folder, *types], check=True,
                   timeout=COMPILER_S)
    subprocess.run(["cc", "-std=gnu99", "-Wall", "-Werror", f"-I{folder}", PEERS / "subscriber.c",
                    *folder.glob("*.c"), "-llcm", "-o", folder / "subscriber"], check=True,
                   timeout=COMPILER_S)
    return folder / "subscriber"


def cpp_subscriber(folder):
    types = sorted(map(str, (ROOT / "lcmtypes").glob("*.lcm")))
    subprocess.run(["lcm-gen", "-x", "--cpp-hpath", folder, *types], check=True, timeout=COMPILER_S)
    subprocess.run(["c++", "-std=c++17", "-Wall", f"-I{folder}", PEERS / "subscriber.cpp", "-llcm",
                    "-o", folder / "subscriber"], check=True, timeout=COMPILER_S)
    return folder / "subscriber"


@pytest.mark.parametrize("make", [c_subscriber, cpp_subscriber])
def test_c_and_cpp_read_all_that_is_published_to_the_last_byte(make, start, peer, tmp_path):
    """What they decoded is encoded again by the same code and must be what was sent."""
    program, output = make(tmp_path), tmp_path / "output"
    start(publish=PUBLISH)
    watch = Watch(URL_WITH_ROOM)
    messages = hear_all(watch)
    with output.open("w") as file:
        subscriber = subprocess.Popen([program, URL], stdout=file)

    def printed():
        lines = output.read_text().split("\n")
        return [line.split() for line in lines[:-1]]  # the last may be half a line
    try:
        provoke_all(watch, peer, lambda: {channel for channel, _ in printed()} == set(PUBLISHED))
    finally:
        subscriber.kill()
        subscriber.wait(PATIENCE_S)
    told = printed()
    assert {channel for channel, _ in told} == set(PUBLISHED)

    def not_sent():
        sent = {channel: {data.hex() for data in messages[channel]} for channel in PUBLISHED}
        return [channel for channel, data in told if data not in sent[channel]]
    watch.collect(PATIENCE_S, lambda: not not_sent())  # what the subscriber saw first
    assert not_sent() == []


# ---- the examples -------------------------------------------------------------------------------

def c_example(tmp_path):
    program = tmp_path / "subscribe_map"
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", "-I.", "-Iinclude",
                    "examples/subscribe_map.c", tool("libgpom_codec.a"), "-llcm", "-lm",
                    "-o", program], check=True, cwd=ROOT, timeout=COMPILER_S)
    return [program]


def python_example(_):
    return [sys.executable, ROOT / "examples" / "subscribe_map.py"]


@pytest.mark.parametrize("example", [c_example, python_example])
def test_the_examples_show_the_map_and_say_when_it_is_stale(example, start, peer, tmp_path):
    command, output = example(tmp_path), tmp_path / "output"
    start(publish="keyframe_s = 0.2")
    watch = Watch(URL)
    with output.open("w") as file:
        shown = subprocess.Popen([*command, URL], stdout=file,
                                 env={**os.environ, "PYTHONPATH": str(BUILD / "lcm" / "python")})
    try:
        for i in range(300):
            now_us = int(time.time() * 1e6)
            watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i, utime=now_us)))
            if watch.collect(0.2, lambda: "age 0" in output.read_text()):
                break
        wait_until(watch, lambda: output.read_text().splitlines()[-1:] != []
                   and output.read_text().splitlines()[-1].startswith("stale"))
        wait_until(watch, lambda: (watch.map.classes() == 2).any() and
                   f" {(watch.map.classes() == 2).sum()} occupied" in output.read_text())
    finally:
        shown.kill()
        shown.wait(PATIENCE_S)


def tile_of(peer, epoch, classes):
    """A tile at the corner of a map of two cells."""
    n = len(classes)
    return encoded(peer("gpom.map_t", utime=int(1e6 * time.time()), n_tiles=1, frame_epoch=epoch,
                        cell_m=1.0, prior_variance=1.0, map_nx=2, map_ny=1, nx=n, ny=1, n_cells=n,
                        probability=bytes(n), variance_class=bytes(classes)))


@pytest.mark.parametrize("example", [c_example, python_example])
def test_the_examples_ignore_tiles_from_before_a_jump(example, peer, tmp_path):
    """A late tile of an earlier epoch wipes nothing of the map."""
    command, output, watch = example(tmp_path), tmp_path / "output", Watch(URL)

    def shown():
        return [line for line in output.read_text().splitlines() if line.startswith("age")]

    def show_two_occupied():
        watch.bus.publish("GPOM_MAP", tile_of(peer, 1, [2, 2]))
        return any(" 2 occupied" in line for line in shown())
    with output.open("w") as file:
        program = subprocess.Popen([*command, URL], stdout=file,
                                   env={**os.environ, "PYTHONPATH": str(BUILD / "lcm" / "python")})
    try:
        wait_until(watch, show_two_occupied)
        watch.bus.publish("GPOM_MAP", tile_of(peer, 0, [0, 0]))
        watch.bus.publish("GPOM_MAP", tile_of(peer, 1, [0]))
        wait_until(watch, lambda: any(" 1 free" in line for line in shown()))
        assert " 1 occupied" in shown()[-1] and not any(" 2 free" in line for line in shown())
    finally:
        program.kill()
        program.wait(PATIENCE_S)

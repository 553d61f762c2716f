"""Subscribers made by lcm-gen, in C, C++ and Python, read everything that gpomd publishes."""
import os
import subprocess
import sys
import time

import pytest
from conftest import BUILD, ROOT, URL, encoded, scan, tool, wait_until
from gpom_watch import Watch

PUBLISHED = {"GPOM_MAP": "gpom.map_t", "GPOM_STATUS": "gpom.status_t",
             "GPOM_ANSWER": "gpom.answer_t", "SLAM_MAP": "mbot_lcm_msgs.occupancy_grid_t",
             "PIXEL_MAP": "occ_map.pixel_map_t"}
PEERS = ROOT / "tests" / "linux" / "peers"


def all_published(watch, peer, is_enough):
    """Messages of every channel, by channel, until enough have come."""
    messages = {channel: [] for channel in PUBLISHED}
    for channel in PUBLISHED:
        watch.bus.subscribe(channel, lambda name, data: messages[name].append(data))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0)))
    points = [peer("gpom.point_t", x=x, y=80.0) for x in (20.0, 28.0, 60.0)]
    query = encoded(peer("gpom.query_t", client=1, n_points=3, points=points))
    end = time.monotonic() + 20
    while not is_enough(messages) and time.monotonic() < end:
        watch.bus.publish("GPOM_QUERY", query)
        watch.collect(0.2)
    return messages


PUBLISH = 'grid = "SLAM_MAP"\npixels = "PIXEL_MAP"\ngrid_s = 0.1\nkeyframe_s = 0.2'


def test_python_reads_all_that_is_published_to_the_last_byte(start, peer):
    start(publish=PUBLISH)
    messages = all_published(Watch(URL), peer, lambda seen: all(seen.values()))
    for channel, name in PUBLISHED.items():
        assert messages[channel], channel
        for data in messages[channel]:
            assert peer.type(name).decode(data).encode() == data, channel


def c_subscriber(folder):
    types = sorted(map(str, (ROOT / "lcmtypes").glob("*.lcm")))
    subprocess.run(["lcm-gen", "-c", "--c-cpath", folder, "--c-hpath", folder, *types], check=True,
                   timeout=60)
    subprocess.run(["cc", "-std=gnu99", "-Wall", "-Werror", f"-I{folder}", PEERS / "subscriber.c",
                    *folder.glob("*.c"), "-llcm", "-o", folder / "subscriber"], check=True,
                   timeout=60)
    return folder / "subscriber"


def cpp_subscriber(folder):
    types = sorted(map(str, (ROOT / "lcmtypes").glob("*.lcm")))
    subprocess.run(["lcm-gen", "-x", "--cpp-hpath", folder, *types], check=True, timeout=60)
    subprocess.run(["c++", "-std=c++17", "-Wall", f"-I{folder}", PEERS / "subscriber.cpp", "-llcm",
                    "-o", folder / "subscriber"], check=True, timeout=60)
    return folder / "subscriber"


@pytest.mark.parametrize("make", [c_subscriber, cpp_subscriber])
def test_c_and_cpp_read_all_that_is_published_to_the_last_byte(make, start, peer, tmp_path):
    """What they decoded is encoded again by the same code and must be what was sent."""
    program, output = make(tmp_path), tmp_path / "output"
    start(publish=PUBLISH)
    with output.open("w") as file:
        subscriber = subprocess.Popen([program, URL], stdout=file)

    def printed():
        lines = output.read_text().splitlines()
        return [line.split() for line in lines[:-1]]  # the last may be half a line
    try:
        messages = all_published(
            Watch(URL), peer, lambda _: {line[0] for line in printed()} == set(PUBLISHED))
    finally:
        subscriber.kill()
        subscriber.wait(10)
    assert {channel for channel, _ in printed()} == set(PUBLISHED)
    sent = {channel: {data.hex() for data in messages[channel]} for channel in PUBLISHED}
    n_seen = sum(data in sent[channel] for channel, data in printed())
    assert n_seen >= len(PUBLISHED) and n_seen >= len(printed()) - 5  # the newest may be ahead


# ---- the examples -------------------------------------------------------------------------------

def c_example(tmp_path):
    program = tmp_path / "subscribe_map"
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", "-I.", "-Iinclude",
                    "tools/examples/subscribe_map.c", tool("libgpom_codec.a"), "-llcm", "-lm",
                    "-o", program], check=True, cwd=ROOT, timeout=60)
    return [program]


def python_example(_):
    return [sys.executable, ROOT / "tools" / "examples" / "subscribe_map.py"]


@pytest.mark.parametrize("example", [c_example, python_example])
def test_the_examples_show_the_map_and_say_when_it_is_stale(example, start, peer, tmp_path):
    command, output = example(tmp_path), tmp_path / "output"
    start(publish="keyframe_s = 0.2")
    watch = Watch(URL)
    with output.open("w") as file:
        shown = subprocess.Popen([*command, URL], stdout=file,
                                 env={**os.environ, "PYTHONPATH": str(BUILD / "lcm" / "python")})
    try:
        now_us = int(time.time() * 1e6)
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 0, utime=now_us)))
        wait_until(watch, lambda: "age 0" in output.read_text()
                   and output.read_text().splitlines()[-1].startswith("stale"))
        occupied = int((watch.map.classes() == 2).sum())
        wait_until(watch, lambda: f"{occupied} occupied" in output.read_text())
        assert occupied > 0
    finally:
        shown.kill()
        shown.wait(10)

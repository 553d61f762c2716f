"""The device image with an autopilot at UART 1, read by pymavlink."""
import select
import subprocess
import time

import pytest
from conftest import IMAGE, PATIENCE_S, ROOT, SCANS, connect, scan_message, street_messages
from pymavlink.dialects.v20 import common as mavlink
from sectors_oracle import NO_READING, World, allowed_distances, clockwise_from_forward

IMAGES = [ROOT / f"build/arm-none-eabi-{cpu}/gpom_mavlink.elf" for cpu in ("cortex-m7",
                                                                           "cortex-m4")]
RANGE_M, RADIUS_M = 40.0, 0.5  # ports/cortex_m/device_limits.h, and a default
STARTING, MAPPING, STALE = 1, 4, 5  # MAV_STATE


class Line:
    """What comes over UART 1."""

    def __init__(self, path):
        self.socket = connect(path)
        self.parser = mavlink.MAVLink(None)  # refuses bytes that are no message

    def next(self, kind, holds=lambda message: True):
        end, last = time.monotonic() + PATIENCE_S, None
        while time.monotonic() < end:
            if not select.select([self.socket], [], [], 0.1)[0]:
                continue
            for message in self.parser.parse_buffer(self.socket.recv(4096)) or []:
                if message.get_type() == kind:
                    last = message
                    if holds(message):
                        return message
        raise AssertionError(f"no such {kind}; the last: {last}")


@pytest.fixture(params=[("mps2-an500", IMAGES[0]), ("mps2-an386", IMAGES[1])],
                ids=["cortex-m7", "cortex-m4"])
def device(request, start, tmp_path):
    machine, image = request.param
    device = start("-serial", f"unix:{tmp_path}/autopilot,server=on,wait=off", machine=machine,
                   image=image)
    device.line = Line(tmp_path / "autopilot")
    return device


def again(k):
    """The last scan of the street, as if the robot stood there."""
    row = SCANS.read_text().splitlines()[-1].split(",")
    return scan_message([str(1000.0 + k), *row[1:]], 1000 + k)


def test_every_distance_is_that_of_the_map_and_a_stale_map_gives_none(device):
    """The cells are those that the device publishes; while a scan is worked in they may change, so
    those before and after the message must be equal."""
    assert set(device.line.next("OBSTACLE_DISTANCE").distances) == {NO_READING}
    assert device.line.next("HEARTBEAT").system_status == STARTING
    for message in street_messages():
        device.send("GPOM_SCAN", message)
    device.wait_for_counts(scans_inserted=len(street_messages()))
    for k in range(10):
        before = device.fresh_map()
        device.send("GPOM_SCAN", again(k))
        stamp_us = round(1e6 * (1000.0 + k))
        message = device.line.next("OBSTACLE_DISTANCE", lambda m: m.time_usec == stamp_us
                                   and min(m.distances) < NO_READING)
        if device.fresh_map() == before:
            break
    else:
        raise AssertionError("the map does not settle")
    tile = device.map.tile
    world = World(device.map.classes(), tile.corner_m, tile.cell_m, RANGE_M, RADIUS_M)
    values = clockwise_from_forward(message, 72)
    wanted = allowed_distances(world, list(tile.pose), 72)
    assert [(v, w) for v, w in zip(values, wanted) if v not in w] == []
    assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 196)
    device.line.next("OBSTACLE_DISTANCE", lambda m: set(m.distances) == {NO_READING})
    device.line.next("HEARTBEAT", lambda m: m.system_status == STALE)
    for _ in range(5):
        assert set(device.line.next("OBSTACLE_DISTANCE").distances) == {NO_READING}


def test_the_device_image_without_it_has_nothing_of_it():
    for image in (IMAGE, IMAGES[0]):
        listing = subprocess.run(["arm-none-eabi-nm", image], capture_output=True, text=True,
                                 check=True).stdout
        has = [name for name in ("gpom_mavlink", "gpom_sectors", "uart1") if name in listing]
        assert len(has) == (3 if image == IMAGES[0] else 0), has

"""The codec against LCM in Python, and over real LCM.

lcm-gen's C and C++ code is compared in tests/codec.
"""
import importlib
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import zlib

import lcm_schema
import pytest
import status_words
from conftest import ROOT, from_root

SCHEMAS = lcm_schema.read_all()
MESSAGES = [name for name in SCHEMAS if name not in ("gpom.point_t", "gpom.point_answer_t")]
LISTED = { # what the code bases they come from send
    "bot_core.planar_lidar_t": 0xe3d17423180b5e8d,
    "bot_core.pose_t": 0x2e16efb052b0105e,
    "mbot_lcm_msgs.lidar_t": 0x89dc5b879a5056cf,
    "mbot_lcm_msgs.occupancy_grid_t": 0xd5447e494a66cc92,
    "mbot_lcm_msgs.pose2D_t": 0x1f317af1246276ac,
    "occ_map.pixel_map_t": 0xe4b099a4cce13107,
}
CELLS = 5 * 7
FIXED = { # array sizes, and fields that a random number would make invalid
    "gpom.scan_t": {"n_ranges": 181},
    "gpom.map_t": {"i_tile": 2, "n_tiles": 3, "keyframe": 1, "map_nx": 32, "map_ny": 32, "ix0": 4,
                   "iy0": 25, "nx": 5, "ny": 7, "n_cells": CELLS,
                   "probability": bytes([255, *range(CELLS - 1)]),
                   "variance_class": bytes([3, *range(0, 4 * (CELLS - 1), 4)])},
    "gpom.distances_t": {"i_tile": 2, "n_tiles": 3, "keyframe": 1, "map_nx": 32, "map_ny": 32,
                         "ix0": 4, "iy0": 25, "nx": 5, "ny": 7, "n_cells": CELLS,
                         "occupied_dx": [-4] * CELLS, "occupied_dy": [0] * CELLS,
                         "not_free_dx": [-32768] * CELLS, "not_free_dy": [-32768] * CELLS},
    "gpom.status_t": {"state": 2},
    "gpom.query_t": {"kind": 1, "n_points": 80},
    "gpom.answer_t": {"status": 0, "n_points": 80},
    "gpom.point_answer_t": {"cls": 3},
    "bot_core.planar_lidar_t": {"nranges": 1081, "nintensities": 0},
    "mbot_lcm_msgs.lidar_t": {"num_ranges": 290},
    "mbot_lcm_msgs.occupancy_grid_t": {"width": 37, "height": 37, "num_cells": 37 * 37},
    "occ_map.pixel_map_t": {"dimensions": [37, 37], "compressed": 0, "data_type": 8,
                            "datasize": 37 * 37},
}


@pytest.fixture(scope="session")
def modules():
    """modules(name): lcm-gen's Python class of a full type name."""
    folder = from_root("GPOM_BUILD", "build/host-release") / "lcm" / "python"
    if not folder.is_dir():
        pytest.fail(f"{folder} is missing: run `make codec-tests`")
    sys.path.insert(0, str(folder))

    def find(name):
        return getattr(importlib.import_module(name), name.split(".")[1])
    return find


@pytest.fixture
def rng():
    return lcm_schema.random_generator(os.environ.get("GPOM_SEED", "1"))


def random_message(modules, name, rng, **fixed):
    package = name.split(".", maxsplit=1)[0]
    return lcm_schema.random_message(modules(name), SCHEMAS[name], rng,
                                     {**FIXED.get(name, {}), **fixed},
                                     lambda kind: random_message(modules, f"{package}.{kind}", rng))


def encoded(message):
    """Bytes of a message by lcm-gen's Python code; CRC-32 by zlib where it has one."""
    if hasattr(message, "crc32"):
        message.crc32 = struct.unpack(">i", struct.pack(">I", zlib.crc32(message.encode()[:-4])))[0]
    return message.encode()


def fields_of(message):
    """All fields, those of nested types too, to be compared."""
    if isinstance(message, (list, tuple)):
        return [fields_of(element) for element in message]
    if hasattr(message, "__slots__"):
        return [fields_of(getattr(message, name)) for name in message.__slots__]
    return message


def echo(tool, messages):
    """What the codec makes of messages: decoded and encoded again, b"" where it refuses."""
    sent = b"".join(struct.pack(">I", len(message)) + message for message in messages)
    back = subprocess.run([tool("codec-echo")], input=sent, capture_output=True, check=True).stdout
    received = []
    while back:
        (size,) = struct.unpack(">I", back[:4])
        received.append(back[4:4 + size])
        back = back[4 + size:]
    assert len(received) == len(messages)
    return received


@pytest.mark.parametrize("name", SCHEMAS)
def test_the_fingerprint_follows_from_the_definition(name, modules):
    value = lcm_schema.fingerprint(SCHEMAS[name], SCHEMAS)
    assert modules(name)._get_packed_fingerprint() == struct.pack(">Q", value)
    assert LISTED.get(name, value) == value


def test_the_headers_list_every_fingerprint():
    text = "".join(path.read_text() for path in (ROOT / "ports" / "codec").glob("*.h"))
    for name in MESSAGES:
        assert f"UINT64_C(0x{lcm_schema.fingerprint(SCHEMAS[name], SCHEMAS):016x})" in text, name


def test_header_and_gpom_watch_know_every_place_of_the_status():
    """Counters and problems, by the constants of the definition."""
    text = (lcm_schema.LCMTYPES / "gpom_status_t.lcm").read_text()
    constants = dict(re.findall(r"const int32_t (\w+) = (\d+);", text))  # places in counts
    bits = dict(re.findall(r"const int8_t (PROBLEM_\w+) = (\d+);", text))
    header = (ROOT / "ports" / "codec" / "gpom_status.h").read_text()
    listed = dict(re.findall(r"GPOM_WIRE_(\w+) = (\d+),", header))
    states = {name for name in listed if name.startswith("STATE_")}
    assert {**constants, **bits} == {name: n for name, n in listed.items() if name not in states}
    places = {name: int(n) for name, n in constants.items()}
    assert places.pop("PROBLEMS") == status_words.PROBLEMS_PLACE
    assert {place: name.upper() for place, name in status_words.COUNTS.items()} == {
        place: name for name, place in places.items()}
    assert bits == {f"PROBLEM_{name.upper()}": str(bit)
                    for bit, (name, _) in enumerate(status_words.PROBLEMS)}
    assert status_words.TYPES == {lcm_schema.fingerprint(SCHEMAS[name], SCHEMAS): name
                                  for name in MESSAGES}


@pytest.mark.parametrize("name", status_words.COUNTS.values())
def test_every_counter_of_the_status_has_a_row_in_the_documents(name):
    """In the first column of the table of signs, under its own name."""
    text = (ROOT / "docs" / "counters.md").read_text().partition("## Of gpomd and of devices")[2]
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| ")]
    assert any(f"`{name}`" in row for row in rows)


@pytest.mark.parametrize("name", MESSAGES)
def test_the_codec_keeps_every_byte_and_field_of_a_python_message(name, modules, rng, tool):
    messages = [random_message(modules, name, rng) for _ in range(20)]
    sent = [encoded(message) for message in messages]
    received = echo(tool, sent)
    assert received == sent
    for message, back in zip(messages, received):
        assert fields_of(modules(name).decode(back)) == fields_of(message)


def test_the_codec_refuses_a_python_message_with_a_wrong_checksum(modules, rng, tool):
    message = encoded(random_message(modules, "gpom.scan_t", rng))
    assert echo(tool, [message[:-1] + bytes([message[-1] ^ 1])]) == [b""]


def test_a_subscriber_reads_cells_as_the_definition_says(modules, tool):
    """The formulas in gpom_map_t.lcm, applied to a tile that went through the codec."""
    tile = modules("gpom.map_t")()
    tile.n_tiles = tile.ny = tile.map_ny = 1
    tile.nx = tile.map_nx = tile.n_cells = 4
    tile.prior_variance = 2.0
    tile.probability = bytes([0, 127, 254, 255])
    tile.variance_class = bytes([1 << 2 | 0, 32 << 2 | 1, 0 << 2 | 2, 63 << 2 | 3])
    read = modules("gpom.map_t").decode(echo(tool, [encoded(tile)])[0])
    classes = [code & 3 for code in read.variance_class]
    assert classes == [read.CLASS_FREE, read.CLASS_UNSURE, read.CLASS_OCCUPIED, read.CLASS_UNKNOWN]
    assert [p == read.PROBABILITY_UNKNOWN for p in read.probability] == [False, False, False, True]
    assert read.probability[1] / 254.0 == 0.5
    assert math.isclose((read.variance_class[1] >> 2) / 63.0 * read.prior_variance, 64 / 63)


def namespace_command():
    """Command that runs a shell script in a network of its own, or None."""
    for command in (["unshare", "-n"], ["unshare", "-rn"]):
        if shutil.which("unshare") and subprocess.run(
                [*command, "true"], capture_output=True, check=False).returncode == 0:
            return command
    return None


def test_messages_survive_real_lcm_both_ways(modules, rng, tool, tmp_path):
    """Every type, and one so large that liblcm sends it in fragments; the codec answers with
    fragments of 1472 bytes."""
    command = namespace_command()
    if command is None:
        pytest.skip("no network namespace may be made here (unshare -n, unshare -rn)")
    messages = [encoded(random_message(modules, name, rng)) for name in MESSAGES]
    messages.append(encoded(random_message(modules, "bot_core.planar_lidar_t", rng,
                                           nranges=18_000, nintensities=18_000)))
    assert len(messages[-1]) > 2 * 65_499
    script = 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"'
    done = subprocess.run(
        [*command, "sh", "-c", script, "sh", sys.executable,
         str(ROOT / "tests" / "codec" / "lcm_round_trip.py"), str(tool("codec-echo")),
         str(tmp_path / "bus.log")],
        input="\n".join(message.hex() for message in messages), capture_output=True, text=True,
        timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr

"""[can] of gpomd's configuration: every fault is named by file, line and field."""
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
GPOMD = (ROOT / os.environ.get("GPOM_BUILD", "build/host-release")).resolve() / "gpomd"
TOP = f"""params = "{ROOT}/tools/params/street.toml"
[map]
beam_max = 100
[raster]
cell_m = 0.25
nx = 10
ny = 10
[[sensor]]
type = "gpom.scan_t"
range_max_m = 30.0
[can]
interface = "can0"
"""
SPEED = "speed = { id = 0x1A0, start = 0, length = 16 }\n"
YAW_RATE = "yaw_rate = { id = 0x1A1, start = 7, length = 16, order = \"motorola\" }\n"
ODOMETRY = "[can.odometry]\n" + SPEED + YAW_RATE
MESSAGE = ODOMETRY + "[[can.odometry.message]]\nid = 0x1A0\n"


def check(text, tmp_path):
    path = tmp_path / "gpomd.toml"
    path.write_text(text)
    done = subprocess.run([GPOMD, "--config", path, "--check"], capture_output=True, text=True,
                          timeout=60, check=False)
    return done.returncode, done.stderr or done.stdout


@pytest.mark.parametrize("text", [
    "", ODOMETRY, "fd = true\n[can.publish]\nclearance_fd_hz = 10\ntile_hz = 2.0\n",
    "[can.odometry]\nleft = { id = 0x18FF0000, start = 0, length = 12 }\n"
    "right = { id = 0x18FF0000, start = 12, length = 12, absent = 4095 }\ntrack_m = 0.4\n",
    ODOMETRY + "[[can.odometry.message]]\nid = 0x1A1\nbytes = 8\ncrc = \"e2e\"\ncrc_byte = 7\n"
    "data_id = 0xFFFF\ncounter = { start = 48, length = 4, max = 14 }\n"])
def test_good_tables_are_taken(text, tmp_path):
    code, output = check(TOP + text, tmp_path)
    assert code == 0, output


BAD = [  # text after interface, line that must be named, what must be said
    ("speed = 1\n", 13, "can.speed: unknown key"),
    ("receive_bytes = 1\n", 13, "receive_bytes: must be a whole number from 4096"),
    (ODOMETRY.replace(YAW_RATE, ""), 13, "can.odometry.yaw_rate: missing"),
    (ODOMETRY.replace("id = 0x1A0", "id = 0x20000000"), 14, "can.odometry.speed.id: must be"),
    (ODOMETRY.replace("length = 16 }", "length = 65 }"), 14, "length: must be a whole number"),
    (ODOMETRY.replace("start = 0", "start = 500"), 14, "would reach beyond 64 bytes"),
    (ODOMETRY.replace("motorola", "big"), 15, "\"big\" is not one of intel, motorola"),
    (ODOMETRY.replace("length = 16 }", "length = 16, factor = 0.0 }"), 14, "must not be 0"),
    (ODOMETRY.replace("length = 16 }", "length = 16, unit = \"km/h\" }"), 14, "unknown key"),
    (ODOMETRY + "track_m = 1.0\n", 16, "only with left and right"),
    (ODOMETRY + "left = { id = 1, start = 0, length = 8 }\n", 16, "give either speed and"),
    (ODOMETRY + "timeout_s = 0.0\n", 16, "timeout_s: must be from 0.001 to 10"),
    (ODOMETRY + "timeout_s = nan\n", 16, "timeout_s: must be from"),
    (ODOMETRY + "[[can.odometry.message]]\nid = 0x1A2\n", 17, "no signal of the odometry"),
    (ODOMETRY + "[[can.odometry.message]]\nid = 0x1A0\ncrc = \"crc8\"\n", 18,
     "not one of j1850, e2e"),
    (ODOMETRY + "[[can.odometry.message]]\nid = 0x1A0\ncrc = \"e2e\"\n", 16, "crc_byte: missing"),
    (ODOMETRY + "[[can.odometry.message]]\nid = 0x1A0\ndata_id = 1\n", 18, "without crc"),
    (ODOMETRY + "[[can.odometry.message]]\nid = 0x1A0\n"
     "counter = { start = 0, length = 4, max = 16 }\n", 18, "max: must be a whole number from 1"),
    ("[can.publish]\nstatus_id = 0x6A1\n", 14, "two messages would have one identifier"),
    (ODOMETRY + "[can.publish]\nstatus_id = 0x1A0\n", 17, "is one of the odometry's"),
    ("[can.publish]\ntile_hz = 1.0\n", 14, "needs CAN FD"),
    (ODOMETRY.replace("length = 16 }", "length = 12, absent = 4096 }"), 14,
     "speed.absent: must be a whole number from 0 to 4095"),
    (ODOMETRY.replace("start = 0", "start = 56"), 14, "speed.start: the signal reaches beyond 8"),
    (MESSAGE + "bytes = 1\n", 18, "message[0].bytes: a signal of this message needs 2"),
    (MESSAGE + "bytes = 12\n", 18, "message[0].bytes: more than 8 need CAN FD"),
    (MESSAGE + "bytes = 4\ncrc = \"e2e\"\ndata_id = 0\ncrc_byte = 4\n", 21,
     "crc_byte: is beyond the message's 4 bytes"),
    (MESSAGE + "crc = \"e2e\"\ndata_id = 0\ncrc_byte = 8\n", 20,
     "crc_byte: is beyond the message's 8 bytes"),
    (MESSAGE + "bytes = 4\ncounter = { start = 32, length = 4 }\n", 19,
     "counter: is beyond the message's 4 bytes"),
    (MESSAGE + "[[can.odometry.message]]\nid = 0x1A0\n", 19,
     "message[1].id: an earlier message has the same id"),
    ("[can.publish]\nclearance_id = 0x6A0\n", 14, "publish.clearance_id: two messages would"),
    (ODOMETRY.replace("0x1A0", "0x6A1"), 13, "can.publish.clearance_id: an identifier that is"),
    ("[can.publish]\nstatus_hz = 1e-300\n", 14, "status_hz: must be 0 or at least 0.001"),
    ("[can.publish]\nstatus_hz = 1000.0\n", 14, "status_hz: must be from 0 to 100"),
    ("[can.publish]\nrange_m = 30.0\n", 14, "range_m: must be from"),
]


@pytest.mark.parametrize("text, line, said", [pytest.param(*row, id=row[2]) for row in BAD])
def test_what_is_wrong_is_named(text, line, said, tmp_path):
    code, output = check(TOP + text, tmp_path)
    assert code == 2 or code == 1
    assert len(output.strip().splitlines()) == 1, output
    assert f"gpomd.toml:{line}:" in output and said in output, output


@pytest.mark.parametrize("raster, said", [
    ("cell_m = 0.333", "whole centimetres"), ("cell_m = 3.0", "whole centimetres"),
    ("cell_m = 0.25\ncorner = [0.1, 0.0]", "whole multiples of cell_m")])
def test_tiles_need_cells_that_they_can_tell(raster, said, tmp_path):
    text = TOP.replace("cell_m = 0.25", raster) + "fd = true\n[can.publish]\ntile_hz = 1.0\n"
    code, output = check(text, tmp_path)
    assert code != 0 and said in output and "tile_hz" in output


@pytest.mark.parametrize("name", ["", "a-name-too-long-for-it"])
def test_an_interface_has_a_name_that_fits(name, tmp_path):
    code, output = check(TOP.replace("can0", name), tmp_path)
    assert code != 0 and "gpomd.toml:12: can.interface" in output

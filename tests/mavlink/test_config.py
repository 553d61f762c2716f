"""[mavlink] of gpomd's configuration: every fault is named by file, line and field."""
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
[mavlink]
"""
LINE = TOP.count("\n") + 1  # of the first line after TOP


def check(text, tmp_path):
    path = tmp_path / "gpomd.toml"
    path.write_text(text)
    done = subprocess.run([GPOMD, "--config", path, "--check"], capture_output=True, text=True,
                          timeout=60, check=False)
    return done.returncode, done.stderr or done.stdout


@pytest.mark.parametrize("text", [
    "", 'to = "udp:192.168.1.1:14580"\n', 'to = "/dev/ttyS0"\nbaud = 57600\nrate_hz = 30\n',
    "system_id = 255\ncomponent_id = 1\nrate_hz = 100\nsectors = 8\n", 'sensor = "ultrasound"\n',
    "range_m = 655.0\nradius_m = 0\nsectors = 36\n"])
def test_good_tables_are_taken(text, tmp_path):
    code, output = check(TOP + text, tmp_path)
    assert code == 0, output


def test_the_table_takes_no_memory_of_the_map(tmp_path):
    """And without it nothing is configured."""
    assert check(TOP, tmp_path) == check(TOP.replace("[mavlink]\n", ""), tmp_path)


ADDRESS = 'to: must be "udp:ADDRESS:PORT" with an IPv4 address in digits, or the path'
SECTORS = "sectors: must be from 8 to 72 and divide 360"
BAD = [  # text, line after TOP's last that must be named, what must be said
    ('udp = "127.0.0.1:14550"\n', 0, "mavlink.udp: unknown key"),
    ("sector = 36\n", 0, "mavlink.sector: unknown key; did you mean sectors?"),
    ("rate_Hz = 5\n", 0, "mavlink.rate_Hz: unknown key; did you mean rate_hz?"),
    ("system_ID = 36\n", 0, "did you mean system_id?"),
    ('to = "127.0.0.1:14550"\n', 0, ADDRESS),
    ('to = "udp:127.0.0.1"\n', 0, ADDRESS),
    ('to = "udp:127.0.0.1:0"\n', 0, ADDRESS),
    ('to = "udp:127.0.0.1:65536"\n', 0, ADDRESS),
    ('to = "udp:127.0.0.1:1x"\n', 0, ADDRESS),
    ('to = "udp:localhost:14550"\n', 0, ADDRESS),
    ('to = "udp:127.0.0.1.5:14550"\n', 0, ADDRESS),
    ('to = "ttyS0"\n', 0, ADDRESS), ('to = ""\n', 0, ADDRESS),
    ("to = 14550\n", 0, "mavlink.to: "),
    (f'to = "/{"x" * 200}"\n', 0, "mavlink.to: longer than 127 characters"),
    ('to = "/dev/ttyS0"\nbaud = 9601\n', 1, "mavlink.baud: must be one of 9600, 19200"),
    ("baud = -1\n", 0, "mavlink.baud: must be a whole number"),
    ("system_id = 0\n", 0, "mavlink.system_id: must be a whole number from 1 to 255"),
    ("system_id = 256\n", 0, "mavlink.system_id: must be a whole number from 1 to 255"),
    ("component_id = 0\n", 0, "mavlink.component_id: must be a whole number from 1 to 255"),
    ("component_id = 1.5\n", 0, "mavlink.component_id: must be a whole number"),
    ("rate_hz = 0\n", 0, "mavlink.rate_hz: must be from 1 to 100"),
    ("rate_hz = nan\n", 0, "mavlink.rate_hz: must be from 1 to 100"),
    ("sectors = 7\n", 0, SECTORS), ("sectors = 71\n", 0, SECTORS), ("sectors = 73\n", 0, SECTORS),
    ("sectors = 90\n", 0, SECTORS), ("sectors = 0\n", 0, SECTORS),
    ("sectors = -72\n", 0, "mavlink.sectors: "),
    ('sensor = "lidar"\n', 0,
     "\"lidar\" is not one of laser, ultrasound, infrared, radar, unknown"),
    ("range_m = 0\n", 0, "mavlink.range_m: must be from 0.1 to 655"),
    ("range_m = 656\n", 0, "mavlink.range_m: must be from 0.1 to 655"),
    ("range_m = 2.0\nradius_m = 2.0\n", 1, "mavlink.radius_m: must be below range_m"),
    ('to = "/dev/ttyS0"\nbaud = 57600\nrate_hz = 40\n', 2,
     "mavlink.rate_hz: 57600 baud carry at most 32 messages a second; lower rate_hz or raise baud"),
    ('to = "/dev/ttyS0"\nbaud = 9600\n', 1, "mavlink.baud: 9600 baud carry at most 5 messages"),
]


@pytest.mark.parametrize("text, line, said", [pytest.param(*row, id=row[0][:40]) for row in BAD])
def test_what_is_wrong_is_named(text, line, said, tmp_path):
    code, output = check(TOP + text, tmp_path)
    assert code == 2
    assert len(output.strip().splitlines()) == 1, output
    assert f"gpomd.toml:{LINE + line}:" in output and said in output, output


def test_a_table_that_is_no_table_is_named(tmp_path):
    code, output = check("mavlink = 1\n" + TOP.replace("[mavlink]\n", ""), tmp_path)
    assert code == 2 and "gpomd.toml:1: mavlink:" in output, output


def test_a_misspelt_table_is_named(tmp_path):
    code, output = check(TOP.replace("[mavlink]", "[mavlnk]"), tmp_path)
    assert code == 2 and "did you mean mavlink?" in output, output

"""The package under test, and a drive in several kinds of files."""
import ctypes
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = (ROOT / os.environ.get("GPOM_BUILD", "build/host-release")).resolve()
sys.path.append(str(BUILD / "lcm" / "python"))  # last: it has a package gpom, too

gpom = pytest.importorskip("gpom", reason="no package gpom in this Python: make python-package")
import drives  # noqa: E402  after the package, which it needs


@pytest.fixture(scope="session")
def run():
    """run(name, *words): a finished program of the build folder, which must succeed."""
    def start(name, *words):
        done = subprocess.run([BUILD / name, *map(str, words)], capture_output=True, text=True,
                              timeout=300, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout
    return start


@pytest.fixture(scope="session")
def peer(tmp_path_factory):
    """peer.c with the static C library in it, by ctypes."""
    path = tmp_path_factory.mktemp("peer") / "peer.so"
    subprocess.run(["cc", "-std=c99", "-shared", "-fPIC", "-O2", f"-I{ROOT}/include",
                    ROOT / "tests/python/peer.c", BUILD / "libgpom.a", "-lldl", "-lamd", "-lm",
                    "-o", path], check=True, timeout=100)
    return ctypes.CDLL(str(path))


@pytest.fixture(scope="session")
def drive():
    """A simulated drive: scans at 5 Hz, poses at 20 Hz."""
    return drives.simulated()


@pytest.fixture(scope="session")
def log(drive, tmp_path_factory):
    """The drive as an LCM event log of libbot's types."""
    return drives.write_lcm(drive, tmp_path_factory.mktemp("lcm") / "drive.lcmlog")


@pytest.fixture(scope="session", params=["ros1", "sqlite3", "mcap", "one mcap file"])
def bag(request, drive, tmp_path_factory):
    """The drive as a bag of each kind."""
    return drives.write_bag(drive, tmp_path_factory.mktemp("bag"), request.param)


@pytest.fixture(scope="session")
def ros2(drive, tmp_path_factory):
    """The drive as a ROS 2 bag, poses by PoseStamped."""
    return drives.write_bag(drive, tmp_path_factory.mktemp("ros2"), "sqlite3")

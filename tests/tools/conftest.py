"""Where the tests find the built tools and the logs, and how they run a tool.

GPOM_BUILD  build directory, default build/host-release
GPOM_DATA   folder of laser logs, default ../shared/data; tests that need a missing log are skipped
"""
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "common"), str(ROOT / "tools" / "view")]


def from_root(variable, default):
    return (ROOT / os.environ.get(variable, default)).resolve()


@pytest.fixture(scope="session")
def tool():
    """tool(name): path of a built tool; a tool that is not built fails the test."""
    build = from_root("GPOM_BUILD", "build/host-release")

    def find(name):
        for path in (build / name, build / "tools" / name, build / "bin" / name):
            if path.is_file():
                return path
        pytest.fail(f"{name} is not in {build}: run `make tools` or set GPOM_BUILD")
    return find


@pytest.fixture(scope="session")
def log():
    """log(name): path of a laser log; the test is skipped if it is not there."""
    def find(name):
        path = from_root("GPOM_DATA", "../shared/data") / name
        if not path.is_file():
            pytest.skip(f"missing {path}: set GPOM_DATA")
        return path
    return find


@pytest.fixture(scope="session")
def run(tool):
    """run(name, *arguments): the finished process, with its stdout and stderr as text."""
    def start(name, *arguments):
        command = [str(tool(name)), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, errors="replace",
                              timeout=120, check=False)
    return start


@pytest.fixture(scope="session")
def street(run, tmp_path_factory):
    """Scan file of the simulated street of seed 1."""
    folder = tmp_path_factory.mktemp("street")
    scans = folder / "scans.csv"
    done = run("gpom-sim", "--seed", 1, "--out", scans, "--truth", folder / "truth.pgm")
    assert done.returncode == 0, done.stderr
    return scans

"""The wheel and the sdist, in clean environments: from a bag to maps in five lines; types and
documentation of every name."""
import importlib.util
import pathlib
import re
import subprocess
import sys

import gpom
import pytest
from gpom import _core
from PIL import Image
from rosbags.highlevel import AnyReader

ROOT = pathlib.Path(__file__).resolve().parents[2]

FIVE_LINES = """\
import gpom
scans = gpom.io.read("drive").scans
grid = gpom.map_of(scans, gpom.preset("street")).grid(0.1)
gpom.io.write_map("map.yaml", grid)
gpom.io.write_map("map.mcap", grid)
"""


def run(*command, **more):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True,
                          timeout=900, check=False, **more)
    assert done.returncode == 0, f"{done.stdout[-3000:]}{done.stderr[-3000:]}"
    return done.stdout


def clean_environment(folder, package):
    """A new virtual environment with the package and what it needs, without a network."""
    run(sys.executable, "-m", "venv", folder)
    python = folder / "bin" / "python"
    run(python, "-m", "pip", "install", "--no-index", "--find-links", ROOT / "build/wheelhouse",
        package)
    return python


@pytest.fixture(scope="module")
def packages():
    """The files of `make wheel`."""
    run("make", "-C", ROOT, "wheel")
    return {path.suffix: path for path in (ROOT / "build/wheel").iterdir()}


@pytest.mark.campaign
@pytest.mark.parametrize("suffix", [".whl", ".gz"])
def test_five_lines_in_a_clean_environment_make_maps_of_a_bag(packages, ros2, tmp_path, suffix):
    python = clean_environment(tmp_path / "venv", packages[suffix])
    (tmp_path / "drive").symlink_to(ros2)
    run(python, "-c", FIVE_LINES, cwd=tmp_path)
    assert Image.open(tmp_path / "map.pgm").size[0] > 100
    with AnyReader([tmp_path / "map.mcap"]) as reader:
        assert [c.msgtype for c in reader.connections] == ["nav_msgs/msg/OccupancyGrid"]
    told = run(tmp_path / "venv" / "bin" / "gpom-convert", "--list", "drive", cwd=tmp_path)
    assert "/scan" in told


@pytest.mark.campaign
def test_a_wheel_has_no_library_of_the_lgpl_in_it(packages):
    """SuiteSparse stays a shared library of the system."""
    folder = pathlib.Path(importlib.util.find_spec("gpom._core").origin)
    needed = run("readelf", "-d", folder)
    assert "libldl.so" in needed and "libamd.so" in needed
    names = run(sys.executable, "-m", "zipfile", "-l", packages[".whl"])
    assert "libldl" not in names and names.count(".so ") == 1


def public_names(thing, prefix=""):
    for name in dir(thing):
        if not name.startswith("_"):
            yield prefix + name, getattr(thing, name)


def test_every_public_name_has_a_docstring():
    names = [*public_names(gpom, "gpom."), *public_names(gpom.io, "gpom.io."),
             *public_names(gpom.Map, "Map."), *public_names(gpom.Params, "Params."),
             *public_names(gpom.Sensor, "Sensor."), *public_names(gpom.Grid, "Grid."),
             *public_names(gpom.Scan, "Scan.")]
    ours = [(name, each) for name, each in names
            if callable(each) or isinstance(each, property) or hasattr(each, "fget")]
    assert len(ours) > 60
    assert [name for name, each in ours if not (each.__doc__ or "").strip()] == []


def test_the_stub_knows_every_name_of_the_extension():
    """Built by nanobind; each class and method has a line."""
    stub = pathlib.Path(importlib.util.find_spec("gpom._core").origin).parent / "_core.pyi"
    if not stub.is_file():
        pytest.skip("the package is not installed: make python-package")
    text = stub.read_text()
    for kind in (_core.Map, _core.Params, _core.Sensor):
        for name, _ in public_names(kind):
            assert re.search(rf"\bdef {name}\(", text), name


def test_the_versions_agree():
    """The package's is that of the C header."""
    from importlib import metadata
    assert metadata.version("gpom") == gpom.__version__

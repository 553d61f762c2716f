"""Written maps, read by readers of their own: map_server's rules, rosbags and mcap, OctoMap."""
import dataclasses
import pathlib
import struct
import subprocess

import gpom
import numpy as np
import pytest
from PIL import Image

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def grid():
    """A grid with all four classes; its sides differ, so that a swap of axes is seen."""
    street = gpom.simulate_street(seed=4, n_scans=6)
    made = gpom.map_of(street.scans, gpom.preset("street"), live=False)
    grid = made.grid(0.5, (-10.0, 5.0, 160.0, 110.0))
    assert np.all(np.bincount(grid.cls.ravel(), minlength=4) > 100) and grid.shape == (210, 340)
    return grid


# --- nav2 ---------------------------------------------------------------------------------------

def map_server(path):
    """(cells, corner, cell) as nav2's map_server gives them: by its documented rules, with the
    lowest row first."""
    words = dict(line.split(": ", 1) for line in path.read_text().splitlines())
    image = Image.open(path.parent / words["image"])
    occupied, free = float(words["occupied_thresh"]), float(words["free_thresh"])
    grey = np.asarray(image.convert("L") if image.mode == "L" else image.getchannel(0), float)
    alpha = np.asarray(image.getchannel("A")) if image.mode == "LA" else np.full(grey.shape, 255)
    shade = (255.0 - grey) / 255.0 if words["negate"] == "0" else grey / 255.0
    cells = np.full(grey.shape, -1, int)
    if words["mode"] == "scale":
        cells = np.rint((shade - free) / (occupied - free) * 100.0).astype(int)
    cells[shade > occupied] = 100
    cells[shade < free] = 0
    if words["mode"] == "scale":
        cells[alpha < 255] = -1
    corner = [float(word) for word in words["origin"].strip("[]").split(",")]
    return cells[::-1], corner, float(words["resolution"])


def test_map_server_reads_the_trinary_map(grid, tmp_path):
    gpom.io.write_nav2(tmp_path / "map.yaml", grid)
    cells, corner, cell_m = map_server(tmp_path / "map.yaml")
    expected = np.select([grid.cls == gpom.FREE, grid.cls == gpom.OCCUPIED], [0, 100], -1)
    assert np.array_equal(cells, expected)
    assert corner == [-10.0, 5.0, 0.0] and cell_m == 0.5
    assert (tmp_path / "map.pgm").read_bytes().startswith(b"P5")


def test_map_server_reads_the_scale_map(grid, tmp_path):
    """Free and occupied cells as the map has them, no cell over a threshold by rounding."""
    gpom.io.write_nav2(tmp_path / "map.yaml", grid, mode="scale")
    cells, _, _ = map_server(tmp_path / "map.yaml")
    assert np.array_equal(cells == -1, grid.cls == gpom.UNKNOWN)
    assert np.array_equal(cells == 100, grid.cls == gpom.OCCUPIED)
    assert np.array_equal(cells == 0, grid.cls == gpom.FREE)
    unsure = grid.cls == gpom.UNSURE
    share = (grid.probability - grid.p_free) / (grid.p_occupied - grid.p_free) * 100.0
    assert np.abs(cells - share)[unsure].max() <= 2.0


def test_a_probability_at_every_distance_of_a_threshold_stays_on_its_side(tmp_path):
    """Thresholds that fall on and between the 256 grey values."""
    for p_free, p_occupied in (0.3, 0.7), (0.2, 0.8), (0.4, 0.6), (0.35, 0.65):
        p = np.linspace(0.0, 1.0, 2001, dtype=np.float32).reshape(1, -1)
        cls = np.where(p >= p_occupied, gpom.OCCUPIED,
                       np.where(p <= p_free, gpom.FREE, gpom.UNSURE)).astype(np.uint8)
        grid = gpom.Grid(0.0, 0.0, 1.0, p, np.ones_like(p), cls, p_free, p_occupied)
        gpom.io.write_nav2(tmp_path / "map.yaml", grid, mode="scale")
        cells, _, _ = map_server(tmp_path / "map.yaml")
        assert np.array_equal(cells == 100, cls == gpom.OCCUPIED), (p_free, p_occupied)
        assert np.array_equal(cells == 0, cls == gpom.FREE), (p_free, p_occupied)


# --- MCAP ---------------------------------------------------------------------------------------

def percent(grid):
    values = [[-1 if c == gpom.UNKNOWN else round(100.0 * float(p)) for p, c in zip(*rows)]
              for rows in zip(grid.probability, grid.cls)]
    return np.array(values)


def test_rosbags_reads_the_occupancy_grid(grid, tmp_path):
    from rosbags.highlevel import AnyReader
    gpom.io.write_mcap(tmp_path / "map.mcap", grid)
    with AnyReader([tmp_path / "map.mcap"]) as reader:
        (connection, _, raw), = reader.messages()
        message = reader.deserialize(raw, connection.msgtype)
    assert connection.topic == "/map" and message.header.frame_id == "map"
    assert (message.info.height, message.info.width) == grid.shape
    assert (message.info.origin.position.x, message.info.origin.position.y) == (-10.0, 5.0)
    assert message.info.resolution == 0.5
    assert np.abs(message.data.reshape(grid.shape) - percent(grid)).max() <= 1
    assert np.array_equal(message.data.reshape(grid.shape) == -1, grid.cls == gpom.UNKNOWN)


def test_mcap_reads_the_occupancy_grid_and_its_bytes_are_cdr(grid, tmp_path):
    """The CDR bytes are taken apart by hand: alignment is to 4 and 8 behind a head of 4 bytes."""
    from mcap.reader import make_reader
    gpom.io.write_mcap(tmp_path / "map.mcap", grid, topic="/grid", frame="world")
    with open(tmp_path / "map.mcap", "rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        (schema, channel, message), = reader.iter_messages()
    assert (schema.name, schema.encoding) == ("nav_msgs/msg/OccupancyGrid", "ros2msg")
    assert (channel.topic, channel.message_encoding) == ("/grid", "cdr")
    assert b"geometry_msgs/Pose origin" in schema.data
    body = message.data[4:]
    sec, nanosec, n_frame = struct.unpack_from("<iII", body)
    assert 1_000_000 * sec + nanosec // 1000 == grid.stamp_us
    assert body[12:12 + n_frame] == b"world\0"
    at = (12 + n_frame + 3) // 4 * 4
    _, _, cell_m, nx, ny = struct.unpack_from("<iIfII", body, at)
    at = (at + 20 + 7) // 8 * 8
    x_m, y_m, z_m, qx, qy, qz, qw, n = struct.unpack_from("<7dI", body, at)
    assert (cell_m, ny, nx, n) == (0.5, *grid.shape, grid.cls.size)
    assert (x_m, y_m, z_m, qx, qy, qz, qw) == (-10.0, 5.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    cells = np.frombuffer(body, np.int8, n, at + 60)
    assert np.array_equal(cells.reshape(grid.shape) == -1, grid.cls == gpom.UNKNOWN)
    assert len(body) <= at + 60 + n + 4


# --- OctoMap, NPZ, PNG, CSV ---------------------------------------------------------------------

@pytest.fixture(scope="module")
def octomap_reader(tmp_path_factory):
    path = tmp_path_factory.mktemp("octomap") / "read_octomap"
    subprocess.run(["c++", "-std=c++17", "-O1", ROOT / "tests/python/read_octomap.cpp",
                    "-loctomap", "-loctomath", "-o", path], check=True, timeout=200)
    return path


def test_octomap_reads_the_tree(grid, octomap_reader, tmp_path, capfd):
    gpom.io.write_octomap(tmp_path / "map.bt", grid)
    assert capfd.readouterr() == ("", "")
    done = subprocess.run([octomap_reader, tmp_path / "map.bt", "-10", "5", "0.5", "340", "210"],
                          capture_output=True, text=True, check=True, timeout=100)
    cells = np.array(done.stdout.split(), int).reshape(grid.shape)
    expected = np.select([grid.cls == gpom.FREE, grid.cls == gpom.OCCUPIED], [0, 1], -1)
    assert np.array_equal(cells, expected)


def test_octomap_refuses_cells_beside_its_own(grid, tmp_path):
    shifted = dataclasses.replace(grid, x0_m=-10.1)
    with pytest.raises(gpom.FileError, match=r"map\.bt: x0_m = -10\.1 .* cell_m = 0\.5"):
        gpom.io.write_octomap(tmp_path / "map.bt", shifted)


def test_npz_and_png_hold_the_grid(grid, tmp_path):
    gpom.io.write_map(tmp_path / "map.npz", grid)
    gpom.io.write_map(tmp_path / "map.png", grid)
    with np.load(tmp_path / "map.npz") as file:
        assert np.array_equal(file["cls"], grid.cls) and file["cell_m"] == 0.5
    picture = np.asarray(Image.open(tmp_path / "map.png")).astype(int)[::-1]
    is_grey = np.all(picture == picture[..., :1], axis=-1)
    assert np.array_equal(is_grey, grid.cls != gpom.UNKNOWN)
    assert np.abs(picture[..., 0] - 255.0 * (1.0 - grid.probability))[is_grey].max() <= 0.51


def test_answers_of_gpom_query_are_a_grid(run, tmp_path):
    """The same cells as the package's own raster; unknown cells by the prior variance."""
    params = gpom.preset("indoor")
    (tmp_path / "params.toml").write_text(params.to_toml())
    run("gpom-sim", "--seed", 4, "--scans", 6, "--out", tmp_path / "scans.csv")
    run("gpom-query", "--scans", tmp_path / "scans.csv", "--params", tmp_path / "params.toml",
        "--raster", "10,20,0.5,60,40", "--out", tmp_path / "out.csv")
    read = gpom.io.read_grid(tmp_path / "out.csv", params)
    made = gpom.map_of(gpom.io.read(tmp_path / "scans.csv").scans, params, live=False)
    own = made.grid(0.5, (10.0, 20.0, 40.0, 40.0))
    assert read.extent == own.extent and read.shape == (40, 60)
    assert np.array_equal(read.probability, own.probability) and np.array_equal(read.cls, own.cls)


def test_a_snapshot_of_gpomd_is_a_map(tmp_path):
    """NAME.0 and NAME.1: of both the newer one."""
    params = gpom.preset("street")
    street = gpom.simulate_street(seed=4)
    old = gpom.map_of(street.scans[:5], params)
    (tmp_path / "map.1").write_bytes(old.snapshot())
    new = gpom.Map(params, beam_max=16384)
    new.restore(old.snapshot())
    for scan in street.scans[5:]:
        new.insert(scan)
    (tmp_path / "map.0").write_bytes(new.snapshot())
    read = gpom.io.map_of_snapshot(tmp_path / "map", params)
    assert read.n_beams in (old.n_beams, new.n_beams)
    (tmp_path / "map.1").unlink()
    assert gpom.io.map_of_snapshot(tmp_path / "map", params).n_beams == new.n_beams
    assert gpom.io.map_of_snapshot(tmp_path / "map.0", params).n_beams == new.n_beams


def test_a_failed_write_leaves_the_old_file(grid, tmp_path):
    path = tmp_path / "map.png"
    path.write_bytes(b"old")
    tmp_path.chmod(0o500)
    try:
        gpom.io.write_map(path, grid)
    except gpom.FileError as error:
        assert str(error).startswith(f"{path}: cannot write")
        assert path.read_bytes() == b"old"
    finally:
        tmp_path.chmod(0o700)
    with pytest.raises(gpom.FileError, match="cannot write"):
        gpom.io.write_map(tmp_path / "no" / "map.png", grid)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["map.png"]

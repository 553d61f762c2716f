"""Files of maps: nav2's image and YAML, OccupancyGrid in MCAP, OctoMap, NPZ, PNG."""
import math
import os
import pathlib

import numpy as np
from PIL import Image

from .. import _core
from ..grid import FREE, OCCUPIED, UNKNOWN
from .recording import FileError

#: Grey values of map_server's own saver.
FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY = 254, 0, 205


def _replace(path, write):
    """Write a file under another name beside it, then rename it: never half a file."""
    path = pathlib.Path(path)
    staged = path.with_name(f".{path.name}.tmp{os.getpid()}")
    try:
        write(staged)
        os.replace(staged, path)
    except OSError as error:
        raise FileError(f"{path}: cannot write: {error.strerror or error}") from None
    finally:
        staged.unlink(missing_ok=True)


def write_nav2(path, grid, mode="trinary"):
    """Write NAME.yaml and its image, as nav2's map_server reads them.

    mode  "trinary": NAME.pgm, occupied, free or unknown; cells of class unsure become unknown.
          "scale": NAME.png, with each cell's probability; unknown cells are transparent, since a
          PGM has no value for them. The thresholds are those of the map.
    """
    path = pathlib.Path(path)
    if mode not in ("trinary", "scale"):
        raise ValueError("mode: must be trinary or scale")
    image_path = path.with_suffix(".pgm" if mode == "trinary" else ".png")
    if mode == "trinary":
        image, occupied, free = _trinary_image(grid), 0.65, 0.1
    else:
        image, occupied, free = _scale_image(grid), grid.p_occupied, grid.p_free
    image_format = "PPM" if mode == "trinary" else "PNG"
    _replace(image_path, lambda staged: image.save(staged, image_format))
    text = (f"image: {image_path.name}\nmode: {mode}\nresolution: {grid.cell_m!r}\n"
            f"origin: [{float(grid.x0_m)!r}, {float(grid.y0_m)!r}, 0.0]\nnegate: 0\n"
            f"occupied_thresh: {occupied:.6g}\nfree_thresh: {free:.6g}\n")
    _replace(path, lambda staged: staged.write_text(text, encoding="utf-8"))


def _trinary_image(grid):
    grey = np.full(grid.shape, UNKNOWN_GREY, np.uint8)
    grey[grid.cls == FREE] = FREE_GREY
    grey[grid.cls == OCCUPIED] = OCCUPIED_GREY
    return Image.fromarray(np.ascontiguousarray(grey[::-1]))  # the image's first row is the top


def _scale_image(grid):
    """map_server takes (255 - grey) / 255 for the probability. Rounding must not move a cell over a
    threshold, so grey values of each class stay on their side of it."""
    grey = np.rint(255.0 * (1.0 - grid.probability.astype(float))).astype(int)
    at_occupied, at_free = 255.0 * (1.0 - grid.p_occupied), 255.0 * (1.0 - grid.p_free)
    darkest, lightest = math.floor(at_occupied) + 1, math.ceil(at_free) - 1
    grey = np.where(grid.cls == OCCUPIED, np.minimum(grey, darkest - 2),
                    np.where(grid.cls == FREE, np.maximum(grey, lightest + 2),
                             np.clip(grey, darkest, lightest)))
    alpha = np.where(grid.cls == UNKNOWN, 0, 255)
    pixels = np.stack([grey, alpha], axis=-1).astype(np.uint8)[::-1]
    return Image.fromarray(np.ascontiguousarray(pixels))


def occupancy(grid):
    """ny x nx values of nav_msgs/OccupancyGrid: percent of the probability, -1 unknown, int8."""
    percent = np.rint(100.0 * grid.probability).astype(np.int8)
    return np.where(grid.cls == UNKNOWN, -1, percent).astype(np.int8)


def write_mcap(path, grid, topic="/map", frame="map"):
    """Write an MCAP file with one nav_msgs/OccupancyGrid, for Foxglove and ROS 2."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore
    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = "nav_msgs/msg/OccupancyGrid"
    data = store.serialize_cdr(_grid_message(store, grid, frame), kind)
    definition, _ = store.generate_msgdef(kind, ros_version=2)
    stamp_ns = 1000 * grid.stamp_us

    def write(staged):
        with open(staged, "wb") as file:
            writer = Writer(file)
            writer.start(profile="ros2", library="gpom")
            schema = writer.register_schema(kind, "ros2msg", definition.encode())
            channel = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channel, stamp_ns, bytes(data), stamp_ns)
            writer.finish()
    _replace(path, write)


def _grid_message(store, grid, frame):
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=grid.stamp_us // 1_000_000,
                                                 nanosec=grid.stamp_us % 1_000_000 * 1000)
    corner = types["geometry_msgs/msg/Pose"](
        position=types["geometry_msgs/msg/Point"](x=float(grid.x0_m), y=float(grid.y0_m), z=0.0),
        orientation=types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0))
    ny, nx = grid.shape
    info = types["nav_msgs/msg/MapMetaData"](map_load_time=stamp, resolution=grid.cell_m, width=nx,
                                             height=ny, origin=corner)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
    return types["nav_msgs/msg/OccupancyGrid"](header=header, info=info,
                                               data=occupancy(grid).ravel())


def write_octomap(path, grid):
    """Write an OctoMap file (.bt): free and occupied cells, one layer at z = 0 .. cell_m.

    Raises FileError: a corner that is not a whole multiple of cell_m, as OctoMap's cells are.
    """
    for name, corner_m in ("x0_m", grid.x0_m), ("y0_m", grid.y0_m):
        if abs(corner_m / grid.cell_m - round(corner_m / grid.cell_m)) > 1e-6:
            raise FileError(f"{path}: {name} = {corner_m:g} is no whole multiple of cell_m = "
                            f"{grid.cell_m:g}, as OctoMap's cells need; make the grid with "
                            "Map.grid()")
    _replace(path, lambda staged: _core.write_octomap(str(staged), grid.cls, grid.x0_m, grid.y0_m,
                                                      grid.cell_m))


def write_npz(path, grid):
    """Write the fields of a Grid as arrays."""
    def write(staged):
        with open(staged, "wb") as file:
            np.savez_compressed(file, **vars(grid))
    _replace(path, write)


def write_png(path, grid):
    """Write a picture of the probabilities, black occupied, white free; unknown cells are blue."""
    grey = np.rint(255.0 * (1.0 - grid.probability)).astype(np.uint8)
    pixels = np.stack([grey] * 3, axis=-1)
    pixels[grid.cls == UNKNOWN] = (70, 110, 180)
    image = Image.fromarray(np.ascontiguousarray(pixels[::-1]))
    _replace(path, lambda staged: image.save(staged, "PNG"))


WRITERS = {".yaml": write_nav2, ".mcap": write_mcap, ".bt": write_octomap, ".npz": write_npz,
           ".png": write_png}


def write_map(path, grid, mode="trinary"):
    """Write a Grid as the name says: .yaml (nav2, with `mode`), .mcap, .bt, .npz or .png."""
    suffix = pathlib.Path(path).suffix
    if suffix not in WRITERS:
        raise FileError(f"{path}: maps are written to a name that ends in "
                        f"{', '.join(sorted(WRITERS))}")
    if suffix == ".yaml":
        write_nav2(path, grid, mode)
    else:
        WRITERS[suffix](path, grid)

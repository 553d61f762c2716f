"""Files of maps: nav2's image and YAML, OctoMap, NPZ, PNG; MCAP is in mcap_files.py."""
import math
import pathlib

import numpy as np
from PIL import Image

from .. import _core
from ..grid import FREE, OCCUPIED, UNKNOWN
from .mcap_files import write_mcap
from .recording import FileError, replace_file, require_suffix

#: Grey values of map_server's own saver.
FREE_GREY, OCCUPIED_GREY, UNKNOWN_GREY = 254, 0, 205


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
        occupied, free = (float(f"{p:.6g}") for p in (grid.p_occupied, grid.p_free))
        image = _scale_image(grid, occupied, free)
    image_format = "PPM" if mode == "trinary" else "PNG"
    replace_file(image_path, lambda staged: image.save(staged, image_format))
    text = (f"image: {image_path.name}\nmode: {mode}\nresolution: {grid.cell_m!r}\n"
            f"origin: [{float(grid.x0_m)!r}, {float(grid.y0_m)!r}, 0.0]\nnegate: 0\n"
            f"occupied_thresh: {occupied:.6g}\nfree_thresh: {free:.6g}\n")
    replace_file(path, lambda staged: staged.write_text(text, encoding="utf-8"))


def _trinary_image(grid):
    grey = np.full(grid.shape, UNKNOWN_GREY, np.uint8)
    grey[grid.cls == FREE] = FREE_GREY
    grey[grid.cls == OCCUPIED] = OCCUPIED_GREY
    return Image.fromarray(np.ascontiguousarray(grey[::-1]))  # the image's first row is the top


def _scale_image(grid, occupied, free):
    """map_server takes (255 - grey) / 255 for the probability: over `occupied` it gives 100, below
    `free` 0, and between 0 to 100 in proportion. Rounding must not move a cell over a threshold, so
    grey values of each class stay on their side, those of unsure cells between 1 and 99."""
    grey = np.rint(255.0 * (1.0 - grid.probability.astype(float))).astype(int)
    margin = 0.0051 * (occupied - free)
    darkest = math.ceil(255.0 * (1.0 - occupied + margin))
    lightest = math.floor(255.0 * (1.0 - free - margin))
    grey = np.where(grid.cls == OCCUPIED,
                    np.minimum(grey, math.floor(255.0 * (1.0 - occupied) - 1e-6)),
                    np.where(grid.cls == FREE,
                             np.maximum(grey, math.ceil(255.0 * (1.0 - free) + 1e-6)),
                             np.clip(grey, darkest, lightest)))
    alpha = np.where(grid.cls == UNKNOWN, 0, 255)
    pixels = np.stack([grey, alpha], axis=-1).astype(np.uint8)[::-1]
    return Image.fromarray(np.ascontiguousarray(pixels))


def write_octomap(path, grid):
    """Write an OctoMap file (.bt): free and occupied cells, one layer at z = 0 .. cell_m.

    Raises FileError: a corner that is not a whole multiple of cell_m, as OctoMap's cells are.
    """
    for name, corner_m in ("x0_m", grid.x0_m), ("y0_m", grid.y0_m):
        if abs(corner_m / grid.cell_m - round(corner_m / grid.cell_m)) > 1e-6:
            raise FileError(f"{path}: {name} = {corner_m:g} is no whole multiple of cell_m = "
                            f"{grid.cell_m:g}, as OctoMap's cells need; make the grid with "
                            "Map.grid()")
    replace_file(path, lambda staged: _core.write_octomap(
        str(staged), grid.cls, grid.x0_m, grid.y0_m, grid.cell_m))


def write_npz(path, grid):
    """Write the fields of a Grid as arrays."""
    def write(staged):
        with open(staged, "wb") as file:
            np.savez_compressed(file, **vars(grid))
    replace_file(path, write)


def write_png(path, grid):
    """Write a picture of the probabilities, black occupied, white free; unknown cells are blue."""
    grey = np.rint(255.0 * (1.0 - grid.probability)).astype(np.uint8)
    pixels = np.stack([grey] * 3, axis=-1)
    pixels[grid.cls == UNKNOWN] = (70, 110, 180)
    image = Image.fromarray(np.ascontiguousarray(pixels[::-1]))
    replace_file(path, lambda staged: image.save(staged, "PNG"))


WRITERS = {".yaml": write_nav2, ".mcap": write_mcap, ".bt": write_octomap, ".npz": write_npz,
           ".png": write_png}


def write_map(path, grid, mode="trinary"):
    """Write a Grid as the name says: .yaml (nav2, with `mode`), .mcap, .bt, .npz or .png."""
    suffix = require_suffix(path, WRITERS)
    if suffix == ".yaml":
        write_nav2(path, grid, mode)
    else:
        WRITERS[suffix](path, grid)

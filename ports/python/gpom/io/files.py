"""Tells files apart by their content, and reads them."""
import csv
import gzip
import pathlib
import zipfile

import numpy as np

from .. import _core
from ..grid import FREE, OCCUPIED, UNSURE, Grid, with_unknown
from ..scan import scan_of_tuple
from . import arrays, lcm, ros
from .mcap_files import write_scans_mcap
from .recording import FileError, ReadOptions, Recording, require_suffix

SCAN_SUFFIXES = (".csv", ".mcap", ".npz")


def kind_of(path):
    """ros, mcap, lcm, npz, snapshot, grid or text."""
    path = pathlib.Path(path)
    if path.is_dir():
        return "ros"
    try:
        head = path.open("rb").read(64)
        if head[:2] == b"\x1f\x8b":
            with gzip.open(path, "rb") as packed:
                head = packed.read(64)
    except (OSError, EOFError) as error:
        raise FileError(f"{path}: cannot be read: {error}; give the name of a recording") from None
    if not head:
        raise FileError(f"{path}: is empty; record again")
    if head.startswith(b"#ROSBAG"):
        return "ros"
    if head.startswith(ros.MCAP_MAGIC):
        return "mcap"
    if lcm.is_log(head):
        return "lcm"
    if zipfile.is_zipfile(path):
        return "npz"
    return "grid" if head.startswith(b"x,y,mean,variance") else "text"


def read(path, options=None, **words):
    """Recording of a file: its scans with poses, in order of time.

    path     a ROS 1 bag, the folder of a ROS 2 bag, an MCAP file, an LCM event log, a CARMEN log
             (.gfs.log too), CSV or NPZ; text and LCM logs may be gzipped
    words    fields of ReadOptions
    Raises   FileError: one line that names file, topic and what to do
    """
    options = ReadOptions(**words) if options is None else options
    kind = kind_of(path)
    if kind == "grid":
        raise FileError(f"{path}: holds answers of gpom-query, not scans; see gpom.io.read_grid()")
    readers = {"ros": ros.read, "mcap": ros.read, "lcm": lcm.read, "npz": arrays.read}
    return readers.get(kind, _read_text)(str(path), options)


def _read_text(path, options):
    rows, notes = _core.read_text_scans(
        path, 49.0 if options.range_max_m is None else options.range_max_m, options.fov_deg,
        0.02 if options.range_min_m is None else options.range_min_m)
    recording = Recording()
    recording.notes = notes
    recording.scans = [scan_of_tuple(row) for row in rows]
    return recording


def write_scans(path, scans):
    """Write scans as CSV (NAME.csv, for all tools), arrays (NAME.npz), or ROS 2 messages
    (NAME.mcap: /scan and /tf). Sweeps become the nearest scan with evenly spaced beams."""
    suffix = require_suffix(path, SCAN_SUFFIXES)
    if suffix == ".csv":
        _core.write_text_scans(str(path), [scan.laser_tuple() for scan in scans])
    elif suffix == ".npz":
        arrays.save(path, scans)
    else:
        write_scans_mcap(path, scans)


def read_grid(path, params=None):
    """Grid of what `gpom-query --raster` wrote.

    params  Params of that map: thresholds of the classes, and with the prior variance the cells
            that are unknown; None: no cell is unknown
    Raises  FileError
    """
    try:
        with open(path, encoding="utf-8", newline="") as file:
            rows = csv.reader(file)
            next(rows)
            columns = list(zip(*rows))
        x_m, y_m, _, variance, probability = (np.array(c, float) for c in columns[:5])
        cls = np.array([{"free": FREE, "unsure": UNSURE, "occupied": OCCUPIED}[word]
                        for word in columns[5]], np.uint8)
    except (OSError, ValueError, KeyError, IndexError, StopIteration) as error:
        raise FileError(f"{path}: is not what gpom-query --raster writes ({error})") from None
    nx = int(np.argmax(np.diff(x_m) < 0)) + 1 if np.any(np.diff(x_m) < 0) else len(x_m)
    if nx < 2 or len(x_m) % nx or not np.array_equal(x_m.reshape(-1, nx)[0],
                                                     x_m.reshape(-1, nx)[-1]):
        raise FileError(f"{path}: the points are not those of a raster; use gpom-query --raster")
    cell_m = float(f"{(x_m[nx - 1] - x_m[0]) / (nx - 1):.9g}")
    if params is not None:
        cls = with_unknown(cls, variance, params)
    shape = (len(x_m) // nx, nx)
    return Grid(x_m[0] - 0.5 * cell_m, y_m[0] - 0.5 * cell_m, cell_m,
                probability.reshape(shape).astype(np.float32),
                variance.reshape(shape).astype(np.float32), cls.reshape(shape),
                *((params.p_free, params.p_occupied) if params else ()))

"""Scans in NPZ files."""
import zipfile

import numpy as np

from ..scan import scan_of_tuple
from .recording import FileError, Recording

#: The arrays of a file: n scans of at most m ranges. Poses are those of the laser.
NAMES = ("stamps_us", "poses", "angle_min_rad", "angle_step_rad", "range_max_m", "ranges_m")


def save(path, scans):
    """Write scans: stamps_us (n), poses (n x 3: x [m], y [m], yaw [rad] of the laser),
    angle_min_rad, angle_step_rad, range_max_m (n), ranges_m (n x m, short scans end in NaN)."""
    rows = [scan.laser_tuple() for scan in scans]
    ranges_m = np.full((len(rows), max((len(row[7]) for row in rows), default=0)), np.nan,
                       np.float32)
    for i, row in enumerate(rows):
        ranges_m[i, :len(row[7])] = row[7]
    columns = np.array([row[1:7] for row in rows]).reshape(-1, 6)
    np.savez_compressed(path, stamps_us=np.array([scan.stamp_us for scan in scans], np.int64),
                        poses=columns[:, :3], angle_min_rad=columns[:, 3],
                        angle_step_rad=columns[:, 4], range_max_m=columns[:, 5], ranges_m=ranges_m)


def read(path, _options):
    """Recording of such a file; scalars stand for n equal values."""
    try:
        with np.load(path) as file:
            missing = [name for name in NAMES if name not in file]
            if missing:
                raise FileError(f"{path}: {missing[0]}: no such array; scans need "
                                f"{', '.join(NAMES)}")
            data = {name: file[name] for name in NAMES}
    except (ValueError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise FileError(f"{path}: cannot be read as NPZ: {error}") from None
    n = len(data["stamps_us"])
    shapes = {"poses": (n, 3), "ranges_m": (n, *data["ranges_m"].shape[1:2])}
    for name, shape in shapes.items():
        if data[name].shape != shape or data[name].ndim != 2:
            raise FileError(f"{path}: {name}: has the shape {data[name].shape}, not that of {n} "
                            "scans, as stamps_us says")
    angles = [np.broadcast_to(data[name], n) for name in NAMES[2:5]]
    recording = Recording()
    for i in range(n):
        scan = scan_of_tuple((1e-6 * data["stamps_us"][i], *data["poses"][i].tolist(),
                              *(float(column[i]) for column in angles),
                              data["ranges_m"][i].astype(np.float32)))
        recording.scans.append(scan)
    return recording.finish(path, "ranges_m")

"""Maps from scans."""
import math

import numpy as np

from . import _core
from .grid import grid_of_answers, grid_of_cells

#: Most cells of one grid().
GRID_CELLS_MAX = 100_000_000


class Map(_core.Map):
    __doc__ = _core.Map.__doc__

    def insert(self, scan):
        """Insert a Scan. Raises Error."""
        if scan.is_sweep:
            self.insert_sweep(scan.ranges_m, scan.bearings_rad, scan.poses, scan.pose,
                              scan.stamp_us, scan.sensor)
        else:
            self.insert_scan(scan.ranges_m, scan.angle_min_rad, scan.angle_step_rad, scan.pose,
                             scan.stamp_us, scan.sensor, scan.cov)

    def extent(self, margin_m=1.0):
        """x0, y0, x1, y1 [m]: the box around sensors and hits of the kept beams, and a margin.
        Raises ValueError for an empty map."""
        beams = self.beams()
        if len(beams) == 0:
            raise ValueError("the map is empty; insert scans first")
        hits = beams[beams["is_hit"] == 1]
        x_m = np.concatenate([beams["x_m"], hits["x_m"] + hits["range_m"] * hits["dir_x"]])
        y_m = np.concatenate([beams["y_m"], hits["y_m"] + hits["range_m"] * hits["dir_y"]])
        return (x_m.min() - margin_m, y_m.min() - margin_m, x_m.max() + margin_m,
                y_m.max() + margin_m)

    def grid(self, cell_m=0.05, extent=None):
        """Grid of the map.

        cell_m  side of a cell [m]
        extent  x0, y0, x1, y1 [m]; None: extent(). Corners are moved outwards to whole cells.
        """
        x0_m, y0_m, x1_m, y1_m = self.extent() if extent is None else extent
        if not (cell_m > 0 and x1_m > x0_m and y1_m > y0_m):
            raise ValueError("grid: cell_m must be over 0, and extent x0, y0, x1, y1 not empty")
        ix0, iy0 = math.floor(x0_m / cell_m), math.floor(y0_m / cell_m)
        nx, ny = math.ceil(x1_m / cell_m) - ix0, math.ceil(y1_m / cell_m) - iy0
        if nx * ny > GRID_CELLS_MAX:
            raise ValueError(f"grid: {nx} x {ny} cells are too many; give a larger cell_m or a "
                             "smaller extent")
        corner = (ix0 * cell_m, iy0 * cell_m)
        beams = self.beams()
        stamp_us = int(beams["stamp_us"].max()) if len(beams) else 0
        return grid_of_answers(corner, cell_m, self.query_raster(*corner, cell_m, nx, ny),
                               self.params, stamp_us)

    def lowres_grid(self, layer="coarse"):
        """Grid of the low-resolution map; see lowres()."""
        return grid_of_cells(*self.lowres(layer), self.params)


def map_of(scans, params, *, live=True, beam_max=None, step_ops=1_000_000, **config):
    """A map of scans.

    scans     Scan objects, in order of time
    params    Params that were learnt for such a map
    live      True: keeps only useful beams, as a vehicle's map does; keep_m is 0.05 m, clear_scans
              3 and beam_max 16384 unless given. False: keeps every beam, and indexes them.
    step_ops  live: budget of Map.step() after each scan [operations]
    config    other fields of gpom_config_t, as for Map
    Raises    Error, which names the scan by its stamp.
    """
    scans = list(scans)
    if live:
        config = {"keep_m": 0.05, "clear_scans": 3, **config}
        beam_max = 16384 if beam_max is None else beam_max
    elif beam_max is None:
        beam_max = max(1, sum(len(scan.ranges_m) for scan in scans))
    made = Map(params, beam_max=beam_max, **config)
    for scan in scans:
        made.insert(scan)
        if live:
            made.step(step_ops)
    if not live:
        made.build()
    return made

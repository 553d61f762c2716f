"""A raster of answers: what the files of maps hold."""
import dataclasses

import numpy as np

FREE, UNSURE, OCCUPIED, UNKNOWN = range(4)

#: A cell is unknown if its variance exceeds this part of the prior's and it is not occupied: the
#: rule of the low-resolution map (gpom/lowres.h).
UNKNOWN_SHARE = 0.95


@dataclasses.dataclass(frozen=True, eq=False)
class Grid:
    """Cells of a map. Cell (iy, ix) has its lower left corner at x0_m + ix cell_m, y0_m + iy cell_m
    in the map frame; row 0 is the lowest y.

    probability  ny x nx probabilities of occupancy, float32
    variance     ny x nx variances of the latent function [1], float32
    cls          ny x nx classes: FREE, UNSURE, OCCUPIED or UNKNOWN, uint8
    p_free, p_occupied  thresholds of the classes
    stamp_us     time of the map [us]
    """
    x0_m: float
    y0_m: float
    cell_m: float
    probability: np.ndarray
    variance: np.ndarray
    cls: np.ndarray
    p_free: float = 0.3
    p_occupied: float = 0.7
    stamp_us: int = 0

    @property
    def shape(self):
        """(ny, nx)."""
        return self.probability.shape

    @property
    def extent(self):
        """x0, x1, y0, y1 [m], as matplotlib's imshow(..., origin="lower") takes it."""
        ny, nx = self.shape
        return (self.x0_m, self.x0_m + nx * self.cell_m, self.y0_m, self.y0_m + ny * self.cell_m)


def with_unknown(cls, variance, params):
    """Classes of answers, which know no UNKNOWN, with the unknown ones marked."""
    is_unknown = (cls != OCCUPIED) & (variance > UNKNOWN_SHARE * params.prior_variance)
    return np.where(is_unknown, UNKNOWN, cls).astype(np.uint8)


def grid_of_answers(corner, cell_m, answers, params, stamp_us=0):
    """Grid of ny x nx answers of Map.query_raster()."""
    cls = with_unknown(answers["cls"], answers["variance"], params)
    return Grid(corner[0], corner[1], cell_m, answers["probability"], answers["variance"], cls,
                params.p_free, params.p_occupied, stamp_us)


def grid_of_cells(cells, info, params):
    """Grid of the low-resolution map: what Map.lowres() returns."""
    return Grid(info["x0_m"], info["y0_m"], info["cell_m"],
                (cells["probability"] / np.float32(65535)).astype(np.float32),
                (cells["variance"] * np.float32(params.prior_variance / 255.0)).astype(np.float32),
                cells["cls"].copy(), params.p_free, params.p_occupied,
                info["stamp0_us"] + 1000 * info["newest_ms"])

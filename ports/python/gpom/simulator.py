"""Simulated streets: gpom-sim in Python."""
import dataclasses

import numpy as np

from . import _core
from .scan import scan_of_tuple

_OPTIONS = {"seed", "width_m", "height_m", "n_scans", "n_beams", "fov_deg", "range_max_m",
            "range_noise_m", "step_m", "truth_cell_m", "cars_arrive_at", "cars_leave_at",
            "there_and_back"}


@dataclasses.dataclass(frozen=True, eq=False)
class Street:
    """A simulated drive and the true occupancy.

    scans     list of Scan
    occupied  ny x nx cells, 1 occupied, 0 free; row 0 is the lowest y, uint8
    x0_m, y0_m, cell_m  lower left corner of cell (0, 0) and side of a cell [m]
    """
    scans: list
    occupied: np.ndarray
    x0_m: float
    y0_m: float
    cell_m: float


def simulate_street(**options):
    """Simulate a drive along streets, the same as gpom-sim with the same options.

    options  seed, width_m, height_m, n_scans, n_beams, fov_deg [degree], range_max_m,
             range_noise_m, step_m, truth_cell_m [m], cars_arrive_at, cars_leave_at, there_and_back
    Returns  Street. Raises ValueError (a value), TypeError (a name).
    """
    if unknown := sorted(set(options) - _OPTIONS):
        raise TypeError(f"simulate_street: no option {unknown[0]!r}")
    rows, *truth = _core.simulate_street(options)
    return Street([scan_of_tuple(row) for row in rows], *truth)

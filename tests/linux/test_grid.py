"""MBot's grid where its float32 corner is coarse."""
import numpy as np
import pytest

from conftest import URL, encoded, scan, wait_for_settled_map, wait_for_status, wait_until
from gpom_watch import Watch


@pytest.mark.parametrize("cell_m", [0.1, 0.05, 0.25])
def test_a_grid_at_utm_coordinates_has_its_cells_where_the_map_has_them(cell_m, start, peer):
    """Its corner is a float32, which there holds half metres only: it begins at one of them, with
    unknown cells before the raster's."""
    start(map="beam_max = 8000\nrebase_m = 500.0", raster=f"cell_m = {cell_m}\nnx = 90\nny = 83",
          publish='grid = "SLAM_MAP"\ngrid_s = 0.1')
    watch, grids = Watch(URL), []
    watch.bus.subscribe("SLAM_MAP", lambda _, data: grids.append(data))
    for i in range(3):
        watch.bus.publish("GPOM_SCAN", encoded(scan(
            peer, i + 1, pose=[500_000.13 + 0.01 * i, 5_400_000.37, 0.0], ranges=[2.0] * 31)))
    wait_for_status(watch, scans_inserted=3, grids_not_sent=0)
    wait_for_settled_map(watch)
    del grids[:]
    wait_until(watch, lambda: grids)
    grid = peer.type("mbot_lcm_msgs.occupancy_grid_t").decode(grids[-1])
    corner = watch.map.tile.corner_m
    before = [round((corner[i] - o) / cell_m) for i, o in enumerate((grid.origin_x, grid.origin_y))]
    for i, origin_m in enumerate((grid.origin_x, grid.origin_y)):
        assert 0 <= before[i] <= 64
        assert abs(origin_m + before[i] * cell_m - corner[i]) <= 1e-3 * cell_m + 1e-9
    assert (grid.width, grid.height) == (90 + before[0], 83 + before[1])
    odds = np.array(grid.cells).astype(np.uint8).astype(np.int8).reshape(grid.height, grid.width)
    inside = odds[before[1]:, before[0]:]
    assert ((inside < 0) == (watch.map.classes() == 0)).all() and (inside < 0).any()
    assert not odds[:before[1]].any() and not odds[:, :before[0]].any()

"""Distances that gpomd sends, against a search of all cells of the map that it sends."""
import numpy as np

from conftest import URL, encoded, scan, wait_for_settled_map, wait_for_status, wait_until
from gpom_watch import Watch

NONE = -32768
NX, NY = 43, 31


def nearest(targets):
    """Squared distance from each cell to the nearest target, by a search of all."""
    iy, ix = np.mgrid[:NY, :NX]
    found_y, found_x = np.nonzero(targets)
    return ((ix[..., None] - found_x) ** 2 + (iy[..., None] - found_y) ** 2).min(axis=-1)


def squares(rasters, kind):
    """Squared distances that the offsets say; the offsets lead to cells of the map."""
    dx, dy = rasters[f"{kind}_dx"], rasters[f"{kind}_dy"]
    assert (dx != NONE).all() and (dy != NONE).all()
    return dx ** 2 + dy ** 2


def test_distances_are_those_of_the_published_map(start, peer):
    start(raster=f"cell_m = 0.25\nnx = {NX}\nny = {NY}",
          publish='distances = "GPOM_DISTANCES"\ndistances_hz = 20\nkeyframe_s = 0.3')
    watch = Watch(URL)
    rasters = {f"{kind}_{axis}": np.full((NY, NX), NONE, int)
               for kind in ("occupied", "not_free") for axis in ("dx", "dy")}
    keyframes = []

    def take(_, data):
        tile = peer.type("gpom.distances_t").decode(data)
        assert (tile.map_nx, tile.map_ny) == (NX, NY)
        place = np.s_[tile.iy0:tile.iy0 + tile.ny, tile.ix0:tile.ix0 + tile.nx]
        for name, raster in rasters.items():
            raster[place] = np.reshape(getattr(tile, name), (tile.ny, tile.nx))
        if tile.keyframe and tile.i_tile + 1 == tile.n_tiles:
            keyframes.append(tile.sequence)

    watch.bus.subscribe("GPOM_DISTANCES", take)
    for i in range(4):
        watch.bus.publish("GPOM_SCAN", encoded(scan(peer, i + 1, pose=[0.1 * i, 0.2, 0.0],
                                                    ranges=[2.0 + 0.1 * i] * 31)))
    wait_for_status(watch, scans_inserted=4)
    wait_for_settled_map(watch)
    del keyframes[:]
    wait_until(watch, lambda: len(keyframes) >= 2)
    classes = watch.map.classes()
    assert (classes == 2).any() and (classes == 0).any()
    assert (squares(rasters, "occupied") == nearest(classes == 2)).all()
    assert (squares(rasters, "not_free") == nearest(classes != 0)).all()


def test_without_a_channel_no_distances_are_sent(start, peer):
    start(raster=f"cell_m = 0.25\nnx = {NX}\nny = {NY}")
    watch, messages = Watch(URL), []
    watch.bus.subscribe("GPOM_DISTANCES", lambda _, data: messages.append(data))
    watch.bus.publish("GPOM_SCAN", encoded(scan(peer, 1)))
    wait_for_status(watch, scans_inserted=1)
    wait_for_settled_map(watch)
    assert not messages

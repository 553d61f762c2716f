#!/usr/bin/env python3
"""Subscribe to gpomd's map in Python, with what lcm-gen makes of lcmtypes/.

    lcm-gen -p lcmtypes/*.lcm    # makes the package gpom
    python3 subscribe_map.py [LCM_URL]

Prints, for each publication, its age and the cells by class. Stale is said when tiles stop or the
newest scan is old: act on it, the last map is then history.
"""
import sys
import time

import lcm
from gpom import map_t

STALE_S = 1.0
FREE, UNSURE, OCCUPIED, UNKNOWN = range(4)


class MapOfGpomd:
    def __init__(self):
        self.classes, self.key, self.utime = [], None, 0

    def take(self, _channel, data):
        tile = map_t.decode(data)
        if self.key is not None and tile.frame_epoch < self.key[0]:
            return  # late: from before the frame jumped
        corner = [round(tile.corner[k] - tile.cell_m * (tile.ix0, tile.iy0)[k], 3) for k in (0, 1)]
        key = (tile.frame_epoch, tile.map_nx, tile.map_ny, *corner)
        if self.key is None or key != self.key:  # another frame or place: forget everything
            self.key, self.classes = key, [UNKNOWN] * (tile.map_nx * tile.map_ny)
        for iy in range(tile.ny):
            row = tile.variance_class[iy * tile.nx:(iy + 1) * tile.nx]
            at = (tile.iy0 + iy) * tile.map_nx + tile.ix0
            self.classes[at:at + tile.nx] = [code & 3 for code in row]
        self.utime = tile.utime
        if tile.i_tile + 1 == tile.n_tiles:
            n = [self.classes.count(cls) for cls in (FREE, UNSURE, OCCUPIED, UNKNOWN)]
            print(f"age {time.time() - tile.utime / 1e6:.3f} s: {n[0]} free, {n[1]} unsure, "
                  f"{n[2]} occupied, {n[3]} unknown", flush=True)


def main():
    bus = lcm.LCM(*sys.argv[1:2])
    newest = MapOfGpomd()
    bus.subscribe("GPOM_MAP", newest.take)
    while True:
        arrived = bus.handle_timeout(int(1000 * STALE_S)) > 0
        if not arrived or time.time() - newest.utime / 1e6 > STALE_S:
            print("stale: no map from a recent scan", flush=True)


if __name__ == "__main__":
    main()

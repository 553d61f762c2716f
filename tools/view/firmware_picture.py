#!/usr/bin/env python3
"""Collect the map that a microcontroller publishes, compare it with the PC's map, draw both.

Waits until no cell is dirty and nothing changes any more. Exit code 0: every cell is the same. 1:
some cells differ. 2: no map came.
"""
import argparse
import pathlib
import sys

import numpy as np
from gpom_plot import InputError, OneLineParser, plt, read_raster, save, show_probability
from gpom_watch import EXIT_USAGE, PROBABILITY_UNKNOWN, URL, Watch


def probability_of(codes):
    return np.where(codes == PROBABILITY_UNKNOWN, np.nan, codes / 254)


def draw(collected, expected, fine_path, out_path):
    """Draw the microcontroller's map, the PC's map in the same cells and in fine cells."""
    (fine,), fine_extent = read_raster(fine_path, "probability")
    cells = f"{collected.tile.map_nx} x {collected.tile.map_ny} cells of " \
            f"{collected.tile.cell_m:g} m"
    panels = [(f"Cortex-M7, over the UART and LCM: {cells}",
               probability_of(collected.probability), collected.extent()),
              (f"PC: {cells}", probability_of(expected), collected.extent()),
              ("PC: cells of 0.5 m", fine, fine_extent)]
    figure, row = plt.subplots(1, 3, figsize=(20, 6.4), sharex=True, sharey=True,
                               layout="constrained")
    for axes, (title, image, extent) in zip(row, panels):
        axes.set_facecolor("#c8d8f0")
        axes.set(aspect="equal", xlabel="x [m]", title=title)
        show_probability(axes, image, extent)
        axes.plot(*collected.tile.pose[:2], "o", color="red", markersize=5)
    row[0].set_ylabel("y [m]; blue: unknown; red: the robot")
    out_path.parent.mkdir(parents=True, exist_ok=True)
    save({out_path: figure})


def run(arguments):
    """Collect, compare and draw. Returns the number of codes that differ."""
    watch = Watch(arguments.url)
    if not watch.collect_settled(arguments.seconds):
        raise InputError("the map did not settle in time; does the device run, do scans come?")
    watch.request_keyframe()
    watch.collect(arguments.seconds, lambda: watch.map.is_whole)
    if watch.map.tile is None:
        raise InputError("no GPOM_MAP came from the device")
    codes = np.stack([watch.map.probability, watch.map.variance_class])
    expected = np.frombuffer(arguments.cells.read_bytes(), np.uint8)
    if expected.size != codes.size:
        raise InputError(f"{arguments.cells}: {expected.size} codes, the device has {codes.size}")
    expected = expected.reshape(codes.shape)
    draw(watch.map, expected[0], arguments.fine, arguments.out)
    n_differ = int((codes != expected).sum())
    counts = {name: n for name, n in watch.status["counts"].items() if n}
    print(f"{codes.size - n_differ} of {codes.size} codes of {codes.size // 2} cells are the PC's; "
          f"{watch.status['n_beams']} beams; {counts}")
    print(arguments.out)
    return n_differ


def main():
    parser = OneLineParser(prog="firmware-picture", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--url", default=URL, help="LCM's network (default: %(default)s)")
    parser.add_argument("--cells", metavar="FILE", type=pathlib.Path, required=True,
                        help="codes of the PC's cells, as library-map writes them")
    parser.add_argument("--fine", metavar="CSV", type=pathlib.Path, required=True,
                        help="raster of gpom-query to draw beside the map")
    parser.add_argument("--out", metavar="PNG", type=pathlib.Path, required=True)
    parser.add_argument("--seconds", metavar="S", type=float, default=60,
                        help="longest wait for the map (default: %(default)s)")
    try:
        return 1 if run(parser.parse_args()) else 0
    except InputError as error:
        print(f"firmware-picture: {error}", file=sys.stderr)
        return EXIT_USAGE


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Maps of one log side by side, one for each method of `gpom-slam drive`.

Black: the returns at the poses that the method found. Orange: the way.
"""
import argparse
import csv
import pathlib
import sys

import numpy as np
from gpom_plot import EXIT_USAGE, InputError, OneLineParser, plt, save

TITLES = {"odometry": "Odometry alone", "gpom": "Aligned to its own map (gpom)",
          "hector": "Hector-style", "icp": "Scan to scan (ICP)", "corrected": "Corrected poses"}
WAY_COLOUR = "#d55e00"  # of Okabe and Ito (2008), which colour-blind readers can tell apart


def columns_of(path, names):
    """Columns by name, of a CSV file that has them; the first is text, the others are numbers."""
    try:
        with open(path, encoding="utf-8", newline="") as source:
            rows = list(csv.DictReader(source))
        columns = {name: np.array([row[name] for row in rows]) for name in names}
        return {name: column if name == names[0] else column.astype(float)
                for name, column in columns.items()}
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; write it with gpom-slam drive") from None
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not written by gpom-slam drive ({error})") from None


def draw_map(axes, method, points, way):
    here, along = points["method"] == method, way["method"] == method
    axes.plot(points["x"][here], points["y"][here], ",", color="black", alpha=0.4)
    axes.plot(way["x"][along], way["y"][along], color=WAY_COLOUR, linewidth=0.8)
    axes.set(aspect="equal", title=TITLES.get(method, method), xlabel="x [m]", ylabel="y [m]")


def main():
    parser = OneLineParser(prog="slam-picture", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--way", metavar="CSV", type=pathlib.Path, required=True,
                        help="file of gpom-slam drive --csv")
    parser.add_argument("--points", metavar="CSV", type=pathlib.Path, required=True,
                        help="file of gpom-slam drive --points")
    parser.add_argument("--out", metavar="PNG", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    try:
        way = columns_of(arguments.way, ("method", "x", "y"))
        points = columns_of(arguments.points, ("method", "x", "y"))
        methods = list(dict.fromkeys(way["method"]))
        figure, row = plt.subplots(1, len(methods), figsize=(7 * len(methods), 7.5),
                                   layout="constrained", squeeze=False)
        for axes, method in zip(row[0], methods):
            draw_map(axes, method, points, way)
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        save({arguments.out: figure})
    except InputError as error:
        print(f"slam-picture: {error}", file=sys.stderr)
        return EXIT_USAGE
    print(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""Pictures of vehicles that leave and arrive, from reports of `gpom-live cars`.

One row for each report: the low-resolution map before the change and at the end. A circle marks
each cell that was still wrong after five scans.
"""
import argparse
import json
import pathlib
import sys

import numpy as np
from gpom_plot import EXIT_USAGE, InputError, OneLineParser, plt, save, show_probability


def read_report(path):
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        shape = report["ny"], report["nx"]
        for name in "before", "after":
            cells = np.array(report[name], dtype=float).reshape(shape)
            report[name] = np.where(cells < 0.0, np.nan, cells)
        return report
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: no report of gpom-live cars ({error})") from None


def known_window(report):
    """Limits in x and y of the cells that are known before or after [m]."""
    known = np.isfinite(report["before"]) | np.isfinite(report["after"])
    return [(report["cell_m"] * np.flatnonzero(known.any(axis=axis))[[0, -1]]).tolist()
            for axis in (0, 1)]


def draw_row(row, path, report):
    cells, cell_m = report["cells"], report["cell_m"]
    extent = (0.0, report["nx"] * cell_m, 0.0, report["ny"] * cell_m)
    window = known_window(report)
    titles = (f"{path.stem}: before",
              f"at the end: {cells['cells'] - cells['late']} of {cells['cells']} cells right "
              "within five scans")
    for axes, name, title in zip(row, ("before", "after"), titles):
        axes.set_facecolor("#c8d8f0")
        axes.set(aspect="equal", title=title, xlabel="x [m]", ylabel="y [m]; blue: unknown")
        show_probability(axes, report[name], extent)
        axes.set(xlim=window[0], ylim=window[1])
    for x_m, y_m, *_ in cells["late_cells"]:
        row[1].plot(x_m, y_m, "o", markersize=8, markerfacecolor="none", color="magenta")


def main():
    parser = OneLineParser(prog="cars-picture", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("reports", metavar="JSON", type=pathlib.Path, nargs="+")
    parser.add_argument("--out", metavar="PNG", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    try:
        reports = [(path, read_report(path)) for path in arguments.reports]
        figure, rows = plt.subplots(len(reports), 2, figsize=(16, 6.6 * len(reports)),
                                    layout="constrained", squeeze=False)
        for row, (path, report) in zip(rows, reports):
            draw_row(row, path, report)
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        save({arguments.out: figure})
    except InputError as error:
        print(f"cars-picture: {error}", file=sys.stderr)
        return EXIT_USAGE
    print(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

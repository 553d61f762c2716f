#!/usr/bin/env python3
"""Picture of the doors in a report of `gpom-live door`, from its first run.

One row for each door: the true walls, then the classes of the continuous map, of low-resolution
maps and of OctoMap (free: p <= 0.3, occupied: p >= 0.7). A line and a number show the free width
around the door's middle.
"""
import argparse
import json
import pathlib
import sys

import numpy as np
from gpom_plot import (CLASS_COLOURS, CLASSES, EXIT_USAGE, InputError, OneLineParser, plt, save,
                       show)
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

P_OCCUPIED = 0.7
# Colours of Okabe and Ito (2008), which colour-blind readers can tell apart.
WALL_COLOUR, FREE_COLOUR = "#d55e00", "#0072b2"
STAGES = {"past": "After the drive past the doors",
          "through": "After the drive past and through the doors"}


def read_run(path, stage):
    """Walls and doors of the first run, and the largest probability of free space."""
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        run = report["runs"][0]
        doors = run[stage]["doors"]
        _ = [width["picture"]["p"] for door in doors for width in door["widths"]]
        return report["free_probability"], run["obstacles_m"], doors
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (ValueError, KeyError, IndexError, TypeError) as error:
        raise InputError(f"{path}: no report of gpom-live door ({error})") from None


def draw_walls(axes, obstacles, **style):
    for x0_m, y0_m, x1_m, y1_m in obstacles:
        axes.add_patch(Rectangle((x0_m, y0_m), x1_m - x0_m, y1_m - y0_m, **style))


def draw_classes(axes, picture, p_free):
    p = np.array(picture["p"], dtype=float).reshape(picture["ny"], picture["nx"])
    classes = np.where(p <= p_free, 0.0, np.where(p < P_OCCUPIED, 1.0, 2.0))
    classes[p < 0.0] = np.nan
    x0_m, y0_m, cell_m = picture["x0_m"], picture["y0_m"], picture["cell_m"]
    extent = (x0_m, x0_m + cell_m * p.shape[1], y0_m, y0_m + cell_m * p.shape[0])
    axes.set_facecolor(CLASS_COLOURS.colors[CLASSES.index("unknown")])
    show(axes, classes, extent, cmap=CLASS_COLOURS, vmin=0, vmax=len(CLASSES) - 1)


def free_stretch(width, p_free):
    """Both ends of the connected free cells around the middle. None: the middle is not free."""
    row, cell_m = width["row"], width["cell_m"]
    is_free = [p is not None and p <= p_free for p in row["p"]]
    first = last = row["i_middle"]
    if not is_free[first]:
        return None
    while first > 0 and is_free[first - 1]:
        first -= 1
    while last + 1 < len(is_free) and is_free[last + 1]:
        last += 1
    return row["x0_m"] + (first - 0.5) * cell_m, row["x0_m"] + (last + 0.5) * cell_m


def draw_width(axes, width, p_free):
    stretch = free_stretch(width, p_free)
    if stretch:
        axes.plot(stretch, [width["row"]["y_m"]] * 2, "-|", color=FREE_COLOUR, linewidth=2.5,
                  markersize=14, markeredgewidth=2.5)


def title_of(width):
    name = {"continuous": "continuous map", "lowres": "low resolution",
            "octomap": "OctoMap"}[width["map"]]
    cells = "" if width["map"] == "continuous" else f", {width['cell_m']:g} m cells"
    return f"{name}{cells}\nfree {width['free_m']:.2f} m"


def titles_of(door):
    titles = [f"truth\ndoor of {door['width_m']:.2f} m", *map(title_of, door["widths"])]
    titles[1] += f", for robots of {door['radius_max_m']:.2f} m radius"
    return titles


def draw_row(row, door, obstacles, p_free):
    draw_walls(row[0], obstacles, facecolor="black")
    for axes, width in zip(row[1:], door["widths"]):
        draw_classes(axes, width["picture"], p_free)
        draw_width(axes, width, p_free)
        draw_walls(axes, obstacles, fill=False, edgecolor=WALL_COLOUR, linewidth=1.2)
    for axes, title in zip(row, titles_of(door)):
        axes.set_title(title, fontsize=10)
        axes.set(aspect="equal", xlim=(door["x_m"] - 0.75, door["x_m"] + 0.75),
                 ylim=(door["y_m"] - 0.5, door["y_m"] + 0.5))
    row[0].set_ylabel("y [m]")


def draw(p_free, obstacles, doors, stage):
    n_columns = 1 + len(doors[0]["widths"])
    figure, rows = plt.subplots(len(doors), n_columns, squeeze=False, layout="constrained",
                                figsize=(3.3 * n_columns, 2.6 * len(doors) + 0.8))
    for row, door in zip(rows, doors):
        draw_row(row, door, obstacles, p_free)
    for axes in rows[-1]:
        axes.set_xlabel("x [m]")
    keys = [Patch(facecolor=colour, edgecolor="0.3", label=name)
            for name, colour in zip(CLASSES, CLASS_COLOURS.colors)]
    keys += [Line2D([], [], color=WALL_COLOUR, label="true walls and door frames"),
             Line2D([], [], color=FREE_COLOUR, linewidth=2.5,
                    label="free width around the door's middle")]
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys))
    figure.suptitle(f"{STAGES[stage]}; the corridor is below")
    return figure


def main():
    parser = OneLineParser(prog="door-picture", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", metavar="JSON", type=pathlib.Path)
    parser.add_argument("--stage", choices=STAGES, default="through",
                        help="part of the drive after which the maps are drawn")
    parser.add_argument("--out", metavar="PNG", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    try:
        figure = draw(*read_run(arguments.report, arguments.stage), arguments.stage)
        arguments.out.parent.mkdir(parents=True, exist_ok=True)
        save({arguments.out: figure})
    except InputError as error:
        print(f"door-picture: {error}", file=sys.stderr)
        return EXIT_USAGE
    print(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

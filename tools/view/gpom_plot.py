#!/usr/bin/env python3
"""Pictures of gpom-eval's results: the map beside its rivals, as in the paper's Figs. 2 to 6.

Makes map.png (truth, hits, occupancy grid, variance, probability, classes), roc.png (ROC curves and
reliability) and profile.png (probability and classes by the distance from a surface). For a log it
also makes coarse.png (the whole area in coarse cells, grid beside map) and window.png (a part of
the area in cells of 0.1 m, with the variance).
"""
import argparse
import difflib
import csv
import json
import os
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")  # no display needed; before pyplot
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.colors import BoundaryNorm, ListedColormap  # noqa: E402
from matplotlib.transforms import ScaledTranslation  # noqa: E402

EXIT_USAGE = 2
CLASSES = ("free", "unsure", "occupied", "unknown")
CLASS_COLOURS = ListedColormap(["white", "0.55", "black", "#9ad0f5"])
# Unknown: the variance is over this part of the prior variance, as in low-resolution maps.
UNKNOWN_VARIANCE = 0.95
# Colours of Okabe and Ito, for colour-blind readers. Dashes and markers differ, too.
METHOD_STYLES = {"gp_query": ("#0072b2", "-", "o"), "gp_map": ("#56b4e9", "-.", "v"),
                 "grid": ("#d55e00", "--", "s"), "wide_grid": ("#e69f00", (0, (6, 1)), "^"),
                 "strong_grid": ("black", (0, (3, 1, 1, 1)), "D"), "octomap": ("#cc79a7", ":", "P"),
                 "exact_gp": ("#009e73", (0, (1, 1)), "X")}
OTHER_MARKERS = "<>*hdp"
DOTS_PER_INCH = 130


class InputError(Exception):
    """An error of the input, in one line."""


# ---- reading ------------------------------------------------------------------------------------

def read_columns(path):
    """Columns of a CSV file by name: numbers if all are numbers, else text."""
    with open(path, encoding="utf-8", newline="") as source:
        rows = list(csv.reader(source))
    if len(rows) < 2:
        raise InputError(f"{path}: no rows; run gpom-eval --out again")
    header, body = rows[0], rows[1:]
    for number, row in enumerate(body, 2):
        if len(row) != len(header):
            raise InputError(f"{path}:{number}: {len(row)} fields, expected {len(header)}")
    columns = {}
    for name, column in zip(header, zip(*body)):
        try:
            columns[name] = np.array(column, dtype=float)
        except ValueError:
            if name != "class":
                raise InputError(f"{path}: column {name} has a field that is no number") from None
            columns[name] = np.array(column)
    return columns


def require(path, columns, *names):
    missing = [name for name in names if name not in columns]
    if missing:
        raise InputError(f"{path}: no column {', '.join(missing)}; not written by gpom-eval")


def read_raster(path, *names):
    """Images of the named columns, row 0 south, and their extent (west, east, south, north)."""
    columns = read_columns(path)
    require(path, columns, "x", "y", *names)
    x, ix = np.unique(columns["x"], return_inverse=True)
    y, iy = np.unique(columns["y"], return_inverse=True)
    if len(x) < 2 or len(y) < 2 or len(x) * len(y) != len(ix):
        raise InputError(f"{path}: not a full raster of two or more rows and columns")
    images = []
    for name in names:
        image = np.empty((len(y), len(x)), dtype=columns[name].dtype)
        image[iy, ix] = columns[name]
        images.append(image)
    half_x, half_y = (x[1] - x[0]) / 2, (y[1] - y[0]) / 2
    return images, (x[0] - half_x, x[-1] + half_x, y[0] - half_y, y[-1] + half_y)


def read_truth(path):
    """Occupancy, row 0 south, and its extent, from a PGM image of gpom-sim."""
    content = path.read_bytes()
    lines = content.split(b"\n")
    n_header = next((i + 1 for i, line in enumerate(lines) if line == b"255"), None)
    place = next((line.split() for line in lines[:n_header or 0]
                  if line.startswith(b"# gpom-truth 1 ")), None)
    if n_header is None or place is None or lines[0] != b"P5":
        raise InputError(f"{path}: not an image of truth written by gpom-sim")
    nx, ny = (int(word) for word in lines[n_header - 2].split())
    x0, y0, cell = (float(word) for word in place[3:6])
    pixels = np.frombuffer(content[-nx * ny:], dtype=np.uint8)
    if pixels.size != nx * ny:
        raise InputError(f"{path}: image is too short")
    return pixels.reshape(ny, nx)[::-1] == 0, (x0, x0 + nx * cell, y0, y0 + ny * cell)


def read_report(path):
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        _ = [(method["all"]["roc"]["fp"], method["profile"]["rows"], report["prior_variance"])
             for method in report["methods"]]
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not written by gpom-eval ({error})") from error
    return report


# ---- the map, as Fig. 2 -------------------------------------------------------------------------

def show(axes, image, extent, **style):
    return axes.imshow(image, origin="lower", extent=extent, interpolation="nearest", **style)


def colour_bar(axes, image, label, **style):
    axes.figure.colorbar(image, ax=axes, fraction=0.038, pad=0.02, label=label, **style)


def show_probability(axes, image, extent):
    shown = show(axes, image, extent, cmap="gray_r", vmin=0, vmax=1)
    colour_bar(axes, shown, "probability of occupancy [1]")


def show_classes(axes, names, is_unknown, extent):
    names = np.where(is_unknown & (names != "occupied"), "unknown", names)
    numbers = np.select([names == name for name in CLASSES], range(len(CLASSES)))
    norm = BoundaryNorm(np.arange(len(CLASSES) + 1) - 0.5, len(CLASSES))
    shown = show(axes, numbers, extent, cmap=CLASS_COLOURS, norm=norm)
    colour_bar(axes, shown, "class", ticks=range(len(CLASSES)),
               format=lambda i, _: CLASSES[int(i)])


def panel_height(extent, width):
    """Height of a panel with title and labels [inch]. `width` is the width of its picture."""
    return min(max(width * (extent[3] - extent[2]) / (extent[1] - extent[0]), 2.5), 9) + 0.9


def draw_ground(axes, folder, report, hits, poses):
    """Draw the truth of a street. A log has no truth: draw all returns instead."""
    if report["mode"] == "street":
        occupied, extent = read_truth(folder / "truth.pgm")
        show(axes, occupied, extent, cmap="gray_r", vmin=0, vmax=1)
        axes.set_title("(a) Ground truth, robot positions")
    else:
        axes.plot(hits["x"], hits["y"], ",", color="0.45", alpha=0.5)
        axes.set_title("(a) All returns, robot positions")
    axes.plot(poses["x"], poses["y"], ".", color="red", markersize=4)


def map_figure(folder, report):
    (variance, probability, classes), extent = read_raster(
        folder / "map.csv", "variance", "probability", "class")
    (grid,), grid_extent = read_raster(folder / "wide_grid.csv", "probability")
    hits, poses = read_columns(folder / "hits.csv"), read_columns(folder / "poses.csv")
    require(folder / "hits.csv", hits, "x", "y", "in_map")
    require(folder / "poses.csv", poses, "x", "y")
    figure, panels = plt.subplots(2, 3, figsize=(19, 2 * panel_height(extent, 5.3)), sharex=True,
                                  sharey=True, layout="constrained")
    (ground, points, rival), (spread, chance, decided) = panels
    draw_ground(ground, folder, report, hits, poses)
    kept = hits["in_map"] > 0
    points.plot(hits["x"][kept], hits["y"][kept], ".", color="black", markersize=2.5)
    points.set_title("(b) Laser hits in the map")
    show_probability(rival, grid, grid_extent)
    rival.set_title("(c) Occupancy grid, widened beams")
    colour_bar(spread, show(spread, variance, extent, cmap="viridis"), "variance [1]")
    spread.set_title("(d) GP: predictive variance")
    show_probability(chance, probability, extent)
    chance.set_title("(e) GP: probability of occupancy")
    show_classes(decided, classes, variance > UNKNOWN_VARIANCE * report["prior_variance"], extent)
    decided.set_title("(f) GP: classes")
    for axes in panels.flat:
        axes.set(aspect="equal", xlim=extent[:2], ylim=extent[2:])
    for axes in panels[1]:
        axes.set_xlabel("x [m]")
    for axes in panels[:, 0]:
        axes.set_ylabel("y [m]")
    return figure


# ---- a log, the whole area and a part, as Figs. 4 to 6 -------------------------------------------

def read_view(folder, name):
    """Images of one view: probability and variance of the map, probability of the grid."""
    (probability, variance), extent = read_raster(folder / f"{name}.csv", "probability", "variance")
    (grid,), _ = read_raster(folder / f"{name}_grid.csv", "probability")
    return probability, variance, grid, extent


def draw_hits(axes, hits, kept, size):
    axes.plot(hits["x"][kept], hits["y"][kept], ".", color="tab:blue", markersize=size,
              label="returns in the map")


def legend_below(axes):
    below_labels = ScaledTranslation(0, -0.4, axes.figure.dpi_scale_trans)  # inches
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0),
                bbox_transform=axes.transAxes + below_labels, ncols=2, frameon=False, markerscale=2)


def label_axes(panels, extent):
    for axes in panels.flat:
        axes.set(aspect="equal", xlim=extent[:2], ylim=extent[2:], xlabel="x [m]", ylabel="y [m]")


def cell_of(image, extent):
    return (extent[1] - extent[0]) / image.shape[1]


def coarse_figure(folder):
    probability, _, grid, extent = read_view(folder, "coarse")
    window = read_view(folder, "window")[-1]
    hits, poses = read_columns(folder / "hits.csv"), read_columns(folder / "poses.csv")
    figure, panels = plt.subplots(2, 2, figsize=(15, 2 * panel_height(extent, 6.3)),
                                  layout="constrained")
    (ground, points), (rival, chance) = panels
    ground.plot(hits["x"], hits["y"], ",", color="0.45", alpha=0.5)
    ground.plot(poses["x"], poses["y"], color="red", linewidth=1.2, label="way of the robot")
    ground.set_title("(a) All returns")
    draw_hits(points, hits, hits["in_map"] > 0, 1.5)
    points.add_patch(plt.Rectangle((window[0], window[2]), window[1] - window[0],
                                   window[3] - window[2], fill=False, color="red",
                                   label="area of window.png"))
    points.set_title("(b) What the map gets")
    for axes in (ground, points):
        legend_below(axes)
    cell = f"{cell_of(probability, extent):.1f} m"
    show_probability(rival, grid, extent)
    rival.set_title(f"(c) Occupancy grid, cells of {cell} (grey 0.5: unknown)")
    show_probability(chance, probability, extent)
    chance.set_title(f"(d) GP asked every {cell} (grey: unknown)")
    label_axes(panels, extent)
    return figure


def window_figure(folder):
    probability, variance, grid, extent = read_view(folder, "window")
    hits = read_columns(folder / "hits.csv")
    figure, panels = plt.subplots(2, 2, figsize=(17, 2 * panel_height(extent, 7.3)),
                                  layout="constrained")
    (points, rival), (chance, spread) = panels
    others = hits["in_map"] == 0
    points.plot(hits["x"][others], hits["y"][others], ".", color="0.75", markersize=1.5,
                label="returns left out")
    draw_hits(points, hits, ~others, 5)
    legend_below(points)
    points.set_title("(a) Laser returns")
    show_probability(rival, grid, extent)
    rival.set_title("(b) Occupancy grid, widened beams (grey 0.5: unknown)")
    cell = f"{cell_of(probability, extent):.1f} m"
    show_probability(chance, probability, extent)
    chance.set_title(f"(c) GP asked every {cell} (grey: unknown)")
    colour_bar(spread, show(spread, variance, extent, cmap="viridis"), "variance [1]")
    spread.set_title("(d) GP: predictive variance")
    label_axes(panels, extent)
    return figure


# ---- ROC and reliability, as Fig. 3 -------------------------------------------------------------

def line_styles(methods):
    """Colour, line and marker of each method, by its key."""
    others = [method["key"] for method in methods if method["key"] not in METHOD_STYLES]
    return METHOD_STYLES | {
        key: ("0.5", (0, (2 + 2 * i, 1)), OTHER_MARKERS[i % len(OTHER_MARKERS)])
        for i, key in enumerate(others)}


def draw_roc(axes, methods, part):
    styles = line_styles(methods)
    for method in methods:
        colour, line, marker = styles[method["key"]]
        metrics = method[part]
        axes.plot(metrics["roc"]["fp"], metrics["roc"]["tp"], color=colour, linestyle=line,
                  marker=marker, markevery=0.12, markersize=5)
    axes.plot([0, 1], [0, 1], "-", color="0.7", linewidth=0.8)
    axes.axhline(0.95, color="0.8", linewidth=0.8, zorder=0)
    axes.set(xlabel="false-positive rate [1]", ylabel="true-positive rate [1]", aspect="equal",
             xlim=(-0.01, 1.01), ylim=(-0.01, 1.01))


def draw_reliability(axes, methods, part):
    """A marker's area is the share of the points in its bin. Small markers are less certain."""
    styles = line_styles(methods)
    for method in methods:
        colour, line, marker = styles[method["key"]]
        metrics = method[part]
        bins = [b for b in metrics["reliability"] if b["points"] > 0]
        x = [b["mean_probability"] for b in bins]
        y = [b["share_occupied"] for b in bins]
        axes.plot(x, y, color=colour, linestyle=line, linewidth=1)
        axes.scatter(x, y, color=colour, marker=marker,
                     s=[1 + 300 * b["points"] / metrics["points"] for b in bins])
    axes.plot([0, 1], [0, 1], "-", color="0.7", linewidth=0.8)
    axes.set(xlabel="mean probability in the bin [1]", ylabel="share occupied [1]",
             aspect="equal", xlim=(-0.01, 1.01), ylim=(-0.01, 1.01),
             title="Reliability (marker area: share of the points; grey: calibrated)")


def roc_figure(report):
    methods = report["methods"]
    part = "near" if all("near" in method for method in methods) else "all"
    figure, (left, right) = plt.subplots(1, 2, figsize=(14, 8.4), layout="constrained")
    draw_roc(left, methods, part)
    where = "points within 5 m of a beam" if part == "near" else "held-out beams"
    left.set_title(f"ROC, {where} (grey: chance)")
    draw_reliability(right, methods, part)
    figure.legend(left.get_lines()[:len(methods)],
                  [f"{m['label']}: AUC {m[part]['auc']:.4f}, ECE {m[part]['ece']:.4f}"
                   for m in methods], loc="outside lower center", ncols=2, frameon=False)
    return figure


# ---- probability by the distance from a surface -------------------------------------------------

def draw_profile(axes, methods, name):
    """Draw one figure of all rows: mean_probability, share_free or share_occupied."""
    styles = line_styles(methods)
    for method in methods:
        colour, line, marker = styles[method["key"]]
        rows = method["profile"]["rows"]
        axes.plot([row["offset_m"] for row in rows], [row[name] for row in rows], color=colour,
                  linestyle=line, marker=marker, markersize=5)
    ticks = [row["offset_m"] for row in methods[0]["profile"]["rows"]]
    axes.set_xscale("symlog", linthresh=0.1, linscale=0.7)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks], rotation=60)
    axes.minorticks_off()
    axes.axvline(0, color="0.8", linewidth=0.8, zorder=0)
    axes.set(ylim=(-0.02, 1.02))
    axes.grid(axis="y", color="0.92")


def profile_figure(report):
    methods = report["methods"]
    surface = "true surface" if report["mode"] == "street" else "return of a held-out beam"
    figure, panels = plt.subplots(1, 3, figsize=(18, 7), sharey=True, layout="constrained")
    for axes, (name, title) in zip(panels, (
            ("mean_probability", "Mean probability of occupancy"),
            ("share_free", "Share called free (p at most 0.3)"),
            ("share_occupied", "Share called occupied (p at least 0.7)"))):
        draw_profile(axes, methods, name)
        axes.set(title=title, xlabel=f"offset from the {surface} [m], negative before it")
    panels[0].axhline(0.5, color="0.8", linewidth=0.8, zorder=0)
    panels[0].set_ylabel("probability or share [1]")
    lines = panels[0].get_lines()[:len(methods)]
    labels = []
    for method in methods:
        crossing = method["profile"]["crossing_m"]
        labels.append(f"{method['label']}: mean p " + (
            "never rises to 0.5" if crossing is None else f"is 0.5 at {crossing:.3f} m"))
    figure.legend(lines, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure


# ---- command line -------------------------------------------------------------------------------

def save(figures):
    """Write all pictures or none: first beside their targets, then rename them."""
    staged = [(path.with_name(f".{path.stem}.{os.getpid()}.png"), path) for path in figures]
    try:
        for temporary, path in staged:
            figures[path].savefig(temporary, dpi=DOTS_PER_INCH)
        for temporary, path in staged:
            os.replace(temporary, path)
    finally:
        for temporary, _ in staged:
            temporary.unlink(missing_ok=True)


def plot(folder, out):
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder of gpom-eval --out")
    report = read_report(folder / "eval.json")
    figures = {out / "map.png": map_figure(folder, report), out / "roc.png": roc_figure(report),
               out / "profile.png": profile_figure(report)}
    if report["mode"] == "log":
        figures[out / "coarse.png"] = coarse_figure(folder)
        figures[out / "window.png"] = window_figure(folder)
    out.mkdir(parents=True, exist_ok=True)
    save(figures)
    for path in figures:
        print(path)


class OneLineParser(argparse.ArgumentParser):
    def error(self, message):
        options = list(self._option_string_actions)
        meant = [near for word in message.split() if word.startswith("--")
                 for near in difflib.get_close_matches(word.split("=")[0], options, 1)]
        hint = f"; did you mean {meant[0]}?" if meant and meant[0] not in message else ""
        self.exit(EXIT_USAGE, f"{self.prog}: {message}{hint}; see {self.prog} --help\n")


def main():
    parser = OneLineParser(prog="gpom-plot", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", metavar="DIR", type=pathlib.Path,
                        help="folder of gpom-eval --out")
    parser.add_argument("--out", metavar="DIR", type=pathlib.Path,
                        help="folder for the pictures (default: the same)")
    arguments = parser.parse_args()
    try:
        plot(arguments.folder, arguments.out or arguments.folder)
    except InputError as error:
        print(f"gpom-plot: {error}", file=sys.stderr)
        return EXIT_USAGE
    except OSError as error:
        print(f"gpom-plot: {error.filename}: {error.strerror}", file=sys.stderr)
        return EXIT_USAGE
    return 0


if __name__ == "__main__":
    sys.exit(main())

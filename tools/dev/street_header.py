#!/usr/bin/env python3
"""Write scans and query points as a C header for the Cortex-M image.

usage: tools/dev/street_header.py SCANS.csv POINTS.csv OUT.h

The image has no file system. gpom-query with the same two files and the preset street.toml gives
the answers to compare.
"""
import os
import sys


def rows(path):
    with open(path, encoding="ascii") as lines:
        return [line.split(",") for line in map(str.strip, lines) if line and line[0] != "#"]


def c_float(text):
    return f"{float(text)!r}f"


def c_range(text, range_max_m):
    """A reading written without <math.h>: no return is the maximum, a missing reading is 0."""
    value = float(text)
    return c_float(0.0 if value != value else min(value, range_max_m))


def header(scans_path, points_path):
    scans = rows(scans_path)
    n_ranges = len(scans[0]) - 7
    if any(len(scan) != n_ranges + 7 for scan in scans):
        sys.exit(f"{scans_path}: scans differ in their number of ranges")
    poses = ",\n".join("    {" + ", ".join(scan[1:4]) + "}" for scan in scans)
    ranges = ",\n".join("    {" + ", ".join(c_range(r, float(scan[6])) for r in scan[7:]) + "}"
                        for scan in scans)
    points = ",\n".join("    {" + ", ".join(point) + "}" for point in rows(points_path)
                        if point != ["x", "y"])
    return f"""/* Written by tools/dev/street_header.py; do not edit. */
#include "gpom/gpom.h"

#define STREET_SCANS {len(scans)}
#define STREET_RANGES {n_ranges}

static const double street_angle_min_rad = {scans[0][4]};
static const double street_angle_step_rad = {scans[0][5]};
static const float street_range_max_m = {c_float(scans[0][6])};

/* x, y [m], yaw [rad] */
static const double street_poses[STREET_SCANS][3] = {{
{poses}
}};

static const float street_ranges_m[STREET_SCANS][STREET_RANGES] = {{
{ranges}
}};

static const gpom_point_t street_points[] = {{
{points}
}};
"""


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    text = header(*sys.argv[1:3])
    temporary = sys.argv[3] + ".tmp"
    with open(temporary, "w", encoding="ascii") as file:
        file.write(text)
    os.replace(temporary, sys.argv[3])


if __name__ == "__main__":
    main()

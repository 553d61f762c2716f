#!/usr/bin/env python3
"""Write scans, hyperparameters and query points as a C header for the Cortex-M image.

usage: tools/dev/street_header.py SCANS.csv PARAMS.toml POINTS.csv OUT.h

The image has no file system. gpom-query with the same three files gives the answers to compare.
"""
import os
import sys
import tomllib


def rows(path):
    with open(path, encoding="ascii") as lines:
        return [line.split(",") for line in map(str.strip, lines) if line and line[0] != "#"]


def c_float(text):
    return f"{float(text)!r}f"


def c_range(text, range_max_m):
    """A reading written without <math.h>: no return is the maximum, a missing reading is 0."""
    value = float(text)
    return c_float(0.0 if value != value else min(value, range_max_m))


def params_initialiser(path):
    with open(path, "rb") as file:
        toml = tomllib.load(file)
    is_nn = toml["kernel"] == "nn"
    fields = {
        "struct_bytes": "sizeof(gpom_params_t)",
        "kernel": f"GPOM_KERNEL_{toml['kernel'].upper()}",
        "frame": f"GPOM_FRAME_{toml.get('frame', 'query').upper()}",
        "n_hits": toml["hits"],
        "n_free": toml["free"],
        "n_fading": toml.get("fading", 0),
        "scan_points_max": toml.get("scan_points_max", 0),
        "sn2_free": c_float(toml.get("sn2_free", toml["sn2"])),
    }
    names = ["sf2", "sn2", "alpha", "beta", "gap_m", "p_occupied", "p_free"]
    for name in names + (["s0", "s1"] if is_nn else ["ell_m"]):
        fields[name] = c_float(toml[name])
    counts = {"hits", "free", "fading"}
    for name in sorted(set(toml) - set(fields) - counts):  # an absent key has its neutral value
        fields[name] = c_float(toml[name])
    return ",\n".join(f"    .{name} = {value}" for name, value in fields.items())


def header(scans_path, params_path, points_path):
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

static const gpom_params_t street_params = {{
{params_initialiser(params_path)}
}};

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
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    text = header(*sys.argv[1:4])
    temporary = sys.argv[4] + ".tmp"
    with open(temporary, "w", encoding="ascii") as file:
        file.write(text)
    os.replace(temporary, sys.argv[4])


if __name__ == "__main__":
    main()

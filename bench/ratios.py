#!/usr/bin/env python3
"""Ratios within one run of bench/speed.cpp.

usage: bench/ratios.py SPEED.json

A line for each map and n: queries a second in rasters and lists, and how many times as many as
plain Eigen with brute force and with the tree; the time of a whole query over that of nanoflann's
search of the hits alone; multiply-adds of all whole queries as a part of the measured peak
(n^3 / 6 + n^2 a query: factor and substitutions, nothing for search and covariances).
"""
import json
import math
import re
import sys


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        run = json.load(file)
    rate = {row["run_name"]: row["items_per_second"] for row in run["benchmarks"]
            if row.get("aggregate_name") == "median" and "items_per_second" in row}
    lanes = run["context"]["lanes"]
    peak = rate.get(f"multiply-add/{lanes}")
    print(f"{lanes} lanes, compiler {run['context']['compiler']}; medians of one run")
    print(f"{'map':<12} {'n':>3} {'raster/s':>9} {'list/s':>9} {'x brute':>8} {'x tree':>7} "
          f"{'time / nanoflann':>17} {'of peak':>8}")
    for name, raster in sorted(rate.items()):
        match = re.fullmatch(r"raster/(\S+)/n(\d+)", name)
        if not match:
            continue
        of, n = f"/{match[1]}/n{match[2]}", int(match[2])
        listed, brute, tree, hits = [
            rate.get(other + of, math.nan)  # left out of the run: nan
            for other in ("points", "eigen-brute", "eigen-tree", "nanoflann-hits")]
        share = f"{100 * raster * (n**3 / 6 + n**2) / peak:6.0f} %" if peak else "-"
        print(f"{match[1]:<12} {n:>3} {raster:9.3g} {listed:9.3g} {raster / brute:8.1f} "
              f"{raster / tree:7.1f} {hits / raster:17.2f} {share:>8}")


if __name__ == "__main__":
    main()

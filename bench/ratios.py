#!/usr/bin/env python3
"""Ratios within one run of bench/speed.cpp.

usage: bench/ratios.py [--speed FILE [--sklearn FILE]] [--insert FILE...] [--record DIR]

Prints first the processor and its peak. Then a line for each map and n. It has the queries a second
in rasters and lists, and the ratio to plain Eigen with brute force, to plain Eigen with the tree,
and to scikit-learn (in another process of the same run, if it is installed). Then it has the time
of a whole query over that of nanoflann's search of the hits only, and the speed of the solve only,
with covariances, as a part of the measured peak of multiply-adds (two operations each). The
covariance is Matern-1/2, or the paper's for maps named -nn. Further lines compare whole maps with
the paper's times, and give the figures of a real log, of building and inserting (mean and worst
scan of `gpom-live insert`), and of the two solves of many neighbours. --record prints nothing of
this, but writes the main ratios into a file of DIR, named after the processor (bench/processor.py).
"""
import argparse
import json
import math
import os
import pathlib
import re
import sys

import processor

PAPER = {"coarse-120000-m2": "paper: under 5 s",
         "street-100-m-20-m": "paper: 200 s at 1,000 points a second"}


class Run:
    """The medians of one run, by name."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            run = json.load(file)
        self.context = run["context"]
        self.rows = {row["run_name"]: row for row in run["benchmarks"]
                     if row.get("aggregate_name") == "median"}

    def rate(self, name):
        """Items a second. NaN: the run has no such row."""
        return self.rows.get(name, {}).get("items_per_second", math.nan)

    def matching(self, pattern):
        """(match, row) of the rows whose name matches, in order of name."""
        for name, row in sorted(self.rows.items()):
            if match := re.fullmatch(pattern, name):
                yield match, row


def print_queries(run, sklearn):
    peak = run.rate(f"multiply-add/{run.context['lanes']}")
    print(f"{'map':<12} {'n':>3} {'raster/s':>9} {'list/s':>9} {'x brute':>8} {'x tree':>7} "
          f"{'x sklearn':>9} {'time / nanoflann':>17} {'solve of peak':>14}")
    for match, row in run.matching(r"raster/(\S+)/n(\d+)"):
        of, n, raster = f"/{match[1]}/n{match[2]}", int(match[2]), row["items_per_second"]
        listed, brute, tree, hits = [run.rate(other + of) for other in
                                     ("points", "eigen-brute", "eigen-tree", "nanoflann-hits")]
        kernel = "nn" if match[1].endswith("-nn") else "matern12"
        peer = math.nan if kernel == "nn" else sklearn.get(f"n{n}", {}).get(
            "queries_per_second", math.nan)
        share = 100 * run.rate(f"solve/{kernel}/n{n}") / (2 * peak)
        print(f"{match[1]:<12} {n:>3} {raster:9.3g} {listed:9.3g} {raster / brute:8.1f} "
              f"{raster / tree:7.1f} {raster / peer:9.0f} {hits / raster:17.2f} {share:12.0f} %")
    for n in (16, 32):
        shares = [f"{kernel} {100 * run.rate(f'solve/{kernel}/n{n}') / (2 * peak):.0f} %"
                  for kernel in ("matern12", "nn", "askey")]
        print(f"solve of peak by covariance, n = {n}: {', '.join(shares)}")
        rates = [run.rate(f"raster/{name}/n{n}") for name in ("wide-500k", "sparse", "wide-12k")]
        print(f"rate with 500,000 beams, n = {n}: {rates[0] / rates[1]:.2f} of that with 476, "
              f"{rates[0] / rates[2]:.2f} of that with 12,000 of the same town")


def print_maps(run):
    sparse = run.rate("raster/sparse/n16")
    for match, row in run.matching(r"map/(\S+)"):
        print(f"map {match[1]}: {row['cpu_time'] / 1e6:.1f} ms, n = 16 ({PAPER[match[1]]})")
    for match, row in run.matching(r"log/(\S+)/n16"):
        rate = row["items_per_second"]
        print(f"log {match[1]}: {row['beams']:.0f} beams, {rate:.3g} queries/s at n = 16, "
              f"{rate / sparse:.2f} of the sparse street's")


def print_maintenance(run):
    for match, row in run.matching(r"build/(\S+)"):
        print(f"build {match[1]}: {row['beams']:.0f} beams, "
              f"{row['cpu_time'] / row['beams']:.0f} ns and {row['bytes_per_beam']:.1f} bytes each")
    for match, row in run.matching(r"insert/(\S+)"):
        print(f"insert {match[1]}: {1e6 / row['items_per_second']:.1f} us a scan with its step, "
              f"{row['beams']:.0f} beams kept")


def print_insertion(live):
    print(f"insert live, from {live['kept']} of {live['beam_max']} beams on: "
          f"{live['insert']['us_mean']:.1f} us a scan of {live['beams_per_scan']} beams, "
          f"{1e-3 * live['insert']['us_max']:.2f} ms at worst, without its step")
    if "of_nanoflann" in live:
        print(f"    as many searches by nanoflann: {live['rival']['us_mean']:.1f} us; "
              f"insertion takes {live['of_nanoflann']:.2f} of that, its worst scan "
              f"{live['insert']['us_max'] / live['insert']['us_mean']:.1f} times the mean")


def print_solves(run):
    rows = run.matching(r"solve-sparse(/ell(\d+)/n(\d+))")
    for match, row in sorted(rows, key=lambda found: (int(found[0][3]), int(found[0][2]))):
        ratio = run.rate("solve-dense" + match[1]) / row["items_per_second"]
        print(f"n = {match[3]}, ell {match[2]:>2} m: {100 * row['nonzeros']:5.1f} % of K not zero, "
              f"sparse takes {ratio:6.2f} of the dense time")


def read_json(path):
    """The JSON file of a program. Empty if there is none."""
    if path is None or not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def print_speed(run, sklearn):
    print(processor.describe(processor.record_of(run, [])))
    print(f"{run.context['lanes']} lanes, compiler {run.context['compiler']}; medians of one run")
    print_queries(run, sklearn)
    print_maps(run)
    print_maintenance(run)
    print_solves(run)


def write_record(folder, run, insertions):
    record = processor.record_of(run, insertions)
    path = folder / processor.file_name(record)
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {path}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--speed", help="output of bench/speed.cpp")
    parser.add_argument("--sklearn", help="output of bench/sklearn_gp.py")
    parser.add_argument("--insert", nargs="+", default=[], type=pathlib.Path,
                        help="outputs of bench-insertion")
    parser.add_argument("--record", metavar="DIR", type=pathlib.Path,
                        help="write the main ratios into this folder; needs --speed")
    arguments = parser.parse_args()
    if arguments.record is not None and arguments.speed is None:
        parser.error("--record needs --speed FILE")
    insertions = [read_json(path) for path in arguments.insert]
    run = Run(arguments.speed) if arguments.speed is not None else None
    if arguments.record is not None:
        write_record(arguments.record, run, insertions)
        return
    if run is not None:
        print_speed(run, read_json(arguments.sklearn))
    for live in insertions:
        print_insertion(live)


if __name__ == "__main__":
    main()

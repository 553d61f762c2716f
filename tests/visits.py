#!/usr/bin/env python3
"""What searches of dense maps visit, against the figures recorded in tests/budget.csv.

usage: tests/visits.py [--log FILE] [--json FILE]

Counts, for each packet of 16 queries of rasters, the boxes that are compared with the queries and
the parts of beams ("items") whose distances are computed. The counts are the same in every run.
--log also counts on the live map of a log, for which nothing is recorded. Exit code 0: no figure is
more than 3 % above the recorded one, else 1. A lower figure is recorded by hand, a higher one in a
commit of its own that says why.
"""
import argparse
import csv
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = "build/host-visits/count-visits"
TARGET = "host-visits"
RISE_MAX = 1.03
COLUMNS = ("hit boxes", "hit items", "free boxes", "free items")


def recorded():
    """{(map, column): count in 1000 packets} from lines `host-visits,MAP COLUMN,COUNT`."""
    figures = {}
    with open("tests/budget.csv", encoding="ascii", newline="") as file:
        for row in csv.DictReader(file):
            metric = re.fullmatch(r"(\S+) (\w+ \w+)", row["metric"])
            if row["target"] == TARGET and metric:
                figures[metric[1], metric[2]] = int(row["limit"])
    return figures


def counted(log):
    done = subprocess.run([PROGRAM, *([log] if log else [])], stdout=subprocess.PIPE, text=True,
                          check=False)
    if done.returncode != 0:
        sys.exit(f"{PROGRAM}: exit code {done.returncode}")
    return list(csv.DictReader(done.stdout.splitlines()))


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n")[0])
    parser.add_argument("--log", metavar="FILE")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    os.chdir(ROOT)
    limits = recorded()
    rows = counted(args.log)
    n_above = 0
    for row in rows:
        for column in COLUMNS:
            count = 1000.0 * float(row[column])
            limit = limits.pop((row["map"], column), None)
            beside = f"{100 * count / limit - 100:+.1f} % of {limit}" if limit else "not recorded"
            print(f"{row['map']:<20} {column:<10} {count:8.0f} in 1000 packets, {beside}")
            n_above += 1 if limit and count > RISE_MAX * limit else 0
    for name, column in limits:
        print(f"tests/budget.csv: {TARGET},{name} {column}: {PROGRAM} has no such count")
    if args.json:
        os.makedirs(os.path.dirname(args.json) or ".", exist_ok=True)
        with open(args.json, "w", encoding="ascii") as file:
            json.dump(rows, file, indent=1)
    return 1 if n_above or limits else 0


if __name__ == "__main__":
    sys.exit(main())

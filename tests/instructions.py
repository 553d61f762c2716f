#!/usr/bin/env python3
"""Instructions per query of the scalar build, against the figures recorded in tests/budget.csv.

usage: tests/instructions.py [--json FILE]

callgrind counts what gpom_query_points() and gpom_query_gradients() do at 150 places of a simulated
street of 476 beams: the same number in every run of one compiler. Exit code 0: no figure is more
than 3 % above the recorded one, 77: valgrind is not installed, else 1. A lower figure is recorded
by hand, a higher one in a commit of its own that says why.
"""
import argparse
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PROGRAM = "build/host-scalar/count-queries"
TARGET = "host-scalar"
N_POINTS = 150
RISE_MAX = 1.03


CALLS = {"query": ("gpom_query_points", "points"),
         "gradient": ("gpom_query_gradients", "gradients")}


def recorded():
    """{(call, kernel, points of each kind): instructions} from lines `host-scalar,query KERNEL
    N+N,I` and `host-scalar,gradient KERNEL N+N,I`."""
    figures = {}
    with open("tests/budget.csv", encoding="ascii", newline="") as file:
        for row in csv.DictReader(file):
            metric = re.fullmatch(r"(query|gradient) (\w+) (\d+)\+\3", row["metric"])
            if row["target"] == TARGET and metric:
                figures[metric[1], metric[2], int(metric[3])] = int(row["limit"])
    return figures


def count(call, kernel, n_each):
    """Instructions of one query or gradient with n_each hits and free points."""
    function, what = CALLS[call]
    with tempfile.NamedTemporaryFile("r", encoding="utf-8") as profile:
        done = subprocess.run(
            ["valgrind", "--tool=callgrind", "--collect-atstart=no",
             f"--toggle-collect={function}", f"--callgrind-out-file={profile.name}",
             PROGRAM, f"tests/golden/params_{kernel}_query.toml", str(n_each), str(n_each),
             str(N_POINTS), what], capture_output=True, text=True, check=False)
        total = re.search(r"^summary: (\d+)$", profile.read(), re.MULTILINE)
    if done.returncode != 0 or not total:
        sys.exit(f"{PROGRAM} under valgrind: exit code {done.returncode}\n{done.stderr}")
    return int(total[1]) / N_POINTS


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n")[0])
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    os.chdir(ROOT)
    if shutil.which("valgrind") is None:
        print("valgrind is not installed")
        return 77
    rows = []
    for (call, kernel, n_each), limit in recorded().items():
        each = count(call, kernel, n_each)
        rows.append({"call": call, "kernel": kernel, "n": 2 * n_each, "instructions": each,
                     "recorded": limit})
        print(f"{kernel:<9} n = {2 * n_each:<2}  {each:8.0f} instructions a {call}, "
              f"{100 * each / limit - 100:+.1f} % of {limit}")
    if args.json:
        os.makedirs(os.path.dirname(args.json) or ".", exist_ok=True)
        with open(args.json, "w", encoding="ascii") as file:
            json.dump(rows, file, indent=1)
    if not rows:
        print(f"tests/budget.csv records no query of {TARGET}")
        return 1
    return 1 if any(row["instructions"] > RISE_MAX * row["recorded"] for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())

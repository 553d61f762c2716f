"""The processor of a run of bench/speed.cpp, and the run's main ratios, to compare processors.

A record is a JSON file: processor, lanes, compiler, caches, peak, and the rows of ROWS. The folder
bench/processors/ keeps one for each processor on which `make bench-record` ran; RESULTS.md has a
column for each.
"""
import json
import math
import re

KINDS = {"Data": "L1d", "Instruction": "L1i"}
# The rows, and what is wanted of every processor. "": nothing.
ROWS = {
    "whole query / nanoflann's hits, sparse street, n = 16": "<= .8",
    "whole query / nanoflann's hits, sparse street, n = 32": "<= 1.1",
    "whole query / nanoflann's hits, dense 50,000, n = 16": "<= .9",
    "whole query / nanoflann's hits, dense 50,000, n = 32": "<= 1.1",
    "over plain Eigen with brute force, n = 32, Matern-1/2": "",
    "over plain Eigen with brute force, n = 32, NN": "",
    "solve / peak, Matern-1/2, n = 16": ">= .5",
    "solve / peak, NN, n = 16": ">= .5",
    "solve / peak, Matern-1/2, n = 32": ">= .6",
    "solve / peak, NN, n = 32": ">= .6",
    "campus-west live / sparse street, n = 16": ">= .5",
    "500,000 beams / 476, n = 16": ">= .95",
    "insertion with room / 180 nanoflann searches": "<= .6",
    "insertion, full / 180 nanoflann searches": "<= .6",
    "insertion, worst / mean": "<= 4",
}


def caches_of(context):
    """[L1d 48 KiB, ...] as Google Benchmark saw them."""
    found = []
    for cache in context.get("caches", []):
        name = KINDS.get(cache["type"], f"L{cache['level']}") if cache["level"] == 1 else \
            f"L{cache['level']}"
        found.append(f"{name} {cache['size'] // 1024:,} KiB")
    return found


def peaks_of(run):
    """{bits of a vector: measured peak of multiply-adds, two operations each, in 1e9 a second}"""
    peaks = {int(match[1]): round(2e-9 * row["items_per_second"])
             for match, row in run.matching(r"multiply-add/(\d+)")}
    return {str(32 * lanes): peaks[lanes] for lanes in sorted(peaks)}


def ratios_of(run, insertions):
    """{row of ROWS: value}, in the order of ROWS. Values that the run does not have are NaN."""
    peak = 2 * run.rate(f"multiply-add/{run.context['lanes']}")
    hits = [run.rate(f"nanoflann-hits/{of}") / run.rate(f"raster/{of}")
            for of in ("sparse/n16", "sparse/n32", "dense-50k/n16", "dense-50k/n32")]
    brute = [run.rate(f"raster/{of}/n32") / run.rate(f"eigen-brute/{of}/n32")
             for of in ("sparse", "sparse-nn")]
    solves = [run.rate(f"solve/{kernel}/n{n}") / peak for n in (16, 32)
              for kernel in ("matern12", "nn")]
    large = [run.rate(of) / run.rate("raster/sparse/n16")
             for of in ("log/campus-west-live/n16", "raster/wide-500k/n16")]
    return dict(zip(ROWS, [*hits, *brute, *solves, *large, *insertion_ratios(insertions)]))


def insertion_ratios(insertions):
    """With room, full, and the worst scan over the mean, of the outputs of `gpom-live insert`."""
    by_room = {live["kept"] < live["beam_max"]: live for live in insertions}
    if set(by_room) != {True, False}:
        return [math.nan] * 3
    beside = [by_room[has_room].get("of_nanoflann", math.nan) for has_room in (True, False)]
    worst = max(live["insert"]["us_max"] / live["insert"]["us_mean"] for live in insertions)
    return [*beside, worst]


def record_of(run, insertions):
    return {"processor": run.context.get("processor", "unknown"),
            "lanes": int(run.context["lanes"]), "compiler": run.context["compiler"],
            "caches": caches_of(run.context), "peak_gflop_per_s": peaks_of(run),
            "wanted": ROWS,
            "ratios": {row: round(value, 3) for row, value in ratios_of(run, insertions).items()
                       if not math.isnan(value)}}


def file_name(record):
    """amd-epyc-family-26-model-2-16-lanes.json"""
    words = re.sub(r"[^a-z0-9]+", "-", record["processor"].lower()).strip("-")
    return f"{words}-{record['lanes']}-lanes.json"


def describe(record):
    """Two lines for people."""
    peaks = ", ".join(f"{peak} at {bits} bits" for bits, peak in record["peak_gflop_per_s"].items())
    return (f"processor {record['processor']}; {', '.join(record['caches'])}\n"
            f"peak of multiply-adds, GFLOP/s of one core: {peaks}")

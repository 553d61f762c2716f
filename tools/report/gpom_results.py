#!/usr/bin/env python3
"""Judge every method on every log and on simulated streets, and write the tables of RESULTS.md.

The figures come from the tools of the build. Each table names its commands. Logs that are not in
the data folder are left out, and the document says which.
"""
import argparse
import contextlib
import json
import os
import pathlib
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from tqdm import tqdm

import live_section
import odometry_section
import processor_section
from results_layout import Commands, tables_first
from results_tables import (PRESETS, Figures, ahead_table, cross_table, log_profile_table,
                            log_table, neighbour_table, solve_table, street_profile_table,
                            street_table, table_text)

EXIT_USAGE = 2
ROOT = pathlib.Path(__file__).resolve().parents[2]
NEIGHBOURS = "8,16,32"
MANY_NEIGHBOURS = "8,16,32,64,128,256"
# "All beams" means nine of ten, also for learning, because the others judge.
TRAINING_SHARE_MAX = 0.9
# The paper's model in the paper's frame, for the paper's claim about few neighbours.
PAPER_PARAMS = "tools/params/street_paper.toml"
# A kernel of compact support, for more than 64 neighbours.
ASKEY_PARAMS = "tools/params/street_askey.toml"
# The share at which our learning is compared with the paper's learning and with the presets.
LML_SHARE = 0.04
# The share for gpom-eval that matches the returns of live maps.
SHARE_OF_LIVE = 1.0


class ResultsError(Exception):
    """An error, in one line."""


@dataclass(frozen=True)
class Log:
    name: str
    preset: str
    range_max_m: int


LOGS = (Log("intel", "indoor", 49), Log("csail", "indoor", 49), Log("seattle", "indoor", 49),
        Log("campus-west", "campus", 25), Log("acapulco", "campus", 49))


@dataclass(frozen=True)
class Job:
    """One run of gpom-eval. The runs of gpom-learn in `learnings` come before it. `$DATA` and
    `$STREETS` in the words stand for folders."""
    table: str
    data: str
    seed: int
    words: tuple
    learnings: tuple = ()
    tool: str = "gpom-eval"

    def name(self):
        return "-".join((self.table, self.data, str(self.seed))).replace(" ", "-")

    def shown(self):
        lines = [seedless("gpom-learn", words) for words in self.learnings]
        return "\n".join([*lines, seedless(self.tool, self.words)])


def seedless(tool, words):
    """A command line with the seed as a variable."""
    if "--seed" not in words:
        return " ".join([tool, *words])
    seed = words[words.index("--seed") + 1]
    shown = [word if before not in ("--seed", "--training-of") else "$SEED"
             for before, word in zip(("",) + words, words)]
    return " ".join([tool, *shown]).replace(f"-seed-{seed}/", "-seed-$SEED/")


# ---- jobs ---------------------------------------------------------------------------------------

def params_of(preset):
    """Parameter file of a preset. The indoor preset's file, if the preset has none yet."""
    path = f"tools/params/{preset}.toml"
    return path if (ROOT / path).is_file() else "tools/params/indoor.toml"


def shipped_presets():
    return [preset for preset in PRESETS if (ROOT / f"tools/params/{preset}.toml").is_file()]


def plain_params(own):
    """Parameters learnt for the paper's model only: NAME_plain.toml beside NAME.toml."""
    return own.replace(".toml", "_plain.toml")


def other_params(own):
    """All other presets, and this preset's plain model, to compare with."""
    names = [f"tools/params/{preset}.toml" for preset in PRESETS] + [plain_params(own or ".")]
    return tuple(name for name in names if name != own and (ROOT / name).is_file())


def log_job(log, split, fraction, seed):
    """Held-out beams: learn on the beams that make the map. Held-out runs: take a preset, because
    learning would draw its beams from all scans, also from the held-out ones."""
    kept = min(fraction, TRAINING_SHARE_MAX)
    source = ("--scans", f"$DATA/{log.name}.log.gz", "--range-max", str(log.range_max_m),
              "--fraction", str(kept), "--seed", str(seed))
    folder = f"$STREETS/{log.name}-{fraction}-seed-{seed}"
    params, also, learnings = params_of(log.preset), (), []
    if split == "beams":
        params = f"{folder}/lobo.toml"
        learnings.append((*source, *live_section.LEARNT_MODEL, "--out", params))
        if fraction == LML_SHARE:
            also = (f"{folder}/lml.toml", *other_params(""))
            learnings.append((*source, "--kernel", "nn", "--method", "lml", "--out", also[0]))
    words = ("log", *source, "--split", split, "--params", params)
    words += ("--map-frame-params", "tools/params/indoor_paper.toml")
    words += ("--also", ",".join(also)) if also else ()
    return Job(f"{split} {fraction}", log.name, seed, words, tuple(learnings))


def street_jobs(n_streets, n_points):
    params = params_of("street")
    for i in range(n_streets):
        words = ("street", "--scans", f"$STREETS/{i}.csv", "--truth", f"$STREETS/{i}.pgm",
                 "--params", params, "--points", str(n_points), "--exact-gp")
        if other_params(params):
            words += ("--also", ",".join(other_params(params)))
        yield Job("street", f"street {i}", i, words)
    if n_streets > 0:
        for table, params, counts in (
                ("neighbours", PAPER_PARAMS, (NEIGHBOURS,)),
                ("many neighbours", ASKEY_PARAMS, (MANY_NEIGHBOURS, "--dense-points", "500"))):
            yield Job(table, "street 0", 0,
                      ("street", "--scans", "$STREETS/0.csv", "--truth", "$STREETS/0.pgm",
                       "--params", params, "--points", str(n_points), "--rivals", "off",
                       "--neighbours", *counts))


def all_jobs(arguments, logs):
    jobs = [log_job(log, "beams", fraction, seed) for fraction in arguments.fractions
            for log in logs for seed in arguments.seeds]
    jobs += [log_job(log, "runs", fraction, seed) for fraction in arguments.fractions
             for log in logs for seed in arguments.seeds]
    return jobs + list(street_jobs(arguments.streets, arguments.points))


def live_jobs(arguments, logs):
    jobs = [Job(trial, log.name, seed, live_section.judge_words(log, seed, trial),
                tool="gpom-live")
            for trial in live_section.TRIALS for log in logs
            for seed in range(arguments.live_seeds)]
    jobs += [Job(live_section.LEARNT, log.name, seed, *live_section.learnt_words(log, seed),
                 tool="gpom-live")
             for log in logs for seed in live_section.few_seeds(arguments.live_seeds)]
    jobs += [Job(live_section.SEAMS, log.name, seed, live_section.seams_words(log, seed),
                 tool="gpom-live")
             for log in logs for seed in live_section.few_seeds(arguments.live_seeds)]
    jobs += [Job(live_section.SEAMS, f"street {i}", 0, live_section.street_seams_words(i),
                 tool="gpom-live") for i in range(arguments.streets)]
    if jobs:
        jobs.append(Job(live_section.DOORS, "corridor", 0, live_section.door_words(),
                        tool="gpom-live"))
    if arguments.drive > 0:
        jobs.append(Job("drive", "town", 0, live_section.drive_words(arguments.drive),
                        tool="gpom-live"))
    return jobs + [Job(odometry_section.name(*drive), "street", seed,
                       odometry_section.words(*drive, seed), tool="gpom-odometry")
                   for drive in odometry_section.DRIVES for seed in range(arguments.odometry)]


class Runner:
    """Runs tools of one build. They write into a folder."""

    def __init__(self, build, data, folder):
        self.build, self.data, self.folder = build, data, folder

    def run(self, tool, *words):
        words = [word.replace("$DATA", str(self.data)).replace("$STREETS", str(self.folder))
                 for word in words]
        try:
            done = subprocess.run([self.build / tool, *words], cwd=ROOT, capture_output=True,
                                  text=True, check=False)
        except OSError as error:
            raise ResultsError(f"{self.build / tool}: {error.strerror}; run make tools") from None
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
            raise ResultsError(f"{tool} failed: {lines[-1]}")

    def simulate(self, seed):
        self.run("gpom-sim", "--seed", str(seed), "--out", f"$STREETS/{seed}.csv",
                 "--truth", f"$STREETS/{seed}.pgm")

    def evaluate(self, job):
        for words in job.learnings:
            folder = pathlib.Path(words[-1].replace("$STREETS", str(self.folder))).parent
            folder.mkdir(parents=True, exist_ok=True)
            self.run("gpom-learn", *words)
        self.run(job.tool, *job.words, "--json", f"$STREETS/{job.name()}.json")
        return json.loads((self.folder / f"{job.name()}.json").read_text(encoding="utf-8"))

    def report(self, job):
        """The report in the folder from the same commands, or else a new report."""
        path = self.folder / f"{job.name()}.report"
        if path.is_file():
            kept = json.loads(path.read_text(encoding="utf-8"))
            if kept["commands"] == job.shown():
                return kept["report"]
        report = self.evaluate(job)
        write_text(path, json.dumps({"commands": job.shown(), "report": report}))
        return report


def run_jobs(runner, jobs, n_streets, n_at_once):
    for seed in range(n_streets):
        runner.simulate(seed)
    with ThreadPoolExecutor(n_at_once) as pool:
        futures = [pool.submit(runner.report, job) for job in jobs]
        try:
            bar = tqdm(zip(jobs, futures), total=len(jobs), unit="job", disable=None)
            return {(job.table, job.data, job.seed): future.result() for job, future in bar}
        finally:
            pool.shutdown(cancel_futures=True)


# ---- the document -------------------------------------------------------------------------------

def commands_of(jobs, seeds=""):
    lines = list(dict.fromkeys(job.shown() for job in jobs))
    return Commands("```\n" + "\n".join(lines) + "\n```\n" + seeds)


INTRO = """# Results

Written by `make results`; do not edit. Tables come first, then
[how they are judged](#how-it-is-judged) and what the columns mean, then the [commands](#commands)
that made each of them.
"""

METHOD = """## How it is judged

A log: at most 600 scans, taken evenly. Split *beams*: each return goes into the map with the
probability *share* (1.0 means 0.9). 6000 of the other returns judge the map. 3000 of them give an
occupied point 5 cm beyond the return. The other 3000 give a free point before the return: every
second one anywhere on the beam, the others on its last 0.5 m, all at least 5 cm before the return.
Split *runs*: two runs of 40 consecutive scans judge the map, which never gets them. A street:
random places in the whole area judge, with the simulator's truth.

AUC: area under the ROC curve. FP@95: false-positive rate at true-positive rate 0.95. NLL: mean
negative log likelihood, probabilities clipped to [0.001, 0.999]. ECE: expected calibration error in
ten bins. Band: the points within 0.5 m of the return of their beam. On streets: the points within
0.5 m of the true surface and within 5 m of a beam. Logs: mean over the split seeds, with the spread
(largest minus smallest) in brackets.

Before and behind surfaces: the map's answers at offsets from the return, along 3000 held-out beams.
An offset is negative before the return, in free space. On streets it is the distance from the true
surface, at 3000 places of the surface that the sensor could see. "p = .5 at": the offset at which
the mean probability rises to one half, interpolated between the offsets. Free means a probability
of at most 0.3, occupied of at least 0.7. A beam that grazes a wall is nearer to the wall than its
offset, so no map reaches 100 %. The truth of a street has cells of 0.25 m, which blurs its surface
by half a cell.

For held-out beams of logs, `gpom-learn` learns the GP's parameters from the beams that make the
map, as a vehicle would during a drive. For held-out runs and for streets, the parameters are those
of a preset. "GP, lml" is learnt from the same beams in the way of the paper: the covariance by the
log marginal likelihood, then the sigmoid by leave-one-out.

The strong grid, OctoMap and the occupancy grids get the cell size with the least NLL on the test
points themselves. The occupancy grids also get the best sensor model. These choices favour the
rivals. The smallest cells tried on logs are 0.05 m. The strong grid learns its scaling from beams
that it leaves out, also on streets, where points behind walls judge, too. FP@95 is 1 if over 5 % of
the occupied points have the least probability that a clamped map can give.
"""

BENCH_COMMAND = "```\nmake bench\n```\n"
RECORD_COMMAND = "```\nmake bench-record\n```\n"

SHARE_TITLES = {0.04: "4 %", 0.25: "25 %", 1.0: "100 % (90 % for the map)"}


SPEED = """Medians of one run on one core: the paper's model with Matern-1/2, or with
the paper's covariance for maps named -nn. n is the number of points, half of them hits. *x brute*,
*x tree*: speed compared with plain Eigen of dynamic size, with brute force and with our tree, both
compiled for any x86-64. *x sklearn*: speed compared with scikit-learn's solve only. *time /
nanoflann*: time of a whole query over the time of nanoflann's search of the hits only. *solve of
peak*: part of the measured peak of multiply-adds.
"""


def log_sections(figures, jobs, arguments, names):
    seeds = "`$SEED` = " + ", ".join(map(str, arguments.seeds)) + "\n"
    tables = [(f"{split} {f}", f"Logs, held-out {split}, {SHARE_TITLES.get(f, f'share {f}')}")
              for split in ("beams", "runs") for f in arguments.fractions]
    yield "## Is the GP ahead?\n"
    yield ("In AUC, FP@95 and NLL, means over the seeds; then its NLL over the rival's. From the "
           "tables below.\n")
    yield ahead_table(figures, [table for table, _ in tables], names)
    for table, title in tables:
        yield f"## {title}\n"
        yield commands_of([job for job in jobs if job.table == table], seeds)
        yield log_table(figures, table, names)
        yield "Before and behind surfaces:\n"
        yield log_profile_table(figures, table, names)


def street_sections(figures, jobs, streets, bench):
    for part, title in (("near", "within 5 m of a beam"), ("all", "whole area")):
        yield f"## Streets, {title}\n"
        yield commands_of([job for job in jobs if job.table == "street"])
        yield "Cells: AUC / FP@95 / NLL, with the spread over the streets in brackets.\n"
        yield street_table(figures, streets, part)
    yield "Before and behind the true surface, means over the streets:\n"
    yield street_profile_table(figures, streets)
    yield "## Few neighbours or all beams\n"
    yield commands_of([job for job in jobs if job.table == "neighbours"])
    yield ("The paper's section III.D: its model, in the map frame, from the nearest hits and free "
           "segments,\nagainst the dense one of all beams with eq. 10 in double precision; "
           "labels are 1 and -1.\n")
    yield neighbour_table(figures.reports["neighbours", "street 0", 0])
    yield "## Many neighbours\n"
    yield commands_of([job for job in jobs if job.table == "many neighbours"])
    yield ("A covariance of compact support; up to 32 + 32 points solved dense, from 64 + 64 on "
           "sparse. 128 + 128 is\nthe row of 256 neighbours.\n")
    yield neighbour_table(figures.reports["many neighbours", "street 0", 0])
    if bench is not None:
        table, lanes = solve_table(bench)
        yield Commands(BENCH_COMMAND)
        yield (f"Time of a query by the sparse solve over that by the dense one, forced, with "
               f"{lanes} queries side by\nside, on 12,000 beams of sparse streets; the sparse "
               "solve takes them one by one. Below 1 it wins.\n")
        yield table


def rival_entries(figures, name):
    """Label and entries, seed by seed, of every rival of the live map of a log."""
    table = f"beams {SHARE_OF_LIVE}"
    return [(label, figures.of(table, name, key))
            for key, label in figures.methods(table).items() if not key.startswith("gp_")]


def live_sections(figures, jobs, arguments, logs):
    names = [log.name for log in logs]
    n_few = len(live_section.few_seeds(arguments.live_seeds))
    if names:
        yield "## The live map: before and behind surfaces\n"
        yield commands_of([job for job in jobs if job.table == live_section.LEARNT],
                            f"`$SEED` = 0 to {n_few - 1}\n")
        yield live_section.SURFACES_TEXT
        if SHARE_OF_LIVE not in arguments.fractions:
            yield f"Rivals left out: no share {SHARE_OF_LIVE} among those asked for.\n"
        yield table_text(*live_section.surface_table(
            figures.reports, logs, lambda name: rival_entries(figures, name)))
    for trial in live_section.TRIALS if names else ():
        yield f"## The live map: {live_section.TITLES[trial]}\n"
        yield commands_of([job for job in jobs if job.table == trial],
                            f"`$SEED` = 0 to {arguments.live_seeds - 1}\n")
        for part in live_section.parts(trial, figures.reports, names):
            yield part if isinstance(part, str) else table_text(*part)
    yield from seams_and_doors(figures, jobs, arguments)
    if arguments.drive > 0:
        yield "## The live map: a long drive\n"
        yield commands_of([job for job in jobs if job.table == "drive"])
        yield table_text(*live_section.drive_table(figures.reports["drive", "town", 0]))


def seams_and_doors(figures, jobs, arguments):
    seams = [job for job in jobs if job.table == live_section.SEAMS]
    if seams:
        n_few = len(live_section.few_seeds(arguments.live_seeds))
        yield "## The live map: jumps\n"
        yield commands_of(seams, f"`$SEED` = 0 to {n_few - 1}\n")
        yield live_section.SEAMS_TEXT
        yield table_text(*live_section.seams_table(figures.reports))
    doors = [job for job in jobs if job.table == live_section.DOORS]
    if doors:
        yield "## The live map: doors\n"
        yield commands_of(doors)
        yield live_section.DOORS_TEXT
        yield table_text(*live_section.door_table(
            figures.reports[live_section.DOORS, "corridor", 0]))


def odometry_sections(figures, jobs, n_seeds):
    if n_seeds == 0:
        return
    yield "## Odometry between poses\n"
    yield odometry_section.TEXT
    for drive in odometry_section.DRIVES:
        name = odometry_section.name(*drive)
        yield commands_of([job for job in jobs if job.table == name],
                            f"`$SEED` = 0 to {n_seeds - 1}\n")
        yield odometry_section.caption(*drive)
        yield table_text(*odometry_section.table(
            [figures.reports[name, "street", seed] for seed in range(n_seeds)]))


def speed_sections(bench):
    """The output of `make bench` without the solves of many neighbours, which have a table."""
    if bench is None:
        return
    yield "## Speed beside others\n"
    yield Commands(BENCH_COMMAND)
    yield SPEED
    lines = (bench / "ratios.txt").read_text(encoding="utf-8").splitlines()
    yield "\n".join(["```", *(line for line in lines if not line.startswith("n = ")), "```\n"])


def processor_sections():
    """The main ratios of all processors that were tried."""
    records = processor_section.read_records(ROOT / "bench" / "processors")
    if records:
        yield "## Speed on other processors\n"
        yield Commands(RECORD_COMMAND)
        yield processor_section.TEXT
        yield processor_section.table(records)


def document(figures, jobs, arguments, logs):
    names = [log.name for log in logs]
    streets = [f"street {i}" for i in range(arguments.streets)]
    intro, method, parts = INTRO, [METHOD], []
    absent = [log.name for log in LOGS if log.name not in names]
    if absent:
        intro += "\nLogs left out, not in the data folder: " + ", ".join(absent) + ".\n"
    notes = dict.fromkeys(note for report in figures.reports.values()
                          for note in report.get("left_out", []))
    method += [f"Left out: {note}.\n" for note in notes]
    if names:
        parts += log_sections(figures, jobs, arguments, names)
    if streets:
        parts += street_sections(figures, jobs, streets, arguments.bench)
    parts += live_sections(figures, jobs, arguments, logs)
    parts += odometry_sections(figures, jobs, arguments.odometry)
    parts += speed_sections(arguments.bench)
    parts += processor_sections()
    places = [("beams 0.04", log.name, pathlib.Path(params_of(log.preset)).stem, "all")
              for log in logs if 0.04 in arguments.fractions]
    places += [("street", name, "street", "near") for name in streets]
    if places:
        parts += ["## Parameters used on each other's data\n",
                  "NLL, from the runs above at 4 % and near beams. Bold: the preset for such\n"
                  "data, used on held-out runs; which one is best was seen here alone.\n",
                  cross_table(figures, shipped_presets(), places)]
    return tables_first(intro, parts, method)


# ---- command line -------------------------------------------------------------------------------

class OneLineParser(argparse.ArgumentParser):
    def error(self, message):
        self.exit(EXIT_USAGE, f"{self.prog}: {message}; see {self.prog} --help\n")


def numbers(kind):
    def parse(text):
        values = [kind(word) for word in text.split(",")]
        if not all(0 <= value < 1000 for value in values):
            raise ValueError(text)
        return values
    parse.__name__ = "list of numbers"
    return parse


def parse_arguments():
    parser = OneLineParser(prog="gpom-results", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", metavar="DIR", type=pathlib.Path, required=True,
                        help="folder of the logs")
    parser.add_argument("--out", metavar="FILE", type=pathlib.Path, required=True,
                        help="Markdown file to write")
    parser.add_argument("--build", metavar="DIR", type=pathlib.Path,
                        default=ROOT / "build" / "host-release",
                        help="folder of the built tools (default: build/host-release)")
    parser.add_argument("--seeds", type=numbers(int), default=[0, 1, 2],
                        help="seeds of the splits, comma between them (default: 0,1,2)")
    parser.add_argument("--fractions", type=numbers(float), default=[0.04, 0.25, 1.0],
                        help="shares of the returns (default: 0.04,0.25,1.0)")
    parser.add_argument("--streets", type=int, choices=range(0, 11), default=5, metavar="N",
                        help="streets of seeds 0 to N - 1 (default: 5)")
    parser.add_argument("--points", type=int, choices=range(100, 1_000_001), default=20000,
                        metavar="N", help="test points of a street (default: 20000)")
    parser.add_argument("--live-seeds", type=int, choices=range(1, 101), default=10, metavar="N",
                        help="live maps of seeds 0 to N - 1, at most 3 of them learnt for "
                             "(default: 10)")
    parser.add_argument("--drive", type=int, choices=range(0, 10_000_001), default=864_000,
                        metavar="N", help="scans of the long drive (default: 864000, ten minutes)")
    parser.add_argument("--bench", metavar="DIR", type=pathlib.Path,
                        help="folder of `make bench`: speed.json, ratios.txt (default: left out)")
    parser.add_argument("--odometry", type=int, choices=range(0, 101), default=10, metavar="N",
                        help="drives with odometry of seeds 0 to N - 1 (default: 10)")
    parser.add_argument("--reports", metavar="DIR", type=pathlib.Path,
                        help="folder that keeps the report of each run. A run is not repeated if "
                             "its commands have not changed. Remove the folder when tools or "
                             "presets have changed (default: nothing is kept)")
    parser.add_argument("--jobs", type=int, choices=range(1, 65), default=2, metavar="N",
                        help="runs at once (default: 2)")
    return parser.parse_args()


def write_text(path, text):
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(text, encoding="utf-8")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def make_results(arguments):
    arguments.data, arguments.build = arguments.data.resolve(), arguments.build.resolve()
    logs = [log for log in LOGS if (arguments.data / f"{log.name}.log.gz").is_file()]
    for log in LOGS:
        if log not in logs:
            print(f"gpom-results: {log.name} left out: no {arguments.data / log.name}.log.gz")
    jobs = all_jobs(arguments, logs) + live_jobs(arguments, logs)
    if not jobs:
        raise ResultsError("nothing to do: no logs, no streets and no drives")
    with contextlib.ExitStack() as stack:
        folder = arguments.reports or pathlib.Path(stack.enter_context(
            tempfile.TemporaryDirectory(prefix="gpom-results-")))
        folder.mkdir(parents=True, exist_ok=True)
        runner = Runner(arguments.build, arguments.data, folder.resolve())
        reports = run_jobs(runner, jobs, arguments.streets, arguments.jobs)
    write_text(arguments.out, document(Figures(reports), jobs, arguments, logs))


def main():
    arguments = parse_arguments()
    try:
        make_results(arguments)
    except ResultsError as error:
        print(f"gpom-results: {error}", file=sys.stderr)
        return EXIT_USAGE
    except OSError as error:
        print(f"gpom-results: {error.filename}: {error.strerror}", file=sys.stderr)
        return EXIT_USAGE
    print(arguments.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The live map's sections of RESULTS.md: figures of gpom-live as Markdown tables."""
from profile_cells import PROFILE_TITLES, profile_cells

# Keys of a figure in a report, and its title.
METRICS = ((("auc",), "AUC"), (("fp_at_tp95",), "FP@95"), (("nll",), "NLL"), (("ece",), "ECE"),
           (("band", "nll"), "NLL, band"), (("band", "ece"), "ECE, band"))
MORE_IS_BETTER = (("auc",),)
COUNTS = ("beams_known", "beams_contradicting", "beams_redundant", "beams_evicted_redundant",
          "beams_evicted_contradicted", "beams_not_confirmed", "hits_cleared", "free_cleared")
# Further words for `gpom-live judge`, beside the log.
TRIALS = {"live": (), "spurious": ("--spurious", "0.05")}
TITLES = {"live": "what is worth keeping", "spurious": "spurious returns"}
# Maps with parameters learnt from their own beams.
LEARNT = "live learnt"
# Number of seeds where ten seeds would give no more information.
FEW_SEEDS = 3
# Neighbours fade in live maps.
FADING = ("--fix", "fading=2")
# Weight of a free place in learning for a live map (gpom-learn --free-weight).
FREE_WEIGHTS = {"indoor": "1.4", "campus": "1"}
LEARNT_MODEL = ("--kernel", "matern12", "--model", "noise,anisotropy,vote,line")
SEAMS = "seams"
SEAMS_TEXT = """\
Measured along 500 random lines of 1 m through places on held-out beams (streets: through random
places near beams). The table has the number of neighbouring places, 2 mm apart, whose probabilities
differ by more than a bound, for each metre, and the largest difference. A jump is the part of a
difference that is left when the places are 0.03 mm apart. The rest is a steep slope. Means over the
seeds, and the largest difference of all.
"""
DOORS = "doors"
DOORS_TEXT = """\
A corridor with three doors, and a laser of 180 beams with 1 cm noise. First the robot only drives
past the doors, then through them. Free: p <= 0.3. Widths: the worst of ten runs, with the median in
brackets. Robots: the runs in which a disc of this radius fits through (`gpom_path_query`).
"""
SURFACES_TEXT = """\
Live maps as below: nine of ten returns of all scans in order, with at most 16,384 beams kept. The
other returns judge. "Learnt": `gpom-learn` learnt the parameters from the returns that make the
map. Rivals: from the tables above, with nine of ten returns of at most 600 scans, all kept, and
each rival's best setting. Means over the seeds, with the spread in brackets.
"""
TEXT = """\
Nine of ten returns of all scans, in order, go into a map of 16,384 beams. It is compared with a map
of the same number of beams, drawn at random from these returns. The other returns judge. The spread
over the seeds is in brackets.
"""
SPURIOUS_TEXT = """\
One of twenty returns that make the maps is too short, by a random part of its range, as dust, rain
or another laser can cause it.
"""
UNCHANGED_TEXT = """\
The same without the places that changed. A return judges even if the thing that it came from has
left later. The map then calls the place free, which is right, but counts as an error above. This
table leaves out an occupied point if the last five scans that saw its place looked through it (a
beam passes within 0.05 m and goes on for 0.5 m, and there is no return within 0.15 m).
"""


def log_words(log):
    """`$DATA` stands for the folder of the logs."""
    return ("--scans", f"$DATA/{log.name}.log.gz", "--range-max", str(log.range_max_m))


def judge_words(log, seed, trial):
    """Words of gpom-live for a log and the preset for such data."""
    return ("judge", *log_words(log), "--params", f"tools/params/{log.preset}.toml",
            "--seed", str(seed), *TRIALS[trial])


def learnt_words(log, seed):
    """Words of gpom-live, and of gpom-learn, which runs before it on the beams of the same map."""
    params = f"$STREETS/{log.name}-live-seed-{seed}/live.toml"
    learn = (*log_words(log), "--training-of", str(seed), "--seed", str(seed), *LEARNT_MODEL,
             *FADING, "--free-weight", FREE_WEIGHTS[log.preset], "--out", params)
    return ("judge", *log_words(log), "--params", params, "--seed", str(seed)), (learn,)


def seams_words(log, seed):
    return ("seams", *log_words(log), "--params", f"tools/params/{log.preset}.toml",
            "--seed", str(seed))


def street_seams_words(i):
    return ("seams", "--scans", f"$STREETS/{i}.csv", "--truth", f"$STREETS/{i}.pgm", "--params",
            "tools/params/street.toml")


def door_words():
    return ("door", "--params", "tools/params/indoor.toml", "--runs", "10")


def drive_words(n_scans):
    return ("drive", "--params", "tools/params/street.toml", "--scans", str(n_scans), "--cells",
            "64", "--step-ops", "400000")


def figure_of(entry, path):
    for key in path:
        entry = entry[key]
    return entry


def mean_and_spread(values):
    return f"{sum(values) / len(values):.4f} ({max(values) - min(values):.4f})"


def seeds_ahead(reports, metric):
    """Number of seeds on which kept beams are better than the same number at random."""
    gains = [figure_of(report["live"], metric) - figure_of(report["random"], metric)
             for report in reports]
    n_ahead = sum(gain > 0 if metric in MORE_IS_BETTER else gain < 0 for gain in gains)
    return f"{n_ahead} of {len(gains)}"


def accuracy_table(reports):
    """Header and rows. reports: for each log's name the reports of `gpom-live judge`, seed by seed,
    or their parts about places that did not change."""
    rows = []
    for name, of_seeds in reports.items():
        for key, label in (("live", "kept"), ("random", "as many at random")):
            cells = [mean_and_spread([figure_of(report[key], metric) for report in of_seeds])
                     for metric, _ in METRICS]
            rows.append([name, label, *cells, str(of_seeds[0][key]["kept"]),
                         str(of_seeds[0]["points"])])
        ahead = [seeds_ahead(of_seeds, metric) for metric, _ in METRICS]
        rows.append([name, "seeds on which kept ones are better", *ahead, "", ""])
    return ["log", "beams", *(title for _, title in METRICS), "number", "test points"], rows


def few_seeds(n_seeds):
    return range(min(n_seeds, FEW_SEEDS))


def surface_table(reports, logs, rivals_of):
    """Profiles of live maps with learnt parameters and with those of the preset, and of rivals.
    rivals_of(name): label and entries of gpom-eval for each rival, seed by seed."""
    rows = []
    for name, preset in ((log.name, log.preset) for log in logs):
        seeds = [seed for table, log, seed in reports if (table, log) == (LEARNT, name)]
        lives = [(label, [reports[table, name, seed]["live"] for seed in seeds])
                 for table, label in ((LEARNT, "live map, learnt"),
                                      ("live", f"live map, {preset}.toml"))]
        rivals = [(label, [entry["all"] | entry for entry in entries])
                  for label, entries in rivals_of(name)]
        for label, entries in lives + rivals:
            figures = [mean_and_spread([figure_of(entry, path) for entry in entries])
                       for path, _ in METRICS]
            rows.append([name, label, *figures,
                         *profile_cells([entry["profile"] for entry in entries])])
    return ["log", "map", *(title for _, title in METRICS), *PROFILE_TITLES], rows


def seams_table(reports):
    """A row for each log or street, from the reports of `gpom-live seams`, seed by seed."""
    rows, bounds = [], []
    names = dict.fromkeys(name for table, name, _ in reports if table == SEAMS)
    for name in names:
        of_seeds = [report for key, report in reports.items() if key[:2] == (SEAMS, name)]
        cells = []
        for kind in ("differences", "jumps"):
            bounds = [row["over"] for row in of_seeds[0][kind]["per_m"]]
            for i in range(len(bounds)):
                values = [report[kind]["per_m"][i]["per_m"] for report in of_seeds]
                cells.append(f"{sum(values) / len(values):.3f}")
            cells.append(f"{max(report[kind]['largest'] for report in of_seeds):.3f}")
        rows.append([name, *cells])
    titles = [title for kind in ("differences", "jumps")
              for title in (*(f"{kind} over {bound} a metre" for bound in bounds),
                            f"largest of the {kind}")]
    return ["map of", *titles], rows


def door_table(report):
    """A row for each door and stage of `gpom-live door`."""
    rows = []
    for row in report["summary"]:
        doors = [door for run in report["runs"] for door in run[row["stage"]]["doors"]
                 if door["width_m"] == row["width_m"]]
        widths = [f"{figure['worst']:.3f} ({figure['median']:.3f})" for figure in row["free_m"]]
        robots = [f"{sum(door['paths'][i]['free'] for door in doors)} of {len(doors)}"
                  for i in range(len(doors[0]["paths"]))]
        rows.append([f"{row['width_m']:g}", f"driven {row['stage']}", *widths, *robots])
    door = report["runs"][0]["through"]["doors"][0]
    maps = [width["map"] if width["map"] == "continuous" else
            f"{width['map']}, {width['cell_m']:g} m" for width in door["widths"]]
    robots = [f"robot of {path['radius_m']:g} m" for path in door["paths"]]
    return ["door [m]", "", *(f"free in {name} [m]" for name in maps), *robots], rows


def parts(trial, reports, names):
    """The contents of a trial's section: texts, and headers and rows of tables."""
    of_logs = {name: [report for (table, log, _), report in reports.items()
                      if (table, log) == (trial, name)] for name in names}
    if trial == "spurious":
        yield SPURIOUS_TEXT
        yield accuracy_table(of_logs)
        return
    yield TEXT
    yield accuracy_table(of_logs)
    yield UNCHANGED_TEXT
    yield accuracy_table(unchanged(of_logs))
    yield work_table(of_logs)


def unchanged(reports):
    """For each log's name, the parts of its reports about places that did not change."""
    return {name: [report["unchanged"] for report in of_seeds]
            for name, of_seeds in reports.items()}


def work_table(reports):
    """Memory, operations of steps and counts by cause, from the first seed."""
    rows = []
    for name, (report, *_) in reports.items():
        ops = report["step_ops"]
        rows.append([name, str(report["scans"]), str(report["map_bytes"]), f"{ops['mean']:.0f}",
                     str(ops["max"]), *(str(report["counts"][count]) for count in COUNTS)])
    header = ["log", "scans", "bytes", "mean operations a step", "largest"]
    return header + [count.replace("_", " ") for count in COUNTS], rows


def drive_table(report):
    """A row for each tenth of `gpom-live drive`."""
    rows = [[str(i + 1), str(t["kept"]), str(t["resident_bytes"]), f"{t['step_ops_mean']:.0f}",
             str(t["step_ops_max"]), f"{t['items_per_query']:.0f}"]
            for i, t in enumerate(report["tenths"])]
    return ["tenth", "kept", "resident bytes", "mean operations a step", "largest",
            "beams looked at by a query"], rows

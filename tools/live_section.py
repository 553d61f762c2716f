"""The live map's sections of RESULTS.md: figures of gpom-live as Markdown tables."""
METRICS = (("auc", "AUC"), ("fp_at_tp95", "FP@95"), ("nll", "NLL"), ("ece", "ECE"))
PRESETS = {"intel": "indoor", "csail": "indoor", "seattle": "indoor", "campus-west": "campus",
           "acapulco": "campus"}
COUNTS = ("beams_known", "beams_contradicting", "beams_redundant", "beams_evicted_redundant",
          "beams_evicted_contradicted", "beams_not_confirmed", "hits_cleared", "free_cleared")


def judge_words(name, seed):
    """Words of gpom-live for a log; `$DATA` stands for the folder of the logs."""
    return ("judge", "--scans", f"$DATA/{name}.log.gz", "--params",
            f"tools/params/{PRESETS[name]}.toml", "--seed", str(seed))


def drive_words(n_scans):
    return ("drive", "--params", "tools/params/street.toml", "--scans", str(n_scans), "--cells",
            "64", "--step-ops", "400000")


def mean_and_spread(values):
    return f"{sum(values) / len(values):.4f} ({max(values) - min(values):.4f})"


def accuracy_table(reports):
    """Header and rows. reports: of each log's name, those of `gpom-live judge`, seed by seed."""
    rows = []
    for name, of_seeds in reports.items():
        for key, label in (("live", "kept"), ("random", "as many at random")):
            cells = [mean_and_spread([report[key][metric] for report in of_seeds])
                     for metric, _ in METRICS]
            rows.append([name, label, *cells, str(of_seeds[0][key]["kept"])])
    return ["log", "beams", *(title for _, title in METRICS), "number"], rows


def work_table(reports):
    """Memory, operations of steps and counts by cause, of the first seed."""
    rows = []
    for name, (report, *_) in reports.items():
        ops = report["step_ops"]
        rows.append([name, str(report["scans"]), str(report["map_bytes"]), f"{ops['mean']:.0f}",
                     str(ops["max"]), *(str(report["counts"][count]) for count in COUNTS)])
    header = ["log", "scans", "bytes", "mean operations a step", "largest"]
    return header + [count.replace("_", " ") for count in COUNTS], rows


def drive_table(report):
    """Of `gpom-live drive`, a line for each tenth."""
    rows = [[str(i + 1), str(t["kept"]), str(t["resident_bytes"]), f"{t['step_ops_mean']:.0f}",
             str(t["step_ops_max"]), f"{t['items_per_query']:.0f}"]
            for i, t in enumerate(report["tenths"])]
    return ["tenth", "kept", "resident bytes", "mean operations a step", "largest",
            "beams looked at by a query"], rows

"""gpom-eval, gpom-plot and the demo, end to end: files, figures, bars, and bad input."""
import csv
import json
import os
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARAMS = ROOT / "tools" / "params"
METHODS = ["gp_query", "gp_map", "grid", "wide_grid", "strong_grid", "octomap"]
FILES = {"eval.json", "map.csv", "grid.csv", "wide_grid.csv", "hits.csv", "poses.csv", "points.csv",
         "profile.csv"}
OFFSETS = [-1.0, -0.5, -0.3, -0.2, -0.1, -0.05, 0.0, 0.05, 0.1, 0.2]
PNG_START = b"\x89PNG\r\n\x1a\n"


def columns_of(path):
    with open(path, encoding="utf-8", newline="") as source:
        header, *rows = list(csv.reader(source))
    return dict(zip(header, zip(*rows)))


def numbers(columns, name):
    return np.array(columns[name], dtype=float)


def report_of(folder):
    report = json.loads((folder / "eval.json").read_text(encoding="utf-8"))
    report["by_key"] = {method["key"]: method for method in report["methods"]}
    return report


def auc(scores, truth):
    """Share of (occupied, free) pairs in the right order, ties 1/2."""
    occupied, free = np.sort(scores[truth]), np.sort(scores[~truth])
    below = np.searchsorted(free, occupied, "left")
    not_above = np.searchsorted(free, occupied, "right")
    return float((below + not_above).mean() / (2 * len(free)))


def false_positive_rate(scores, truth):
    """At the largest score that at least 95 % of the occupied points reach."""
    occupied = np.sort(scores[truth])[::-1]
    threshold = occupied[int(np.ceil(0.95 * len(occupied) - 1e-9)) - 1]
    return float((scores[~truth] >= threshold).mean())


def nll(scores, truth):
    p = np.clip(scores, 0.001, 0.999)
    return float(-np.log(np.where(truth, p, 1 - p)).mean())


def ece(scores, truth):
    """Ten bins of equal width, 1 in the last one."""
    bins = np.minimum(np.floor(scores * 10).astype(int), 9)
    return sum(abs((scores[bins == i] - truth[bins == i]).sum()) for i in set(bins)) / len(scores)


def evaluate_street(run, street, out, *more):
    return run("gpom-eval", "street", "--scans", street, "--truth", street.with_name("truth.pgm"),
               "--params", PARAMS / "street.toml", "--out", out, *more)


@pytest.fixture(scope="session")
def street_eval(run, street, tmp_path_factory):
    """Folder and stdout of an evaluation on the street of seed 1."""
    out = tmp_path_factory.mktemp("eval") / "new" / "street"
    done = evaluate_street(run, street, out)
    assert done.returncode == 0, done.stderr
    return out, done.stdout


@pytest.fixture(scope="session")
def intel_eval(run, log, tmp_path_factory):
    out = tmp_path_factory.mktemp("eval") / "intel"
    done = run("gpom-eval", "log", "--scans", log("intel.log.gz"), "--range-max", 49,
               "--params", PARAMS / "indoor.toml", "--out", out)
    assert done.returncode == 0, done.stderr
    return out


# ---- figures ------------------------------------------------------------------------------------

def test_the_map_beats_both_grids_on_a_street(street_eval):
    methods = report_of(street_eval[0])["by_key"]
    near = {key: method["near"]["auc"] for key, method in methods.items()}
    assert near["gp_query"] >= near["grid"] + 0.12
    assert near["gp_query"] >= near["wide_grid"] + 0.05


def test_the_map_is_accurate_on_a_log_at_four_percent(intel_eval):
    """Measured: AUC 0.981, FP@95 0.099, mean probability one half 0.137 m before the return."""
    method = report_of(intel_eval)["by_key"]["gp_query"]
    assert method["all"]["auc"] >= 0.975
    assert method["all"]["fp_at_tp95"] <= 0.12
    assert -0.16 < method["profile"]["crossing_m"] < 0


def test_the_log_protocol_takes_600_scans_and_6000_points(intel_eval):
    report = report_of(intel_eval)
    assert report["scans"] == 600
    assert 0.035 < report["beams"] / len(columns_of(intel_eval / "hits.csv")["x"]) < 0.045
    truth = numbers(columns_of(intel_eval / "points.csv"), "truth")
    assert len(truth) == 6000 and truth.sum() == 3000


@pytest.mark.parametrize("part", ["all", "near"])
def test_the_figures_are_those_of_the_points(street_eval, part):
    points = columns_of(street_eval[0] / "points.csv")
    kept = numbers(points, "near") >= (1 if part == "near" else 0)
    truth = numbers(points, "truth")[kept] > 0
    report = report_of(street_eval[0])
    assert list(report["by_key"]) == METHODS
    for key, method in report["by_key"].items():
        p, metrics = numbers(points, key)[kept], method[part]
        assert metrics["points"] == len(p)
        assert metrics["share_occupied"] == pytest.approx(truth.mean())
        assert metrics["auc"] == pytest.approx(auc(p, truth), abs=1e-5)
        assert metrics["fp_at_tp95"] == pytest.approx(false_positive_rate(p, truth), abs=1e-3)
        assert metrics["nll"] == pytest.approx(nll(p, truth), abs=1e-5)
        assert len(metrics["roc"]["fp"]) == len(metrics["roc"]["tp"]) <= 500
        assert sum(b["points"] for b in metrics["reliability"]) == len(p)


@pytest.mark.parametrize("where", ["street_eval", "intel_eval"])
def test_the_band_is_that_of_the_points(request, where):
    """Of a street the near ones in it; of a log all occupied ones belong to it."""
    out = request.getfixturevalue(where)
    out = out[0] if isinstance(out, tuple) else out
    points = columns_of(out / "points.csv")
    truth = numbers(points, "truth") > 0
    kept = (numbers(points, "band") > 0) & (numbers(points, "near") > 0)
    assert where == "street_eval" or kept[truth].all()
    for key, method in report_of(out)["by_key"].items():
        p, band = numbers(points, key)[kept], method["band"]
        assert band["points"] == kept.sum() > 500
        assert band["share_occupied"] == pytest.approx(truth[kept].mean())
        assert band["nll"] == pytest.approx(nll(p, truth[kept]), abs=1e-5)
        assert band["ece"] == pytest.approx(ece(p, truth[kept]), abs=1e-5)


def crossing_of(means):
    """Where the mean probability first rises to one half; None if it never does."""
    for i, (before, here) in enumerate(zip(means, means[1:])):
        if before < 0.5 <= here:
            return float(np.interp(0.5, [before, here], OFFSETS[i:i + 2]))
    return None


@pytest.mark.parametrize("where", ["street_eval", "intel_eval"])
def test_the_profile_is_that_of_its_places(request, where):
    out = request.getfixturevalue(where)
    out = out[0] if isinstance(out, tuple) else out
    places = columns_of(out / "profile.csv")
    offset = numbers(places, "offset")
    for key, method in report_of(out)["by_key"].items():
        rows, means = method["profile"]["rows"], []
        assert [row["offset_m"] for row in rows] == OFFSETS
        for row in rows:
            p = numbers(places, key)[np.isclose(offset, row["offset_m"])]
            means.append(p.mean())
            assert row["places"] == len(p)
            assert row["mean_probability"] == pytest.approx(p.mean(), abs=1e-6)
            assert row["share_free"] == pytest.approx((p <= 0.3 + 1e-6).mean())
            assert row["share_occupied"] == pytest.approx((p >= 0.7 - 1e-6).mean())
        assert method["profile"]["crossing_m"] == pytest.approx(crossing_of(means), abs=1e-6)


def test_the_profile_of_a_log_is_along_its_held_out_beams(intel_eval):
    """At offset 0 lie 3000 different returns that the map did not get, the others on their beam."""
    hits, places = (columns_of(intel_eval / name) for name in ("hits.csv", "profile.csv"))
    held_out = {(x, y) for x, y, kept in zip(hits["x"], hits["y"], hits["in_map"]) if kept == "0"}
    at = np.stack([numbers(places, "x"), numbers(places, "y")], axis=1)
    offset = numbers(places, "offset")
    first = np.flatnonzero(np.isclose(offset, 0.0))
    assert len(first) == 3000
    assert all((places["x"][i], places["y"][i]) in held_out for i in first)
    ends = at[np.flatnonzero(np.isclose(offset, 0.2))]
    direction = (ends - at[first]) / 0.2
    assert np.allclose(np.hypot(*direction.T), 1, atol=2e-3)
    for wanted in (-0.3, -0.05, 0.1):
        near = at[np.isclose(offset, wanted)]
        if len(near) == 3000:
            assert np.allclose(near, at[first] + wanted * direction, atol=1e-3)


def test_the_table_has_the_band_and_the_profile(street_eval, run, log):
    assert "negative before it" in street_eval[1] and "from the true surface" in street_eval[1]
    done = run("gpom-eval", *log_words(log("csail.log.gz"), "--rivals", "off"))
    assert "from the return along held-out beams" in done.stdout
    assert done.stdout.count("mean p is 0.5 at ") + done.stdout.count("never rises") == 4
    lines = done.stdout.splitlines()
    header = next(line for line in lines if line.startswith("method  ") and "offset" in line)
    assert [float(word) for word in header.split()[2:]] == OFFSETS
    assert sum("free %" in line for line in lines) == 4 == sum("occupied %" in l for l in lines)


# ---- files --------------------------------------------------------------------------------------

def read_truth(path):
    """Occupancy by row from the south, corner and cell, read by the format's description alone."""
    magic, place, *rest = path.read_bytes().split(b"\n", 2)
    x0, y0, cell = map(float, place.split()[3:6])
    lines = rest[0]
    while lines.startswith(b"#"):
        lines = lines.split(b"\n", 1)[1]
    size, _, pixels = lines.split(b"\n", 2)
    nx, ny = map(int, size.split())
    assert magic == b"P5"
    return np.frombuffer(pixels, np.uint8).reshape(ny, nx)[::-1] == 0, x0, y0, cell


def test_truth_of_the_points_is_the_streets(street, street_eval):
    occupied, x0, y0, cell = read_truth(street.with_name("truth.pgm"))
    points = columns_of(street_eval[0] / "points.csv")
    ix = np.floor((numbers(points, "x") - x0) / cell).astype(int)
    iy = np.floor((numbers(points, "y") - y0) / cell).astype(int)
    assert np.array_equal(occupied[iy, ix], numbers(points, "truth") > 0)
    assert 0.2 < occupied.mean() < 0.8


def test_the_robot_drives_on_free_ground_and_hits_lie_on_surfaces(street, street_eval):
    occupied, x0, y0, cell = read_truth(street.with_name("truth.pgm"))
    poses, hits = (columns_of(street_eval[0] / name) for name in ("poses.csv", "hits.csv"))
    ix = ((numbers(poses, "x") - x0) / cell).astype(int)
    iy = ((numbers(poses, "y") - y0) / cell).astype(int)
    assert not occupied[iy, ix].any()
    ix = ((numbers(hits, "x") - x0) / cell).astype(int)
    iy = ((numbers(hits, "y") - y0) / cell).astype(int)
    around = np.pad(occupied, 1, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(around, (3, 3))[iy, ix]
    has_both = windows.any(axis=(1, 2)) & ~windows.all(axis=(1, 2))
    assert has_both.mean() > 0.95


def test_rasters_are_full_and_of_the_documented_columns(street_eval):
    out, _ = street_eval
    assert {path.name for path in out.iterdir()} == FILES | {"truth.pgm"}
    cells = columns_of(out / "map.csv")
    assert list(cells) == ["x", "y", "mean", "variance", "probability", "class"]
    assert set(cells["class"]) <= {"free", "unsure", "occupied"}
    n_columns, n_rows = len(set(cells["x"])), len(set(cells["y"]))
    assert n_columns * n_rows == len(cells["x"]) and n_columns <= 400 and n_rows <= 300
    for name in ("grid.csv", "wide_grid.csv"):
        grid = columns_of(out / name)
        assert list(grid) == ["x", "y", "probability"]
        assert grid["x"] == cells["x"] and grid["y"] == cells["y"]
        assert np.all(np.abs(numbers(grid, "probability") - 0.5) <= 0.5)


def test_the_report_says_how_to_make_it_again(street_eval):
    out, stdout = street_eval
    report = report_of(out)
    assert report["params"]["text"] == (PARAMS / "street.toml").read_text(encoding="utf-8")
    paper = (PARAMS / "street_paper.toml").read_text(encoding="utf-8")
    assert report["map_frame_params"]["text"] == paper
    assert report["command"].split()[1:3] == ["street", "--scans"] and report["seed"] == 0
    for text in ("query frame", "paper, its own street", "0.9948", "0.0260", "0.8938", "0.1913"):
        assert text in stdout


def test_the_same_seed_gives_the_same_bytes_and_another_seed_other_points(
        run, street, street_eval, tmp_path):
    for seed, same in ((0, True), (1, False)):
        out = tmp_path / str(seed)
        assert evaluate_street(run, street, out, "--seed", seed).returncode == 0
        for name, equal in (("points.csv", same), ("map.csv", True)):
            assert ((out / name).read_bytes() == (street_eval[0] / name).read_bytes()) == equal


def test_without_the_papers_parameters_its_map_is_left_out_and_said_so(run, street, tmp_path):
    params = tmp_path / "alone.toml"
    params.write_text((PARAMS / "street.toml").read_text(encoding="utf-8"), encoding="utf-8")
    done = run("gpom-eval", "street", "--scans", street, "--truth", street.with_name("truth.pgm"),
               "--params", params, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "left out" in done.stdout
    assert list(report_of(tmp_path / "out")["by_key"]) == [key for key in METHODS
                                                         if key != "gp_map"]


# ---- rivals, splits, neighbours -----------------------------------------------------------------

def json_of(run, tmp_path, *arguments):
    done = run("gpom-eval", *arguments, "--json", tmp_path / "eval.json")
    assert done.returncode == 0, done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["eval.json"]
    return report_of(tmp_path), done.stdout


def street_words(street, *more, params=PARAMS / "street.toml"):
    return ("street", "--scans", street, "--truth", street.with_name("truth.pgm"),
            "--params", params, *more)


def log_words(path, *more):
    return ("log", "--scans", path, "--params", PARAMS / "indoor.toml", *more)


def test_the_strong_grid_is_the_best_of_the_grids_and_says_its_cells(intel_eval):
    methods = report_of(intel_eval)["by_key"]
    for rival in ("grid", "wide_grid", "octomap"):
        assert methods["strong_grid"]["all"]["nll"] < methods[rival]["all"]["nll"] - 0.03
    assert methods["strong_grid"]["all"]["nll"] < 0.25  # measured: 0.224
    assert " m cells, blur " in methods["strong_grid"]["setting"]
    assert methods["octomap"]["setting"] in ("0.1 m cells", "0.2 m cells")


def test_the_log_odds_grids_are_the_best_of_what_is_tried(run, log, intel_eval, tmp_path):
    """With a cell of its own the best model alone is left to choose, and it is no better."""
    best = report_of(intel_eval)
    for cell in (0.05, 0.1, 0.2, 0.3, 0.5):
        report, _ = json_of(run, tmp_path, *log_words(
            log("intel.log.gz"), "--rivals", "off", "--grid-cell", cell))
        for key in ("grid", "wide_grid"):
            assert report[key]["cell_m"] == cell
            assert f"{cell:g} m cells, p_hit" in report["by_key"][key]["setting"]
            nll_here, nll_best = (r["by_key"][key]["all"]["nll"] for r in (report, best))
            assert (nll_here == nll_best) == (cell == best[key]["cell_m"])
            assert nll_here >= nll_best


def test_without_rivals_their_rows_are_missing(run, street, tmp_path):
    report, _ = json_of(run, tmp_path, *street_words(street, "--rivals", "off", "--points", 500))
    assert list(report["by_key"]) == METHODS[:4]


@pytest.mark.campaign
def test_the_exact_gp_beats_every_grid_on_a_street(run, street, tmp_path):
    pytest.importorskip("sklearn")
    report, _ = json_of(run, tmp_path, *street_words(street, "--exact-gp", "--points", 2000))
    assert list(report["by_key"]) == METHODS + ["exact_gp"]
    near = {key: method["near"] for key, method in report["by_key"].items()}
    for key in METHODS[2:]:
        assert near["exact_gp"]["auc"] > near[key]["auc"]
        assert near["exact_gp"]["nll"] < near[key]["nll"]


@pytest.mark.parametrize("code", [3, 1, None])
def test_an_exact_gp_that_cannot_run_is_left_out_or_refused(tool, street, tmp_path, code):
    """Exit code 3 is a missing scikit-learn, no script at all the same; all else is an error."""
    program = tmp_path / "gpom-eval"
    program.write_bytes(tool("gpom-eval").read_bytes())
    program.chmod(0o755)
    if code is not None:
        (tmp_path / "exact-gp").write_text(f"#!/bin/sh\nexit {code}\n", encoding="utf-8")
        (tmp_path / "exact-gp").chmod(0o755)
    words = street_words(street, "--exact-gp", "--points", 500, "--json", tmp_path / "eval.json")
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True,
                          timeout=60, check=False)
    if code == 1:
        refused(done, "gpom-eval", "exact-gp")
        assert not (tmp_path / "eval.json").exists()
    else:
        assert done.returncode == 0 and "left out: exact GP" in done.stdout
        assert list(report_of(tmp_path)["by_key"]) == METHODS


def test_more_parameters_make_more_rows(run, street, tmp_path):
    also = f"{PARAMS / 'indoor.toml'},{PARAMS / 'street.toml'}"
    report, _ = json_of(run, tmp_path, *street_words(
        street, "--rivals", "off", "--points", 500, "--also", also))
    methods = report["by_key"]
    assert list(methods) == METHODS[:2] + ["gp_indoor", "gp_street"] + METHODS[2:4]
    assert methods["gp_street"]["near"] == methods["gp_query"]["near"]
    assert methods["gp_indoor"]["near"] != methods["gp_query"]["near"]


def test_held_out_runs_leave_eighty_scans_out_of_the_map(run, log, intel_eval, tmp_path):
    report, _ = json_of(run, tmp_path, *log_words(log("intel.log.gz"), "--split", "runs"))
    beams = report_of(intel_eval)
    assert (report["split"], beams["split"]) == ("runs", "beams")
    assert 0.8 < report["beams"] / beams["beams"] < 0.93  # 520 of 600 scans
    # Grids know nothing between beams, so that whole runs without beams cost them.
    assert (report["by_key"]["strong_grid"]["all"]["nll"] >
            beams["by_key"]["strong_grid"]["all"]["nll"])


def test_runs_need_enough_scans(run, street):
    refused(run("gpom-eval", *log_words(street, "--split", "runs")), "gpom-eval", "--split runs")


@pytest.mark.campaign
def test_all_beams_are_nine_in_ten(run, log, tmp_path):
    report, _ = json_of(run, tmp_path, *log_words(log("seattle.log.gz"), "--fraction", 1.0,
                                                  "--rivals", "off"))
    quarter, _ = json_of(run, tmp_path, *log_words(log("seattle.log.gz"), "--fraction", 0.25,
                                                   "--rivals", "off"))
    assert report["beams"] / quarter["beams"] == pytest.approx(0.9 / 0.25, rel=0.02)
    assert report["by_key"]["gp_query"]["all"]["points"] == 6000


def test_more_neighbours_come_closer_to_all_beams(run, street, tmp_path):
    """Of a covariance that falls with distance; the plain model, in which nothing is capped."""
    params = street.with_name("plain.toml")
    params.write_text('kernel = "matern12"\nsf2 = 1.0\nell_m = 4.0\nsn2 = 0.1\nalpha = 5.0\n'
                      'beta = 0.5\nhits = 8\nfree = 8\ngap_m = 0.1\np_occupied = 0.7\n'
                      'p_free = 0.3\n', encoding="utf-8")
    report, stdout = json_of(run, tmp_path, *street_words(
        street, "--rivals", "off", "--points", 400, "--neighbours", "1,8,32",
        "--dense-points", 100, params=params))
    rows = report["neighbours"]
    assert [row["neighbours"] for row in rows] == [1, 8, 32, 0]
    assert all(row["points"] == 100 for row in rows)
    errors = [row["mean_error_max"] for row in rows]
    assert errors == sorted(errors, reverse=True) and errors[-1] == 0 < errors[-2] < errors[0]
    assert "32 + 32" in stdout and "all beams" in stdout


def test_many_neighbours_need_compact_support(run, street, tmp_path):
    json_path = tmp_path / "eval.json"
    words = street_words(street, "--rivals", "off", "--points", 100, "--neighbours", "64",
                         "--dense-points", 50, params=PARAMS / "street_plain.toml")
    refused(run("gpom-eval", *words, "--json", json_path), "gpom-eval", "--neighbours 64",
            "kernel askey")
    assert not json_path.exists()
    report, _ = json_of(run, tmp_path, *street_words(
        street, "--rivals", "off", "--points", 400, "--neighbours", "32,64,128",
        "--dense-points", 60, params=PARAMS / "street_askey.toml"))
    errors = [row["mean_error_max"] for row in report["neighbours"]]
    assert errors[3] == 0 < errors[2] < errors[0]


# ---- bad input ----------------------------------------------------------------------------------

def refused(done, tool, *names):
    assert done.returncode == 2, done.stdout + done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stderr.startswith(f"{tool}: ")
    for name in names:
        assert name in done.stderr


@pytest.mark.parametrize("option", ["--scans", "--truth", "--params", "--map-frame-params"])
def test_a_missing_file_is_refused_and_nothing_is_written(run, street, tmp_path, option):
    files = {"--scans": street, "--truth": street.with_name("truth.pgm"),
             "--params": PARAMS / "street.toml", "--map-frame-params": PARAMS / "street_paper.toml",
             option: tmp_path / "nowhere.file"}
    arguments = [word for pair in files.items() for word in pair]
    done = run("gpom-eval", "street", *arguments, "--out", tmp_path / "out")
    refused(done, "gpom-eval", "nowhere.file")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option, value", [
    ("--points", "0"), ("--points", "many"), ("--rivals", "maybe"), ("--neighbours", "8,33"),
    ("--neighbours", "0"), ("--dense-points", "1"), ("--grid-cell", "0"), ("--grid-cell", "nan"),
    ("--grid-cell", "-1"), ("--seed", "-1"), ("--pionts", "5")])
def test_an_absurd_street_option_is_refused_by_name(run, street, tmp_path, option, value):
    done = evaluate_street(run, street, tmp_path / "out", option, value)
    refused(done, "gpom-eval", option)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option, value", [
    ("--fraction", "0"), ("--fraction", "1.1"), ("--fraction", "nan"), ("--range-max", "0"),
    ("--split", "halves"), ("--exact-gp", "log"),
    ("--beam-width-deg", "180"), ("--beam-width-deg", "nan")])
def test_an_absurd_log_option_is_refused_by_name(run, street, tmp_path, option, value):
    done = run("gpom-eval", "log", "--scans", street, "--params", PARAMS / "indoor.toml",
               "--out", tmp_path / "out", option, value)
    refused(done, "gpom-eval", option)
    assert list(tmp_path.iterdir()) == []


def test_parameters_for_another_frame_are_refused_as_the_papers(run, street, tmp_path):
    done = evaluate_street(run, street, tmp_path / "out",
                           "--map-frame-params", PARAMS / "street.toml")
    refused(done, "gpom-eval", "street.toml", "frame")


def test_an_output_folder_that_is_a_file_is_refused(run, street, tmp_path):
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    refused(evaluate_street(run, street, tmp_path / "out"), "gpom-eval", "out")
    assert (tmp_path / "out").read_text(encoding="utf-8") == "mine"


# ---- gpom-plot and the demo ---------------------------------------------------------------------

def test_pictures_of_a_street_are_drawn(run, street_eval, tmp_path):
    done = run("gpom-plot", street_eval[0], "--out", tmp_path / "pictures")
    assert done.returncode == 0, done.stderr
    for name in ("map.png", "roc.png", "profile.png"):
        content = (tmp_path / "pictures" / name).read_bytes()
        assert content.startswith(PNG_START) and len(content) > 30_000
        assert str(tmp_path / "pictures" / name) in done.stdout.splitlines()


@pytest.mark.campaign
def test_pictures_of_a_log_are_drawn(run, intel_eval, tmp_path):
    done = run("gpom-plot", intel_eval, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"map.png", "roc.png", "profile.png",
                                                          "coarse.png", "window.png"}


@pytest.mark.parametrize("name", sorted(
    FILES - {"points.csv", "profile.csv", "grid.csv"} | {"truth.pgm"}))
@pytest.mark.parametrize("spoil", ["missing", "empty", "header"])
def test_a_spoilt_folder_is_refused_by_file(run, street_eval, tmp_path, name, spoil):
    folder = tmp_path / "in"
    folder.mkdir()
    for path in street_eval[0].iterdir():
        content = path.read_bytes()
        if path.name == name:
            content = content.split(b"\n")[0] + b"\n" if spoil == "header" else b""
        if path.name != name or spoil != "missing":
            (folder / path.name).write_bytes(content)
    done = run("gpom-plot", folder, "--out", tmp_path / "out")
    refused(done, "gpom-plot", name)
    assert not (tmp_path / "out").exists()


def test_a_missing_folder_and_a_misspelt_option_are_refused(run, tmp_path):
    refused(run("gpom-plot", tmp_path / "nowhere"), "gpom-plot", "nowhere")
    refused(run("gpom-plot", tmp_path, "--uot", "x"), "gpom-plot", "--uot")


def test_help_exits_0(run):
    for arguments in (("gpom-plot", "--help"), ("gpom-eval", "--help"),
                      ("gpom-eval", "street", "--help"), ("gpom-eval", "log", "--help")):
        done = run(*arguments)
        assert done.returncode == 0 and done.stderr == "" and "--help" in done.stdout


def demo(tool, *arguments):
    environment = dict(os.environ, GPOM_BUILD=str(tool("gpom-eval").parent))
    return subprocess.run([ROOT / "tools" / "demo", *map(str, arguments)], env=environment,
                          capture_output=True, text=True, timeout=120, check=False)


def test_the_demo_draws_a_street_and_names_its_pictures(tool):
    done = demo(tool)
    assert done.returncode == 0, done.stderr
    pictures = [pathlib.Path(line) for line in done.stdout.splitlines() if line.endswith(".png")]
    assert [path.name for path in pictures] == ["map.png", "roc.png", "profile.png"]
    assert all(path.is_absolute() and path.is_file() for path in pictures)


@pytest.mark.campaign
def test_the_demo_learns_on_the_first_metres_of_a_log_and_maps_the_rest(tool, log):
    done = demo(tool, log("campus-west.log.gz"))
    assert done.returncode == 0, done.stderr
    pictures = [pathlib.Path(line) for line in done.stdout.splitlines() if line.endswith(".png")]
    assert [path.name for path in pictures] == [
        "map.png", "roc.png", "profile.png", "coarse.png", "window.png"]
    folder = pictures[0].parent
    assert "--first-metres 100" in (folder / "learnt.toml").read_text(encoding="utf-8")
    report = report_of(folder)
    assert report["after_m"] == 100 and report["fraction"] == 0.04
    for name, cell_m in (("coarse", 5.0), ("window", 0.1)):
        x = np.unique(numbers(columns_of(folder / f"{name}.csv"), "x"))
        assert np.allclose(np.diff(x), cell_m, atol=2e-4)
    assert report["by_key"]["gp_query"]["all"]["nll"] < report["by_key"]["wide_grid"]["all"]["nll"]


def test_the_way_must_be_longer_than_what_is_left_out(run, log, tmp_path):
    done = run("gpom-eval", "log", "--scans", log("seattle.log.gz"), "--params",
               PARAMS / "indoor.toml", "--after-metres", 1e6)
    refused(done, "gpom-eval", "--after-metres")


def test_the_demo_refuses_a_missing_log(tool):
    refused(demo(tool, "nowhere.log.gz"), "demo", "nowhere.log.gz")

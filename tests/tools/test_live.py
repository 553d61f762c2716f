"""Maps kept the vehicle's way: the same drive gives the same map, spurious returns and vehicles
that come or go do little harm, and a long drive costs no more at its end than at its start.
"""
import csv
import json
import pathlib
import subprocess

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARAMS = ROOT / "tools" / "params"
SPURIOUS = 0.05
COST_MAX = 0.10  # of NLL, for that share


def figures(run, *arguments):
    done = run("gpom-live", *arguments)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def drive(run, tmp_path_factory):
    """Scans and ground truth of a drive past the same street twice."""
    folder = tmp_path_factory.mktemp("drive")
    scans, truth = folder / "scans.csv", folder / "truth.pgm"
    done = run("gpom-sim", "--seed", 2, "--scans", 240, "--beams", 120, "--step", 0.8,
               "--there-and-back", "--out", scans, "--truth", truth)
    assert done.returncode == 0, done.stderr
    return scans, truth


# ---- gpom-query --live --------------------------------------------------------------------------

RASTER = "10,10,0.5,120,100"


def live_map(program, scans, folder, name, *more):
    """Bytes of the kept beams' file, and probabilities of a raster."""
    kept, out = folder / f"{name}-kept.csv", folder / f"{name}-out.csv"
    words = [program, "--scans", scans, "--params", PARAMS / "street.toml", "--raster", RASTER,
             "--out", out, "--kept", kept, "--live", "--beam-max", 3000, *more]
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, check=False,
                          timeout=120)
    assert done.returncode == 0, done.stderr
    with open(out, encoding="utf-8") as file:
        answers = np.array([float(row["probability"]) for row in csv.DictReader(file)])
    return kept.read_bytes(), answers, done.stdout


def test_the_same_drive_gives_the_same_map_bit_for_bit(tool, drive, tmp_path):
    first = live_map(tool("gpom-query"), drive[0], tmp_path, "first")
    second = live_map(tool("gpom-query"), drive[0], tmp_path, "second")
    assert first[0].count(b"\n") == 3001 and first[0] == second[0]
    assert np.array_equal(first[1], second[1]) and first[2] == second[2]


def test_live_options_need_live(run, drive, tmp_path):
    done = run("gpom-query", "--scans", drive[0], "--params", PARAMS / "street.toml", "--raster",
               RASTER, "--out", tmp_path / "out.csv", "--keep", 0.1)
    assert done.returncode == 2 and "--live" in done.stderr


# ---- accuracy -----------------------------------------------------------------------------------

def judged(run, scans, preset, *more):
    return figures(run, "judge", "--scans", scans, "--params", PARAMS / f"{preset}.toml", *more)


def evaluated(run, folder, mode, scans, seed, *more):
    done = run("gpom-eval", mode, "--scans", scans, "--params", PARAMS / "street.toml", "--seed",
               seed, "--rivals", "off", "--json", folder / "eval.json", *more)
    assert done.returncode == 0, done.stderr
    return json.loads((folder / "eval.json").read_text(encoding="utf-8"))


def judged_seeds(run, scans, preset, *more):
    return [judged(run, scans, preset, "--seed", seed, *more) for seed in range(3)]


def mean_of(reports, *path):
    """Over reports, of the figure that a path of keys leads to."""
    values = []
    for report in reports:
        for key in path:
            report = report[key]
        values.append(report)
    return np.mean(values)


PRESETS = {"intel": "indoor", "csail": "indoor", "seattle": "indoor", "campus-west": "campus",
           "acapulco": "campus"}


def campaign(*values):
    return [pytest.param(value, marks=pytest.mark.campaign) for value in values]


@pytest.mark.parametrize("name", ["intel", *campaign(*sorted({*PRESETS} - {"intel"}))])
def test_kept_beams_know_more_than_as_many_drawn_at_random(run, log, name):
    reports = judged_seeds(run, log(f"{name}.log.gz"), PRESETS[name])
    for report in reports:
        assert report["live"]["kept"] == report["random"]["kept"] <= report["beam_max"]
        assert report["step_ops"]["max"] <= report["step_ops"]["budget"]
    for where in [], ["unchanged"]:
        live, drawn = ([mean_of(reports, *where, who, figure) for figure in ("auc", "nll")]
                       for who in ("live", "random"))
        assert live[0] > drawn[0] and live[1] < drawn[1], where


@pytest.mark.parametrize("seed", [0, 3])
def test_a_map_of_every_beam_is_judged_as_gpom_eval_judges_it(run, street, tmp_path, seed):
    """With next to no spacing all returns are kept: "random" is then the map of the whole split,
    and points, band and profile are those of the same held-out beams."""
    report = judged(run, street, "street", "--seed", seed, "--keep", 0.001, "--clear-scans", 0)
    expected = evaluated(run, tmp_path, "log", street, seed, "--range-max", 49, "--fraction", 0.9)
    method = expected["methods"][0]
    assert report["random"]["kept"] == expected["beams"] == report["live"]["kept"]
    assert report["random"]["nll"] == method["all"]["nll"]
    assert report["random"]["band"] == method["band"]
    assert report["random"]["profile"] == method["profile"]
    held_out = report["random"]["profile"]["rows"][6]["places"]
    assert held_out == pytest.approx(expected["beams"] / 9, rel=0.2)


def test_a_street_is_judged_across_the_surface_that_gpom_eval_finds(run, street, tmp_path):
    truth = street.with_name("truth.pgm")
    rows = judged(run, street, "street", "--truth", truth)["live"]["profile"]["rows"]
    expected = evaluated(run, tmp_path, "street", street, 0, "--truth", truth)
    for row, other in zip(rows, expected["methods"][0]["profile"]["rows"], strict=True):
        assert (row["offset_m"], row["places"]) == (other["offset_m"], other["places"])


def test_the_live_map_has_a_band_and_a_profile_of_its_own(run, log):
    report = judged(run, log("seattle.log.gz"), "indoor")
    rows = {who: report[who]["profile"]["rows"] for who in ("live", "random")}
    assert [row["offset_m"] for row in rows["live"]] == [-1.0, -0.5, -0.3, -0.2, -0.1, -0.05, 0.0,
                                                         0.05, 0.1, 0.2]
    assert [row["places"] for row in rows["live"]] == [row["places"] for row in rows["random"]]
    assert rows["live"] != rows["random"]
    for who in rows:
        assert report[who]["band"]["nll"] > report[who]["nll"]  # the hardest places
        assert report["unchanged"][who]["band"]["points"] < report[who]["band"]["points"]
        assert "profile" not in report["unchanged"][who]


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["csail", "campus-west"])
def test_spurious_returns_cost_little_of_a_real_drive(run, log, name):
    """One in twenty; most wait for a second scan as their own looks past them."""
    scans = log(f"{name}.log.gz")
    clean, spurious = (mean_of(judged_seeds(run, scans, PRESETS[name], *more), "live", "nll")
                       for more in ((), ("--spurious", SPURIOUS)))
    assert spurious < 1.2 * clean


@pytest.mark.parametrize("name", ["intel", "csail", "seattle"])
def test_answers_of_a_real_drive_do_not_jump(run, log, name):
    """With a preset whose neighbours fade; without the fading they do, some once a metre."""
    def jumps(*more):
        report = figures(run, "seams", "--scans", log(f"{name}.log.gz"), *more)
        assert report["lines"] == report["length_m"] == 500
        per_m = {row["over"]: row["per_m"] for row in report["jumps"]["per_m"]}
        return per_m[0.05], report["jumps"]["largest"]
    per_m, largest = jumps("--params", PARAMS / "indoor.toml")
    assert per_m <= 0.02 and largest <= 0.12


def test_answers_jump_where_neighbours_do_not_fade(run, log, tmp_path):
    text = (PARAMS / "indoor.toml").read_text(encoding="utf-8")
    assert text.count("\nfading = ") == 1
    (tmp_path / "jumps.toml").write_text(text.replace("\nfading = ", "\n# "), encoding="utf-8")
    report = figures(run, "seams", "--scans", log("seattle.log.gz"), "--params",
                     tmp_path / "jumps.toml")
    assert report["jumps"]["per_m"][1]["per_m"] > 0.2
    for row, other in zip(report["jumps"]["per_m"], report["differences"]["per_m"]):
        assert row["over"] == other["over"]


def test_answers_of_a_street_do_not_jump(run, street):
    report = figures(run, "seams", "--scans", street, "--truth", street.with_name("truth.pgm"),
                     "--params", PARAMS / "street.toml")
    assert report["lines"] == 500 and report["jumps"]["largest"] <= 0.05


def test_classes_are_judged_by_the_thresholds_of_the_parameters(run, log, tmp_path):
    """A lower threshold for free leaves more unsure and errs less often; what is called occupied
    does not feel it."""
    text = (PARAMS / "indoor.toml").read_text(encoding="utf-8")
    assert text.count("\np_free = 0.3") == 1
    strict_path = tmp_path / "strict.toml"
    strict_path.write_text(text.replace("\np_free = 0.3", "\np_free = 0.1"), encoding="utf-8")
    usual, strict = (
        figures(run, "judge", "--scans", log("csail.log.gz"), "--params", params)["live"]["classes"]
        for params in (PARAMS / "indoor.toml", strict_path))
    assert strict["unsure"] > usual["unsure"] > 0
    assert 0 < strict["occupied_of_free"] < usual["occupied_of_free"] < 0.1
    assert strict["free_of_occupied"] == usual["free_of_occupied"] > 0


def test_what_one_scan_alone_saw_is_less_sure(run, log, tmp_path):
    """A preset's sn2_once takes something off the NLL of a map with spurious returns."""
    text = (PARAMS / "indoor.toml").read_text(encoding="utf-8")
    assert text.count("\nsn2_once = ") == 1
    without = tmp_path / "without.toml"
    without.write_text(text.replace("\nsn2_once = ", "\n# "), encoding="utf-8")
    nll = [figures(run, "judge", "--scans", log("csail.log.gz"), "--params", params,
                   "--spurious", SPURIOUS)["live"]["nll"]
           for params in (PARAMS / "indoor.toml", without)]
    assert nll[0] < nll[1]


def test_places_that_changed_are_told_from_those_that_did_not(run, tmp_path):
    def left_out(leave_at):
        scans = tmp_path / f"{leave_at}.csv"
        done = run("gpom-sim", "--seed", 2, "--scans", 120, "--beams", 360, "--step", 0.8,
                   "--there-and-back", "--cars-leave-at", leave_at, "--out", scans,
                   "--truth", tmp_path / "truth.pgm")
        assert done.returncode == 0, done.stderr
        report = judged(run, scans, "street")
        return report, 1.0 - report["unchanged"]["points"] / report["points"]
    assert left_out(-1)[1] < 0.005
    report, share = left_out(60)
    assert share > 0.03 and report["unchanged"]["live"]["nll"] < 0.5 * report["live"]["nll"]


def test_every_beam_of_a_log_is_accounted_for(run, log):
    counts = judged(run, log("intel.log.gz"), "indoor")["counts"]
    kept = counts["beams_hit"] + counts["beams_no_return"]
    offered = kept + sum(counts[name] for name in (
        "beams_nan", "beams_not_positive", "beams_too_near", "beams_masked", "beams_known",
        "beams_contradicting", "beams_redundant", "beams_ids_spent"))
    assert counts["scans_inserted"] == 910 and offered == 910 * 180


def test_spurious_returns_cost_little(run, drive):
    clean, dirty = (judged(run, drive[0], "street", "--truth", drive[1], "--spurious", share)
                    for share in (0, SPURIOUS))
    assert dirty["counts"]["beams_not_confirmed"] > clean["counts"]["beams_not_confirmed"]
    assert dirty["live"]["nll"] <= (1.0 + COST_MAX) * clean["live"]["nll"]


# ---- vehicles that come and go ------------------------------------------------------------------

def changed_cells(run, leave_at, arrive_at, *more, seed=1):
    report = figures(run, "cars", "--params", PARAMS / "street.toml", "--seed", seed,
                     "--scans", 80, "--cars-leave-at", leave_at, "--cars-arrive-at", arrive_at,
                     "--keep", 0.1, *more)
    return report["cells"]


# Seen through: by a scan whose beams are 0.1 m apart or less.
@pytest.mark.parametrize("seed", [1, *campaign(*range(2, 7))])
def test_cells_of_vehicles_that_left_clear_within_five_scans_that_look_through_them(run, seed):
    cells = changed_cells(run, 40, 0, seed=seed)
    assert cells["cells"] >= 50 and cells["late"] == 0


def test_cells_of_vehicles_that_arrived_are_not_free_after_five_scans_that_return_from_them(run):
    """One in five may take longer: edges that beams graze."""
    cells = changed_cells(run, -1, 40)
    assert cells["cells"] >= 20 and cells["late"] <= 0.2 * cells["cells"]


# ---- long drives --------------------------------------------------------------------------------

def test_memory_work_and_query_cost_of_a_drive_do_not_grow(run):
    report = figures(run, "drive", "--params", PARAMS / "street.toml", "--scans", 1500,
                     "--beam-max", 4000, "--step-ops", 200_000, "--cells", 64)
    tenths = report["tenths"]
    assert len(tenths) == 10 and sum(t["scans"] for t in tenths) == 1500
    assert all(t["step_ops_max"] <= report["step_ops_budget"] for t in tenths)
    assert all(t["kept"] == 4000 for t in tenths[3:])
    grown = tenths[-1]["resident_bytes"] - tenths[2]["resident_bytes"]
    assert grown < 1_000_000  # of scans of 720 bytes each, and of the process itself
    early, late = (np.mean([t["items_per_query"] for t in part])
                   for part in (tenths[3:6], tenths[7:]))
    assert late < 1.5 * early


def test_insertion_is_measured_on_a_full_map(run):
    report = figures(run, "insert", "--params", PARAMS / "street.toml", "--scans", 2000,
                     "--beam-max", 2000, "--kept", 2000, "--measured", 50, "--runs", 2)
    assert report["kept"] == 2000 and report["scans"] == 50
    for part in ("insert", "step"):
        assert 0 < report[part]["us_mean"] <= report[part]["us_max"]


def test_a_drive_too_short_to_fill_the_map_is_refused(run):
    done = run("gpom-live", "insert", "--params", PARAMS / "street.toml", "--scans", 10)
    assert done.returncode == 2 and "--scans" in done.stderr

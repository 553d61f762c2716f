"""gpom-learn end to end: what it learns is good elsewhere too, files whole, bad input."""
import csv
import json
import pathlib
import re
import subprocess
import tomllib
import zlib

import oracle
import pytest

INCLUDE = pathlib.Path(__file__).resolve().parents[2] / "include"
KERNELS = ("nn", "matern12", "matern32", "se", "askey")
QUICK = ("--points", 300, "--model", "paper")
HEADER_PROGRAM = """
#include <stdio.h>
#include "learnt.h"
int main(void)
{
    const gpom_params_t p = gpom_params_learnt;
    const char *problem;
    if (gpom_params_check(&p, &problem) != GPOM_OK) { puts(problem); return 1; }
    printf("%d %.6g %.6g %.6g %.6g %d\\n", (int)p.kernel, p.sf2, p.ell_m, p.sn2_free, p.beta,
           p.n_hits);
    return 0;
}
"""


def table_of(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


def held_out(stdout, kernel):
    """AUC, FP@95, NLL, ECE, p0 of a kernel's line in the last table but the parameters."""
    line = re.findall(rf"^{kernel} +\d+\.\d+ +([\d. ]+)", stdout, re.MULTILINE)[-1]
    return [float(word) for word in line.split()]


@pytest.fixture(scope="session")
def town(run, tmp_path_factory):
    """town(seed): scans and truth of a street."""
    folder = tmp_path_factory.mktemp("town")

    def make(seed):
        scans, truth = folder / f"{seed}.csv", folder / f"{seed}.pgm"
        done = run("gpom-sim", "--seed", seed, "--out", scans, "--truth", truth)
        assert done.returncode == 0, done.stderr
        return scans, truth
    return make


@pytest.fixture(scope="session")
def csail(run, log, tmp_path_factory):
    """Folder, arguments and stdout of learning on csail with the library's present model."""
    folder = tmp_path_factory.mktemp("csail")
    arguments = ("--scans", log("csail.log.gz"), "--kernel", "matern12", "--model", "noise",
                 "--fraction", 0.04)
    done = run("gpom-learn", *arguments, "--out", folder / "p.toml", "--header",
               folder / "learnt.h", "--record", folder / "learnt.bin")
    assert done.returncode == 0, done.stderr
    return folder, arguments, done.stdout


# ---- what is learnt -----------------------------------------------------------------------------

@pytest.mark.campaign
def test_learnt_figures_are_those_of_the_map_on_other_beams(run, log, csail):
    folder, _, stdout = csail
    done = run("gpom-eval", "log", "--scans", log("csail.log.gz"), "--params", folder / "p.toml",
               "--out", folder / "eval")
    assert done.returncode == 0, done.stderr
    report = json.loads((folder / "eval" / "eval.json").read_text(encoding="utf-8"))
    gp = report["methods"][0]["all"]
    auc, _, nll, ece, p0 = held_out(stdout, "matern12")
    # Other scans and other points: a fifth of a log's scans spreads by a few hundredths.
    assert abs(gp["auc"] - auc) < 0.01 and abs(gp["nll"] - nll) < 0.05
    assert gp["auc"] > 0.96 and gp["nll"] < 0.23 and gp["ece"] < 0.025 and ece < 0.03
    assert 0.35 <= p0 <= 0.65


def test_learning_against_truth_is_good_on_a_street_it_never_saw(run, town, tmp_path):
    arguments = []
    for seed in (21, 22, 23):
        scans, truth = town(seed)
        arguments += ["--scans", scans, "--truth", truth]
    done = run("gpom-learn", *arguments, "--out", tmp_path / "p.toml", "--kernel", "matern12",
               "--points", 600, "--model", "paper")
    assert done.returncode == 0, done.stderr
    scans, truth = town(24)
    done = run("gpom-eval", "street", "--scans", scans, "--truth", truth, "--params",
               tmp_path / "p.toml", "--out", tmp_path / "eval")
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "eval" / "eval.json").read_text(encoding="utf-8"))
    gp, grid = report["methods"][0]["near"], report["methods"][-1]["near"]
    assert gp["nll"] < 0.8 * grid["nll"] and gp["auc"] > grid["auc"] and gp["ece"] < 0.08


@pytest.mark.parametrize("kernel, more, auc_min", [("matern12", ["--points", 300], 0.93),
                                                   ("nn", ["--composite"], 0.95)])
def test_marginal_likelihood_gives_a_map_that_ranks(run, log, tmp_path, kernel, more, auc_min):
    done = run("gpom-learn", "--scans", log("csail.log.gz"), "--out", tmp_path / "p.toml",
               "--kernel", kernel, "--method", "lml", "--fraction", 0.04, *more)
    assert done.returncode == 0, done.stderr
    assert held_out(done.stdout, kernel)[0] > auc_min
    table = table_of(tmp_path / "p.toml")
    assert table["alpha"] <= 60.0 and table["sn2"] == table["sn2_free"] and "vote" not in table


@pytest.mark.campaign
def test_all_kernels_are_reported_and_the_best_on_held_out_points_is_written(run, log, tmp_path):
    done = run("gpom-learn", "--scans", log("csail.log.gz"), "--out", tmp_path / "p.toml", *QUICK)
    assert done.returncode == 0, done.stderr
    nlls = {kernel: held_out(done.stdout, kernel)[2] for kernel in KERNELS}
    assert table_of(tmp_path / "p.toml")["kernel"] == min(nlls, key=nlls.get)
    assert done.stdout.count("<- written") == 1


def test_the_paper_s_model_has_one_noise_and_no_additions(run, log, tmp_path):
    done = run("gpom-learn", "--scans", log("csail.log.gz"), "--out", tmp_path / "p.toml",
               "--kernel", "se", *QUICK)
    assert done.returncode == 0, done.stderr
    params = oracle.load_params(tmp_path / "p.toml")
    assert params.sn2_free == params.sn2 >= 0.99e-2 * params.sf2


def live_nll(run, log, params, *more):
    done = run("gpom-live", "judge", "--scans", log("csail.log.gz"), "--params", params,
               "--seed", 7, *more)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["live"]["nll"]


@pytest.mark.campaign
def test_learning_is_for_a_live_map_of_all_beams_unless_a_share_is_asked_for(run, log, tmp_path):
    """On a live map its own parameters beat those of a thinned map that keeps all it gets."""
    arguments = ("--scans", log("csail.log.gz"), "--kernel", "matern12", "--model",
                 "noise,anisotropy,vote,line", "--training-of", 7)
    for name, more in (("live", ()), ("thin", ("--fraction", 0.04))):
        done = run("gpom-learn", *arguments, *more, "--out", tmp_path / f"{name}.toml")
        assert done.returncode == 0, done.stderr
    live, thin = tmp_path / "live.toml", tmp_path / "thin.toml"
    assert "For live maps of all beams, keep_m = 0.05" in live.read_text(encoding="utf-8")
    assert "keep all of their beams, 4 % of" in thin.read_text(encoding="utf-8")
    assert table_of(live)["sn2_once"] > table_of(live)["sn2"]
    assert "sn2_once" not in table_of(thin)
    assert live_nll(run, log, live) < 0.95 * live_nll(run, log, thin)


def test_a_value_at_the_edge_of_its_search_is_a_warning_with_what_to_do(run, log, tmp_path):
    done = run("gpom-learn", "--scans", log("csail.log.gz"), "--kernel", "matern12",
               "--ell-max", 0.3, *QUICK, "--out", tmp_path / "p.toml")
    assert done.returncode == 0, done.stderr
    assert "warning: ell_m ended at its longest" in done.stderr and "--ell-max" in done.stderr
    assert "Warning: ell_m" in (tmp_path / "p.toml").read_text(encoding="utf-8")


@pytest.mark.campaign
def test_the_more_free_places_count_the_more_of_the_map_is_free(run, log, tmp_path):
    for weight in (1, 2):
        done = run("gpom-learn", "--scans", log("seattle.log.gz"), "--kernel", "matern12",
                   "--model", "noise,line", "--points", 2000, "--free-weight", weight,
                   "--out", tmp_path / f"{weight}.toml")
        assert done.returncode == 0, done.stderr
        done = run("gpom-query", "--scans", log("seattle.log.gz"), "--live", "--params",
                   tmp_path / f"{weight}.toml", "--raster", "-20,-20,0.1,400,400",
                   "--out", tmp_path / f"{weight}.csv")
        assert done.returncode == 0, done.stderr
    free = []
    for weight in (1, 2):
        with open(tmp_path / f"{weight}.csv", encoding="utf-8") as file:
            lines = [line for line in file if not line.startswith("#")]
        free.append(sum(float(row["probability"]) <= 0.5 for row in csv.DictReader(lines)))
    assert free[0] < free[1]


# ---- files --------------------------------------------------------------------------------------

@pytest.mark.campaign
def test_learning_twice_writes_the_same_bytes(run, csail):
    folder, arguments, _ = csail
    first = (folder / "p.toml").read_bytes()
    done = run("gpom-learn", *arguments, "--out", folder / "p.toml", "--header",
               folder / "learnt.h", "--record", folder / "learnt.bin")
    assert done.returncode == 0, done.stderr
    assert (folder / "p.toml").read_bytes() == first


def test_the_record_is_whole(csail):
    record = (csail[0] / "learnt.bin").read_bytes()
    assert len(record) == 108 and record[:6] == b"GPMP\x04\x00"
    assert int.from_bytes(record[-4:], "little") == zlib.crc32(record[:-4])


def test_the_file_says_how_it_was_learnt_without_folders(csail):
    folder, _, _ = csail
    head = (folder / "p.toml").read_text(encoding="utf-8").splitlines()[:6]
    assert "--scans csail.log.gz" in head[0] and str(folder) not in "".join(head)
    assert "NLL" in "".join(head) and "Prior probability" in "".join(head)


def test_what_is_fixed_stays_and_is_not_searched_for(run, log, tmp_path):
    done = run("gpom-learn", "--scans", log("csail.log.gz"), "--out", tmp_path / "p.toml",
               "--kernel", "matern12", *QUICK, "--fix", "gap_m=0.25,fade_m=12")
    assert done.returncode == 0, done.stderr
    table = table_of(tmp_path / "p.toml")
    assert table["gap_m"] == 0.25 and table["fade_m"] == 12.0
    assert "gap_m = 0" not in done.stdout.split("# Learnt by")[0]


@pytest.mark.parametrize("compiler", [["cc", "-std=c99"], ["c++", "-std=c++17"]])
def test_the_header_gives_firmware_the_same_numbers(tool, csail, compiler):
    folder, _, _ = csail
    root = tool("gpom-learn").parent
    source = folder / ("main.c" if compiler[0] == "cc" else "main.cpp")
    source.write_text(HEADER_PROGRAM, encoding="utf-8")
    subprocess.run([*compiler, "-Wall", "-Wextra", "-Werror", "-pedantic-errors", "-I", folder,
                    "-I", INCLUDE, source, root / "libgpom.a",
                    "-lldl", "-lamd", "-lm", "-o", folder / "main"],
                   check=True)
    printed = subprocess.run([folder / "main"], capture_output=True, text=True, check=True).stdout
    table = table_of(folder / "p.toml")
    kernel, sf2, ell_m, sn2_free, beta, hits = map(float, printed.split())
    assert kernel == 1 and hits == table["hits"]
    for got, key in ((sf2, "sf2"), (ell_m, "ell_m"), (sn2_free, "sn2_free"), (beta, "beta")):
        assert got == pytest.approx(table[key], rel=1e-5)


# ---- bad input ----------------------------------------------------------------------------------

@pytest.mark.parametrize("more, complaint", [
    (["--kernel", "cubic"], "not one of nn, matern12"),
    (["--model", "speed"], "not one of paper"),
    (["--method", "guess"], "--method"),
    (["--truth", "a.pgm", "--truth", "b.pgm"], "2 files for 1"),
    (["--hits", 40, "--free", 40], "at most 64"),
    (["--fraction", 0], "only 0 hits"),
    (["--fraction", 2], "--fraction"),
    (["--method", "lml", "--fraction", 0.04, "--points", 5000], "at most 1000"),
    (["--method", "lml", "--fraction", 0.04, "--model", "full"], "can only be paper"),
    (["--method", "lml", "--fraction", 0.04, "--fix", "fade_m=20"], "--fix"),
    (["--fix", "fade_m"], "not name=value"),
    (["--fix", "fade_m=far"], "not name=value"),
    (["--fix", "vote=1"], "only fade_m"),
    (["--fix", "scan_points_max=1.5"], "only fade_m"),
    (["--fix", "fade_m=0.01"], "fade_m: must be"),
    (["--fix", "gap_m=0.1,depth_m=9"], "depth_m: must be"),
    (["--points", "many"], "--points"),
    (["--method", "lml"], "give --fraction"),
    (["--keep", 0.1, "--fraction", 0.04], "--keep: only for live maps"),
])
def test_bad_arguments_are_one_line_and_nothing_is_written(run, street, tmp_path, more, complaint):
    out = tmp_path / "p.toml"
    done = run("gpom-learn", "--scans", street, "--out", out, *more)
    assert done.returncode == 2
    assert complaint in done.stderr and done.stderr.count("\n") == 1
    assert done.stderr.startswith("gpom-learn: ") and not out.exists()


@pytest.mark.parametrize("text, complaint", [
    ("", "no scans"),
    ("0,0,0,0,-1,0.1,30,1,2,3\n", "give more scans"),
    ("0,0,0,0,-1,oops,30,1,2,3\n", ":1:"),
])
def test_bad_scans_are_one_line(run, tmp_path, text, complaint):
    scans, out = tmp_path / "scans.csv", tmp_path / "p.toml"
    scans.write_text(text, encoding="utf-8")
    done = run("gpom-learn", "--scans", scans, "--out", out)
    assert done.returncode == 2
    assert complaint in done.stderr and done.stderr.count("\n") == 1 and not out.exists()


def test_a_folder_that_is_not_there_is_one_line(run, street, tmp_path):
    done = run("gpom-learn", "--scans", street, "--fraction", 1, "--kernel", "matern12", *QUICK,
               "--out", tmp_path / "no" / "p.toml")
    assert done.returncode == 2 and done.stderr.count("\n") == 1

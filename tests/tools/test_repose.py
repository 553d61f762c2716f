"""gpom-live repose: a map that follows corrected poses is nearly that of the right poses."""
import json
import math
import pathlib

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
INDOOR = ROOT / "tools" / "params" / "indoor.toml"
STREET = ROOT / "tools" / "params" / "street.toml"


def reposed(run, params, scans, drifted, *more):
    done = run("gpom-live", "repose", "--params", params, "--scans", scans, "--drifted", drifted,
               *more)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def drift(source, target, turn_rad_per_scan):
    """The scans of a CSV file, by a robot whose odometry turns a little too far at each scan."""
    x = y = before_x = before_y = 0.0
    lines, n = [], 0
    for line in source.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        t, true_x, true_y, theta, *rest = line.split(",")
        turn = turn_rad_per_scan * n
        step_x, step_y = (float(true_x) - before_x, float(true_y) - before_y) if n else (0.0, 0.0)
        x += math.cos(turn) * step_x - math.sin(turn) * step_y
        y += math.sin(turn) * step_x + math.cos(turn) * step_y
        before_x, before_y = float(true_x), float(true_y)
        lines.append(",".join([t, repr(x), repr(y), repr(float(theta) + turn), *rest]))
        n += 1
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return target


@pytest.fixture(name="street", scope="module")
def fixture_street(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("repose")
    scans = folder / "scans.csv"
    done = run("gpom-sim", "--seed", 3, "--scans", 60, "--beams", 90, "--step", 1.0,
               "--there-and-back", "--out", scans, "--truth", folder / "truth.pgm")
    assert done.returncode == 0, done.stderr
    return scans, drift(scans, folder / "drifted.csv", 0.02)


def test_a_drifted_street_is_as_accurate_as_the_right_one_once_its_poses_are_corrected(run, street):
    report = reposed(run, STREET, *street)
    assert report["scans"] == 60 and report["drift_m"] > 5.0
    assert report["drifted"]["nll"] > report["right"]["nll"] + 0.1
    assert report["reposed"]["nll"] < report["right"]["nll"] + 0.015
    counts = report["repose"]
    assert counts["moved"] == report["drifted"]["kept"] == report["reposed"]["kept"]
    assert counts["restored"] > 0 and counts["before"] == counts["after"] == 0
    assert counts["forgotten"] == 0


def test_no_drift_moves_nothing_that_matters(run, street):
    report = reposed(run, STREET, *street, "--share", 0)
    assert report["drift_m"] == 0 and report["drifted"] == report["right"]


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["intel", "csail"])
def test_real_odometry_corrected_later_gives_the_map_of_the_right_poses(run, log, name):
    """With room for what the drifted frame keeps twice."""
    report = reposed(run, INDOOR, log(f"{name}.log.gz"), log(f"{name}-raw.log.gz"),
                     "--beam-max", 65536)
    assert report["drift_m"] > 20.0
    assert report["reposed"]["nll"] < report["right"]["nll"] + 0.005
    assert report["reposed"]["fp_at_tp95"] < report["right"]["fp_at_tp95"] + 0.003
    on = {rule: report[f"half drifted, then {rule}"]["nll"] for rule in ("repose", "keep", "clear")}
    assert on["repose"] < report["right"]["nll"] + 0.01
    assert on["repose"] < min(on["keep"], on["clear"]) - 0.05


def test_a_log_of_another_drive_is_refused(run, street, tmp_path):
    other = tmp_path / "other.csv"
    lines = [line for line in street[0].read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    other.write_text("".join(line + ",3.5\n" for line in lines), encoding="utf-8")
    done = run("gpom-live", "repose", "--params", STREET, "--scans", street[0], "--drifted", other)
    assert done.returncode != 0
    assert done.stderr.splitlines()[-1] == \
        f"gpom-live: {other}: has no scans with the ranges of {street[0]}; give the log of the " \
        "same drive before its poses were corrected"


def test_two_robots_that_share_a_street_make_one_map(run, street):
    done = run("gpom-live", "merge", "--params", STREET, "--scans", street[0])
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    counts = report["import"]
    assert counts["known"] > 0 and counts["kept"] > 0
    assert counts["damaged"] == counts["out_of_reach"] == counts["not_useful"] == 0
    one, half, both = (report[name]["nll"] for name in ("one robot", "first half", "both halves"))
    assert both < half - 0.01 and both < 1.15 * one

"""gpom-odometry: odometry without errors is as good as poses; the table says what the tool said."""
import json
import pathlib
import sys

import pytest

TOOLS = pathlib.Path(__file__).resolve().parents[2] / "tools"
sys.path.insert(0, str(TOOLS / "report"))
import odometry_section  # noqa: E402  it is found by the line above

PARAMS = ("--params", TOOLS / "params" / "street.toml")
SMALL = (*PARAMS, "--beams", 31, "--points", 2000, "--seed", 3)
SHORT = (*SMALL, "--scans", 60)


def rows_of(run, *words):
    done = run("gpom-odometry", *words)
    assert done.returncode == 0, done.stderr
    return {row["key"]: row for row in json.loads(done.stdout)["rows"]}


def test_odometry_without_errors_brings_every_scan_to_its_place(run):
    rows = rows_of(run, *SHORT, "--speed-scale-sd", 0, "--yaw-rate-bias-sd", 0, "--speed-noise", 0,
                   "--yaw-rate-noise", 0)
    # what poses lack themselves, 0.02 m and 0.004 rad over 10 m, stays
    assert rows["plain_unweighed"]["place_error_m"] < 0.06
    assert rows["every"]["scans"] == rows["weighed"]["scans"] == 60
    assert rows["dropped"]["scans"] < 10
    assert rows["plain_unweighed"]["place_error_m"] < rows["interpolated"]["place_error_m"]


def test_errors_that_are_learnt_are_smaller(run):
    rows = rows_of(run, *SMALL, "--scans", 200, "--speed-scale-sd", 0.1)
    assert rows["weighed"]["place_error_m"] < rows["plain_weighed"]["place_error_m"]
    assert rows["weighed"]["place_error_m"] == rows["unweighed"]["place_error_m"]


def test_the_same_seed_gives_the_same_figures(run):
    assert rows_of(run, *SHORT) == rows_of(run, *SHORT)


@pytest.mark.parametrize("words, said", [
    (("--speed-swing", 9), "--speed-swing must be less than --speed"),
    (("--scans", 1000, "--step", 8), "too long")])
def test_absurd_drives_are_refused(run, words, said):
    done = run("gpom-odometry", *PARAMS, *words)
    assert done.returncode != 0 and said in done.stderr


def test_the_table_has_the_tool_s_figures():
    def report(shift):
        return {"rows": [{"key": key, "label": key, "nll": nll + shift, "auc": 0.9, "ece": 0.1,
                          "place_error_m": 0.05, "scans": 400}
                         for key, nll in (("every", 0.2), ("every_unweighed", 0.2 + 3 * shift),
                                          ("weighed", 0.21), ("unweighed", 0.2))]}
    header, rows = odometry_section.table([report(0.0), report(0.02)])
    assert header[1] == "NLL"
    assert rows[2][1:3] == ["0.2200 (0.0200)", "+4.8 %"]
    assert [row[-1] for row in rows] == ["1 of 2", "", "0 of 2", ""]

"""gpom-live door: doors are never wider than they are, walls stay shut, and a door loses no more of
its width than is known today. Widths are computed anew from the rows of cells in the report.
"""
import json
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARAMS = ROOT / "tools" / "params" / "indoor.toml"
RUNS = 5
NOISE = 0.01
STAGES = ("past", "through")
DOORS = (0.7, 0.8, 0.9)
FREE = 0.3

# Measured: .07, .066 and .076 m in the worst of the runs once the robot drove through, .214, .094
# and .078 in the median one where it only drove past.
LOST_MAX = 0.12  # of the free width in the continuous map, in every run [m]
LOST_PAST_MEDIAN_MAX = 0.25  # in the median run, when the robot only drove past [m]
# Doors with the robots that get through in every run.
RADIUS_THROUGH = {0.7: 0.25, 0.8: 0.3, 0.9: 0.3}


@pytest.fixture(scope="module")
def report(run):
    done = run("gpom-live", "door", "--params", PARAMS, "--runs", RUNS)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def doors_of(report, stages=STAGES):
    return [door for run in report["runs"] for stage in stages for door in run[stage]["doors"]]


def widths_of(report):
    return [(door, width) for door in doors_of(report) for width in door["widths"]]


def stretch(row, cell_m, p_free):
    """Width of the connected cells about the middle one with p <= p_free."""
    free = "".join("f" if p is not None and p <= p_free else "-" for p in row["p"])
    left, right = free[:row["i_middle"]], free[row["i_middle"]:]
    n_right = len(right) - len(right.lstrip("f"))
    n_left = len(left) - len(left.rstrip("f")) if n_right else 0
    return cell_m * (n_left + n_right)


def loss(door):
    continuous = next(width for width in door["widths"] if width["map"] == "continuous")
    return door["width_m"] - continuous["free_m"]


def test_every_run_says_what_each_map_makes_of_each_door(report):
    maps = [("continuous", 0.002), ("lowres", 0.05), ("lowres", 0.1), ("octomap", 0.05),
            ("octomap", 0.1)]
    assert [run["seed"] for run in report["runs"]] == list(range(1, RUNS + 1))
    assert report["free_probability"] == pytest.approx(FREE)
    for run in report["runs"]:
        for stage in STAGES:
            assert [door["width_m"] for door in run[stage]["doors"]] == list(DOORS)
    for door in doors_of(report):
        assert [(width["map"], width["cell_m"]) for width in door["widths"]] == maps
        assert [path["radius_m"] for path in door["paths"]] == [0.25, 0.3]


def test_doors_are_as_wide_as_the_walls_leave_them(report):
    for run in report["runs"]:
        for door in run["through"]["doors"]:
            across = [(x0, x1) for x0, y0, x1, y1 in run["obstacles_m"] if y0 < door["y_m"] < y1]
            left = max(x1 for x0, x1 in across if x1 <= door["x_m"])
            right = min(x0 for x0, x1 in across if x0 >= door["x_m"])
            assert right - left == pytest.approx(door["width_m"], abs=1e-9)
            assert 0.5 * (left + right) == pytest.approx(door["x_m"], abs=1e-9)
            assert not any(x0 < door["x_m"] < x1 for x0, x1 in across)


def test_a_width_is_that_of_the_connected_free_cells_of_its_row(report):
    for door, width in widths_of(report):
        row, cell_m = width["row"], width["cell_m"]
        for name, p_free in (("free_m", report["free_probability"]),
                             ("class_free_m", report["class_free_probability"])):
            assert width[name] == pytest.approx(stretch(row, cell_m, p_free), abs=1e-9)
        middle_m = row["x0_m"] + row["i_middle"] * cell_m
        assert abs(middle_m - door["x_m"]) <= cell_m / 2 + 1e-9
        assert abs(row["y_m"] - door["y_m"]) <= cell_m / 2 + 1e-9
        assert len(row["p"]) * cell_m > door["width_m"] + 0.3  # reaches into both walls


def test_class_free_follows_the_thresholds_of_the_parameters(run, report, tmp_path):
    strict = tmp_path / "strict.toml"
    text = PARAMS.read_text(encoding="utf-8")
    assert text.count("\np_free = 0.3") == 1
    strict.write_text(text.replace("\np_free = 0.3", "\np_free = 0.1"), encoding="utf-8")
    done = run("gpom-live", "door", "--params", strict, "--runs", 1)
    assert done.returncode == 0, done.stderr
    narrower = 0
    for (door, width), (_, same) in zip(widths_of(json.loads(done.stdout)), widths_of(report)):
        assert width["free_m"] == same["free_m"]
        assert width["class_free_m"] == pytest.approx(
            stretch(width["row"], width["cell_m"], 0.1 + 1e-8), abs=1e-9)
        narrower += width["class_free_m"] < width["free_m"]
    assert narrower > 10


def test_no_map_makes_a_door_wider_than_a_cell_and_the_noise(report):
    for door, width in widths_of(report):
        assert width["free_m"] <= door["width_m"] + width["cell_m"] + 2 * NOISE


def test_nothing_leads_through_the_wall_beside_the_doors(report):
    for run in report["runs"]:
        for stage in STAGES:
            assert run[stage]["wall"]["p_max"] >= 0.7


def test_a_path_is_free_only_where_the_row_is_free(report):
    n_free = 0
    for door in doors_of(report):
        row_free_m = door["widths"][0]["free_m"]
        for path in door["paths"]:
            assert path["free"] == (path["p_max"] <= report["free_probability"])
            n_free += path["free"]
            assert not path["free"] or row_free_m >= 2 * path["radius_m"] - 0.03
        assert door["radius_max_m"] <= row_free_m / 2 + 0.015
    assert 0 < n_free < 2 * len(doors_of(report))


def test_a_door_keeps_its_width_but_for_12_cm(report):
    for door in doors_of(report, ["through"]):
        assert loss(door) <= LOST_MAX


def test_a_door_that_the_robot_only_passed_keeps_most_of_its_width(report):
    for i, width_m in enumerate(DOORS):
        losses = sorted(loss(run["past"]["doors"][i]) for run in report["runs"])
        assert losses[RUNS // 2] <= LOST_PAST_MEDIAN_MAX, width_m


def test_robots_that_fit_get_through_once_they_drove_there(report):
    for door in doors_of(report, ["through"]):
        for path in door["paths"]:
            if path["radius_m"] <= RADIUS_THROUGH.get(door["width_m"], 0.0):
                assert path["free"], (door["width_m"], path)


def test_the_summary_is_of_the_runs(report):
    for row in report["summary"]:
        doors = [run[row["stage"]]["doors"][DOORS.index(row["width_m"])]
                 for run in report["runs"]]
        for i, figure in enumerate(row["free_m"]):
            values = sorted(door["widths"][i]["free_m"] for door in doors)
            assert (figure["worst"], figure["median"]) == (values[0], values[RUNS // 2])
        for i, figure in enumerate(row["p_max"]):
            values = sorted(door["paths"][i]["p_max"] for door in doors)
            assert (figure["worst"], figure["median"]) == (values[-1], values[RUNS // 2])


def test_a_run_depends_on_its_seed_alone(run, report):
    done = run("gpom-live", "door", "--params", PARAMS, "--seed", 2, "--runs", 1)
    assert done.returncode == 0, done.stderr
    first, second = json.loads(done.stdout)["runs"][0], report["runs"][1]
    for stage in STAGES:
        for mine, other in zip(first[stage]["doors"], second[stage]["doors"]):
            assert mine["paths"] == other["paths"]
            assert [w["row"] for w in mine["widths"]] == [w["row"] for w in other["widths"]]


def test_the_picture_is_drawn_and_other_files_are_refused(report, tmp_path):
    def draw(text):
        (tmp_path / "doors.json").write_text(text, encoding="utf-8")
        return subprocess.run(
            [sys.executable, ROOT / "tools" / "view" / "door_picture.py", tmp_path / "doors.json",
             "--out", tmp_path / "doors.png"], capture_output=True, text=True, check=False)
    refused = draw('{"runs": []}')
    assert refused.returncode == 2 and "doors.json" in refused.stderr
    assert refused.stderr.count("\n") == 1
    done = draw(json.dumps(report))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "doors.png").read_bytes().startswith(b"\x89PNG")

"""The examples do what they say; those that need LCM are in tests/linux."""
import csv
import pathlib
import re
import subprocess

import board_output
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
NX, NY, CELL_M = 56, 36, 0.25
FREE, WAY, OCCUPIED = ".", "*", "#"


@pytest.fixture
def example(tool):
    """example(name, *arguments): the finished process."""
    def start(name, *arguments):
        return subprocess.run([tool("libgpom.a").parent / "examples" / name,
                               *map(str, arguments)], capture_output=True, text=True, timeout=60,
                              check=False)
    return start


@pytest.mark.parametrize("name", ["bare_main_loop", "host_program", "planner"])
def test_the_command_in_its_head_builds_an_example(name, tmp_path):
    """As copied from the comment, but for where the program goes."""
    text = (ROOT / "examples" / f"{name}.c").read_text()
    command = re.search(r"^ \*     ((?:arm-none-eabi-g)?cc (?:.*\\\n)*.*)$", text, re.MULTILINE)[1]
    words = re.sub(r"\\\n \*", " ", command).split(" && ")[0].split()
    output = tmp_path / name
    if "-o" in words:
        words[words.index("-o") + 1] = str(output)
    else:
        words += ["-o", str(output)]
    subprocess.run([*words, "-Wall", "-Wextra", "-Werror"], cwd=ROOT, check=True)
    assert output.is_file()


def test_the_bare_main_loop_stops_before_the_wall(example):
    done = example("bare_main_loop")
    assert done.returncode == 0
    board_output.check(done.stdout)


def test_the_host_program_answers_as_gpom_query(example, run, street, tmp_path):
    """A street's log, 40 points: class and probability, to the digits that are printed."""
    points = [(10.0 + 3.1 * i, 20.0 + 1.7 * i) for i in range(40)]
    (tmp_path / "points.csv").write_text("".join(f"{x:.6g},{y:.6g}\n" for x, y in points))
    done = run("gpom-query", "--scans", street, "--params", ROOT / "tools/params/street.toml",
               "--points", tmp_path / "points.csv", "--out", tmp_path / "answers.csv")
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "answers.csv", encoding="ascii") as file:
        expected = list(csv.DictReader(file))
    done = example("host_program", street, *[f"{value:.6g}" for point in points for value in point])
    assert done.returncode == 0, done.stderr
    rows = re.findall(r"^\S+ \S+: p = (\S+), variance (\S+), (\w+)$", done.stdout, re.MULTILINE)
    assert len(rows) == 40 and len({row[2] for row in rows}) > 1
    for row, answer in zip(rows, expected):
        assert float(row[0]) == pytest.approx(float(answer["probability"]), abs=6e-4)
        assert float(row[1]) == pytest.approx(float(answer["variance"]), abs=6e-4)
        assert row[2] == answer["class"] or row[2] == ("free", "unsure", "occupied")[
            int(answer["class"])]


@pytest.mark.parametrize("text, complaint", [
    ("0,0,0,0,-1,0.1,30,1,2\n0,0,0,0,-1,0.1\n", "bad.csv:2: "),
    ("# fine\n0,0,0,0,-1,0.1,30,1,two\n", "bad.csv:2: "),
    ("0,nan,0,0,-1,0.1,30,1\n", "bad.csv:1: "),
    (None, "bad.csv: No such file"),
])
def test_the_host_program_names_the_line_that_is_bad(example, tmp_path, text, complaint):
    if text is not None:
        (tmp_path / "bad.csv").write_text(text)
    done = example("host_program", tmp_path / "bad.csv", 1, 2)
    assert done.returncode == 2 and complaint in done.stderr and done.stderr.count("\n") == 1
    assert example("host_program", tmp_path / "bad.csv", 1).stderr.startswith("usage: ")


def test_the_planner_goes_through_the_door(example):
    """From room to room: each step to a neighbour, on no cell near a wall, through the door."""
    done = example("planner")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    picture = {(ix, NY - 1 - row): sign for row in range(NY) for ix, sign in enumerate(lines[row])}
    way = {cell for cell, sign in picture.items() if sign == WAY}
    n_steps = int(re.search(r"^way of (\d+) steps", done.stdout, re.MULTILINE)[1])
    start, goal = (12, 12), (44, 24)
    assert len(way) == n_steps >= abs(goal[0] - start[0]) + abs(goal[1] - start[1])
    assert start in way and all(picture[x + dx, y + dy] in (FREE, WAY) for x, y in way
                                for dx in (-1, 0, 1) for dy in (-1, 0, 1))
    reached, edge = {start}, [start]
    while edge:
        x, y = edge.pop()
        new = {(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)} & way - reached
        reached |= new
        edge += new
    assert reached == way and any(abs(x - goal[0]) + abs(y - goal[1]) == 1 for x, y in way)
    crossings = [y * CELL_M for x, y in way if x == 28]
    assert crossings and all(5.0 <= y < 6.5 for y in crossings)


def test_the_planner_explores_a_place_in_the_raster_that_is_not_occupied(example):
    done = example("planner")
    x_m, y_m = map(float, re.search(r"^explore next: (\S+) (\S+),", done.stdout, re.M).groups())
    assert 0 < x_m < NX * CELL_M and 0 < y_m < NY * CELL_M
    assert done.stdout.splitlines()[NY - 1 - int(y_m / CELL_M)][int(x_m / CELL_M)] != OCCUPIED

"""Figures in documents: each mark says what its source says."""
import csv
import importlib.util
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATH = ROOT / "tools" / "report" / "figures.py"
SPEC = importlib.util.spec_from_file_location("figures", PATH)
figures = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(figures)


def test_every_marked_figure_says_what_its_source_says():
    done = subprocess.run([sys.executable, PATH, "--check"], capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_figures_of_the_budget_are_those_of_its_file():
    with open(ROOT / "tests" / "budget.csv", encoding="ascii", newline="") as file:
        limits = {(row["target"], row["metric"]): row["limit"] for row in csv.DictReader(file)}
    texts = figures.texts_of(figures.read_rows())
    expected = int(limits["cortex-m7", "instructions query 8+8"])
    assert texts["query_m7_street"].replace(",", "") == str(expected)


@pytest.mark.parametrize("line, fault", [
    ("<!-- figure: ram -->12,345<!-- /figure --> bytes", None),
    ("<!-- figure: ram -->12,346<!-- /figure --> bytes", "its source says 12,345"),
    ("<!-- figure: rom -->12,345<!-- /figure --> bytes", "rom is not in"),
    ("12,345 bytes", "mark it"),
    ("112,345 bytes", None),
])
def test_a_mark_that_is_wrong_unknown_or_absent_is_a_fault(line, fault):
    faults = list(figures.faults_of("first\n" + line, {"ram": "12,345"}))
    assert len(faults) == (fault is not None)
    assert all(number == 2 and fault in what for number, what in faults)


def test_marks_are_filled_and_nothing_else_changes():
    text = "a <!-- figure: ram -->1<!-- /figure -->, 1 <!-- figure: rom -->2<!-- /figure -->\n"
    assert figures.filled(text, {"ram": "12,345"}) == text.replace("->1<", "->12,345<")


def test_a_figure_whose_place_is_gone_is_one_line_that_names_it():
    row = {"name": "ram", "format": "{}", "source": "budget", "place": "none; such", "value": ""}
    with pytest.raises(figures.FigureError, match="figures.csv: ram: budget has no \"none; such\""):
        figures.texts_of([row])

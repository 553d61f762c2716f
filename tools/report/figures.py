#!/usr/bin/env python3
"""Figures that stand in several documents, each from one source.

usage: tools/report/figures.py [--check]

A document marks a figure: `<!-- figure: NAME -->50,312<!-- /figure -->`. figures.csv says where
NAME comes from. Without --check the marks of all documents are filled; figures of the firmware and
of the demonstration are measured first, where these are built. With --check nothing is written: one
line for each mark that differs from its source, for each figure of five digits or more without a
mark, and for each line of figures.csv that no document uses; then exit code 1.

Sources in figures.csv and what `place` is there (parts between semicolons):
  budget    target; metric of tests/budget.csv
  table     heading of RESULTS.md; first cells of the row...; column
  speed     first two words of a row of `make bench` in RESULTS.md; column
  line      how a line of `make bench` in RESULTS.md begins; the figure is the word after it
  firmware  metric of tests/firmware/budget.py; `value` keeps what `make firmware` measured
  demo      method; part; metric of `make demo`; `value` keeps what it measured
  command   the command that printed `value`
"""
import csv
import json
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE = ROOT / "tools" / "report" / "figures.csv"
MARK = re.compile(r"<!-- figure: (\w+) -->(.*?)<!-- /figure -->")
NUMBER = re.compile(r"(?<![\w.,])\d[\d,.]*\d")
LONG_DIGITS = 5  # from here on equal figures are no coincidence
# Where figures come from, and where they stand as they were.
UNMARKED = {"RESULTS.md", "CHANGELOG.md"}
SPEED_COLUMNS = ("map", "n", "raster/s", "list/s", "x brute", "x tree", "x sklearn",
                 "time / nanoflann", "solve of peak")
IMAGE = ROOT / "build" / "arm-none-eabi-cortex-m7"
DEMO = ROOT / "build" / "demo" / "street" / "eval.json"
DEMO_SEED = 1


class FigureError(Exception):
    """Something that one line can say."""


# ---- sources ------------------------------------------------------------------------------------

def number_of(cell):
    """The first number of a cell."""
    return float(re.search(r"-?\d+(\.\d+)?", cell.replace(",", ""))[0])


def budget_figure(target, metric):
    with open(ROOT / "tests" / "budget.csv", encoding="ascii", newline="") as file:
        found = [row["limit"] for row in csv.DictReader(file)
                 if (row["target"], row["metric"]) == (target, metric)]
    return float(found[0])


def results_text():
    return (ROOT / "RESULTS.md").read_text(encoding="utf-8")


def table_figure(heading, *place):
    """In the first row below a heading whose first cells are given; the last part is the column."""
    *first_cells, column = place
    section = results_text().partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")]
            for line in section.splitlines() if line.startswith("|")]
    header = next(row for row in rows if column in row)
    row = next(row for row in rows if row[:len(first_cells)] == first_cells)
    return number_of(row[header.index(column)])


def speed_figure(name, n_points, column):
    rows = (line.split() for line in results_text().splitlines())
    row = next(row for row in rows if row[:2] == [name, n_points] and len(row) > 8)
    return float(row[SPEED_COLUMNS.index(column)])


def line_figure(beginning):
    line = next(line for line in results_text().splitlines() if line.startswith(beginning))
    return number_of(line.removeprefix(beginning))


IN_DOCUMENTS = {"budget": budget_figure, "table": table_figure, "speed": speed_figure,
                "line": line_figure}
KEPT = ("firmware", "demo", "command")


def value_of(row):
    if row["source"] in KEPT:
        return float(row["value"])
    place = row["place"].split("; ")
    try:
        return IN_DOCUMENTS[row["source"]](*place)
    except (KeyError, IndexError, StopIteration, TypeError):
        raise FigureError(f"{TABLE.relative_to(ROOT)}: {row['name']}: {row['source']} has no "
                          f"\"{row['place']}\"") from None


def texts_of(rows):
    """{name: the figure as documents write it}"""
    return {row["name"]: row["format"].format(value_of(row)) for row in rows}


# ---- measured -----------------------------------------------------------------------------------

def measured_firmware():
    if not (IMAGE / "gpom_device.elf").is_file():
        return {}
    sys.path.insert(0, str(ROOT / "tests" / "firmware"))
    import budget  # pylint: disable=import-outside-toplevel
    return budget.figures(str(IMAGE), budget.beam_max())[0]


def measured_demo():
    if not DEMO.is_file():
        return {}
    report = json.loads(DEMO.read_text(encoding="utf-8"))
    return {f"{method['key']}; near; nll": round(method["near"]["nll"], 4)
            for method in report["methods"] if report["seed"] == DEMO_SEED}


def measure(rows):
    """Put what this build measures into the rows."""
    found = {"firmware": measured_firmware(), "demo": measured_demo()}
    for row in rows:
        measured = found.get(row["source"], {}).get(row["place"])
        if measured is not None and float(row["value"]) != measured:
            row["value"] = f"{measured:g}"


# ---- documents ----------------------------------------------------------------------------------

def documents():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "*.md"], cwd=ROOT,
                            capture_output=True, text=True, check=True).stdout.split()
    return [ROOT / name for name in listed if (ROOT / name).is_file() and name not in UNMARKED]


def faults_of(text, texts):
    """(line, what) of each mark that does not say what its source says, and of each long figure
    that stands there without a mark."""
    long_ones = {shown: name for name, shown in texts.items()
                 if sum(letter.isdigit() for letter in shown) >= LONG_DIGITS}
    for number, line in enumerate(text.splitlines(), 1):
        for shown in NUMBER.findall(MARK.sub("", line)):
            if shown in long_ones:
                yield number, f"{shown} is the figure {long_ones[shown]}: mark it"
        for name, shown in MARK.findall(line):
            if name not in texts:
                yield number, f"figure {name} is not in tools/report/figures.csv"
            elif shown != texts[name]:
                yield number, (f"figure {name} is {shown}, its source says {texts[name]}: run make "
                               "figures")


def filled(text, texts):
    def fill(match):
        shown = texts.get(match[1], match[2])
        return f"<!-- figure: {match[1]} -->{shown}<!-- /figure -->"
    return MARK.sub(fill, text)


def read_rows():
    with open(TABLE, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_rows(rows):
    with open(TABLE, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main():
    if sys.argv[1:] not in ([], ["--check"]):
        sys.exit(__doc__)
    is_check, rows = bool(sys.argv[1:]), read_rows()
    if not is_check:
        measure(rows)
        write_rows(rows)
    try:
        texts = texts_of(rows)
    except FigureError as error:
        sys.exit(str(error))
    n_faults, unused = 0, set(texts)
    for path in documents():
        text = path.read_text(encoding="utf-8")
        unused -= {name for name, _ in MARK.findall(text)}
        if not is_check and filled(text, texts) != text:
            path.write_text(filled(text, texts), encoding="utf-8")
            print(path.relative_to(ROOT))
        for number, what in faults_of(text if is_check else filled(text, texts), texts):
            print(f"{path.relative_to(ROOT)}:{number}: {what}")
            n_faults += 1
    for name in sorted(unused):
        print(f"{TABLE.relative_to(ROOT)}: no document has the figure {name}: remove its line")
        n_faults += 1
    return 1 if n_faults > 0 else 0


if __name__ == "__main__":
    sys.exit(main())

"""Records of processors: the ratios are those of the run's rates, and each record is a column."""
import json
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
RATES = {"raster/sparse/n16": 8e6, "nanoflann-hits/sparse/n16": 6e6, "raster/sparse/n32": 3e6,
         "nanoflann-hits/sparse/n32": 4.5e6, "eigen-brute/sparse/n32": 5e4,
         "raster/wide-500k/n16": 6e6, "log/campus-west-live/n16": 2e6,
         "solve/matern12/n16": 5e10, "solve/nn/n32": 8e10, "multiply-add/4": 2.5e10,
         "multiply-add/16": 1e11}
ROWS = {"whole query / nanoflann's hits, sparse street, n = 16": 0.75,
        "whole query / nanoflann's hits, sparse street, n = 32": 1.5,
        "over plain Eigen with brute force, n = 32, Matern-1/2": 60,
        "500,000 beams / 476, n = 16": 0.75, "campus-west live / sparse street, n = 16": 0.25,
        "solve / peak, Matern-1/2, n = 16": 0.25, "solve / peak, NN, n = 32": 0.4}


def write_run(path, processor):
    rows = [{"run_name": name, "aggregate_name": "median", "items_per_second": rate,
             "cpu_time": 1.0} for name, rate in RATES.items()]
    for row in rows:
        row.update({"beams": 1} if row["run_name"].startswith("log") else {})
    path.write_text(json.dumps({"benchmarks": rows, "context": {
        "lanes": "16", "compiler": "12.2.0", "processor": processor,
        "caches": [{"type": "Data", "level": 1, "size": 49152},
                   {"type": "Unified", "level": 2, "size": 1048576}]}}), encoding="utf-8")
    return path


def ratios(*arguments):
    return subprocess.run([sys.executable, ROOT / "bench" / "ratios.py", *arguments],
                          capture_output=True, text=True, check=False)


@pytest.fixture(name="folder")
def fixture_folder(tmp_path):
    for name in ("First (R) 1", "Second"):
        run = write_run(tmp_path / "speed.json", name)
        done = ratios("--speed", run, "--record", tmp_path)
        assert done.returncode == 0, done.stderr
        done = ratios("--speed", run)
        assert f"processor {name}; L1d 48 KiB, L2 1,024 KiB\n" in done.stdout
        assert "50 at 128 bits, 200 at 512 bits" in done.stdout
        run.unlink()
    return tmp_path


def test_a_record_has_the_ratios_of_the_rates_and_no_others(folder):
    record = json.loads((folder / "first-r-1-16-lanes.json").read_text(encoding="utf-8"))
    assert {row: value for row, value in record["ratios"].items() if row in ROWS} == \
        pytest.approx(ROWS, abs=1e-3)
    assert all("dense" not in row and "insertion" not in row for row in record["ratios"])


def test_each_record_is_a_column_of_the_table(folder):
    sys.path.insert(0, str(ROOT / "tools" / "report"))
    import processor_section  # pylint: disable=import-outside-toplevel
    table = processor_section.table(processor_section.read_records(folder))
    header, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")]
                        for line in table.splitlines() if line]
    assert header == ["ratio", "wanted", "First (R) 1, 16 lanes", "Second, 16 lanes"]
    by_name = {row[0]: row[2:] for row in rows}
    assert by_name["500,000 beams / 476, n = 16"] == ["0.75", "0.75"]
    assert by_name["over plain Eigen with brute force, n = 32, Matern-1/2"] == ["60", "60"]
    assert by_name["insertion, worst / mean"] == ["", ""]


def test_a_record_without_a_run_is_refused(tmp_path):
    done = ratios("--record", tmp_path)
    assert done.returncode == 2 and done.stderr.splitlines()[-1].endswith(
        "--record needs --speed FILE")

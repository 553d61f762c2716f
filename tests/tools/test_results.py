"""gpom-results: every table, twice the same, and what is left out."""
import json

import pytest


def results(run, tool, data, out, *more):
    return run("gpom-results", "--build", tool("gpom-eval").parent, "--data", data, "--out", out,
               *more)


def check_order(text):
    """Tables come first, then how they are judged, then the commands of each section, once."""
    tables, _, rest = text.partition("\n## How it is judged\n")
    method, _, commands = rest.partition("\n## Commands\n")
    assert "\n## Is the GP ahead?\n" in tables and "| --- |" in tables
    assert "gpom-" not in tables.replace("`gpom-", "")  # in words only, not as a command
    assert "AUC: area under the ROC curve" in method and "| --- |" not in method + commands
    assert commands.count("```\ngpom-") == 10
    assert "### Streets, whole area\n\nAs for \"Streets, within 5 m of a beam\"." in commands
    headings = [line.removeprefix("### ") for line in commands.splitlines() if line[:4] == "### "]
    assert headings and all(f"\n## {heading}\n" in tables for heading in headings)


@pytest.mark.campaign
def test_results_have_every_table_twice_the_same_and_name_absent_logs(run, tool, log, tmp_path):
    (tmp_path / "seattle.log.gz").symlink_to(log("seattle.log.gz"))
    texts = []
    for name in ("a.md", "b.md"):
        done = results(run, tool, tmp_path, tmp_path / name, "--seeds", "0,1", "--fractions",
                       "0.04", "--streets", 1, "--points", 100, "--live-seeds", 2, "--drive", 0,
                       "--odometry", 0)
        assert done.returncode == 0, done.stderr
        assert "intel left out" in done.stdout
        texts.append((tmp_path / name).read_text(encoding="utf-8"))
    text = texts[0]
    assert texts[1] == text and str(tmp_path) not in text
    assert "Logs left out, not in the data folder: intel, csail, campus-west, acapulco." in text
    for words in ("held-out beams, 4 %", "held-out runs", "Streets, within 5 m", "| 32 + 32 |",
                  "| 256 + 256 |",
                  "gpom-eval log --scans $DATA/seattle.log.gz", "`$SEED` = 0, 1",
                  "| seattle | strong grid |", "| **mean** | OctoMap |"):
        assert words in text
    check_order(text)
    assert text.count("| p = .5 at [m] |") == 4  # beams, runs, streets, live maps
    assert "| seattle | live map, learnt |" in text
    assert "| seattle | live map, indoor.toml |" in text
    assert "## The live map: jumps" in text and "| street 0 | " in text
    assert "| 0.7 | driven through |" in text and "| robot of 0.25 m |" in text
    assert "Rivals left out: no share 1.0" in text
    assert "--training-of $SEED" in text and "NLL, band" in text
    assert "0.3 m before it" not in text
    assert "| seattle | kept |" in text and "| seattle | as many at random |" in text
    assert "--method lml --out $STREETS/seattle-0.04-seed-$SEED/lml.toml" in text
    assert "| seattle | GP, lml |" in text and "| best |" in text
    assert "gpom-learn --scans $DATA/seattle.log.gz" in text


def test_results_of_nothing_are_refused(run, tool, tmp_path):
    done = results(run, tool, tmp_path, tmp_path / "out.md", "--streets", 0, "--drive", 0,
                   "--odometry", 0)
    assert done.returncode == 2
    assert done.stderr == "gpom-results: nothing to do: no logs, no streets and no drives\n"
    done = results(run, tool, tmp_path, tmp_path / "out.md", "--seeds", "x")
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and "--seeds" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_reports_are_kept_and_taken_again_for_the_same_commands_alone(run, tool, tmp_path):
    out, reports = tmp_path / "out.md", tmp_path / "reports"

    def drive(n_scans):
        done = results(run, tool, tmp_path, out, "--streets", 0, "--odometry", 0, "--drive",
                       n_scans, "--reports", reports)
        assert done.returncode == 0, done.stderr
        return out.read_text(encoding="utf-8")
    first = drive(200)
    path, = reports.glob("*.report")
    kept = json.loads(path.read_text(encoding="utf-8"))
    assert drive(200) == first
    kept["report"]["tenths"][0]["kept"] = 987654321
    path.write_text(json.dumps(kept), encoding="utf-8")
    assert "987654321" in drive(200)
    assert "987654321" not in drive(300)

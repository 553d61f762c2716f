"""Recorded scans as a person gives them to the tools: what is read, refused and told."""
import pytest

PARAMS = "tools/params/indoor.toml"
LINE = "FLASER 3 4.0 5.0 6.0 1.0 2.0 0.5 1.0 2.0 0.5 {0} host {0}\n"


@pytest.fixture
def ask(run, tmp_path):
    """ask(scans, *options): gpom-query on scans of this text."""
    (tmp_path / "points.csv").write_text("0,0\n", encoding="utf-8")

    def start(scans, *options):
        (tmp_path / "scans").write_text(scans, encoding="utf-8")
        return run("gpom-query", "--scans", tmp_path / "scans", "--params", PARAMS,
                   "--points", tmp_path / "points.csv", "--out", tmp_path / "answers.csv",
                   "--kept", tmp_path / "kept.csv", *options)
    return start


def test_what_is_not_used_of_a_log_is_told_and_the_rest_is_mapped(ask, tmp_path):
    done = ask(LINE.format(1) + "FLASER 0 1.0 2.0 0.5 1.0 2.0 0.5 2 host 2\n" + LINE.format(3),
               "--fov", 90)
    assert done.returncode == 0 and done.stdout.startswith("2 scans: 6 hits")
    assert done.stderr == f"{tmp_path / 'scans'}: 1 line not used: FLASER without ranges\n"

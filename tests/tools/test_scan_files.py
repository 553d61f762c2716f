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


def beam_counts(stdout):
    """Hits, beams without return and readings ignored, of gpom-query's line."""
    return [int(word) for word in stdout.replace(",", "").split() if word.isdigit()][1:4]


@pytest.mark.parametrize("options, counts", [
    ([], [1, 1, 3]),
    (["--zero", "no-return"], [1, 2, 2]),
    (["--too-near", "no-return"], [1, 2, 2]),
    (["--zero", "no-return", "--too-near", "no-return", "--range-min", 0.5], [1, 3, 1]),
    (["--range-min", 0], [2, 1, 2]),
    (["--range-min", 5], [0, 1, 4]),
    (["--zero", "ignore", "--too-near", "ignore"], [1, 1, 3])])
def test_what_readings_of_0_and_near_ones_mean_can_be_said(ask, options, counts):
    done = ask("0,0,0,0,0,0.1,30,0,0.007,4,-1,inf\n", *options)
    assert done.returncode == 0, done.stderr
    assert beam_counts(done.stdout) == counts


@pytest.mark.parametrize("options", [("--zero", "free"), ("--too-near", "0"),
                                     ("--range-min", "-1"), ("--range-min", "nan"),
                                     ("--fov", "0"), ("--fov", "361")])
def test_an_option_for_scans_with_a_wrong_value_is_refused(ask, options):
    done = ask("0,0,0,0,0,0.1,30,4,5\n", *options)
    assert done.returncode == 2 and options[0] in done.stderr


def test_what_is_not_used_of_a_log_is_told_and_the_rest_is_mapped(ask, tmp_path):
    done = ask(LINE.format(1) + "FLASER 0 1.0 2.0 0.5 1.0 2.0 0.5 2 host 2\n" + LINE.format(3),
               "--fov", 90)
    assert done.returncode == 0 and done.stdout.startswith("2 scans: 6 hits")
    assert done.stderr == f"{tmp_path / 'scans'}: 1 line not used: FLASER without ranges\n"

"""learn() and evaluate() are gpom-learn and gpom-eval; gpom-convert learns from a log of gpomd."""
import json
import re

import gpom
import pytest
from gpom.io import convert

LEARN = {"kernel": "matern12", "model": "noise", "n_points": 200, "seed": 3}


@pytest.fixture(scope="module")
def scans_path(log, tmp_path_factory):
    path = tmp_path_factory.mktemp("scans") / "scans.csv"
    gpom.io.write_scans(path, gpom.io.read(log).scans)
    return path


def body(toml):
    return [line for line in toml.splitlines() if not line.startswith("#")]


@pytest.mark.parametrize("words, options", [((), {}), (("--fraction", "0.5"), {"fraction": 0.5})])
def test_learning_gives_the_parameters_of_gpom_learn(run, scans_path, tmp_path, words, options):
    run("gpom-learn", "--scans", scans_path, "--out", tmp_path / "out.toml", "--kernel", "matern12",
        "--model", "noise", "--points", 200, "--seed", 3, *words)
    params, report = gpom.learn(gpom.io.read(scans_path).scans, **LEARN, **options)
    written = (tmp_path / "out.toml").read_text()
    assert body(params.to_toml()) == body(written)
    assert f"NLL {report['held_out_nll']:.4f}" in written


def test_two_drives_are_learnt_from_together(log, scans_path):
    scans = gpom.io.read(log).scans
    one, _ = gpom.learn(scans, **LEARN)
    _, report = gpom.learn([scans, gpom.io.read(scans_path).scans], **LEARN)
    assert "400 places of 2 files" in report["comment"] and one.kernel == "matern12"


def test_one_command_learns_from_a_log_of_the_daemon(log, tmp_path, monkeypatch, capsys):
    """What comes out is what gpom.learn() gives, with the daemon's own configuration."""
    (tmp_path / "gpomd.toml").write_text(
        '[[sensor]]\ntype = "bot_core.planar_lidar_t"\nrange_max_m = 30.0\n[pose]\n')
    monkeypatch.chdir(tmp_path)
    words = ["--kernel", "matern12", "--model", "noise", "--points", "200",
             "--config", "gpomd.toml"]
    assert convert.main([str(log), "--learn", "place.toml", "--map", "map.yaml", *words]) == 0
    params, _ = gpom.learn(gpom.io.read(log).scans, kernel="matern12", model="noise",
                           n_points=200)
    assert gpom.Params.from_file(str(tmp_path / "place.toml")) == params
    assert "drive.lcmlog" in (tmp_path / "place.toml").read_text()
    assert (tmp_path / "map.pgm").is_file()
    assert "matern12" in capsys.readouterr().out


def test_evaluation_is_that_of_gpom_eval(run, scans_path, tmp_path):
    params = gpom.preset("indoor")
    (tmp_path / "params.toml").write_text(params.to_toml())
    run("gpom-eval", "log", "--scans", scans_path, "--params", tmp_path / "params.toml", "--json",
        tmp_path / "eval.json", "--fraction", 0.3, "--range-max", 49)
    expected = json.loads((tmp_path / "eval.json").read_text())
    got = gpom.evaluate(gpom.io.read(scans_path).scans, params, fraction=0.3)
    keys = [method["key"] for method in got["methods"]] if isinstance(got["methods"], list) \
        else list(got["methods"])
    assert any("octomap" in key for key in keys)
    assert got["methods"] == expected["methods"]


def test_wrong_options_are_named(log):
    scans = gpom.io.read(log).scans
    with pytest.raises(TypeError, match="no option 'kernels'; options are"):
        gpom.learn(scans, kernels="nn")
    with pytest.raises(RuntimeError, match="'rbf' is not one of nn, matern12"):
        gpom.learn(scans, kernel="rbf")
    with pytest.raises(RuntimeError, match="give more scans"):
        gpom.learn(scans[:1], kernel="nn")


def test_the_list_of_the_command(log, ros2, capsys):
    for path, topic in (log, "LIDAR"), (ros2, "/scan"):
        assert convert.main([str(path), "--list"]) == 0
        assert re.search(rf"{topic} .*\b40  scans", capsys.readouterr().out)


def test_the_command_writes_every_kind_of_map(ros2, tmp_path):
    names = ["map.yaml", "map.mcap", "map.bt", "map.npz", "map.png"]
    words = [word for name in names for word in ("--map", str(tmp_path / name))]
    assert convert.main([str(ros2), "--params", "indoor", "--cell", "0.2", *words, "--scans",
                         str(tmp_path / "scans.csv")]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {*names, "map.pgm", "scans.csv"}

"""The notebook runs from its first cell to its last, and does what it says."""
import json
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "examples" / "tutorial.ipynb"


def test_the_tutorial_runs(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    notebook = json.loads(NOTEBOOK.read_text())
    names = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [], "outputs are made by who runs it, and are not stored"
            exec(compile("".join(cell["source"]), str(NOTEBOOK), "exec"), names)
    labels = set(names["figures"])
    assert {"OctoMap", "occupancy grid"} <= labels
    ours = names["figures"]["GP, query frame"]
    assert ours["nll"] < names["figures"]["OctoMap"]["nll"]
    assert names["way"]["probability"] < 0.5  # where the robot drove, it was free
    written = {path.name for path in tmp_path.iterdir()}
    assert written >= {"map.yaml", "map.pgm", "map.mcap", "map.bt", "map.npz", "map.png",
                       "place.toml"}


def test_the_lines_of_the_page_run(ros2, tmp_path, monkeypatch):
    """The Python of docs/python.md, with a bag called drive."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive").symlink_to(ros2)
    page = (ROOT / "docs" / "python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert blocks
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), {})
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"drive", "map.yaml", "map.pgm", "map.mcap"}

"""What a file holds."""
from . import lcm, ros
from .files import kind_of, read
from .recording import Row


def contents(path):
    """Rows of the topics or channels of a file, with name, type, n_messages and use."""
    kind = kind_of(path)
    if kind in ("ros", "mcap"):
        return ros.contents(str(path))
    if kind == "lcm":
        return lcm.contents(str(path))
    if kind == "grid":
        return [Row("cells", "answers of gpom-query", 1, "map")]
    recording = read(path)
    return [Row("scans", {"npz": "NPZ"}.get(kind, "CSV or CARMEN"), len(recording.scans), "scans")]

"""Maps of snapshots, such as gpomd's files NAME.0 and NAME.1."""
import pathlib

from ..maps import Map
from .recording import FileError

BLOCK_BYTES, BLOCK_BEAMS = 512, 13


def map_of_snapshot(path, params, **config):
    """The map of a snapshot.

    path    NAME, of which NAME.0 and NAME.1 are looked for, or one of these files
    params  Params of the map
    config  other fields of gpom_config_t; beam_max is as large as the file needs
    Raises  FileError
    """
    path = pathlib.Path(path)
    paths = [path] if path.is_file() else [path.with_name(f"{path.name}.{i}") for i in (0, 1)]
    slots = [each.read_bytes() for each in paths if each.is_file()]
    if not slots:
        raise FileError(f"{path}: no such snapshot; give NAME, of which NAME.0 or NAME.1 exists")
    n_blocks = max(len(slot) for slot in slots) // BLOCK_BYTES
    made = Map(params, **{"beam_max": max(BLOCK_BEAMS * n_blocks, 1), **config})
    try:
        made.restore(*slots)
    except RuntimeError as error:
        raise FileError(f"{path}: {error}; it is cut, damaged, or of another version") from None
    return made

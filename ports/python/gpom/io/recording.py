"""What a reader gives, and what it may be told."""
import dataclasses
import os
import pathlib

from .. import _core

FileError = _core.FileError


@dataclasses.dataclass
class Row:
    """One topic or channel of a file, for lists."""
    name: str
    type: str
    n_messages: int
    use: str  # "scans", "poses", "transforms" or "": not used


@dataclasses.dataclass
class ReadOptions:
    """What a file does not say.

    scan          topic or channel of the scans; None: the only one, or all that gpomd would take
    pose          topic or channel of the poses; None: tf if it has the frames, else the only one
    fixed_frame   frame of the map in tf; None: map, else odom
    range_min_m   readings below it are ignored [m]; None: as the message says, else 0.02
    range_max_m   usable maximum [m]; None: as the message says, else 49 (text), 30 (LCM)
    zero_is_no_return  a reading of 0 is no return; False: ignored
    gap_max_s     poses further apart are not interpolated [s]
    is_sweep      LaserScan: each beam gets the pose of its time (time_increment)
    echo          MultiEchoLaserScan: "first" or "last"
    sensors       sensors by LCM channel and sensor_id; see sensors_of_config()
    fov_deg       CARMEN: field of view [degree]; None: as the log says
    """
    scan: str | None = None
    pose: str | None = None
    fixed_frame: str | None = None
    range_min_m: float | None = None
    range_max_m: float | None = None
    zero_is_no_return: bool = False
    gap_max_s: float = 0.5
    is_sweep: bool = False
    echo: str = "first"
    sensors: dict | None = None
    fov_deg: float | None = None

    @property
    def gap_max_us(self):
        return int(round(1e6 * self.gap_max_s))


class Recording:
    """Scans of a file in order of time, and what happened to the others.

    scans      list of Scan
    notes      how the file was read, one sentence each
    n_dropped  number of messages that are not in scans, by cause
    """

    def __init__(self):
        self.scans = []
        self.notes = []
        self.n_dropped = {}

    def drop(self, cause):
        """Count one message that is left out."""
        self.n_dropped[cause] = self.n_dropped.get(cause, 0) + 1

    def finish(self, path, topic):
        """Sort, and raise FileError if no scan is left."""
        self.scans.sort(key=lambda scan: scan.stamp_us)
        if not self.scans:
            causes = "; ".join(f"{n} {cause}" for cause, n in self.n_dropped.items())
            raise FileError(f"{path}: {topic}: no scan is left{': ' if causes else ''}{causes}"
                            "; list the file with gpom-convert --list")
        for cause, n in self.n_dropped.items():
            self.notes.append(f"{topic}: {n} {cause}")
        return self


def replace_file(path, write):
    """Write a file under another name beside it, then rename it: never half a file."""
    path = pathlib.Path(path)
    staged = path.with_name(f".{path.name}.tmp{os.getpid()}")
    try:
        write(staged)
        os.replace(staged, path)
    except OSError as error:
        raise FileError(f"{path}: cannot write: {error.strerror or error}") from None
    finally:
        staged.unlink(missing_ok=True)


def require_suffix(path, suffixes):
    """The suffix of a name, which says what to write. Raises FileError."""
    suffix = pathlib.Path(path).suffix
    if suffix not in suffixes:
        raise FileError(f"{path}: give a name that ends in {', '.join(sorted(suffixes))}")
    return suffix


def choose(path, wanted, found, what, option):
    """The topic to use: the wanted one, or the only one. Raises FileError with all names."""
    if wanted is not None:
        if wanted not in found:
            raise FileError(f"{path}: {wanted}: no {what} on this topic; topics with {what} are: "
                            f"{', '.join(sorted(found)) or 'none'}; give one with {option}")
        return wanted
    if len(found) != 1:
        known = ", ".join(sorted(found)) or "none"
        raise FileError(f"{path}: {len(found)} topics with {what} ({known}); " +
                        (f"give one with {option}" if found else
                         "list the file with gpom-convert --list"))
    return next(iter(found))

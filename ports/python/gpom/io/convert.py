"""gpom-convert: recordings in; scans, maps and parameters out."""
import argparse
import pathlib
import sys

from .. import _core
from ..learning import learn
from ..maps import map_of
from ..presets import preset, preset_names
from . import contents, read, read_grid, write_map, write_scans
from .files import SCAN_SUFFIXES, kind_of
from .gpomd_config import apply_config
from .maps import WRITERS
from .recording import ReadOptions, require_suffix
from .snapshots import map_of_snapshot

_EPILOG = """\
in: a ROS 1 bag, the folder of a ROS 2 bag, MCAP, an LCM event log, CARMEN, CSV or NPZ; a snapshot
of gpomd with --snapshot; what gpom-query --raster wrote. Examples:
  gpom-convert --list drive.mcap
  gpom-convert drive/ --params indoor --map map.yaml --map map.mcap
  gpom-convert drive.lcmlog --config gpomd.toml --learn place.toml"""


def _parser():
    parser = argparse.ArgumentParser(
        prog="gpom-convert", epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
        description="Read a recording; write its scans, a map of it, or parameters learnt from it.")
    parser.add_argument("input", metavar="IN", help="recording, snapshot or answers of gpom-query")
    parser.add_argument("--list", action="store_true", help="only say what the file holds")
    reading = parser.add_argument_group("reading")
    reading.add_argument("--scan", metavar="TOPIC", help="topic or channel of the scans")
    reading.add_argument("--pose", metavar="TOPIC", help="topic or channel of the poses")
    reading.add_argument("--fixed-frame", metavar="FRAME",
                         help="frame of the map in tf [map, odom]")
    reading.add_argument("--range-min", type=float, metavar="M", help="readings below are ignored")
    reading.add_argument("--range-max", type=float, metavar="M", help="usable maximum [m]")
    reading.add_argument("--zero", choices=["ignore", "no-return"], default="ignore",
                         help="what a reading of 0 is [ignore]")
    reading.add_argument("--gap-max", type=float, default=0.5, metavar="S",
                         help="poses further apart are not interpolated [0.5 s]")
    reading.add_argument("--sweep", action="store_true",
                         help="LaserScan: a pose for each beam, by time_increment")
    reading.add_argument("--echo", choices=["first", "last"], default="first",
                         help="MultiEchoLaserScan: which echo [first]")
    reading.add_argument("--fov", type=float, metavar="DEG", help="CARMEN: field of view")
    reading.add_argument("--config", metavar="FILE",
                         help="LCM: gpomd.toml, for sensors, pose.channel and pose.gap_max_s")
    reading.add_argument("--snapshot", action="store_true", help="IN is a snapshot of gpomd")
    out = parser.add_argument_group("output; each may be repeated")
    out.add_argument("--scans", action="append", default=[], metavar="FILE",
                     help="scans: .csv (for the other tools), .npz or .mcap")
    out.add_argument("--map", action="append", default=[], metavar="FILE",
                     help="map: .yaml (nav2), .mcap, .bt (OctoMap), .npz or .png")
    out.add_argument("--learn", action="append", default=[], metavar="FILE",
                     help="parameters learnt from the scans, TOML")
    _add_map_options(parser.add_argument_group("map and learning"))
    return parser


def _add_map_options(making):
    making.add_argument("--params", metavar="NAME|FILE",
                        help=f"preset ({', '.join(preset_names())}) or file; with --learn: what "
                             "was learnt")
    making.add_argument("--cell", type=float, default=0.05, metavar="M",
                        help="cell of the map [0.05 m]")
    making.add_argument("--extent", type=float, nargs=4, metavar=("X0", "Y0", "X1", "Y1"),
                        help="area of the map [m]; default: all beams")
    making.add_argument("--keep-all", action="store_true",
                        help="keep every beam, instead of useful ones as a vehicle does")
    making.add_argument("--beam-max", type=int, metavar="N", help="capacity of the map [beams]")
    making.add_argument("--mode", choices=["trinary", "scale"], default="trinary",
                        help="nav2: three values, or probabilities [trinary]")
    making.add_argument("--kernel", default="all", help="learning: as for gpom-learn [all]")
    making.add_argument("--model", help="learning: as for gpom-learn [full]")
    making.add_argument("--points", type=int, metavar="N",
                        help="learning: places to learn from [6000]")
    making.add_argument("--fix", default="", help="learning: as for gpom-learn")


def _read_options(args):
    options = ReadOptions(
        scan=args.scan, pose=args.pose, fixed_frame=args.fixed_frame, range_min_m=args.range_min,
        range_max_m=args.range_max, zero_is_no_return=args.zero == "no-return",
        gap_max_s=args.gap_max, is_sweep=args.sweep, echo=args.echo, fov_deg=args.fov)
    if args.config:
        apply_config(args.config, options)
    return options


def _params(args):
    if args.params is None:
        raise _core.FileError(f"{args.input}: a map needs --params: a preset "
                              f"({', '.join(preset_names())}) or a file")
    return preset(args.params) if args.params in preset_names() else \
        _core.Params.from_file(args.params)


def _print_list(path):
    rows = contents(path)
    width = max((len(row.name) for row in rows), default=0)
    kind_width = max((len(row.type) for row in rows), default=0)
    for row in sorted(rows, key=lambda row: row.name):
        print(f"{row.name:<{width}}  {row.type:<{kind_width}}  {row.n_messages:>8}  "
              f"{row.use or 'not used'}")


def _write_maps(args, grid):
    for path in args.map:
        write_map(path, grid, args.mode)


def _learn(args, scans):
    params, report = learn(scans, kernel=args.kernel, model=args.model, fix=args.fix,
                           n_points=args.points,
                           command=f"gpom-convert {pathlib.Path(args.input).name} --learn")
    for warning in report["warnings"]:
        print(f"gpom-convert: warning: {warning}", file=sys.stderr)
    for path in args.learn:
        pathlib.Path(path).write_text(params.to_toml(report["comment"]), encoding="utf-8")
    print(report["figures"], end="")
    return params


def _require_names(args):
    """What a name says is checked first: reading and mapping may take long."""
    for path in args.scans:
        require_suffix(path, SCAN_SUFFIXES)
    for path in args.map:
        require_suffix(path, WRITERS)
    if args.map and not args.learn and kind_of(args.input) != "grid":
        _params(args)


def _convert(args):
    _require_names(args)
    if args.snapshot:
        made = map_of_snapshot(args.input, _params(args))
        _write_maps(args, made.grid(args.cell, args.extent))
        return
    if kind_of(args.input) == "grid":
        _write_maps(args, read_grid(args.input, _params(args) if args.params else None))
        return
    recording = read(args.input, _read_options(args))
    for note in recording.notes:
        print(f"{args.input}: {note}", file=sys.stderr)
    print(f"{args.input}: {len(recording.scans)} scans")
    for path in args.scans:
        write_scans(path, recording.scans)
    learnt = _learn(args, recording.scans) if args.learn else None
    if args.map:
        params = learnt if learnt is not None and args.params is None else _params(args)
        made = map_of(recording.scans, params, live=not args.keep_all, beam_max=args.beam_max)
        _write_maps(args, made.grid(args.cell, args.extent))


def main(words=None):
    """The command line. Returns the exit code."""
    args = _parser().parse_args(words)
    try:
        if args.list:
            _print_list(args.input)
        elif not (args.scans or args.map or args.learn):
            raise _core.FileError(f"{args.input}: nothing to write; give --list, --scans, --map or "
                                  "--learn")
        else:
            _convert(args)
    except (RuntimeError, ValueError, OSError) as error:
        print(f"gpom-convert: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

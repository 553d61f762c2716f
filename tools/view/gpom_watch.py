#!/usr/bin/env python3
"""Collect the map that gpomd publishes and draw it, or print the status of gpomd.

Without an option the map is drawn in the terminal, once a second: `#` occupied, `.` free, `+`
unsure, blank unknown, `R` the robot. The problems that gpomd reports are below the map.
Exit code 1: --compare found a difference. 2: nothing came, or an option is wrong.
"""
import argparse
import errno
import json
import pathlib
import select
import socket
import struct
import sys
import time
import urllib.parse
import zlib

import lcm
import numpy as np
from gpom_plot import (InputError, OneLineParser, colour_bar, plt, read_raster, save, show,
                       show_probability)
from matplotlib.colors import BoundaryNorm, ListedColormap
from status_words import COUNTS, N_COUNTS, PROBLEMS, PROBLEMS_PLACE, TYPES

URL = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=2097152"
EXIT_DIFFERS, EXIT_USAGE = 1, 2
MAP_FINGERPRINT, STATUS_FINGERPRINT = 0x428375daa5a20b5c, 0x9c14d72b736bf503
MAP_HEAD = struct.Struct(">QqIhhbi3d2dff6hi")
STATUS_HEAD = struct.Struct(">QqIbiii4q4f3i2q")
CLASSES = ("free", "unsure", "occupied", "unknown")
STATES = ("starting", "mapping", "stale", "stopping")
PROBABILITY_UNKNOWN, CLASS_UNKNOWN = 255, 3


class BadMessage(Exception):
    """Bytes that are not a message of their channel's type."""


# ---- messages (lcmtypes/gpom_map_t.lcm, gpom_status_t.lcm) ---------------------------------------

def checked(data, fingerprint, head):
    """The fields of a message's head. Raises BadMessage if type or checksum is wrong."""
    if len(data) < head.size + 4 or int.from_bytes(data[:8], "big") != fingerprint:
        raise BadMessage("another type")
    if zlib.crc32(data[:-4]) != int.from_bytes(data[-4:], "big"):
        raise BadMessage("damaged")
    return head.unpack_from(data)


class Tile:
    """A gpom.map_t."""

    def __init__(self, data):
        (_, self.stamp_us, self.sequence, self.i_tile, self.n_tiles, self.keyframe, self.epoch,
         *place) = checked(data, MAP_FINGERPRINT, MAP_HEAD)
        self.pose, corner, (self.cell_m, self.prior_variance) = place[:3], place[3:5], place[5:7]
        self.map_nx, self.map_ny, self.ix0, self.iy0, nx, ny, n_cells = place[7:]
        if n_cells != nx * ny or len(data) != MAP_HEAD.size + 2 * n_cells + 4:
            raise BadMessage("contradicts itself")
        self.corner_m = (corner[0] - self.cell_m * self.ix0, corner[1] - self.cell_m * self.iy0)
        cells = np.frombuffer(data, np.uint8, 2 * n_cells, MAP_HEAD.size).reshape(2, ny, nx)
        self.probability, self.variance_class = cells

    def raster(self):
        """Values that are the same in all tiles of one map, rounded because of float32 cells."""
        return self.map_nx, self.map_ny, round(self.corner_m[0], 3), round(self.corner_m[1], 3)


def read_status(data):
    """A gpom.status_t as a dictionary."""
    (_, stamp_us, sequence, state, version, map_format, epoch, uptime_us, scan_stamp_us, lag_us,
     lag_max_us, scan_hz, pose_hz, map_hz, query_hz, n_beams, beam_max, n_dirty, map_bytes,
     process_bytes) = checked(data, STATUS_FINGERPRINT, STATUS_HEAD)
    counts = struct.unpack_from(f">{N_COUNTS}q", data, STATUS_HEAD.size)
    return {"stamp_us": stamp_us, "sequence": sequence, "state": STATES[state],
            "version": version, "map_format": map_format, "frame_epoch": epoch,
            "uptime_s": uptime_us / 1e6, "scan_stamp_us": scan_stamp_us, "scan_lag_s": lag_us / 1e6,
            "scan_lag_max_s": lag_max_us / 1e6, "scan_hz": scan_hz, "pose_hz": pose_hz,
            "map_hz": map_hz, "query_hz": query_hz, "n_beams": n_beams, "beam_max": beam_max,
            "n_cells_dirty": n_dirty, "map_bytes": map_bytes, "process_bytes": process_bytes,
            "counts": {name: counts[place] for place, name in COUNTS.items()},
            "problems": [f"{name}: {text}" for bit, (name, text) in enumerate(PROBLEMS)
                         if counts[PROBLEMS_PLACE] >> bit & 1]}


# ---- the map, see lcmtypes/README.md -------------------------------------------------------------

class Map:
    """The map as received so far. `tile` is the newest tile, None before the first."""

    def __init__(self):
        self.tile = None
        self.n_tiles = self.n_changed = self.n_lost = self.n_bad = 0
        self.is_whole = False  # a whole keyframe came, and no tile was lost after it
        self.probability = self.variance_class = None
        self._n_in_a_row = 0

    def take(self, data):
        """Add a message of GPOM_MAP."""
        try:
            tile = Tile(data)
        except BadMessage:
            self.n_bad += 1
            return
        if self.tile is not None and tile.epoch < self.tile.epoch:
            return
        is_new = (self.tile is None or tile.epoch != self.tile.epoch
                  or tile.raster() != self.tile.raster())
        if is_new:
            shape = tile.map_ny, tile.map_nx
            self.probability = np.full(shape, PROBABILITY_UNKNOWN, np.uint8)
            self.variance_class = np.full(shape, 63 << 2 | CLASS_UNKNOWN, np.uint8)
            self.is_whole = False
        self._note_order(tile)
        rows, columns = tile.probability.shape
        place = np.s_[tile.iy0:tile.iy0 + rows, tile.ix0:tile.ix0 + columns]
        self.probability[place] = tile.probability
        self.variance_class[place] = tile.variance_class
        self.tile = tile
        self.n_tiles += 1
        self.n_changed += 0 if tile.keyframe else 1

    def _note_order(self, tile):
        last = self.tile
        if last is None:
            follows = tile.i_tile == 0
        elif last.i_tile + 1 < last.n_tiles:
            follows = (tile.sequence, tile.i_tile) == (last.sequence, last.i_tile + 1)
        else:
            follows = (tile.sequence, tile.i_tile) == ((last.sequence + 1) % 2**32, 0)
        if not follows:
            self.n_lost += last is not None
            self.is_whole = False
        in_a_row = follows or tile.i_tile == 0
        self._n_in_a_row = self._n_in_a_row + 1 if in_a_row and tile.i_tile > 0 else 1
        if tile.keyframe and tile.i_tile + 1 == tile.n_tiles:
            self.is_whole = self.is_whole or self._n_in_a_row == tile.n_tiles

    def classes(self):
        return self.variance_class & 3

    def extent(self):
        (x0, y0), cell_m = self.tile.corner_m, self.tile.cell_m
        return x0, x0 + cell_m * self.tile.map_nx, y0, y0 + cell_m * self.tile.map_ny

    def summary(self):
        counts = np.bincount(self.classes().ravel(), minlength=4)
        return {"utime": self.tile.stamp_us, "age_s": time.time() - self.tile.stamp_us / 1e6,
                "map_sequence": self.tile.sequence, "frame_epoch": self.tile.epoch,
                "pose": list(self.tile.pose), "cell_m": self.tile.cell_m,
                "corner_m": list(self.tile.corner_m), "nx": self.tile.map_nx,
                "ny": self.tile.map_ny, "tiles": self.n_tiles, "losses": self.n_lost,
                "bad": self.n_bad, "is_whole": self.is_whole,
                "cells": dict(zip(CLASSES, map(int, counts)))}


def check_route(url):
    """Raise one line if there is no route. liblcm would print a page."""
    place = urllib.parse.urlsplit(url)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((place.hostname or "239.255.76.67", place.port or 7667))
        except OSError as error:
            if error.errno == errno.ENETUNREACH:
                raise InputError("there is no route for multicast; to use LCM on this machine "
                                 "only, run as root: ip link set lo up && ip route add "
                                 "224.0.0.0/4 dev lo"
                                 ) from None
        except ValueError:
            pass  # liblcm says what is wrong with the URL


class Watch:
    """Subscribes to gpomd and keeps what it received."""

    def __init__(self, url, map_channel="GPOM_MAP", status_channel="GPOM_STATUS"):
        self.map, self.status = Map(), None
        check_route(url)
        try:
            self.bus = lcm.LCM(url)
        except RuntimeError:
            raise InputError(f"liblcm refuses {url}; its reason is above") from None
        self.bus.subscribe(map_channel, lambda _, data: self.map.take(data)).set_queue_capacity(0)
        self.bus.subscribe(status_channel, self._take_status)

    def _take_status(self, _, data):
        try:
            self.status = read_status(data)
        except BadMessage:
            pass

    def request_keyframe(self, channel="GPOM_MAP_REQUEST"):
        self.bus.publish(channel, b"keyframe")

    def collect(self, seconds, until=lambda: False):
        """Receive for some seconds, or until `until` returns true. True: it did in time."""
        end = time.monotonic() + seconds
        while not until() and (left := end - time.monotonic()) > 0:
            ready, _, _ = select.select([self.bus.fileno()], [], [], min(left, 0.1))
            if ready:
                self.bus.handle()
        return until()

    def collect_settled(self, seconds, quiet_s=2.0):
        """Receive until no cell is dirty and no tile changes. True: that was reached in time."""
        seen, since = self.map.n_changed, time.monotonic()

        def is_settled():
            nonlocal seen, since
            if self.map.n_changed != seen:
                seen, since = self.map.n_changed, time.monotonic()
            is_quiet = time.monotonic() - since > quiet_s
            return is_quiet and self.status is not None and self.status["n_cells_dirty"] == 0
        return self.collect(seconds, is_settled)


# ---- the same map by gpom-query -----------------------------------------------------------------

def codes_of(probability, variance, prior_variance):
    """Codes of cells from probability and variance in float32: 65535ths and 255ths as in
    gpom/lowres.h, then 254ths and 63rds as in lcmtypes/gpom_map_t.lcm."""
    probability = np.floor(65535.0 * probability.astype(np.float32).astype(float) + 0.5)
    variance = 255.0 * variance.astype(np.float32).astype(float) / prior_variance
    variance = np.minimum(np.ceil(variance), 255.0)
    return np.ceil(254.0 * probability / 65535.0), np.ceil(63.0 * variance / 255.0)


def differing_cells(collected, path):
    """Number of cells that differ from the answers of gpom-query --raster. Compares the variance
    of all cells, and probability and class of known cells. An unknown cell must not be occupied."""
    (probability, variance, named), extent = read_raster(path, "probability", "variance", "class")
    shape = collected.probability.shape
    if probability.shape != shape or not np.allclose(extent, collected.extent(), atol=1e-6):
        x0, _, y0, _ = collected.extent()
        raise InputError(f"{path}: another raster; run gpom-query with --raster "
                         f"{x0:.9g},{y0:.9g},{collected.tile.cell_m:.9g},{shape[1]},{shape[0]}")
    probability, variance = codes_of(probability, variance, collected.tile.prior_variance)
    classes = np.select([named == name for name in CLASSES], range(len(CLASSES)))
    is_known = collected.classes() != CLASS_UNKNOWN
    differs = variance != collected.variance_class >> 2
    differs |= is_known & (probability != collected.probability)
    differs |= np.where(is_known, classes != collected.classes(), classes == 2)
    return int(differs.sum())


def compare(collected, path):
    """Print whether the map agrees with a file of gpom-query. True: it does."""
    n_differ, n = differing_cells(collected, path), collected.probability.size
    n_known = int((collected.classes() != CLASS_UNKNOWN).sum())
    print(f"{n - n_differ} of {n} cells, {n_known} of them known, are those of {path} to the "
          f"message's rounding" + (f"; {n_differ} differ" if n_differ else ""))
    return n_differ == 0


# ---- the channels of the bus ---------------------------------------------------------------------

class Channels:
    """The channels of the bus: the last type of each, and how much comes on it."""

    def __init__(self, url):
        check_route(url)
        try:
            self.bus = lcm.LCM(url)
        except RuntimeError:
            raise InputError(f"liblcm refuses {url}; its reason is above") from None
        self.heard = {}  # fingerprint, messages, bytes
        self.bus.subscribe(".*", self._take).set_queue_capacity(0)

    def _take(self, channel, data):
        _, n_messages, n_bytes = self.heard.get(channel, (0, 0, 0))
        self.heard[channel] = int.from_bytes(data[:8], "big"), n_messages + 1, n_bytes + len(data)

    def collect(self, seconds):
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            ready, _, _ = select.select([self.bus.fileno()], [], [], left)
            if ready:
                self.bus.handle()

    def lines(self, seconds):
        width = max(map(len, [*self.heard, "channel"]))
        yield f"{'channel':{width}}  {'messages/s':>10}  {'bytes/s':>10}  type"
        for channel, (fingerprint, n_messages, n_bytes) in sorted(self.heard.items()):
            name = TYPES.get(fingerprint, f"not known, fingerprint 0x{fingerprint:016x}")
            yield (f"{channel:{width}}  {n_messages / seconds:10.1f}  {n_bytes / seconds:10.0f}  "
                   f"{name}")


def list_channels(url, seconds):
    channels = Channels(url)
    channels.collect(seconds)
    if not channels.heard:
        raise InputError(f"nothing came in {seconds:g} s: nobody sends on {url}, or a firewall "
                         "keeps it out")
    print("\n".join(channels.lines(seconds)))


# ---- pictures -----------------------------------------------------------------------------------

def draw(collected, path):
    """Draw the map as PNG: probability and class."""
    figure, (chance, decided) = plt.subplots(1, 2, figsize=(17, 7), sharex=True, sharey=True,
                                             layout="constrained")
    codes = collected.probability.astype(float)
    known = np.where(codes == PROBABILITY_UNKNOWN, np.nan, codes / 254)
    for axes in chance, decided:
        axes.set(aspect="equal", xlabel="x [m]")
        axes.set_facecolor("#c8d8f0")
    show_probability(chance, known, collected.extent())
    chance.set(title="Probability of occupancy; blue: unknown", ylabel="y [m]")
    colours = ListedColormap(["white", "0.6", "black", "#c8d8f0"])
    classes = show(decided, collected.classes(), collected.extent(), cmap=colours,
                   norm=BoundaryNorm([-0.5, 0.5, 1.5, 2.5, 3.5], 4))
    colour_bar(decided, classes, "class", ticks=range(4), format=lambda i, _: CLASSES[int(i)])
    decided.set_title(f"Classes, {collected.tile.map_nx} x {collected.tile.map_ny} cells of "
                      f"{collected.tile.cell_m:.2g} m")
    for axes in chance, decided:
        axes.plot(*collected.tile.pose[:2], "o", color="red", markersize=5)
    path.parent.mkdir(parents=True, exist_ok=True)
    save({path: figure})
    plt.close(figure)


def terminal_lines(collected, columns=100):
    """The map in characters. Each shows the worst class of the cells that it covers."""
    tile, step = collected.tile, max(1, -(-collected.tile.map_nx // columns))
    severity = np.array([1, 2, 3, 0])[collected.classes()]  # unknown is lowest, occupied highest
    lines = []
    for iy in range(0, tile.map_ny, 2 * step):  # a character is twice as high as it is wide
        rows = severity[iy:iy + 2 * step]
        starts = range(0, tile.map_nx, step)
        lines.append([" .+#"[rows[:, ix:ix + step].max()] for ix in starts])
    x, y = ((tile.pose[k] - tile.corner_m[k]) / tile.cell_m for k in (0, 1))
    if 0 <= x < tile.map_nx and 0 <= y < tile.map_ny:
        lines[int(y) // (2 * step)][int(x) // step] = "R"
    return ["".join(line) for line in reversed(lines)]


# ---- command line -------------------------------------------------------------------------------

def watch_live(watch, seconds):
    watch.request_keyframe()
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        watch.collect(min(1.0, left))
        if watch.map.tile is None:
            counts = watch.status and watch.status["counts"]
            print("gpom-watch: nothing on GPOM_MAP yet; " + (
                "is gpomd running?" if counts is None else
                f"gpomd received {counts['scans_received']} scans and {counts['poses_received']} "
                "poses; see --status"), *(watch.status["problems"] if watch.status else []),
                  sep="\n", flush=True)
            continue
        summary = watch.map.summary()
        home = "\033[H\033[J" if sys.stdout.isatty() else ""
        print(home + "\n".join(terminal_lines(watch.map)))
        print(f"age {summary['age_s']:.2f} s, {summary['losses']} losses, "
              f"{'whole' if summary['is_whole'] else 'waiting for a keyframe'}",
              *(watch.status["problems"] if watch.status else []), sep="\n", flush=True)


def run(arguments):
    """Run with these options. False: --compare found a difference."""
    seconds = arguments.seconds
    if arguments.channels:
        list_channels(arguments.url, seconds or 5)
        return True
    watch = Watch(arguments.url)
    if arguments.status:
        if not watch.collect(seconds or 5, lambda: watch.status is not None):
            raise InputError("no GPOM_STATUS came: gpomd is not running, or on another network")
        print(json.dumps(watch.status, indent=1))
        return True
    if not arguments.out and not arguments.json and not arguments.compare:
        watch_live(watch, seconds or float("inf"))
        return True
    if arguments.settled and not watch.collect_settled(seconds or 60):
        raise InputError("the map did not settle in time; is gpomd running, do scans still come?")
    watch.request_keyframe()
    if arguments.settled:
        seconds = None
    watch.collect(seconds or 30, (lambda: False) if seconds else (lambda: watch.map.is_whole))
    if watch.map.tile is None:
        raise InputError("no GPOM_MAP came: gpomd is not running, gets no scans (see --status), "
                         "or is on another network")
    if arguments.out:
        draw(watch.map, arguments.out)
        print(arguments.out)
    if arguments.json:
        print(json.dumps(watch.map.summary(), indent=1))
    return not arguments.compare or compare(watch.map, arguments.compare)


def main():
    parser = OneLineParser(prog="gpom-watch", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--url", default=URL, help="LCM's network (default: %(default)s)")
    parser.add_argument("--out", metavar="PNG", type=pathlib.Path,
                        help="draw the map when it is whole, or what came in --seconds")
    parser.add_argument("--json", action="store_true", help="print a summary of the map as JSON")
    parser.add_argument("--compare", metavar="CSV", type=pathlib.Path,
                        help="compare the codes with the map that gpom-query --raster wrote")
    parser.add_argument("--status", action="store_true", help="print the next status as JSON")
    parser.add_argument("--channels", action="store_true", help="list the channels of the bus, "
                        "with their types by fingerprint and how much comes on them")
    parser.add_argument("--settled", action="store_true",
                        help="first wait until no scan comes and nothing changes any more")
    parser.add_argument("--seconds", metavar="S", type=float, help="time to watch")
    arguments = parser.parse_args()
    try:
        return 0 if run(arguments) else EXIT_DIFFERS
    except (InputError, OSError) as error:
        print(f"gpom-watch: {error}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        return 0


if __name__ == "__main__":
    sys.exit(main())

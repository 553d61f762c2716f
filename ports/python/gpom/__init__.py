"""Gaussian-process occupancy maps of laser scans: the library and its tools in Python.

    import gpom
    scans = gpom.io.read("drive.bag").scans
    map = gpom.map_of(scans, gpom.preset("indoor"))
    print(map.query([[1.0, 2.0]])["probability"])

Lengths are in metres, angles in radians, times in microseconds. Errors of the library are
gpom.Error, those of files gpom.FileError: one line that says what is wrong and what to do.
"""
from . import io
from ._core import (ANSWER, CELL, LANES, VERSION as __version__, Error, FileError, Params, Sensor)
from .grid import FREE, OCCUPIED, UNKNOWN, UNSURE, Grid
from .learning import evaluate, learn
from .maps import Map, map_of
from .presets import preset, preset_names
from .scan import Scan
from .simulator import Street, simulate_street

__all__ = ["ANSWER", "CELL", "FREE", "LANES", "OCCUPIED", "UNKNOWN", "UNSURE", "Error",
           "FileError", "Grid", "Map", "Params", "Scan", "Sensor", "Street", "evaluate", "io",
           "learn", "map_of", "preset", "preset_names", "simulate_street"]

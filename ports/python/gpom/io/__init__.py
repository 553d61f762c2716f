"""Recordings in, maps out.

    recording = gpom.io.read("drive.mcap")       # Recording: scans, notes, n_dropped
    gpom.io.write_nav2("map.yaml", map.grid(0.05))

read() knows ROS 1 and ROS 2 bags, MCAP, LCM event logs, CARMEN logs, CSV and NPZ by their content.
"""
from .contents import contents
from .files import read, read_grid, write_scans
from .maps import (write_map, write_mcap, write_nav2, write_npz, write_octomap, write_png)
from .recording import ReadOptions, Recording
from .snapshots import map_of_snapshot

__all__ = ["ReadOptions", "Recording", "contents", "map_of_snapshot", "read", "read_grid",
           "write_map", "write_mcap", "write_nav2", "write_npz", "write_octomap", "write_png",
           "write_scans"]

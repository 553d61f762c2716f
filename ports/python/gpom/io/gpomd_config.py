"""Sensors and poses from gpomd.toml, so that a log is read as the daemon read it."""
import tomllib

from .._core import Sensor
from .lcm import LcmSensor
from .recording import FileError

_DEFAULT_CHANNEL = {"gpom.scan_t": "GPOM_SCAN", "bot_core.planar_lidar_t": "LIDAR",
                    "mbot_lcm_msgs.lidar_t": "LIDAR"}


def apply_config(path, options):
    """Fill sensors, pose and gap_max_s of ReadOptions by a configuration of gpomd."""
    try:
        with open(path, "rb") as file:
            config = tomllib.load(file)
        tables = config["sensor"]
        options.sensors = dict(_sensor(table) for table in tables)
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise FileError(f"{path}: cannot be read: {error}") from None
    except (KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path}: [[sensor]]: {error}; gpomd --config {path} --check says what is "
                        "wrong") from None
    pose = config.get("pose", {})
    if options.pose is None:
        options.pose = pose.get("channel")
    options.gap_max_s = pose.get("gap_max_s", options.gap_max_s)


def _sensor(table):
    """((channel, sensor_id or None), LcmSensor)."""
    kind = table["type"]
    x_m, y_m, yaw_rad = table.get("mount", (0.0, 0.0, 0.0))
    sensor = Sensor(x_m, y_m, yaw_rad, range_min_m=table.get("range_min_m", 0.02),
                    range_max_m=table["range_max_m"],
                    range_var_m2=table.get("range_sd_m", 0.0) ** 2,
                    masks=[tuple(mask) for mask in table.get("masks", [])],
                    upside_down=table.get("upside_down", False),
                    zero_is_no_return=table.get("zero", "ignore") == "no_return",
                    too_near_is_no_return=table.get("too_near", "ignore") == "no_return")
    channel = table.get("channel", _DEFAULT_CHANNEL[kind])
    sensor_id = table.get("id", 0) if kind == "gpom.scan_t" else None
    return (channel, sensor_id), LcmSensor(sensor, int(round(1e6 * table.get("latency_s", 0.0))),
                                           table.get("no_return", "free") == "ignore")

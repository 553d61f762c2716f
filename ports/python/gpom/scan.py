"""A scan with its pose."""
import dataclasses
import math

import numpy as np

from ._core import Sensor


@dataclasses.dataclass(frozen=True, eq=False)
class Scan:
    """One scan, as gpom_scan_t or, with `bearings_rad` and `poses`, as gpom_sweep_t (gpom/scan.h).

    stamp_us        time of measurement [us]
    ranges_m        n ranges, float32 [m]; NaN: ignored, inf: no return
    angle_min_rad   bearing of the first range, sensor frame [rad]
    angle_step_rad  bearing step, negative if clockwise [rad]
    pose            robot in the map frame: x [m], y [m], yaw [rad]
    sensor          the sensor and its place on the robot
    cov             3 x 3 covariance of the pose, float32 [m2, m rad, rad2]; None: exact
    bearings_rad    n bearings, float32 [rad], where they are not evenly spaced; else None
    poses           n x 3 poses of the robot, one a beam; needed with bearings_rad
    """
    stamp_us: int
    ranges_m: np.ndarray
    angle_min_rad: float
    angle_step_rad: float
    pose: tuple
    sensor: Sensor = dataclasses.field(default_factory=Sensor)
    cov: np.ndarray | None = None
    bearings_rad: np.ndarray | None = None
    poses: np.ndarray | None = None

    @property
    def is_sweep(self):
        """True if each beam has a bearing and a pose of its own."""
        return self.bearings_rad is not None

    def usable_ranges(self):
        """Ranges with the sensor's rules applied: NaN where ignored, inf where no return [m]."""
        sensor = self.sensor
        ranges_m = np.array(self.ranges_m, np.float32)
        is_zero = ranges_m == 0
        is_near = (ranges_m > 0) & (ranges_m < np.float32(sensor.range_min_m))
        ranges_m[(ranges_m < 0) | is_zero | is_near] = np.nan
        if sensor.zero_is_no_return:
            ranges_m[is_zero] = np.inf
        if sensor.too_near_is_no_return:
            ranges_m[is_near] = np.inf
        for from_rad, to_rad in sensor.masks:
            turn = 2.0 * math.pi
            inside = np.mod(self.bearings() - from_rad, turn) <= np.mod(to_rad - from_rad, turn)
            ranges_m[inside] = np.nan
        return ranges_m

    def bearings(self):
        """n bearings in the sensor frame [rad]."""
        if self.is_sweep:
            return np.asarray(self.bearings_rad, np.float64)
        return self.angle_min_rad + self.angle_step_rad * np.arange(len(self.ranges_m))

    def laser_tuple(self):
        """The scan as the tools take it: time [s], pose of the laser, angles, usable maximum,
        ranges. A sweep becomes the nearest scan of evenly spaced beams at the laser's pose at
        stamp_us; that is an approximation."""
        sensor = self.sensor
        x_m, y_m, yaw_rad = laser_pose(self.pose, sensor)
        sign = -1.0 if sensor.upside_down else 1.0
        angle_min_rad, angle_step_rad = sign * self.angle_min_rad, sign * self.angle_step_rad
        ranges_m = self.usable_ranges()
        if self.is_sweep:
            angle_min_rad, angle_step_rad, ranges_m = self._even_fan((x_m, y_m, yaw_rad), ranges_m)
        return (1e-6 * self.stamp_us, x_m, y_m, yaw_rad, angle_min_rad, angle_step_rad,
                float(sensor.range_max_m), ranges_m)

    def _even_fan(self, laser, ranges_m):
        """(angle_min, angle_step, ranges) of a sweep, seen from one pose of the laser."""
        n = len(ranges_m)
        if n < 2:
            return 0.0, 0.0, np.full(n, np.nan, np.float32)
        lasers = np.array([laser_pose(pose, self.sensor) for pose in self.poses])
        angle_rad = lasers[:, 2] + (-1.0 if self.sensor.upside_down else 1.0) * self.bearings()
        has_return = ranges_m < np.float32(self.sensor.range_max_m)
        reach_m = np.where(has_return, ranges_m, self.sensor.range_max_m)
        dx_m = lasers[:, 0] + reach_m * np.cos(angle_rad) - laser[0]
        dy_m = lasers[:, 1] + reach_m * np.sin(angle_rad) - laser[1]
        bearing_rad = np.unwrap(np.arctan2(dy_m, dx_m) - laser[2])
        low_rad = bearing_rad.min()
        step_rad = max((bearing_rad.max() - low_rad) / (n - 1), 1e-9)
        slot = np.rint((bearing_rad - low_rad) / step_rad).astype(np.int64)
        seen_m = np.where(has_return, np.hypot(dx_m, dy_m), np.inf).astype(np.float32)
        fan_m = np.full(n, np.nan, np.float32)
        for i in np.flatnonzero(~np.isnan(ranges_m)):  # the nearest one, where two share a slot
            fan_m[slot[i]] = np.fmin(fan_m[slot[i]], seen_m[i])
        return low_rad, step_rad, fan_m


def laser_pose(pose, sensor):
    """(x, y, yaw) of the laser in the map frame for a pose of the robot [m, rad]."""
    x_m, y_m, yaw_rad = pose
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return (x_m + c * sensor.x_m - s * sensor.y_m, y_m + s * sensor.x_m + c * sensor.y_m,
            yaw_rad + sensor.yaw_rad)


def scan_of_tuple(row):
    """The inverse of Scan.laser_tuple(): the robot is where the laser is."""
    t_s, x_m, y_m, theta_rad, angle_min_rad, angle_step_rad, range_max_m, ranges_m = row
    sensor = Sensor(range_min_m=0.0, range_max_m=range_max_m)  # the reader has settled near ones
    stamp_us = int(math.copysign(math.floor(abs(t_s * 1e6) + 0.5), t_s))
    return Scan(stamp_us, ranges_m, angle_min_rad, angle_step_rad, (x_m, y_m, theta_rad), sensor)

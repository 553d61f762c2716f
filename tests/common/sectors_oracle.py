"""How far all is free about a pose, by brute force of the low-resolution map's cells: each cell is
cut with each sector.

Distances are in metres, angles in radians. OBSTACLE_DISTANCE is as MAVLink's common.xml says.
"""
import math
from typing import NamedTuple

FREE, UNKNOWN = 0, 3
NO_READING = 65535
FRAME_BODY_FRD = 12


class World(NamedTuple):
    """Cells by rows from the lower left, and how far to look."""
    classes: object
    corner_m: tuple
    cell_m: float
    range_m: float
    radius_m: float


def clipped(polygon, normal):
    """The part of a polygon where a point's product with the normal is at least 0."""
    part = []
    for a, b in zip(polygon, polygon[1:] + polygon[:1]):
        at_a, at_b = (p[0] * normal[0] + p[1] * normal[1] for p in (a, b))
        if at_a >= 0:
            part.append(a)
        if at_a * at_b < 0:
            t = at_a / (at_a - at_b)
            part.append((a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
    return part


def overlaps(low, side, bearing, width):
    """Whether a cell, whose lower left corner is there from the robot, reaches into a sector."""
    corners = [(low[0] + dx, low[1] + dy) for dx, dy in ((0, 0), (side, 0), (side, side),
                                                         (0, side))]
    right, left = bearing - width / 2, bearing + width / 2
    part = clipped(corners, (-math.sin(right), math.cos(right)))
    return bool(part) and bool(clipped(part, (math.sin(left), -math.cos(left))))


def blocking_cells(world, pose):
    """(distance, lower left corner from the robot, class), the nearest first, of cells that are not
    free, and of those beside the raster."""
    n_y, n_x = world.classes.shape
    side, found = world.cell_m, []
    for iy in range(-1, n_y + 1):
        for ix in range(-1, n_x + 1):
            inside = 0 <= ix < n_x and 0 <= iy < n_y
            cls = int(world.classes[iy, ix]) if inside else UNKNOWN
            low = (world.corner_m[0] + side * ix - pose[0], world.corner_m[1] + side * iy - pose[1])
            gap = math.hypot(*(max(at, -at - side, 0.0) for at in low))
            own = math.hypot(low[0] + side / 2, low[1] + side / 2) <= world.radius_m
            if cls != FREE and not own and gap < world.range_m:
                found.append((gap, low, cls))
    return sorted(found)


def allowed_distances(world, pose, n):
    """For each of n elements of OBSTACLE_DISTANCE, clockwise from forward, the set of values that
    it may have: two where the documented rounding of gpom_sectors() reaches over a centimetre."""
    cells = blocking_cells(world, pose)
    values = []
    for i in range(n):
        bearing, width = pose[2] - 2 * math.pi * i / n, 2 * math.pi / n
        least, kinds = None, set()
        for distance, low, cls in cells:
            if least is not None and distance > least:
                break
            if distance == 0.0 or overlaps(low, world.cell_m, bearing, width):
                least = distance
                kinds.add(cls)
        if least is None:
            values.append({round(100 * world.range_m) + 1})
        elif least < world.radius_m + 2 * world.cell_m and UNKNOWN in kinds:
            values.append({NO_READING})
        else:
            lowered = least - 1e-6 * (least + world.range_m)
            values.append({max(math.floor(100 * d), 1) for d in (least, lowered)})
    return values


def clockwise_from_forward(message, n):
    """The n values of a message in that order, by its own fields."""
    assert message.frame == FRAME_BODY_FRD and message.increment_f == 360 / n
    assert set(message.distances[n:]) <= {NO_READING}
    first = message.angle_offset / message.increment_f
    assert first == round(first) and message.increment == 360 // n
    return [message.distances[(i - round(first)) % n] for i in range(n)]

"""How autopilots read OBSTACLE_DISTANCE, written from what their sources do (docs/mavlink.md).

Angles are in degrees, clockwise from forward. Distances are in centimetres.
"""
import math

import numpy as np

NO_READING = 65535
FRAME_BODY_FRD = 12


def increment_of(message):
    return message.increment_f if message.increment_f > 0 else float(message.increment)


def px4_bins_of_36(message):
    """Older PX4: what each of its 36 sectors takes, which is one element. None: no data.
    Arithmetic in float32 as there."""
    assert message.frame == FRAME_BODY_FRD, "PX4 then turns the message by the vehicle's heading"
    factor = np.float32(1) / np.float32(increment_of(message))
    bins = []
    for i in range(36):
        angle = np.float32(10 * i) - np.float32(message.angle_offset)
        at = math.ceil(np.float32(angle % np.float32(360)) * factor)
        bins.append(None if message.distances[at] == NO_READING else message.distances[at])
    return bins


def px4_bins_of_72(message):
    """Newer PX4: each of its 72 sectors takes the last element that overlaps it."""
    assert message.frame == FRAME_BODY_FRD
    width = increment_of(message)
    bins = [None] * 72
    for i in range(72):
        low, high = lower_and_upper(i, 5.0, 0.0, 72)
        for j, distance in enumerate(message.distances[:math.ceil(360 / width)]):
            left, right = lower_and_upper(j, width, message.angle_offset, int(360 / width))
            overlaps = (low < left < high or low < right < high or left <= low and right >= high
                        or left >= low and right <= high)
            if overlaps and distance != NO_READING:
                bins[i] = distance
    return bins


def lower_and_upper(i, width, offset, n):
    lower, upper = ((k % n * width + offset - width / 2) % 360 for k in (i, i + 1))
    return (lower - 360 if lower > upper else lower), upper


def ardupilot_points(message):
    """(angle, distance) of each obstacle that ArduPilot takes into its database: all distances from
    the least to the greatest, but not 0."""
    increment = message.increment_f if message.increment_f != 0 else float(message.increment)
    assert increment != 0, "ArduPilot ignores the message"
    n = int(min(360 / abs(increment) + 0.5, len(message.distances)))
    return [((i * increment + message.angle_offset) % 360, d)
            for i, d in enumerate(message.distances[:n])
            if d not in (0, NO_READING) and message.min_distance <= d <= message.max_distance]


def ardupilot_faces(message):
    """The distance in each of ArduPilot's eight sectors, by which it stops. None: no obstacle. A
    sector's distance is the least of a run of elements; a later run of the same sector replaces
    it."""
    faces, face, least = [None] * 8, None, None
    for angle, distance in ardupilot_points(message):
        latest = int((angle + 22.5) % 360 / 45)
        if latest != face:
            if face is not None:
                faces[face] = least
            face, least = latest, distance
        least = min(least, distance)
    if face is not None:
        faces[face] = least
    return faces

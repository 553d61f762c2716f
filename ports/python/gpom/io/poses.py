"""Poses over time: a track that is interpolated, and a tree of frames."""
import bisect
import math

import numpy as np

TURN_RAD = 2.0 * math.pi


def yaw_of(w, x, y, z):
    """Yaw of a unit quaternion [rad]. The same operations as gpomd's, so that bits are the same."""
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def is_rotation(w, x, y, z):
    """True if a quaternion has unit length up to rounding."""
    return abs(w * w + x * x + y * y + z * z - 1.0) <= 0.02


class PoseTrack:
    """Poses in order of time. Those that are not newer than the newest one are left out, as gpomd
    does."""

    def __init__(self):
        self._stamps_us = []
        self._poses = []
        self.n_repeated = 0
        self._arrays = None

    def push(self, stamp_us, x_m, y_m, yaw_rad):
        """Add a pose."""
        if self._stamps_us and stamp_us <= self._stamps_us[-1]:
            self.n_repeated += 1
            return
        self._stamps_us.append(stamp_us)
        self._poses.append((x_m, y_m, yaw_rad))
        self._arrays = None

    def __len__(self):
        return len(self._stamps_us)

    def at(self, stamps_us, gap_max_us):
        """(poses, cause): n x 3 poses at n times, yaw the shorter way round, or None and why."""
        if not self._stamps_us:
            return None, "without any pose"
        if self._arrays is None:
            self._arrays = np.array(self._stamps_us, np.int64), np.array(self._poses, np.float64)
        known_us, poses = self._arrays
        wanted_us = np.atleast_1d(np.asarray(stamps_us, np.int64))
        if len(wanted_us) and wanted_us.max() > known_us[-1]:
            return None, "after the last pose"
        if len(wanted_us) and wanted_us.min() < known_us[0]:
            return None, "before the first pose"
        after = np.searchsorted(known_us, wanted_us)
        before = np.where(known_us[after] == wanted_us, after, after - 1)
        span_us = known_us[after] - known_us[before]
        if np.any(span_us > gap_max_us):
            return None, f"between poses more than {1e-6 * gap_max_us:g} s apart"
        part = ((wanted_us - known_us[before]) / np.maximum(span_us, 1))[:, None]
        step = poses[after] - poses[before]
        step[:, 2] -= TURN_RAD * np.rint(step[:, 2] / TURN_RAD)
        return np.where(span_us[:, None] == 0, poses[after], poses[before] + part * step), ""


def quaternion_product(p, q):
    """p q, both (w, x, y, z)."""
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    return (pw * qw - px * qx - py * qy - pz * qz, pw * qx + px * qw + py * qz - pz * qy,
            pw * qy - px * qz + py * qw + pz * qx, pw * qz + px * qy - py * qx + pz * qw)


def rotated(q, v):
    """A vector turned by a quaternion."""
    w, x, y, z = q
    turned = quaternion_product(quaternion_product(q, (0.0, *v)), (w, -x, -y, -z))
    return turned[1:]


def between(p, q, part):
    """Spherical interpolation of unit quaternions, the shorter way round."""
    dot = sum(a * b for a, b in zip(p, q))
    sign = -1.0 if dot < 0.0 else 1.0
    angle = math.acos(min(1.0, abs(dot)))
    if angle < 1e-9:
        return p
    a, b = math.sin((1.0 - part) * angle), sign * math.sin(part * angle)
    return tuple((a * u + b * v) / math.sin(angle) for u, v in zip(p, q))


class FrameTree:
    """Transforms of tf: each child frame has a parent and poses over time, or one for ever."""

    def __init__(self):
        self._edges = {}  # child -> [parent, stamps, transforms, is_static]

    def add(self, parent, child, stamp_us, transform, is_static):
        """transform: (translation [m], quaternion w, x, y, z), child's axes in the parent."""
        edge = self._edges.setdefault(child, [parent, [], [], is_static])
        edge[0] = parent
        if is_static:
            edge[1:3] = [stamp_us], [transform]
        elif not edge[1] or stamp_us > edge[1][-1]:
            edge[1].append(stamp_us)
            edge[2].append(transform)

    def frames(self):
        """All frames."""
        return set(self._edges) | {edge[0] for edge in self._edges.values()}

    def path(self, fixed, frame):
        """Child frames from `frame` up to `fixed`; None: there is no way."""
        path = []
        while frame != fixed:
            if frame not in self._edges or frame in path:
                return None
            path.append(frame)
            frame = self._edges[frame][0]
        return path

    def at(self, path, stamp_us, gap_max_us):
        """(transform, cause): from the end of a path to its fixed frame, or None and why."""
        total = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        for child in path:
            transform, cause = self._edge_at(child, stamp_us, gap_max_us)
            if transform is None:
                return None, cause
            position = rotated(transform[1], total[0])
            total = (tuple(a + b for a, b in zip(transform[0], position)),
                     quaternion_product(transform[1], total[1]))
        return total, ""

    def _edge_at(self, child, stamp_us, gap_max_us):
        _, stamps, transforms, is_static = self._edges[child]
        if is_static:
            return transforms[0], ""
        name = f"the transform of {child}"
        if stamp_us < stamps[0]:
            return None, f"before {name} begins"
        if stamp_us > stamps[-1]:
            return None, f"after {name} ends"
        i_after = bisect.bisect_left(stamps, stamp_us)
        if stamps[i_after] == stamp_us:
            return transforms[i_after], ""
        span_us = stamps[i_after] - stamps[i_after - 1]
        if span_us > gap_max_us:
            return None, f"in a gap of {name} of more than {1e-6 * gap_max_us:g} s"
        part = (stamp_us - stamps[i_after - 1]) / span_us
        (p0, q0), (p1, q1) = transforms[i_after - 1], transforms[i_after]
        return (tuple(a + part * (b - a) for a, b in zip(p0, p1)), between(q0, q1, part)), ""

"""Brute-force oracle of the occupancy map in double precision, to be read beside the paper.

O'Callaghan, Ramos, Durrant-Whyte (2009), "Contextual Occupancy Maps using Gaussian Processes";
equation numbers are the paper's.  Nothing here is taken from the library.  Arrays of points have
the shape (..., 2); a leading axis counts the queries that are answered together.
"""
import csv
import gzip
import math
import tomllib
from dataclasses import dataclass, fields

import numpy as np

KERNELS = ("nn", "matern12", "matern32", "se", "askey")
FRAMES = ("query", "map")
CLASSES = ("free", "unsure", "occupied")


@dataclass
class Params:
    """Hyperparameters, with the keys of the parameter files."""
    kernel: str = "matern12"
    sf2: float = 1.0
    s0: float = math.nan       # nn only: variance of the bias weight
    s1: float = math.nan       # nn only: variance of the position weights [1/m2]
    ell_m: float = math.nan    # the other kernels: length scale
    sn2: float = 0.1           # noise variance of hits
    sn2_free: float = math.nan  # noise variance of free points; default: sn2
    alpha: float = 1.0
    beta: float = 0.0
    hits: int = 8
    free: int = 8
    gap_m: float = 0.1
    p_occupied: float = 0.65
    p_free: float = 0.35
    frame: str = "query"

    def __post_init__(self):
        if math.isnan(self.sn2_free):
            self.sn2_free = self.sn2
        if self.kernel not in KERNELS or self.frame not in FRAMES:
            raise ValueError(f"unknown kernel {self.kernel!r} or frame {self.frame!r}")


def load_params(path):
    """Read a parameter file; every key must be known."""
    with open(path, "rb") as source:
        table = tomllib.load(source)
    unknown = set(table) - {field.name for field in fields(Params)}
    if unknown:
        raise ValueError(f"{path}: unknown keys {sorted(unknown)}")
    return Params(**table)


# ---- covariance ---------------------------------------------------------------------------------

def kernel(params, x, y):
    """k(x, y) for points of shape (..., 2), broadcast against each other."""
    if params.kernel == "nn":
        return params.sf2 * np.arcsin(nn_argument(params, x, y))
    r = np.sqrt(np.sum((x - y) ** 2, axis=-1))
    return params.sf2 * stationary_correlation(params, r)


def nn_argument(params, x, y):
    """The arcsine's argument in eq. 4, x~ = (1, x1, x2), Sigma = diag(s0, s1, s1)."""
    def form(a, b):  # 2 a~' Sigma b~
        return 2.0 * (params.s0 + params.s1 * np.sum(a * b, axis=-1))
    argument = form(x, y) / np.sqrt((1.0 + form(x, x)) * (1.0 + form(y, y)))
    return np.clip(argument, -1.0, 1.0)


def stationary_correlation(params, r):
    """Correlation over the distance r; Rasmussen and Williams (2006), chapter 4."""
    ratio = r / params.ell_m
    if params.kernel == "matern12":
        return np.exp(-ratio)
    if params.kernel == "matern32":
        s = math.sqrt(3.0) * ratio
        return (1.0 + s) * np.exp(-s)
    if params.kernel == "se":
        return np.exp(-0.5 * ratio**2)
    return np.where(ratio < 1.0, (1.0 - np.minimum(ratio, 1.0)) ** 3, 0.0)  # askey


def excess_noise(params, d_m, sn2):
    """Noise of a point whose position has the standard deviation d_m.

    rho is the correlation of f over d_m, along x from the origin; a label seen at an unsure place
    is y = f(x) + e with the noise sn2 + w (sn2 + k00), w = 1 / rho^2 - 1.
    """
    zero = np.zeros(2)
    moved = np.array([float(d_m), 0.0])
    k00 = float(kernel(params, zero, zero))
    rho = float(kernel(params, zero, moved)) / math.sqrt(k00 * float(kernel(params, moved, moved)))
    w = 1.0 / rho**2 - 1.0
    return sn2 + w * (sn2 + k00)


# ---- beams --------------------------------------------------------------------------------------

@dataclass
class Beams:
    """Kept beams in order of insertion: a beam's index is its id."""
    origin: np.ndarray     # (n, 2) [m], map frame
    direction: np.ndarray  # (n, 2) unit vectors
    free_m: np.ndarray     # (n,) length of the free segment
    hit: np.ndarray        # (n, 2) [m]; NaN where there was no return
    position_std_m: np.ndarray  # (n,) 0: known exactly


def read_rows(path):
    """Lines of numbers of a CSV file, plain or gzipped; lines from # on are skipped."""
    opened = gzip.open if str(path).endswith(".gz") else open
    with opened(path, "rt", encoding="utf-8", newline="") as source:
        rows = [row for row in csv.reader(source) if row and not row[0].startswith("#")]
    return [[float(cell) for cell in row] for row in rows]


def read_beams(path, params):
    """Beams of a scan file: rows t,x,y,theta,angle_min,angle_step,range_max,r0,r1,..."""
    return beams_from_scans(read_rows(path), params.gap_m)


def beams_from_scans(rows, gap_m):
    origin, direction, free_m, hit = [], [], [], []
    for _, x, y, theta, angle_min, angle_step, range_max, *ranges in rows:
        for i, r in enumerate(ranges):
            if math.isnan(r) or r <= 0.0:
                continue
            bearing = theta + angle_min + i * angle_step
            u = (math.cos(bearing), math.sin(bearing))
            returned = r < range_max
            origin.append((x, y))
            direction.append(u)
            free_m.append(max(0.0, r - gap_m) if returned else range_max)
            hit.append((x + r * u[0], y + r * u[1]) if returned else (math.nan, math.nan))
    n = len(free_m)
    return Beams(np.array(origin).reshape(n, 2), np.array(direction).reshape(n, 2),
                 np.array(free_m), np.array(hit).reshape(n, 2), np.zeros(n))


# ---- neighbourhood ------------------------------------------------------------------------------

@dataclass
class Neighbours:
    """The nearest points of each query, in the order (squared distance, id)."""
    point: np.ndarray  # (q, k, 2) [m], relative to the query
    index: np.ndarray  # (q, k) beam
    margin_m: np.ndarray  # (q,) how much farther the first point left out is than the last taken


def nearest(offset, index, k):
    """The k nearest of the candidates `offset` (q, n, 2) of the beams `index` (n,)."""
    d2 = np.sum(offset**2, axis=-1)
    order = np.argsort(d2, axis=1, kind="stable")  # stable: equal distances stay in order of id
    taken = order[:, :k]
    margin_m = np.full(len(d2), math.inf)
    if 0 < k < d2.shape[1]:
        edge = np.sqrt(np.take_along_axis(d2, order[:, k - 1:k + 1], axis=1))
        margin_m = edge[:, 1] - edge[:, 0]
    return Neighbours(np.take_along_axis(offset, taken[:, :, None], axis=1), index[taken], margin_m)


def nearest_hits(beams, query, k):
    index = np.flatnonzero(~np.isnan(beams.hit[:, 0]))
    return nearest(beams.hit[index][None] - query[:, None], index, k)


def nearest_free(beams, query, k):
    """Eq. 10: each beam's closest point to the query on its free segment."""
    from_origin = query[:, None] - beams.origin[None]
    along = np.sum(from_origin * beams.direction[None], axis=-1)
    along = np.clip(along, 0.0, beams.free_m[None])
    offset = along[:, :, None] * beams.direction[None] - from_origin
    return nearest(offset, np.arange(len(beams.free_m)), k)


# ---- Gaussian process ---------------------------------------------------------------------------

def local_gp(params, x, labels, noises, query):
    """Mean and variance at the query, eqs. 2 and 3, with a noise variance for every point.

    x (..., n, 2), labels (..., n), noises (..., n), query (..., 2), all in one frame.
    """
    kss = kernel(params, query, query)
    if x.shape[-2] == 0:
        return np.zeros_like(kss), kss
    gram = kernel(params, x[..., :, None, :], x[..., None, :, :])
    gram = gram + noises[..., :, None] * np.eye(x.shape[-2])
    ks = kernel(params, query[..., None, :], x)
    solved = np.linalg.solve(gram, np.stack([labels, ks], axis=-1))  # (K + N)^-1 (y, k*)
    mean = np.sum(ks * solved[..., 0], axis=-1)
    variance = kss - np.sum(ks * solved[..., 1], axis=-1)
    return mean, variance


def normal_cdf(z):
    """Phi(z), accurate in both tails."""
    return 0.5 * np.vectorize(math.erfc, otypes=[float])(-np.asarray(z, float) / math.sqrt(2.0))


def probability(params, mean, variance):
    """Eq. 7 with its square root (Rasmussen and Williams, section 6.5), for y = +1."""
    return normal_cdf((params.alpha * mean + params.beta)
                      / np.sqrt(1.0 + params.alpha**2 * variance))


def classify(params, p):
    """0 free, 1 unsure, 2 occupied: index into CLASSES."""
    return np.where(p >= params.p_occupied, 2, np.where(p <= params.p_free, 0, 1))


# ---- the whole map ------------------------------------------------------------------------------

@dataclass
class Answers:
    mean: np.ndarray
    variance: np.ndarray
    probability: np.ndarray
    cls: np.ndarray
    margin_m: np.ndarray  # how far from a tie the choice of the neighbours was


def point_noises(params, beams, index, sn2):
    """Noise of the points of the beams `index`; the same for all exactly known beams."""
    noise = np.array([sn2 if d == 0.0 else excess_noise(params, d, sn2)
                      for d in beams.position_std_m])
    return noise[index] if len(noise) else np.zeros(index.shape)


def query_block(params, beams, query, origin):
    hits = nearest_hits(beams, query, params.hits)
    free = nearest_free(beams, query, params.free)
    x = np.concatenate([hits.point, free.point], axis=1)
    labels = np.concatenate([np.ones(hits.index.shape), -np.ones(free.index.shape)], axis=1)
    noises = np.concatenate([point_noises(params, beams, hits.index, params.sn2),
                             point_noises(params, beams, free.index, params.sn2_free)], axis=1)
    # The neural network covariance is not stationary: the frame decides where its origin lies.
    at = np.zeros_like(query) if params.frame == "query" else query - origin
    mean, variance = local_gp(params, x + at[:, None], labels, noises, at)
    return mean, variance, np.minimum(hits.margin_m, free.margin_m)


def query_map(params, beams, query, origin=(0.0, 0.0), block=500):
    """Answers at the points `query` (q, 2), map frame; `origin` is the map's."""
    query = np.asarray(query, float).reshape(-1, 2)
    parts = [query_block(params, beams, query[i:i + block], np.asarray(origin, float))
             for i in range(0, max(len(query), 1), block)]
    mean, variance, margin_m = (np.concatenate(column) for column in zip(*parts))
    p = probability(params, mean, variance)
    return Answers(mean, variance, p, classify(params, p), margin_m)

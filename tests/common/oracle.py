"""Brute-force oracle of the occupancy map in double precision, to be read beside the paper.

O'Callaghan, Ramos, Durrant-Whyte (2009), "Contextual Occupancy Maps using Gaussian Processes";
equation numbers are the paper's.  Nothing here is taken from the library.  Arrays of points have
the shape (..., 2); a leading axis counts the queries that are answered together.

Beyond the paper, each switched off by its neutral value: an occupied depth behind the hits, a cap
on the points of one scan, anisotropy along the hits' main axis, in the argument of eq. 7 a vote of
the beams' directions and the logarithms of four distances, neighbours that fade with their
distance, and a fading to the prior.
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
FAR_M = 30.0        # distances of eq. 7's additions count no farther; the vote fades to 0 there
LOG_OFFSET_M = 0.02  # keeps the logarithm of a distance finite
FACING_SOFT_M = 0.02  # where neighbours fade, the cosine of the vote turns over such a way
WEIGHT_MIN = 1e-6   # of a neighbour that has faded


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
    depth_m: float = 0.0       # a hit's occupied part reaches so far beyond it along the beam
    scan_points_max: int = 0   # of each kind at most so many points of one scan; 0: no cap
    anisotropy: float = 0.0    # 0: none .. 1: the hits' scatter becomes round
    vote: float = 0.0          # weight of the vote of the hits' beam directions in eq. 7
    line: float = 0.0          # weight in eq. 7 of the side of the hits' line that the query is on
    log_hit_first: float = 0.0  # weights in eq. 7 of the logarithms of the distances to the first
    log_hit_last: float = 0.0   # and the last chosen hit
    log_free_first: float = 0.0
    log_free_last: float = 0.0
    fade_m: float = 0.0        # so far from the nearest chosen point the answer is the prior
    beta_far: float = 0.0      # added to beta as far as the neighbours faded by fade_m
    fading: int = 0            # of each kind the last so many neighbours fade; 0: none
    sn2_once: float = 0.0      # of live maps alone: here every beam is kept

    def __post_init__(self):
        if math.isnan(self.sn2_free):
            self.sn2_free = self.sn2
        if self.kernel not in KERNELS or self.frame not in FRAMES:
            raise ValueError(f"unknown kernel {self.kernel!r} or frame {self.frame!r}")
        if (self.anisotropy > 0.0 or self.fade_m > 0.0) and self.frame != "query":
            raise ValueError("anisotropy and fade_m need frame = \"query\"")


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
    scan: np.ndarray       # (n,) which scan of the file the beam belongs to


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
    origin, direction, free_m, hit, scan = [], [], [], [], []
    for i_scan, (_, x, y, theta, angle_min, angle_step, range_max, *ranges) in enumerate(rows):
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
            scan.append(i_scan)
    n = len(free_m)
    return Beams(np.array(origin).reshape(n, 2), np.array(direction).reshape(n, 2),
                 np.array(free_m), np.array(hit).reshape(n, 2), np.zeros(n),
                 np.array(scan, int))


# ---- neighbourhood ------------------------------------------------------------------------------

@dataclass
class Neighbours:
    """The points chosen for each query, in the order (squared distance, id)."""
    point: np.ndarray  # (q, k, 2) [m], relative to the query
    index: np.ndarray  # (q, k) beam
    present: np.ndarray  # (q, k) False in the last columns of a query that has fewer than k points
    weight: np.ndarray  # (q, k) 1, or what is left of a neighbour that fades
    margin_m: np.ndarray  # (q,) by how much the choice was clear; inf: only exact ties, or no rival

    def distance_m(self):
        return np.sqrt(np.sum(self.point**2, axis=-1))


@dataclass
class Cap:
    """At most `most` points of one scan; `scan` (n,) is that of every beam."""
    scan: np.ndarray
    most: int


def nearest(offset, index, k, cap=None, fading=0):
    """The k nearest of the candidates `offset` (q, n, 2) of the beams `index` (n,)."""
    d2 = np.sum(offset**2, axis=-1)
    order = np.argsort(d2, axis=1, kind="stable")  # stable: equal distances stay in order of id
    if cap is None:
        taken = order[:, :k]
        present = np.ones(taken.shape, bool)
        weight = pool_weights(d2, order[:, :k + 1], k, fading)[:, :k]
        margin_m = pool_end_gap(d2, order, k)
    else:
        pool = order[:, :max(k + k // 2, k + (fading > 0))]
        chosen = pick_capped(cap.scan[index[pool]], k, cap.most)
        # Chosen items come first, still in order.
        first = np.argsort(~chosen, axis=1, kind="stable")[:, :k]
        taken = np.take_along_axis(order, first, axis=1)
        present = np.take_along_axis(chosen, first, axis=1)
        weight = pool_weights(d2, pool, k, fading, cap.scan[index[pool]], cap.most)
        weight = np.take_along_axis(weight, first, axis=1)
        margin_m = capped_margin(d2, order, chosen, k, Cap(cap.scan[index], cap.most))
    return Neighbours(np.take_along_axis(offset, taken[:, :, None], axis=1), index[taken], present,
                      weight, margin_m)


def fading_weight(d_m, from_m, end_m):
    """1 up to from_m, 1 - t^2 beyond, t rising from 0 to 1 at end_m; 1 if all is equally far."""
    beyond = (d_m > from_m) & (end_m > from_m)
    t = np.divide(d_m - from_m, end_m - from_m, out=np.zeros(beyond.shape), where=beyond)
    return np.maximum(1.0 - t**2, WEIGHT_MIN)


def pool_weights(d2, pool, k, fading, scan=None, most=0):
    """Weights (q, m) of a pool in order, of which at most k are chosen, at most `most` of a scan.

    They fade from the last that does not to the first that would be chosen besides, or to the
    pool's end; of a scan at its cap the last one fades to the first beyond the cap, too.
    """
    if fading == 0 or pool.shape[1] < k + 1:
        return np.ones(pool.shape)
    d_m = np.sqrt(np.take_along_axis(d2, pool, axis=1))
    from_m, end_m = d_m[:, k - fading - 1:k - fading], d_m[:, -1:]
    weight = np.ones(d_m.shape)
    if scan is not None:
        same = scan[:, :, None] == scan[:, None, :]
        rank = np.sum(np.tril(same, -1), axis=2)  # how many of the scan are nearer

        def of_rank(r):  # (q, m): distance of the point with this rank in each one's scan
            return np.min(np.where(same & (rank[:, None, :] == r), d_m[:, None, :], end_m[:, None]),
                          axis=2)
        before_m = of_rank(most - 2) if most > 1 else np.zeros(d_m.shape)
        weight = np.where(rank == most - 1, fading_weight(d_m, before_m, of_rank(most)), 1.0)
        next_m = np.sort(np.where(rank < most, d_m, end_m), axis=1)[:, k:k + 1]
        end_m = np.minimum(end_m, next_m)
    return weight * fading_weight(d_m, from_m, end_m)


def pick_capped(scan, k, most):
    """Which items of a pool (q, m) in order are chosen: k at most, and `most` of one scan."""
    chosen = np.zeros(scan.shape, bool)
    for i in range(scan.shape[1]):
        before = chosen[:, :i]
        of_this_scan = np.sum(before & (scan[:, :i] == scan[:, i:i + 1]), axis=1)
        chosen[:, i] = (of_this_scan < most) & (before.sum(axis=1) < k)
    return chosen


def unless_tied(gap_m):
    """The gap, or inf for an exact tie: the id decides that, whatever the precision."""
    return np.where(gap_m == 0.0, math.inf, gap_m)


def pool_end_gap(d2, order, k):
    """How much farther the first item left out is than the last one taken."""
    if not 0 < k < d2.shape[1]:
        return np.full(len(d2), math.inf)
    edge = np.sqrt(np.take_along_axis(d2, order[:, k - 1:k + 1], axis=1))
    return unless_tied(edge[:, 1] - edge[:, 0])


def capped_margin(d2, order, chosen, k, cap):
    """The least gap between an item not chosen and the one whose place it would take if nearer.

    An item of a scan that has its share competes with that scan's last chosen item, another one
    with the last chosen of all when k were found.  An item beyond the pool also competes with the
    pool's last item, if one of the two would count, and the first of them with the last chosen
    one, which it can push out of the pool.
    """
    n_pool = chosen.shape[1]
    d_m = np.sqrt(np.take_along_axis(d2, order, axis=1))
    scan, pool_m = cap.scan[order], d_m[:, :n_pool]
    last_m = np.max(pool_m, axis=1, initial=-math.inf, where=chosen)
    complete = chosen.sum(axis=1) == k
    margin_m = np.full(len(d2), math.inf)
    if d_m.shape[1] > n_pool:
        margin_m = unless_tied(d_m[:, n_pool] - last_m)
    for i in range(d_m.shape[1]):
        own = chosen & (scan[:, :n_pool] == scan[:, i:i + 1])
        own_m = np.max(pool_m, axis=1, initial=-math.inf, where=own)
        full = own.sum(axis=1) >= cap.most
        rival_m = np.where(full, own_m, np.where(complete, last_m, -math.inf))
        if i >= n_pool:
            beside = chosen[:, -1] | (~full & ~complete)
            rival_m = np.maximum(rival_m, np.where(beside, pool_m[:, -1], -math.inf))
        left_out = ~chosen[:, i] if i < n_pool else True
        gap_m = unless_tied(d_m[:, i] - rival_m)
        margin_m = np.where(left_out, np.minimum(margin_m, gap_m), margin_m)
    return margin_m


def scan_cap(params, beams):
    return Cap(beams.scan, params.scan_points_max) if params.scan_points_max > 0 else None


def nearest_hits(beams, query, k, depth_m=0.0, cap=None, fading=0):
    """Each hit's closest point to the query on its occupied part, a segment of length depth_m."""
    index = np.flatnonzero(~np.isnan(beams.hit[:, 0]))
    offset = beams.hit[index][None] - query[:, None]
    along = np.clip(np.sum(-offset * beams.direction[index][None], axis=-1), 0.0, depth_m)
    return nearest(offset + along[:, :, None] * beams.direction[index][None], index, k, cap,
                   fading)


def nearest_free(beams, query, k, cap=None, fading=0):
    """Eq. 10: each beam's closest point to the query on its free segment."""
    from_origin = query[:, None] - beams.origin[None]
    along = np.sum(from_origin * beams.direction[None], axis=-1)
    along = np.clip(along, 0.0, beams.free_m[None])
    offset = along[:, :, None] * beams.direction[None] - from_origin
    return nearest(offset, np.arange(len(beams.free_m)), k, cap, fading)


def shrink(x, axis, factor):
    """Points (q, k, 2), their coordinate along the unit vectors (q, 2) times the factor (q,)."""
    along = np.sum(x * axis[:, None], axis=-1)
    return x - ((1.0 - factor)[:, None] * along)[:, :, None] * axis[:, None]


def hits_axis(hits):
    """Mean (q, 2) and main axis (q, 2) of the chosen hits' scatter, near ones counting most, and
    the scatter's width as a share of its length (q,), 1 without an axis."""
    x = hits.point
    weight = np.where(hits.present, hits.weight / (0.01 + np.sum(x**2, axis=-1)), 0.0)
    total = weight.sum(axis=1)
    weight = weight / np.where(total > 0.0, total, 1.0)[:, None]
    mean = np.sum(weight[:, :, None] * x, axis=1)
    centred = x - mean[:, None]
    scatter = np.einsum("qk,qki,qkj->qij", weight, centred, centred)
    lam, vector = np.linalg.eigh(scatter)  # eigenvalues ascend
    lam2, lam1 = np.maximum(lam[:, 0], 0.0), lam[:, 1]
    shaped = (lam1 > 1e-12) & (hits.present.sum(axis=1) >= 2)
    ratio = np.sqrt(np.divide(lam2, lam1, out=np.ones_like(lam1), where=shaped))
    return mean, vector[:, :, 1], ratio


# ---- Gaussian process ---------------------------------------------------------------------------

def local_gp(params, x, labels, noises, query):
    """Mean and variance at the query, eqs. 2 and 3, with a noise variance for every point.

    x (..., n, 2), labels (..., n), noises (..., n), query (..., 2), all in one frame.  A point of
    infinite noise says nothing: it is left out.
    """
    kss = kernel(params, query, query)
    if x.shape[-2] == 0:
        return np.zeros_like(kss), kss
    counts = np.isfinite(noises)
    gram = kernel(params, x[..., :, None, :], x[..., None, :, :])
    gram = gram * (counts[..., :, None] & counts[..., None, :])
    gram = gram + np.where(counts, noises, 1.0)[..., :, None] * np.eye(x.shape[-2])
    ks = kernel(params, query[..., None, :], x) * counts
    solved = np.linalg.solve(gram, np.stack([labels, ks], axis=-1))  # (K + N)^-1 (y, k*)
    mean = np.sum(ks * solved[..., 0], axis=-1)
    variance = kss - np.sum(ks * solved[..., 1], axis=-1)
    return mean, variance


def normal_cdf(z):
    """Phi(z), accurate in both tails."""
    return 0.5 * np.vectorize(math.erfc, otypes=[float])(-np.asarray(z, float) / math.sqrt(2.0))


def probability(params, mean, variance, evidence=0.0):
    """Eq. 7 with its square root (Rasmussen and Williams, section 6.5), for y = +1.

    evidence: what the vote and the distances add to the argument's numerator.
    """
    return normal_cdf((params.alpha * mean + params.beta + evidence)
                      / np.sqrt(1.0 + params.alpha**2 * variance))


def direction_vote(beams, hits, softness_m=0.0):
    """-1 .. 1: do the beams of the chosen hits point at the query (it lies behind) or away from it?

    The mean cosine, fading to 0 where the first hit is 30 m away. At a hit it turns over
    softness_m.
    """
    d_m = np.hypot(hits.distance_m(), softness_m)
    toward = -np.sum(beams.direction[hits.index] * hits.point, axis=-1)
    counts = hits.present & (d_m >= 1e-6)
    cosine = np.divide(toward, d_m, out=np.zeros_like(d_m), where=counts)
    weight = hits.weight * hits.present
    total = np.maximum(weight.sum(axis=1), 1.0)
    fade = np.maximum(0.0, 1.0 - chosen_distance(hits, 0) / FAR_M)
    return np.sum(weight * cosine, axis=1) / total * fade


def line_vote(beams, hits):
    """-1 .. 1: is the query behind the line through the chosen hits (1), or before it?

    The line's normal looks along the hits' beams; their mean direction, the narrowness of the hits
    and the distance from the line, against 5 cm, say how much it counts. Fades as the vote does.
    """
    mean, axis, ratio = hits_axis(hits)
    normal = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
    weight = hits.weight * hits.present
    total = np.maximum(weight.sum(axis=1), 1.0)
    directions = np.sum(weight[:, :, None] * beams.direction[hits.index], axis=1)
    facing = np.sum(normal * directions / total[:, None], axis=1)
    behind_m = -np.sum(normal * mean, axis=1)
    fade = np.maximum(0.0, 1.0 - chosen_distance(hits, 0) / FAR_M)
    return fade * (1.0 - ratio) * facing * behind_m / np.hypot(behind_m, 0.05)


def chosen_distance(neighbours, i):
    """Distance (q,) to the i-th chosen point, 30 m if there is none or it is farther."""
    if not 0 <= i < neighbours.present.shape[1]:
        return np.full(len(neighbours.present), FAR_M)
    d_m = np.minimum(neighbours.distance_m()[:, i], FAR_M)
    return np.where(neighbours.present[:, i], d_m, FAR_M)


def log_distance(d_m):
    return np.log(d_m + LOG_OFFSET_M)


def evidence_of(params, beams, hits, free):
    """The additions to the numerator of eq. 7, from distances before any shrinking."""
    softness_m = FACING_SOFT_M if params.fading > 0 else 0.0
    return (params.vote * direction_vote(beams, hits, softness_m)
            + params.line * line_vote(beams, hits)
            + params.log_hit_first * log_distance(chosen_distance(hits, 0))
            + params.log_hit_last * log_distance(chosen_distance(hits, params.hits - 1))
            + params.log_free_first * log_distance(chosen_distance(free, 0))
            + params.log_free_last * log_distance(chosen_distance(free, params.free - 1)))


def prior_evidence(params):
    """evidence_of() far from all beams."""
    weights = (params.log_hit_first + params.log_hit_last
               + params.log_free_first + params.log_free_last)
    return params.beta_far + weights * log_distance(FAR_M)


def prior_probability(params):
    """Probability far from all beams, at the origin of the frame."""
    kss = kernel(params, np.zeros(2), np.zeros(2))
    return float(probability(params, 0.0, kss, prior_evidence(params)))


def remaining_correlation(params, hits, free):
    """rho (q,) between f at the query and the f that its neighbours tell of: 1 - d^2 / fade_m^2."""
    x = np.concatenate([hits.point, free.point], axis=1)
    present = np.concatenate([hits.present, free.present], axis=1)
    d2 = np.min(np.sum(x**2, axis=-1), axis=1, initial=params.fade_m**2, where=present)
    return 1.0 - d2 / params.fade_m**2


def faded(params, rho, mean, variance, evidence):
    """Mean, variance and evidence at a query whose f is rho times that of its neighbourhood plus
    an independent part of variance (1 - rho^2) k**."""
    kss = kernel(params, np.zeros(2), np.zeros(2))
    prior = prior_evidence(params)
    return (rho * mean, rho**2 * variance + (1.0 - rho**2) * kss,
            rho * evidence + (1.0 - rho) * prior)


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


def point_noises(params, beams, chosen, sn2):
    """Noise of the chosen points: one for all exactly known beams, infinite for absent points."""
    noise = np.array([sn2 if d == 0.0 else excess_noise(params, d, sn2)
                      for d in beams.position_std_m])
    noise = noise[chosen.index] if len(noise) else np.zeros(chosen.index.shape)
    if params.fading > 0:  # the share of the variance that is left of what a point says is w
        kss = kernel(params, np.zeros(2), np.zeros(2))
        noise = (noise + kss) / chosen.weight - kss
    return np.where(chosen.present, noise, math.inf)


def query_block(params, beams, query, origin):
    cap = scan_cap(params, beams)
    hits = nearest_hits(beams, query, params.hits, params.depth_m, cap, params.fading)
    free = nearest_free(beams, query, params.free, cap, params.fading)
    x = np.concatenate([hits.point, free.point], axis=1)
    if params.anisotropy > 0.0:
        _, axis, ratio = hits_axis(hits)
        x = shrink(x, axis, 1.0 - params.anisotropy * (1.0 - ratio))
    labels = np.concatenate([np.ones(hits.index.shape), -np.ones(free.index.shape)], axis=1)
    noises = np.concatenate([point_noises(params, beams, hits, params.sn2),
                             point_noises(params, beams, free, params.sn2_free)], axis=1)
    # The neural network covariance is not stationary: the frame decides where its origin lies.
    at = np.zeros_like(query) if params.frame == "query" else query - origin
    mean, variance = local_gp(params, x + at[:, None], labels, noises, at)
    evidence = evidence_of(params, beams, hits, free)
    if params.fade_m > 0.0:
        rho = remaining_correlation(params, hits, free)
        mean, variance, evidence = faded(params, rho, mean, variance, evidence)
    p = probability(params, mean, variance, evidence)
    return mean, variance, p, np.minimum(hits.margin_m, free.margin_m)


def query_map(params, beams, query, origin=(0.0, 0.0), block=500):
    """Answers at the points `query` (q, 2), map frame; `origin` is the map's."""
    query = np.asarray(query, float).reshape(-1, 2)
    parts = [query_block(params, beams, query[i:i + block], np.asarray(origin, float))
             for i in range(0, max(len(query), 1), block)]
    mean, variance, p, margin_m = (np.concatenate(column) for column in zip(*parts))
    return Answers(mean, variance, p, classify(params, p), margin_m)

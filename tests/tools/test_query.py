"""gpom-query against the double-precision oracle, and what it says of bad input.

The first part checks the oracle itself against other formulas, so that it can be trusted.
"""
import csv
import dataclasses
import gzip
import math
import pathlib
import statistics
import subprocess
import sys

import numpy as np
import oracle
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "golden"
LEARNT = sorted((ROOT / "tools" / "params").glob("*.toml"))
N_POINTS = 10_000
ORACLE_MAX = 1e-4  # mean and variance, at sn2 >= 0.1
ORIGIN_FAR_M = (400_000.0, 5_800_000.0)
SIGMOID = 'alpha = 3.0\nbeta = 0.1\ngap_m = 0.1\np_occupied = 0.75\np_free = 0.25\n'
KERNEL_KEYS = {
    "nn": "sf2 = 1.0\ns0 = 1.0\ns1 = 0.1\nsn2 = 0.1\n",
    "matern12": "sf2 = 1.0\nell_m = 8.0\nsn2 = 0.1\nsn2_free = 0.16\n",
    "matern32": "sf2 = 1.0\nell_m = 4.0\nsn2 = 0.1\n",
    "se": "sf2 = 1.0\nell_m = 3.0\nsn2 = 0.1\n",
    "askey": "sf2 = 1.0\nell_m = 12.0\nsn2 = 0.1\nsn2_free = 0.2\n",
}
LOG_WEIGHTS = {"log_hit_first": -0.4, "log_hit_last": -0.2, "log_free_first": 0.35,
               "log_free_last": 0.15}
ADDITIONS = {  # to the paper's model
    "depth": {"depth_m": 1.5},
    "cap": {"scan_points_max": 2},
    "anisotropy": {"anisotropy": 0.75},
    "vote": {"vote": 1.25},
    "line": {"line": 1.5},
    "logarithms": LOG_WEIGHTS,
    "fade": {"fade_m": 6.0},
    "all": {"depth_m": 1.0, "scan_points_max": 3, "anisotropy": 0.5, "vote": 0.75, "fade_m": 15.0,
            **LOG_WEIGHTS},
}
EXTENDED = [("matern12", name) for name in ADDITIONS] + [("nn", "all")]


def params_text(kernel, frame="query", **more):
    return (f'kernel = "{kernel}"\nframe = "{frame}"\nhits = 8\nfree = 8\n'
            + KERNEL_KEYS[kernel] + SIGMOID
            + "".join(f"{key} = {value!r}\n" for key, value in more.items()))


# ---- the oracle itself --------------------------------------------------------------------------

@pytest.mark.parametrize("kernel", oracle.KERNELS)
def test_oracle_kernels_are_positive_semidefinite_and_symmetric(kernel):
    params = oracle.Params(kernel=kernel, s0=1.0, s1=0.3, ell_m=5.0)
    x = np.random.default_rng(1).uniform(-20, 20, (120, 2))
    gram = oracle.kernel(params, x[:, None], x[None])
    assert np.allclose(gram, gram.T)
    assert np.linalg.eigvalsh(gram).min() > -1e-10
    at_distance = oracle.kernel(params, x[:1], x[:1] + np.array([[1e4, 0.0]]))
    assert kernel == "nn" or abs(at_distance[0]) < 1e-12


def test_oracle_local_gp_is_the_conditional_of_the_joint_gaussian():
    """Conditioning by the precision matrix of (f*, y) needs neither eq. 2 nor eq. 3."""
    params = oracle.Params(kernel="nn", s0=1.0, s1=0.3)
    rng = np.random.default_rng(2)
    x, query = rng.uniform(-5, 5, (12, 2)), np.array([0.5, -1.0])
    labels, noises = rng.choice([-1.0, 1.0], 12), rng.uniform(0.05, 1.0, 12)
    both = np.vstack([query, x])
    joint = [[oracle.kernel(params, a, b) for b in both] for a in both]
    precision = np.linalg.inv(np.array(joint) + np.diag([0.0, *noises]))
    mean, variance = oracle.local_gp(params, x, labels, noises, query)
    assert mean == pytest.approx(-precision[0, 1:] @ labels / precision[0, 0], abs=1e-9)
    assert variance == pytest.approx(1.0 / precision[0, 0], abs=1e-9)


def test_oracle_point_of_infinite_noise_is_left_out():
    params = oracle.Params(ell_m=4.0)
    x = np.random.default_rng(2).uniform(-5, 5, (6, 2))
    labels, noises = np.array([1.0, -1.0] * 3), np.array([0.1, math.inf, 0.2, 0.3, math.inf, 0.1])
    kept = np.isfinite(noises)
    got = oracle.local_gp(params, x, labels, noises, np.zeros(2))
    expected = oracle.local_gp(params, x[kept], labels[kept], noises[kept], np.zeros(2))
    assert np.allclose(got, expected, rtol=0.0, atol=1e-12)


def test_oracle_normal_distribution_agrees_with_the_standard_library():
    z = np.linspace(-6, 6, 101)
    expected = [statistics.NormalDist().cdf(value) for value in z]
    assert np.allclose(oracle.normal_cdf(z), expected, atol=1e-14)


def test_oracle_closest_point_on_a_free_segment_is_no_farther_than_any_sampled_one():
    rows = [[0, 1.0, 2.0, 0.3, -3.0, 0.7, 20.0, 5.0, 0.05, math.inf, 9.0, 25.0]]
    beams = oracle.beams_from_scans(rows, 0.1)
    assert list(beams.free_m) == pytest.approx([4.9, 0.0, 20.0, 8.9, 20.0])
    query = np.random.default_rng(3).uniform(-15, 15, (50, 2))
    free = oracle.nearest_free(beams, query, 5)
    for i in range(5):
        steps = np.linspace(0, beams.free_m[i], 2001)[:, None] * beams.direction[i]
        d = np.linalg.norm(beams.origin[i] + steps - query[:, None], axis=-1).min(axis=1)
        mine = np.linalg.norm(free.point[free.index == i], axis=-1)
        assert np.all(mine <= d + 1e-9) and np.all(mine >= d - 0.011)


def random_rows(seed, n_scans=12):
    """Scans of a robot that wanders about; one reading in ten is no return."""
    rng = np.random.default_rng(seed)
    rows = []
    for i in range(n_scans):
        ranges = np.where(rng.random(20) < 0.1, math.inf, rng.uniform(0.5, 12.0, 20))
        pose = (*rng.uniform(-8, 8, 2), rng.uniform(-3, 3))
        rows.append([float(i), *pose, -1.5, 0.15, 15.0, *ranges])
    return rows


def oracle_answers(rows, query, kernel="matern12", **changes):
    shape = {"sf2": 1.0, "s0": 1.0, "s1": 0.1, "ell_m": 6.0, "alpha": 3.0, "beta": 0.1}
    params = oracle.Params(kernel=kernel, **{**shape, **changes})
    return oracle.query_map(params, oracle.beams_from_scans(rows, params.gap_m), query)


def assert_same_answers(a, b, tolerance=0.0):
    for name in ("mean", "variance", "probability"):
        assert np.abs(getattr(a, name) - getattr(b, name)).max() <= tolerance, name


# A cap of as many points as are asked for never binds; a depth or a shrinking of next to nothing
# changes next to nothing.
@pytest.mark.parametrize("change", [{"scan_points_max": 64}, {"scan_points_max": 8},
                                    {"depth_m": 1e-12}, {"anisotropy": 1e-12}, {"vote": 1e-12},
                                    {"fade_m": 1e7}],
                         ids=lambda change: next(iter(change)))
def test_oracle_additions_reach_the_plain_model_continuously(change):
    query = np.random.default_rng(4).uniform(-15, 15, (300, 2))
    plain = oracle_answers(random_rows(5), query)
    assert_same_answers(oracle_answers(random_rows(5), query, **change), plain, 1e-9)


@pytest.mark.parametrize("kernel", ["matern12", "nn"])
def test_oracle_with_all_additions_does_not_care_how_the_world_is_turned(kernel):
    query = np.random.default_rng(6).uniform(-15, 15, (300, 2))
    c, s = math.cos(0.7), math.sin(0.7)
    turn, moved = np.array([[c, -s], [s, c]]), np.array([3.0, -5.0])
    turned = [[t, *(turn @ (x, y) + moved), theta + 0.7, *rest]
              for t, x, y, theta, *rest in random_rows(5)]
    there = oracle_answers(turned, query @ turn.T + moved, kernel, **ADDITIONS["all"])
    here = oracle_answers(random_rows(5), query, kernel, **ADDITIONS["all"])
    clear = here.margin_m > 1e-9  # elsewhere the rounding of the turn decides
    assert clear.mean() > 0.9
    assert np.abs(here.probability - there.probability)[clear].max() < 1e-9
    assert np.abs(here.variance - there.variance)[clear].max() < 1e-9


def test_oracle_occupied_part_is_the_segment_behind_the_hit():
    beams = oracle.beams_from_scans(random_rows(7, n_scans=1), 0.1)
    query = np.random.default_rng(3).uniform(-15, 15, (50, 2))
    hits = oracle.nearest_hits(beams, query, 20, 1.5)
    for i in np.flatnonzero(~np.isnan(beams.hit[:, 0])):
        steps = np.linspace(0, 1.5, 1501)[:, None] * beams.direction[i]
        d = np.linalg.norm(beams.hit[i] + steps - query[:, None], axis=-1).min(axis=1)
        mine = np.linalg.norm(hits.point[hits.index == i], axis=-1)
        assert np.all(mine <= d + 1e-9) and np.all(mine >= d - 0.002)


def capped_by_hand(d2, scan, k, most):
    """The definition of the cap for one query, item by item."""
    chosen = []
    for i in sorted(range(len(d2)), key=lambda i: (d2[i], i))[:k + k // 2]:
        if len(chosen) < k and [scan[j] for j in chosen].count(scan[i]) < most:
            chosen.append(i)
    return chosen


@pytest.mark.parametrize("k, most, n_scans",
                         [(8, 2, 12), (8, 1, 4), (3, 2, 5), (15, 3, 9), (8, 2, 1)])
def test_oracle_cap_chooses_by_its_definition_and_knows_how_clearly(k, most, n_scans):
    rng = np.random.default_rng(8)
    offset, scan = rng.normal(0, 5, (400, 25, 2)), rng.integers(n_scans, size=25)
    cap = oracle.Cap(scan, most)
    got = oracle.nearest(offset, np.arange(25), k, cap)
    for i, d2 in enumerate(np.sum(offset**2, axis=-1)):
        assert list(got.index[i, got.present[i]]) == capped_by_hand(d2, scan, k, most)
    # Distances that change by less than half of the margin leave the choice as it is.
    d = np.linalg.norm(offset, axis=-1, keepdims=True)
    change = rng.choice([-0.499, 0.499], d.shape) * np.minimum(got.margin_m, 1.0)[:, None, None]
    moved = oracle.nearest(offset * np.abs(1.0 + change / d), np.arange(25), k, cap)
    near = (d + change > 0.0).all(axis=(1, 2))
    assert near.mean() > 0.8
    for i in np.flatnonzero(near):
        assert set(got.index[i, got.present[i]]) == set(moved.index[i, moved.present[i]])


def test_oracle_full_anisotropy_makes_the_scatter_of_the_hits_round():
    beams = oracle.beams_from_scans(random_rows(9), 0.1)
    hits = oracle.nearest_hits(beams, np.random.default_rng(4).uniform(-9, 9, (100, 2)), 8)
    _, axis, factor = oracle.hits_axis(hits)
    weight = 1.0 / (0.01 + np.sum(hits.point**2, axis=-1))
    for x, w in zip(oracle.shrink(hits.point, axis, factor), weight):
        lam = np.linalg.eigvalsh(np.cov(x.T, aweights=w, ddof=0))
        assert lam[0] == pytest.approx(lam[1], rel=1e-9)


def test_oracle_anisotropy_needs_two_different_hits():
    one = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 30.0, 5.0]]
    for rows in (one, one * 3):
        query = [(1.0, 2.0), (5.5, 0.25)]
        plain = oracle_answers(rows, query)
        assert_same_answers(oracle_answers(rows, query, anisotropy=1.0), plain)


# One beam along x, with its hit at x = 5 m.
@pytest.mark.parametrize("at, vote", [
    ((6.0, 0.0), 1.0 - 1.0 / 30.0), ((3.0, 0.0), -(1.0 - 2.0 / 30.0)), ((5.0, 4.0), 0.0),
    ((8.0, 4.0), 0.6 * (1.0 - 5.0 / 30.0)), ((35.0, 0.0), 0.0), ((80.0, 0.0), 0.0),
    ((5.0, 0.0), 0.0)])
def test_oracle_vote_is_positive_behind_the_surface_and_fades_in_30_m(at, vote):
    beams = oracle.beams_from_scans([[0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 90.0, 5.0]], 0.1)
    hits = oracle.nearest_hits(beams, np.array([at]), 8)
    assert oracle.direction_vote(beams, hits)[0] == pytest.approx(vote, abs=1e-12)


def test_oracle_argument_of_eq_7_is_the_sum_of_its_terms():
    """One beam: the first hit is 2 m and the first free point 2.1 m away, a last one is missing."""
    rows = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 30.0, 5.0]]
    changes = {"vote": 0.7, "hits": 2, "free": 2, **LOG_WEIGHTS}
    plain, got = oracle_answers(rows, [(7.0, 0.0)]), oracle_answers(rows, [(7.0, 0.0)], **changes)
    z = (3.0 * plain.mean[0] + 0.1 + 0.7 * (1.0 - 2.0 / 30.0) - 0.4 * math.log(2.02)
         - 0.2 * math.log(30.02) + 0.35 * math.log(2.12) + 0.15 * math.log(30.02))
    expected = statistics.NormalDist().cdf(z / math.sqrt(1.0 + 9.0 * plain.variance[0]))
    assert got.probability[0] == pytest.approx(expected, abs=1e-12)
    both = oracle_answers(rows, [(7.0, 0.0)], **{**changes, "hits": 1, "free": 1})
    z += -0.2 * math.log(2.02 / 30.02) + 0.15 * math.log(2.12 / 30.02)
    expected = statistics.NormalDist().cdf(z / math.sqrt(1.0 + 9.0 * plain.variance[0]))
    assert both.probability[0] == pytest.approx(expected, abs=1e-12)


# One beam along x, its hit at x = 5 m: 3 m from a point the latent f keeps the correlation
# 1 - 9 / 36 over a fade of 6 m.
def test_oracle_fade_is_a_mixture_with_the_prior():
    rows = [[0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 90.0, 5.0]]
    query = [(2.0, 3.0), (2.0, 6.0), (5.0, 0.0)]
    plain = oracle_answers(rows, query, **LOG_WEIGHTS)
    got = oracle_answers(rows, query, fade_m=6.0, **LOG_WEIGHTS)
    assert got.mean[0] == pytest.approx(0.75 * plain.mean[0], rel=1e-12)
    assert 1.0 - got.variance[0] == pytest.approx(0.75**2 * (1.0 - plain.variance[0]), rel=1e-12)
    prior = oracle.prior_probability(oracle.Params(sf2=1.0, ell_m=6.0, alpha=3.0, beta=0.1,
                                                   **LOG_WEIGHTS))
    assert (got.mean[1], got.variance[1]) == (0.0, 1.0)
    assert got.probability[1] == pytest.approx(prior, abs=1e-12)
    assert got.probability[2] == pytest.approx(plain.probability[2], abs=1e-12)


def test_oracle_prior_probability_is_the_answer_far_from_all_beams_and_without_any():
    plain = oracle.Params(ell_m=6.0, alpha=3.0, beta=0.1)
    changes = {"ell_m": 6.0, "alpha": 3.0, "beta": 0.1, **ADDITIONS["all"]}
    prior = oracle.prior_probability(oracle.Params(**changes))
    assert abs(prior - oracle.prior_probability(plain)) > 0.01
    for rows in (random_rows(5), []):
        far = oracle_answers(rows, [(1e5, -2e5)], **changes)
        assert far.probability[0] == pytest.approx(prior, abs=1e-12)


def test_golden_files_are_what_the_oracle_gives():
    done = subprocess.run([sys.executable, ROOT / "tools" / "dev" / "gen_golden.py", "--check"],
                          capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


# ---- gpom-query against the oracle --------------------------------------------------------------

def write_points(path, points):
    rows = "".join(f"{float(x)!r},{float(y)!r}\n" for x, y in points)
    path.write_text("# x,y\n" + rows, encoding="utf-8")
    return path


def read_answers(path):
    """Answers of gpom-query as an oracle.Answers, with the points' coordinates."""
    with open(path, encoding="utf-8", newline="") as source:
        lines = (line for line in source if not line.startswith("#"))
        header, *rows = list(csv.reader(lines))
    assert header == ["x", "y", "mean", "variance", "probability", "class"]
    numbers = np.array([[float(cell) for cell in row[:5]] for row in rows])
    cls = np.array([oracle.CLASSES.index(row[5]) for row in rows])
    return numbers[:, :2], oracle.Answers(*numbers[:, 2:].T, cls, np.full(len(rows), math.inf))


def ask(run, folder, scans, params, points, *more):
    out = folder / "answers.csv"
    done = run("gpom-query", "--scans", scans, "--params", params, "--points", points,
               "--out", out, *more)
    assert done.returncode == 0, done.stderr
    return read_answers(out)


def clear_choice(margin_m, points):
    """Points whose neighbours are the same in float32: not within its rounding of a tie.

    Exact ties (coincident points at a beam's origin) are decided by the id in both.
    """
    rounding_m = 1e-5 + 5e-7 * np.abs(points).max(axis=1)
    return (margin_m == 0.0) | (margin_m > rounding_m)


@pytest.fixture(scope="session")
def points(street):
    """Random points over the street and 10 m around; one in ten near an end of a beam."""
    beams = oracle.read_beams(street, oracle.Params(ell_m=1.0))
    ends = beams.origin + beams.direction * beams.free_m[:, None]
    rng = np.random.default_rng(7)
    anywhere = rng.uniform(ends.min(axis=0) - 10, ends.max(axis=0) + 10, (N_POINTS, 2))
    near = ends[rng.integers(len(ends), size=N_POINTS)] + rng.normal(0, 0.3, (N_POINTS, 2))
    return np.where(rng.random((N_POINTS, 1)) < 0.1, near, anywhere)


def compared(run, folder, street, params_path, points):
    """Answers of the tool and of the oracle, and which points are no near-ties."""
    params = oracle.load_params(params_path)
    at, got = ask(run, folder, street, params_path, write_points(folder / "points.csv", points))
    assert np.allclose(at, points, atol=1e-3)
    expected = oracle.query_map(params, oracle.read_beams(street, params), points)
    clear = clear_choice(expected.margin_m, points)
    assert clear.mean() > 0.97  # a capped pool has one more edge, where a tie is unclear
    return params, got, expected, clear


def worst(got, expected, clear):
    return np.abs(got - expected)[clear].max()


@pytest.mark.parametrize("frame", oracle.FRAMES)
@pytest.mark.parametrize("kernel", oracle.KERNELS)
def test_mean_and_variance_agree_with_the_oracle(run, tmp_path, street, points, kernel, frame):
    path = tmp_path / "params.toml"
    path.write_text(params_text(kernel, frame), encoding="utf-8")
    _, got, expected, clear = compared(run, tmp_path, street, path, points)
    for name in ("mean", "variance"):
        assert worst(getattr(got, name), getattr(expected, name), clear) < ORACLE_MAX, name


@pytest.fixture(scope="session")
def points_and_beyond(points):
    """The same points and some up to 80 m away, where the vote and the distances run out."""
    rng = np.random.default_rng(11)
    bearing, d_m = rng.uniform(-math.pi, math.pi, 500), rng.uniform(20.0, 80.0, 500)
    edge = points[rng.integers(len(points), size=500)]
    away = edge + d_m[:, None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=1)
    return np.vstack([points, away])


@pytest.mark.parametrize("kernel, addition", EXTENDED)
def test_additions_to_the_model_agree_with_the_oracle(
        run, tmp_path, street, points_and_beyond, kernel, addition):
    path = tmp_path / "params.toml"
    path.write_text(params_text(kernel, **ADDITIONS[addition]), encoding="utf-8")
    _, got, expected, clear = compared(run, tmp_path, street, path, points_and_beyond)
    assert worst(got.mean, expected.mean, clear) < ORACLE_MAX
    assert worst(got.variance, expected.variance, clear) < ORACLE_MAX
    assert worst(got.probability, expected.probability, clear) < 1e-3


@pytest.mark.parametrize("addition", ADDITIONS)
def test_every_addition_changes_what_the_oracle_expects(street, points, addition):
    """Else the agreement above would say nothing of it."""
    plain = oracle.Params(ell_m=8.0, sn2=0.05, alpha=3.0)
    beams = oracle.read_beams(street, plain)
    before = oracle.query_map(plain, beams, points[:500])
    after = oracle.query_map(dataclasses.replace(plain, **ADDITIONS[addition]), beams, points[:500])
    assert np.mean(np.abs(after.probability - before.probability) > 0.01) > 0.1


def test_neutral_additions_do_not_change_a_bit(run, tmp_path, street, points):
    at = write_points(tmp_path / "points.csv", points)
    neutral = {key: 0 if key == "scan_points_max" else 0.0 for key in ADDITIONS["all"]}
    told, untold = tmp_path / "told.toml", tmp_path / "untold.toml"
    neutral["sn2_once"] = 1e6  # of live maps alone: here every beam is kept
    told.write_text(params_text("matern12", **neutral), encoding="utf-8")
    untold.write_text(params_text("matern12"), encoding="utf-8")
    assert_same_answers(*(ask(run, tmp_path, street, path, at)[1] for path in (told, untold)))


def test_there_are_learnt_parameters():
    assert LEARNT, "tools/params has no .toml file"


@pytest.mark.parametrize("path", LEARNT, ids=lambda path: path.stem)
def test_probability_and_class_of_learnt_parameters_agree_with_the_oracle(
        run, tmp_path, street, points, path):
    params, got, expected, clear = compared(run, tmp_path, street, path, points)
    assert worst(got.probability, expected.probability, clear) < 1e-3
    thresholds = np.array([params.p_occupied, params.p_free])
    decided = np.abs(expected.probability[:, None] - thresholds).min(axis=1) > 1e-3
    assert np.array_equal(got.cls[clear & decided], expected.cls[clear & decided])


@pytest.mark.parametrize("path", sorted(GOLDEN.glob("params_*.toml")), ids=lambda path: path.stem)
def test_golden_answers_with_every_kind_of_bad_reading(run, tmp_path, path):
    _, got = ask(run, tmp_path, GOLDEN / "scans.csv", path, GOLDEN / "points.csv")
    _, expected = read_answers(GOLDEN / f"answers_{path.stem.removeprefix('params_')}.csv")
    assert np.abs(got.mean - expected.mean).max() < 1e-3
    assert np.abs(got.variance - expected.variance).max() < 1e-3
    assert np.abs(got.probability - expected.probability).max() < 1e-3


def shifted_scans(street, target):
    """The same street far from the coordinates' origin."""
    rows = []
    for line in street.read_text(encoding="utf-8").splitlines():
        cells = line.split(",")
        if not line.startswith("#") and len(cells) > 7:
            for i, origin_m in ((1, ORIGIN_FAR_M[0]), (2, ORIGIN_FAR_M[1])):
                cells[i] = repr(float(cells[i]) + origin_m)
        rows.append(",".join(cells))
    target.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return target


# In map coordinates the neural network matrix is ill-conditioned 60 m from the origin: one bit of
# a coordinate, which the sum of a pose and the offset may lose, moves the mean by 2e-4.
@pytest.mark.parametrize("frame, tolerance", [("query", 1e-4), ("map", 1e-3)])
def test_a_map_far_from_the_origin_answers_the_same(
        run, tmp_path, street, points, frame, tolerance):
    path = tmp_path / "params.toml"
    path.write_text(params_text("nn", frame), encoding="utf-8")
    _, near, expected, clear = compared(run, tmp_path, street, path, points)
    moved = write_points(tmp_path / "moved.csv", points + np.array(ORIGIN_FAR_M))
    _, far = ask(run, tmp_path, shifted_scans(street, tmp_path / "far.csv"), path, moved,
                 "--origin", "%.0f,%.0f" % ORIGIN_FAR_M)
    assert worst(far.mean, near.mean, clear) < tolerance
    assert worst(far.variance, near.variance, clear) < tolerance
    assert worst(far.probability, near.probability, clear) < tolerance


# ---- bad input ----------------------------------------------------------------------------------

GOOD_SCAN = "0,1.0,2.0,0.5,-1.5,0.1,30.0,4.0,5.0,6.0\n"
SCAN_HEADER = "# t,x,y,theta,angle_min,angle_step,range_max,ranges\n"


@pytest.fixture
def good(tmp_path):
    """Three good input files; a test spoils one of them."""
    files = {"scans": tmp_path / "scans.csv", "params": tmp_path / "params.toml",
             "points": tmp_path / "points.csv"}
    files["scans"].write_text(SCAN_HEADER + GOOD_SCAN * 2, encoding="utf-8")
    files["params"].write_text(params_text("nn"), encoding="utf-8")
    write_points(files["points"], [(0.0, 0.0), (3.0, 4.0)])
    return files


def refused(run, files, names, *more):
    """The tool exits 2, with one line that has all of `names`, and leaves nothing behind."""
    folder = files["params"].parent / "out"
    folder.mkdir()
    done = run("gpom-query", "--scans", files["scans"], "--params", files["params"],
               "--points", files["points"], "--out", folder / "answers.csv", *more)
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
    assert done.stderr.startswith("gpom-query: ")
    for name in names:
        assert name in done.stderr
    assert list(folder.iterdir()) == []


def test_good_input_is_accepted(run, tmp_path, good):
    _, answers = ask(run, tmp_path, good["scans"], good["params"], good["points"])
    assert len(answers.mean) == 2


BAD_SCANS = {
    "too few fields": (SCAN_HEADER + GOOD_SCAN + "0,1.0,2.0,0.5,-1.5\n", ":3:"),
    "NaN pose": (SCAN_HEADER + GOOD_SCAN + GOOD_SCAN.replace("2.0", "nan", 1), ":3:"),
    "infinite pose": (SCAN_HEADER + GOOD_SCAN.replace("1.0", "inf", 1), ":2:"),
    "word for a number": (SCAN_HEADER + GOOD_SCAN.replace("5.0", "five"), ":2:"),
    "number with a tail": (SCAN_HEADER + GOOD_SCAN.replace("5.0", "5.0m"), ":2:"),
    "wrong count in a log": ("FLASER 3 4.0 5.0 1.0 2.0 0.5 1.0 2.0 0.5 0.0 host 0.0\n", ":1:"),
    "negative range_max": (SCAN_HEADER + GOOD_SCAN.replace("30.0", "-30.0"), ":2:"),
}


@pytest.mark.parametrize("case", BAD_SCANS)
def test_a_bad_scan_line_is_refused_by_number(run, good, case):
    content, line = BAD_SCANS[case]
    good["scans"].write_text(content, encoding="utf-8")
    refused(run, good, ["scans.csv" + line])


@pytest.mark.parametrize("which", ["scans", "params", "points"])
def test_a_binary_file_is_refused(run, good, which):
    good[which].write_bytes(np.random.default_rng(9).bytes(5000))
    refused(run, good, [good[which].name])


@pytest.mark.parametrize("which", ["scans", "params", "points"])
def test_a_missing_file_is_refused(run, good, which):
    good[which].unlink()
    refused(run, good, [good[which].name])


def test_a_truncated_compressed_scan_file_is_refused(run, good, tmp_path):
    packed = gzip.compress((SCAN_HEADER + GOOD_SCAN * 500).encode())
    good["scans"] = tmp_path / "scans.csv.gz"
    good["scans"].write_bytes(packed[:-12])
    refused(run, good, ["scans.csv.gz"])


def test_a_truncated_compressed_log_is_refused(run, good, tmp_path, log):
    packed = log("seattle.log.gz").read_bytes()
    good["scans"] = tmp_path / "cut.log.gz"
    good["scans"].write_bytes(packed[:len(packed) // 2])
    refused(run, good, ["cut.log.gz"])


BAD_POINTS = {
    "empty": ("", ""),
    "comment only": ("# x,y\n", ""),
    "one number": ("# x,y\n0.0,0.0\n1.0\n", ":3:"),
    "three numbers": ("# x,y\n1.0,2.0,3.0\n", ":2:"),
    "word": ("# x,y\n1.0,left\n", ":2:"),
    "NaN": ("# x,y\n0.0,0.0\n1.0,nan\n", ":3:"),
}


@pytest.mark.parametrize("case", BAD_POINTS)
def test_a_bad_point_is_refused_by_line(run, good, case):
    content, line = BAD_POINTS[case]
    good["points"].write_text(content, encoding="utf-8")
    refused(run, good, ["points.csv" + line])


BAD_PARAMS = {  # what replaces what in the good file, and the field the message must name
    "unknown key": ("alpha =", "alhpa =", "alhpa"),
    "key twice": ("alpha = 3.0", "alpha = 3.0\nalpha = 3.0", "alpha"),
    "negative signal variance": ("sf2 = 1.0", "sf2 = -1.0", "sf2"),
    "negative noise variance": ("sn2 = 0.1", "sn2 = -0.1", "sn2"),
    "noise variance NaN": ("sn2 = 0.1", "sn2 = nan", "sn2"),
    "noise below 1e-3 sf2": ("sn2 = 0.1", "sn2 = 0.0009", "sn2"),
    "negative s1": ("s1 = 0.1", "s1 = -0.1", "s1"),
    "prior outside the unsure band": ("beta = 0.1", "beta = 20.0", ""),
    "thresholds crossed": ("p_free = 0.25", "p_free = 0.8", "p_free"),
    "no hits": ("hits = 8", "hits = 0", "hits"),
    "too many neighbours": ("hits = 8", "hits = 60", "hits"),
    "unknown kernel": ('"nn"', '"rbf"', "kernel"),
    "unknown frame": ('"query"', '"world"', "frame"),
    "word for a number": ("alpha = 3.0", 'alpha = "steep"', "alpha"),
    "negative gap": ("gap_m = 0.1", "gap_m = -0.1", "gap_m"),
    "anisotropy above 1": ("beta =", "anisotropy = 1.01\nbeta =", "anisotropy"),
    "negative anisotropy": ("beta =", "anisotropy = -0.1\nbeta =", "anisotropy"),
    "anisotropy in the map frame": ('"query"', '"map"\nanisotropy = 0.5', "anisotropy"),
    "negative fade": ("beta =", "fade_m = -1.0\nbeta =", "fade_m"),
    "fade of next to nothing": ("beta =", "fade_m = 0.01\nbeta =", "fade_m"),
    "fade in the map frame": ('"query"', '"map"\nfade_m = 20.0', "fade_m"),
    "noise of hits seen once below sn2": ("beta =", "sn2_once = 0.09\nbeta =", "sn2_once"),
    "negative depth": ("beta =", "depth_m = -0.1\nbeta =", "depth_m"),
    "depth above 5 m": ("beta =", "depth_m = 5.1\nbeta =", "depth_m"),
    "cap above 64": ("beta =", "scan_points_max = 65\nbeta =", "scan_points_max"),
    "negative cap": ("beta =", "scan_points_max = -1\nbeta =", "scan_points_max"),
    "cap of one and a half": ("beta =", "scan_points_max = 1.5\nbeta =", "scan_points_max"),
    "infinite vote": ("beta =", "vote = inf\nbeta =", "vote"),
    **{f"{key} NaN": ("beta =", f"{key} = nan\nbeta =", key)
       for key in (*LOG_WEIGHTS, "anisotropy", "sn2_once")},
    **{f"prior pushed out by {key}": ("beta =", f"{key} = 2.0\nbeta =", "prior probability")
       for key in LOG_WEIGHTS},
}


@pytest.mark.parametrize("case", BAD_PARAMS)
def test_a_bad_parameter_is_refused_by_name(run, good, case):
    old, new, field = BAD_PARAMS[case]
    content = good["params"].read_text(encoding="utf-8")
    assert content.count(old) >= 1
    good["params"].write_text(content.replace(old, new, 1), encoding="utf-8")
    refused(run, good, ["params.toml", field])


@pytest.mark.parametrize("beam_max", ["0", "-5", "1e12", "1000000000000", "many", ""])
def test_an_absurd_capacity_is_refused(run, good, beam_max):
    refused(run, good, ["--beam-max"], "--beam-max", beam_max)


@pytest.mark.parametrize("origin", ["400000", "1,2,3", "nan,0", "a,b"])
def test_a_bad_origin_is_refused(run, good, origin):
    refused(run, good, ["--origin"], "--origin", origin)


def test_a_misspelt_option_is_refused(run, good):
    refused(run, good, ["--orgin"], "--orgin", "0,0")


def test_help_exits_0_and_names_the_options(run):
    done = run("gpom-query", "--help")
    assert done.returncode == 0 and done.stderr == ""
    assert all(option in done.stdout for option in ("--scans", "--points", "--out", "--beam-max"))

"""Derivatives of gpom-query --gradients against central differences of the double oracle.

GPOM_GRADIENT_POINTS  points for each model, default 150
"""
import csv
import os

import numpy as np
import oracle
import pytest
from test_query import ADDITIONS, EXTENDED, LEARNT, clear_choice, params_text, write_points

N_POINTS = int(os.environ.get("GPOM_GRADIENT_POINTS", "150"))
STEP_M = 1e-5
NEAR_M = 0.02  # nearer to data the covariances have kinks
ERROR_MAX = 1e-3  # of the gradient's scale
KINK_MAX = 0.03   # change of a slope over 2 STEP_M, of the gradient's scale
NAMES = ("mean", "variance", "probability")
EVERYTHING = {**ADDITIONS["all"], "fading": 3, "line": 1.5, "beta_far": 0.2}

MODELS = {
    **{f"{kernel}-{frame}": params_text(kernel, frame)
       for kernel in oracle.KERNELS for frame in oracle.FRAMES},
    **{f"{kernel}-{name}": params_text(kernel, **ADDITIONS[name]) for kernel, name in EXTENDED},
    "matern12-fading": params_text("matern12", fading=3),
    "matern12-fading-cap": params_text("matern12", fading=3, scan_points_max=2),
    "matern12-beta_far": params_text("matern12", fade_m=6.0, beta_far=0.3),
    **{f"{kernel}-everything": params_text(kernel, **EVERYTHING) for kernel in oracle.KERNELS},
    **{path.stem: path.read_text(encoding="utf-8") for path in LEARNT},
}


def ask_gradients(run, folder, scans, params_path, points):
    """Values (q, 3) and derivatives (q, 3, 2) of mean, variance and probability."""
    out = folder / "gradients.csv"
    done = run("gpom-query", "--scans", scans, "--params", params_path, "--gradients",
               "--points", write_points(folder / "points.csv", points), "--out", out)
    assert done.returncode == 0, done.stderr
    with open(out, encoding="utf-8", newline="") as source:
        header, *rows = list(csv.reader(source))
    assert header == ["x", "y", *NAMES, "class", *(f"{n}_{axis}" for n in NAMES for axis in "xy")]
    values = np.array([[float(cell) for cell in row[2:5]] for row in rows])
    slopes = np.array([[float(cell) for cell in row[6:]] for row in rows])
    return values, slopes.reshape(-1, 3, 2)


def stacked(answers):
    return np.stack([getattr(answers, name) for name in NAMES], axis=1)


def central_differences(params, beams, points):
    """Derivatives (q, 3, 2) of the oracle, how much the slopes of the two sides differ (q, 3), and
    how far the choice of neighbours was from a tie."""
    here = oracle.query_map(params, beams, points)
    slopes, kink = np.empty((len(points), 3, 2)), np.zeros((len(points), 3))
    for axis in range(2):
        step = np.eye(2)[axis] * STEP_M
        after, before = (stacked(oracle.query_map(params, beams, points + side * step))
                         for side in (1, -1))
        slopes[:, :, axis] = (after - before) / (2.0 * STEP_M)
        kink = np.maximum(kink, np.abs(after + before - 2.0 * stacked(here)) / STEP_M)
    return slopes, kink, here.margin_m


def distance_to_data(params, beams, points):
    hits = oracle.nearest_hits(beams, points, 1, params.depth_m)
    free = oracle.nearest_free(beams, points, 1)
    return np.minimum(hits.distance_m()[:, 0], free.distance_m()[:, 0])


@pytest.fixture(scope="session")
def places(street):
    """Places over the street and 10 m around; three in ten near an end of a beam. float32."""
    beams = oracle.read_beams(street, oracle.Params(ell_m=1.0))
    ends = beams.origin + beams.direction * beams.free_m[:, None]
    rng = np.random.default_rng(21)
    anywhere = rng.uniform(ends.min(axis=0) - 10, ends.max(axis=0) + 10, (N_POINTS, 2))
    near = ends[rng.integers(len(ends), size=N_POINTS)] + rng.normal(0, 0.3, (N_POINTS, 2))
    points = np.where(rng.random((N_POINTS, 1)) < 0.3, near, anywhere)
    return points.astype(np.float32).astype(float)


# The scale of a gradient is its length there plus its root mean square over all places. A place
# where a slope changes within the step of the difference has no derivative to compare with.
@pytest.mark.parametrize("model", MODELS)
def test_derivatives_equal_central_differences_of_the_oracle(run, tmp_path, street, places, model):
    path = tmp_path / "params.toml"
    path.write_text(MODELS[model], encoding="utf-8")
    params = oracle.load_params(path)
    beams = oracle.read_beams(street, params)
    expected, kink, margin_m = central_differences(params, beams, places)
    _, got = ask_gradients(run, tmp_path, street, path, places)
    far = distance_to_data(params, beams, places) > NEAR_M
    clear = far & clear_choice(margin_m, places)
    length = np.linalg.norm(expected, axis=2)
    typical = np.median(length[clear], axis=0)
    smooth = clear & (kink <= KINK_MAX * (length + typical)).all(axis=1)
    assert smooth.sum() > 0.95 * far.sum()
    scale = length + np.sqrt(np.mean(length[smooth]**2, axis=0))
    error = (np.linalg.norm(got - expected, axis=2) / scale)[smooth]
    print(f"{model}: {smooth.sum()} places of {len(places)}, largest errors {error.max(axis=0)}")
    assert error.max() < ERROR_MAX


@pytest.mark.parametrize("model", ["matern12-query", "askey-query", "nn-everything", "street"])
def test_answers_with_derivatives_are_those_without(run, tmp_path, street, places, model):
    path = tmp_path / "params.toml"
    path.write_text(MODELS[model], encoding="utf-8")
    values, _ = ask_gradients(run, tmp_path, street, path, places)
    out = tmp_path / "answers.csv"
    done = run("gpom-query", "--scans", street, "--params", path, "--points",
               tmp_path / "points.csv", "--out", out)
    assert done.returncode == 0, done.stderr
    with open(out, encoding="utf-8", newline="") as source:
        plain = [[float(cell) for cell in row[2:5]] for row in list(csv.reader(source))[1:]]
    assert np.array_equal(values, np.array(plain))

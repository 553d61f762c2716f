"""Write the golden vectors in tests/golden from the double-precision oracle tests/common/oracle.py.

    python3 tools/dev/gen_golden.py           write them
    python3 tools/dev/gen_golden.py --check   compare the files with the oracle; exit code 1 if a
                                              file differs, is missing or is not known

Inputs are multiples of 1/64 where single precision would otherwise round them. Lines that begin
with # are comments. The line after them names the columns.
"""
import argparse
import dataclasses
import math
import pathlib
import random
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "common"))
import numpy as np  # noqa: E402

import oracle  # noqa: E402

GOLDEN = ROOT / "tests" / "golden"
COMMENT = ("# Written by `python3 tools/dev/gen_golden.py` from tests/common/oracle.py; "
           "do not edit.\n")
CLEAR_M = 2e-4  # least difference of distances for the same choice in single precision
TOLERANCE = 2e-9  # files have nine digits; BLAS may add in another order

SHAPES = {  # the prior of each kernel in the golden files
    "nn": {"sf2": 0.75, "s0": 2.0, "s1": 0.25},
    "matern12": {"sf2": 1.25, "ell_m": 6.0},
    "matern32": {"sf2": 1.0, "ell_m": 3.0},
    "se": {"sf2": 1.5, "ell_m": 2.0},
    "askey": {"sf2": 1.0, "ell_m": 9.0},
}
SIGMOID = {"alpha": 2.0, "beta": -0.125, "p_occupied": 0.75, "p_free": 0.25}
CHOICE = {  # neighbourhoods: few, default, and more than exist (all are used)
    "nn": {"hits": 8, "free": 8, "sn2": 0.0625, "sn2_free": 0.125},
    "matern12": {"hits": 8, "free": 8, "sn2": 0.015625},
    "matern32": {"hits": 3, "free": 1, "sn2": 0.125},
    "se": {"hits": 1, "free": 7, "sn2": 0.0625, "sn2_free": 0.25},
    "askey": {"hits": 30, "free": 34, "sn2": 0.03125},
}
NEUTRAL = {  # values that a parameter file leaves out
    "depth_m": 0.0, "scan_points_max": 0, "anisotropy": 0.0, "vote": 0.0, "line": 0.0,
    "log_hit_first": 0.0, "log_hit_last": 0.0, "log_free_first": 0.0, "log_free_last": 0.0,
    "fade_m": 0.0, "sn2_once": 0.0, "fading": 0, "beta_far": 0.0,
}
ADDITIONS = {  # one by one; cap leaves fewer than 8 points of each kind, cap_loose 8 hits
    "depth": {"depth_m": 1.5},
    "cap": {"scan_points_max": 2},
    "cap_loose": {"scan_points_max": 4},
    "anisotropy": {"anisotropy": 0.75},
    "vote": {"vote": 1.25},
    "line": {"line": 1.5},
    "log_hit_first": {"log_hit_first": -0.375},
    "log_hit_last": {"log_hit_last": 0.375},
    "log_free_first": {"log_free_first": 0.4375},
    "log_free_last": {"log_free_last": -0.25},
    "fade": {"fade_m": 5.0},
    "beta_far": {"fade_m": 5.0, "beta_far": 0.5},
    "fading": {"fading": 4},
    "fading_cap": {"fading": 3, "scan_points_max": 2},
}
ALL_ADDITIONS = {
    "depth_m": 1.0, "scan_points_max": 3, "anisotropy": 0.5, "vote": 0.75, "line": -0.5,
    "log_hit_first": -0.5, "log_hit_last": 0.25, "log_free_first": 0.4375,
    "log_free_last": -0.125, "fade_m": 12.0, "beta_far": 0.25, "fading": 3,
}


def grid(value):
    """Nearest multiple of 1/64: exact in single precision and in nine digits."""
    return round(value * 64.0) / 64.0


def text(value):
    return value if isinstance(value, str) else f"{value:.9g}"


def table(columns, rows, comment=""):
    lines = [",".join(text(value) for value in row) for row in rows]
    return COMMENT + comment + columns + "\n" + "\n".join(lines) + "\n"


def params_of(kernel, frame="query"):
    return oracle.Params(kernel=kernel, frame=frame, gap_m=0.25, **SHAPES[kernel], **SIGMOID,
                         **CHOICE[kernel])


def shape_columns(kernel):
    """kernel,sf2,s0,s1,ell_m with 0 for parameters that the kernel does not use."""
    shape = SHAPES[kernel]
    return (kernel, *(shape.get(name, 0.0) for name in ("sf2", "s0", "s1", "ell_m")))


def kernel_values(rng):
    rows = []
    for name in oracle.KERNELS:
        params = params_of(name)
        for frame, centre, reach in (("query", (0.0, 0.0), 12.0), ("map", (-310.0, 145.0), 12.0)):
            for i in range(24):
                x = np.array([grid(c + rng.uniform(-reach, reach)) for c in centre])
                step = (0.0, 0.1, 2.0, 12.0)[i % 4]
                y = np.array([grid(c + rng.uniform(-step, step)) for c in x])
                x = np.array(centre) if i == 0 else x
                rows.append((frame, *shape_columns(name), *x, *y,
                             float(oracle.kernel(params, x, y))))
    return table("frame,kernel,sf2,s0,s1,ell_m,x1,y1,x2,y2,k", rows,
                 "# frame: where the coordinates come from, relative to a query or to the map.\n")


def sigmoid_values(rng):
    rows = []
    for i in range(33):
        z = (i - 16) * 0.5
        rows.append((z, 0.0, 1.0, 0.0, float(oracle.normal_cdf(z))))
    for _ in range(60):
        mean, alpha = grid(rng.uniform(-1.5, 1.5)), grid(rng.uniform(0.5, 20.0))
        variance, beta = grid(rng.uniform(0.0, 2.0)), grid(rng.uniform(-2.0, 2.0))
        params = oracle.Params(ell_m=1.0, alpha=alpha, beta=beta)
        p = float(oracle.probability(params, mean, variance))
        rows.append((mean, variance, alpha, beta, p))
    return table("mean,variance,alpha,beta,probability", rows,
                 "# Eq. 7; with variance 0, alpha 1 and beta 0 it is Phi(mean).\n")


def local_gp_case(rng, kernel, n, centre):
    params = params_of(kernel)
    query = np.array(centre)
    x = np.array([[grid(c + rng.gauss(0.0, 2.0)) for c in centre] for _ in range(n)]).reshape(n, 2)
    labels = np.array([rng.choice((-1.0, 1.0)) for _ in range(n)])
    noises = np.array([rng.choice((0.0625, 0.125, 1.5)) for _ in range(n)])
    for i in range(2, n, 5):  # beams of one origin have the same closest point
        x[i], labels[i] = x[i - 1], labels[i - 1]
    mean, variance = oracle.local_gp(params, x, labels, noises, query)
    points = [value for i in range(n) for value in (*x[i], labels[i], noises[i])]
    return (*shape_columns(kernel), *query, float(mean), float(variance), n, *points)


def local_gp_cases(rng):
    rows = [local_gp_case(rng, kernel, n, centre) for kernel in oracle.KERNELS
            for n, centre in ((0, (0.0, 0.0)), (1, (0.0, 0.0)), (2, (0.0, 0.0)), (7, (0.0, 0.0)),
                              (16, (0.0, 0.0)), (16, (-40.0, 25.0)), (64, (0.0, 0.0)))]
    return table("kernel,sf2,s0,s1,ell_m,x_query,y_query,mean,variance,n,points", rows,
                 "# Eqs. 2 and 3. points: n times x,y,label,noise variance.\n")


def excess_noises():
    rows = []
    for kernel in oracle.KERNELS:
        for d in (0.0, 0.0625, 0.25, 1.0, 2.0):
            sn2 = 0.0625
            rows.append((*shape_columns(kernel), d, sn2,
                         oracle.excess_noise(params_of(kernel), d, sn2)))
    return table("kernel,sf2,s0,s1,ell_m,position_std_m,sn2,noise", rows)


def scan_rows(rng):
    """Three poses in a yard, with every kind of special reading."""
    odd = [math.nan, 0.0, -1.0, math.inf, -math.inf, 30.0, 81.91, 1e30, 0.125, 0.25]
    rows = []
    for i, (x, y, theta) in enumerate(((0.0, 0.0, 0.25), (4.5, 1.25, -2.5), (-3.0, 6.0, 7.0))):
        ranges = [grid(rng.uniform(1.0, 14.0)) for _ in range(22)]
        for j, reading in enumerate(odd):
            ranges[2 * j + i % 2] = reading
        rows.append([0.5 * i, x, y, theta, -1.5, 0.15625, 30.0, *ranges])
    rows.append([1.5, 1.0, 1.0, 0.0, 0.0, 0.015625, 30.0, math.nan])  # one reading, NaN
    return rows


def query_points(rng, beams_by_params):
    """Points with the same neighbours in single precision: exact ties or clear choices."""
    candidates = [(0.0, 0.0), (4.5, 1.25), (1000.0, -2000.0), (0.015625, 0.0)]
    hits = beams_by_params[0][1].hit
    candidates += [(grid(x + rng.uniform(-0.1, 0.1)), grid(y + rng.uniform(-0.1, 0.1)))
                   for x, y in hits[~np.isnan(hits[:, 0])][::2]]
    candidates += [(grid(rng.uniform(-12, 12)), grid(rng.uniform(-12, 14))) for _ in range(120)]
    points = np.array(candidates)
    clear = np.ones(len(points), bool)
    for params, beams in beams_by_params:
        margin_m = oracle.query_map(params, beams, points).margin_m
        clear &= (margin_m == 0.0) | (margin_m > 1e-3)
    return points[clear][:60]


def params_toml(params):
    lines = []
    for field in dataclasses.fields(params):
        value = getattr(params, field.name)
        if field.name in NEUTRAL and value == NEUTRAL[field.name]:
            continue
        if isinstance(value, str):
            lines.append(f'{field.name} = "{value}"')
        elif not math.isnan(value):
            lines.append(f"{field.name} = {value!r}")
    return COMMENT + "\n".join(lines) + "\n"


def answer_table(params, scans, points):
    beams = oracle.beams_from_scans(scans, params.gap_m)
    answers = oracle.query_map(params, beams, points)
    rows = [(*point, *values, oracle.CLASSES[cls]) for point, *values, cls in
            zip(points, answers.mean, answers.variance, answers.probability, answers.cls)]
    if not np.all((answers.margin_m == 0.0) | (answers.margin_m > CLEAR_M)):
        raise ValueError(f"a query point is near a tie with {params}")
    return table("x,y,mean,variance,probability,class", rows)


def extended_cases():
    """Each addition to the paper's model alone, and all together."""
    changes = {f"matern12_{name}": change for name, change in ADDITIONS.items()}
    changes |= {"matern12_all": ALL_ADDITIONS, "nn_all": ALL_ADDITIONS}
    cases = {name: dataclasses.replace(params_of(name.split("_", maxsplit=1)[0]), **change)
             for name, change in changes.items()}
    for name, params in cases.items():
        if not params.p_free < oracle.prior_probability(params) < params.p_occupied:
            raise ValueError(f"{name}: the prior probability would be refused")
    return cases


def end_to_end(rng):
    scans = scan_rows(rng)
    cases = {f"{kernel}_{frame}": params_of(kernel, frame)
             for kernel in oracle.KERNELS for frame in oracle.FRAMES}
    points = query_points(rng, [(params, oracle.beams_from_scans(scans, params.gap_m))
                                for params in cases.values()])
    yield "scans.csv", table("# t,x,y,theta,angle_min,angle_step,range_max,ranges", scans)
    yield "points.csv", table("# x,y", points)
    for name, params in (cases | extended_cases()).items():
        yield f"params_{name}.toml", params_toml(params)
        yield f"answers_{name}.csv", answer_table(params, scans, points)


def golden_files():
    """All files by name. Each has its own random numbers, so that no file changes another."""
    files = {"kernel.csv": kernel_values(random.Random(1)),
             "sigmoid.csv": sigmoid_values(random.Random(2)),
             "local_gp.csv": local_gp_cases(random.Random(3)),
             "excess_noise.csv": excess_noises()}
    files.update(end_to_end(random.Random(4)))
    return files


def same_cell(a, b):
    try:
        return math.isclose(float(a), float(b), rel_tol=TOLERANCE, abs_tol=TOLERANCE) or a == b
    except ValueError:
        return a == b


def first_difference(old, new):
    """Number of the first line that differs, or None."""
    old_lines, new_lines = old.splitlines(), new.splitlines()
    for number, (a, b) in enumerate(zip(old_lines, new_lines), start=1):
        cells_a, cells_b = a.split(","), b.split(",")
        if len(cells_a) != len(cells_b) or not all(map(same_cell, cells_a, cells_b)):
            return number
    return None if len(old_lines) == len(new_lines) else min(len(old_lines), len(new_lines)) + 1


def check(files, folder):
    """Lines that say how the folder differs from the oracle."""
    present = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    complaints = [f"{folder / name}: not written by this program" for name in
                  sorted(present - set(files))]
    for name, new in files.items():
        path = folder / name
        if name not in present:
            complaints.append(f"{path}: missing")
        else:
            number = first_difference(path.read_text(encoding="utf-8"), new)
            if number is not None:
                complaints.append(f"{path}:{number}: differs from the oracle")
    return complaints


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare only; exit 1 on differences")
    parser.add_argument("--folder", type=pathlib.Path, default=GOLDEN, help="default tests/golden")
    arguments = parser.parse_args()
    files = golden_files()
    if arguments.check:
        complaints = check(files, arguments.folder)
        print("\n".join(complaints) or f"{len(files)} golden files agree with the oracle")
        return 1 if complaints else 0
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (arguments.folder / name).write_text(content, encoding="utf-8")
    print(f"{len(files)} files, {sum(map(len, files.values()))} bytes in {arguments.folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

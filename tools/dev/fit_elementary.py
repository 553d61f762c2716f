"""Fit the float32 elementary functions of the core: asin, exp, 2^x, normal distribution, sin, cos.

Run it by hand (it needs numpy and mpmath) and copy the coefficients that it prints into the core:

    python3 tools/dev/fit_elementary.py [OUTPUT.txt]

Every fit is a weighted minimax fit (Lawson's iteration on Chebyshev nodes, references from mpmath
at 40 digits). Coefficients are rounded to float32 one by one, the lowest power first. After each
rounding the remaining coefficients are fitted again, so that rounding adds almost no error. The
error bounds are measured on dense grids with the float32 operations of the core, both with separate
multiply and add ("plain") and with fused multiply-add ("fused").
"""
import math
import sys

import mpmath
import numpy as np

mpmath.mp.dps = 40
F = np.float32
HALF_PI = F(math.pi / 2)
LN2_HI = F(0.693359375)  # 9 significant bits: n * LN2_HI is exact for |n| < 2^15
LN2_LO = F(float(mpmath.log(2) - mpmath.mpf(0.693359375)))


def nodes(low, high, n=1500):
    """Chebyshev nodes of [low, high], ends excluded."""
    return 0.5 * (low + high) - 0.5 * (high - low) * np.cos(math.pi * (np.arange(n) + 0.5) / n)


def reference(function, x):
    return np.array([float(function(mpmath.mpf(float(value)))) for value in x])


def lawson(basis, target, weight):
    """Coefficients that minimise max |weight (basis c - target)|, by Lawson's iteration."""
    importance = np.full(len(target), 1.0 / len(target))
    best, best_error = None, math.inf
    for _ in range(400):
        row = np.sqrt(importance) * weight
        c = np.linalg.lstsq(basis * row[:, None], target * row, rcond=None)[0]
        error = np.abs(weight * (basis @ c - target))
        if error.max() < best_error:
            best, best_error = c, error.max()
        importance *= error
        importance /= importance.sum()
    return best, best_error


def fit(x, target, weight, degree, fixed=()):
    """Polynomial in x with float32 coefficients. `fixed` gives the lowest ones."""
    powers = x[:, None] ** np.arange(degree + 1)
    c = [float(F(value)) for value in fixed]
    while len(c) <= degree:
        k = len(c)
        rest, _ = lawson(powers[:, k:], target - powers[:, :k] @ np.array(c), weight)
        c.append(float(F(rest[0])))
    exact_error = np.abs(weight * (powers @ np.array(c) - target)).max()
    return [F(value) for value in c], exact_error


def multiply_add(a, b, c, fused):
    if fused:  # the product of two floats is exact in double; the sum is rounded twice
        return (a.astype(np.float64) * np.float64(b) + c).astype(F)
    return F(a * b) + c


def horner(c, x, fused):
    value = np.full_like(x, c[-1])
    for coefficient in c[-2::-1]:
        value = multiply_add(value, x, coefficient, fused)
    return value


def ulps(value, exact):
    """Error in units of the last place of the exact value."""
    return np.abs(value.astype(np.float64) - exact) / np.spacing(np.abs(exact).astype(F))


def asin32(p, c, fused):
    """asin(1 - c), c in [0, 1]: pi/2 - sqrt(c) P(c)."""
    return multiply_add(-np.sqrt(c), horner(p, c, fused), HALF_PI, fused)


def exp32(c, x, fused):
    """exp(x) = 2^n (1 + f + f^2 q(f)), f = x - n ln2, for x in [-87, 88]."""
    n = np.rint(x * F(1.44269504))
    f = multiply_add(-n, LN2_HI, x, fused)
    f = multiply_add(-n, LN2_LO, f, fused)
    tail = multiply_add(F(f * f), horner(c, f, fused), f, fused)
    return np.ldexp(tail + F(1), n.astype(np.int32))


def exp2_32(c, x, fused):
    """2^x = 2^n p(f), f = x - n exactly, for x in [-100, 0]."""
    n = np.rint(x)
    return np.ldexp(horner(c, x - n, fused), n.astype(np.int32))


def upper_tail32(scale, c, exp_c, z, fused):
    """Q(z) = 1 - Phi(z) for z >= 0: exp(-z^2/2) t P(t), t = 1 / (1 + scale z)."""
    t = F(1) / multiply_add(z, scale, F(1), fused)
    return exp32(exp_c, F(-0.5) * F(z * z), fused) * F(t * horner(c, t, fused))


def sin32(c, x, fused):
    """x + x^3 s(x^2) for |x| <= pi/4."""
    x2 = x * x
    return multiply_add(F(x * x2), horner(c, x2, fused), x, fused)


def cos32(c, x, fused):
    """1 - x^2/2 + x^4 q(x^2) for |x| <= pi/4."""
    x2 = x * x
    rest = multiply_add(F(x2 * x2), horner(c, x2, fused), F(-0.5) * x2, fused)
    return rest + F(1)


def acos_of_complement(c):
    """acos(1 - c) in double."""
    return 2.0 * np.arcsin(np.sqrt(c.astype(np.float64) / 2.0))


def at_one(p):
    """Value of the polynomial at 1 by Horner's rule."""
    return horner(p, np.ones(1, dtype=F), False)[0]


def with_asin_0(p):
    """Add the lowest coefficient, so that P(1) = pi/2 and asin(0) = 0."""
    return [HALF_PI - at_one([F(0), *p]), *p]


def settle_last_bits(p, error):
    """Change coefficients at random by a few last places, 400 times. Keep what lowers the error."""
    random = np.random.default_rng(1)
    best = error(p)
    for _ in range(400):
        q = with_asin_0([F(value + np.spacing(p[0]) * random.normal()) for value in p[1:]])
        if at_one(q) == HALF_PI and error(q) < best:
            best, p = error(q), q
    return p


def fit_asin(degree):
    """P of asin(1 - c) = pi/2 - sqrt(c) P(c) with P(1) = pi/2. The highest power is rounded first.
    With p[0] = pi/2 - p[1] - ... the fitted part is 0 at c = 1."""
    c = nodes(0.0, 1.0)
    half_pi = mpmath.mpf(float(HALF_PI))
    target = reference(lambda v: mpmath.acos(1 - v) / mpmath.sqrt(v) - half_pi, c)
    powers = c[:, None] ** np.arange(1, degree + 1) - 1.0
    p = np.zeros(degree)
    for k in range(degree - 1, -1, -1):
        rest, _ = lawson(powers[:, :k + 1], target - powers @ p, np.sqrt(c))
        p[k] = F(rest[k])
    exact = np.abs(np.sqrt(c) * (powers @ p - target)).max()
    grid = np.linspace(0.0, 1.0, 400_001).astype(F)
    asin = math.pi / 2 - acos_of_complement(grid)

    def error(p):
        return max(np.abs(asin32(p, grid, fused) - asin).max() for fused in (False, True))

    return settle_last_bits(with_asin_0([F(value) for value in p]), error), exact


def fit_exp(degree):
    f = nodes(-0.5 * math.log(2) * 1.001, 0.5 * math.log(2) * 1.001, 1500)
    q = reference(lambda v: (mpmath.expm1(v) - v) / v**2, f)
    return fit(f, q, f**2 / np.exp(f), degree)


def fit_exp2(degree):
    f = nodes(-0.5001, 0.5001)
    return fit(f, np.exp2(f), np.exp2(-f), degree, fixed=[1.0])


def fit_upper_tail(degree, z_max=14.0):
    """Q over 0 <= z <= z_max, with the best of several scales.

    The weight limits the absolute error of Q near 0. In the tail it changes to a limit on the
    relative error, which may be 50 times larger.
    """
    def mills(z):
        return mpmath.erfc(z / mpmath.sqrt(2)) / 2 * mpmath.exp(z * z / 2)

    best = (math.inf, None, None)
    for scale in np.arange(0.20, 0.52, 0.02):
        scale = F(scale)
        t = nodes(1.0 / (1.0 + float(scale) * z_max), 1.0)
        m = reference(lambda v: mills((1 / v - 1) / mpmath.mpf(float(scale))) / v, t)
        weight = np.array([max(math.erfc((1 / v - 1) / float(scale) / math.sqrt(2)), 0.02)
                           for v in t]) / m
        powers = t[:, None] ** np.arange(degree + 1)
        _, error = lawson(powers, m, weight)
        if error < best[0]:
            best = (error, scale, (t, m, weight))
    _, scale, (t, m, weight) = best
    c, error = fit(t, m, weight, degree)
    return scale, c, error


def fit_sin_cos():
    x = nodes(1e-3, math.pi / 4 * 1.001)
    s = reference(lambda v: (mpmath.sin(v) - v) / v**3, x)
    q = reference(lambda v: (mpmath.cos(v) - 1 + v * v / 2) / v**4, x)
    sin_c, sin_error = fit(x**2, s, x**2, 2)
    cos_c, cos_error = fit(x**2, q, x**4, 2)
    return sin_c, sin_error, cos_c, cos_error


def split_half_pi():
    """pi/2 in three floats. The first two have 11 bits: n times each is exact for n < 8192."""
    rest, parts = mpmath.pi / 2, []
    for bits in (11, 11, 24):
        scale = mpmath.mpf(2) ** (bits - 1 - int(mpmath.floor(mpmath.log(rest, 2))))
        part = (mpmath.nint if bits == 24 else mpmath.floor)(rest * scale) / scale
        parts.append(F(float(part)))
        rest -= part
    return parts


def literals(name, values):
    body = ", ".join(f"{float(v):.9g}f" if "." in f"{float(v):.9g}" or "e" in f"{float(v):.9g}"
                     else f"{float(v):.9g}.0f" for v in values)
    return f"{name} = {{{body}}}  // lowest power first"


def report_asin(lines, degree):
    p, exact = fit_asin(degree)
    c = np.unique(np.concatenate([np.linspace(0, 1, 2_000_001), np.geomspace(1e-7, 1, 200_000)])
                  .astype(F))
    truth = math.pi / 2 - acos_of_complement(c)
    errors = [np.abs(asin32(p, c, fused) - truth).max() for fused in (False, True)]
    lines += ["", f"(a) asin(1 - c) = pi/2 - sqrt(c) P(c), 0 <= c <= 1, P of degree {degree}",
              literals("asin_p", p),
              f"    max |error|: exact arithmetic {exact:.3g}, float32 plain {errors[0]:.3g}, "
              f"fused {errors[1]:.3g}; asin(0) = {asin32(p, c[-1:], False)[0]:g}, "
              f"asin(1) - pi/2 = {float(asin32(p, c[:1], False)[0]) - math.pi / 2:.2g}"]


def report_exp(lines, degree):
    c, exact = fit_exp(degree)
    x = np.linspace(-87.0, 88.0, 3_000_001).astype(F)
    near = np.linspace(-1.0, 1.0, 1_000_001).astype(F)
    worst = [max(ulps(exp32(c, g, fused), np.exp(g.astype(np.float64))).max() for g in (x, near))
             for fused in (False, True)]
    lines += ["", f"(b) exp(x) = 2^n (1 + f + f^2 q(f)), q of degree {degree} "
              f"(degree {degree + 2} in all); n = rint(x * 1.44269504f), "
              f"f = (x - n ln2_hi) - n ln2_lo",
              literals("exp_q", c),
              literals("ln2 hi, lo", [LN2_HI, LN2_LO]),
              f"    relative error {exact:.3g} in exact arithmetic; worst over [-87, 88]: "
              f"plain {worst[0]:.2f} ulp, fused {worst[1]:.2f} ulp"]
    return c


def report_exp2(lines, degree):
    c, exact = fit_exp2(degree)
    x = np.linspace(-100.0, 0.0, 4_000_001).astype(F)
    worst = [ulps(exp2_32(c, x, fused), np.exp2(x.astype(np.float64))).max()
             for fused in (False, True)]
    lines += ["", f"(e) 2^x = 2^n p(f), p of degree {degree}, p(0) = 1; n = rint(x), f = x - n",
              literals("exp2_p", c),
              f"    relative error {exact:.3g} in exact arithmetic; worst over [-100, 0]: "
              f"plain {worst[0]:.2f} ulp, fused {worst[1]:.2f} ulp"]


def report_upper_tail(lines, degree, exp_c):
    scale, c, exact = fit_upper_tail(degree)
    z = np.linspace(0.0, 13.0, 520_001).astype(F)
    exact_q = np.array([0.5 * math.erfc(float(v) / math.sqrt(2)) for v in z])
    lines += ["", f"(c) Q(z) = 1 - Phi(z) = exp(-z^2/2) t P(t), t = 1 / (1 + scale z), z >= 0, "
              f"P of degree {degree}; Phi(z) = 1 - Q(z) for z >= 0, Q(-z) for z < 0",
              literals("phi_scale", [scale]), literals("phi_c", c),
              f"    weighted error (2 Q relative, at least 0.02 relative) in exact arithmetic "
              f"{exact:.3g} (0 <= z <= 14)"]
    for fused in (False, True):
        q = upper_tail32(scale, c, exp_c, z, fused)
        relative = np.abs(q - exact_q) / exact_q
        phi_error = np.abs((F(1) - q).astype(np.float64) - (1 - exact_q)).max()
        slope = np.diff(q)
        steps_up = slope[slope > 0] / q[1:][slope > 0] if (slope > 0).any() else np.array([0.0])
        lines.append(f"    {'fused' if fused else 'plain'}: |error| of Q "
                     f"{np.abs(q - exact_q).max():.3g}, of Phi {phi_error:.3g}; "
                     f"relative error of Q for z <= 6: "
                     f"{relative[z <= 6].max():.3g}, z <= 13: {relative.max():.3g}; "
                     f"largest step against monotony (grid 2.5e-5): {steps_up.max():.2g} relative; "
                     f"Q(0) = {q[0]:.9g}")


def report_sin_cos(lines):
    sin_c, sin_error, cos_c, cos_error = fit_sin_cos()
    x = np.linspace(-math.pi / 4, math.pi / 4, 2_000_001).astype(F)
    exact = x.astype(np.float64)
    nonzero = x != 0
    lines += ["", "(d) |x| <= pi/4: sin(x) = x + (x x^2) s(x^2); "
              "cos(x) = 1 + (-0.5 x^2 + (x^2 x^2) q(x^2))",
              literals("sin_s", sin_c), literals("cos_q", cos_c),
              literals("pi/2 in three parts (11, 11, 24 bits; exact products for |n| < 8192)",
                       split_half_pi()),
              f"    exact arithmetic: sin {sin_error:.3g} relative, cos {cos_error:.3g} absolute"]
    for fused in (False, True):
        worst_sin = ulps(sin32(sin_c, x[nonzero], fused), np.sin(exact[nonzero])).max()
        worst_cos = ulps(cos32(cos_c, x, fused), np.cos(exact)).max()
        lines.append(f"    {'fused' if fused else 'plain'}: sin {worst_sin:.2f} ulp, "
                     f"cos {worst_cos:.2f} ulp")


def main():
    lines = ["Float32 elementary functions, from tools/dev/fit_elementary.py"]
    report_asin(lines, 6)
    report_asin(lines, 7)
    report_exp(lines, 3)
    exp_c = report_exp(lines, 4)
    for degree in (5, 6, 7):
        report_upper_tail(lines, degree, exp_c)
    report_sin_cos(lines)
    report_exp2(lines, 5)
    report_exp2(lines, 6)
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if len(sys.argv) > 1:
        with open(sys.argv[1], "w", encoding="utf-8") as output:
            output.write(text)


if __name__ == "__main__":
    main()

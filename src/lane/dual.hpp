/// \file dual.hpp
/// Dual numbers: a number on lanes, and its derivatives by the x and the y of the query. A template
/// of the hot path that gets dual numbers computes the same value to the bit, and its derivatives
/// by the chain rule (forward automatic differentiation).
///
/// The overloads in namespace lane must be declared before the templates that call them, so that
/// kernel.hpp includes this file. No library has dual numbers on lanes: ceres::Jet and Eigen's
/// AutoDiffScalar need scalars whose comparison gives a bool.
#pragma once

#include "src/lane/elementary.hpp"

namespace gpom
{

template <class F> struct Dual {
    F value, by_x, by_y;
};

/// A number that does not move with the query.
template <class F> inline Dual<F> fixed(F value)
{
    const F zero = lane::splat<F>(0.0f);
    return {value, zero, zero};
}

/// f of a number, from the value of f there and its slope.
template <class F> inline Dual<F> chain(const Dual<F> &a, F value, F slope)
{
    return {value, slope * a.by_x, slope * a.by_y};
}

template <class F> inline Dual<F> operator-(const Dual<F> &a)
{
    return {-a.value, -a.by_x, -a.by_y};
}

template <class F> inline Dual<F> operator+(const Dual<F> &a, const Dual<F> &b)
{
    return {a.value + b.value, a.by_x + b.by_x, a.by_y + b.by_y};
}

template <class F> inline Dual<F> operator-(const Dual<F> &a, const Dual<F> &b)
{
    return {a.value - b.value, a.by_x - b.by_x, a.by_y - b.by_y};
}

template <class F> inline Dual<F> operator*(const Dual<F> &a, const Dual<F> &b)
{
    return {a.value * b.value, lane::fma(a.value, b.by_x, F(a.by_x * b.value)),
            lane::fma(a.value, b.by_y, F(a.by_y * b.value))};
}

template <class F> inline Dual<F> operator/(const Dual<F> &a, const Dual<F> &b)
{
    const F inverse = 1.0f / b.value;
    const F quotient = a.value / b.value;
    return {quotient, inverse * lane::minus_product(a.by_x, quotient, b.by_x),
            inverse * lane::minus_product(a.by_y, quotient, b.by_y)};
}

template <class F> inline Dual<F> operator+(const Dual<F> &a, float b)
{
    return {a.value + b, a.by_x, a.by_y};
}

template <class F> inline Dual<F> operator+(float a, const Dual<F> &b) { return b + a; }

template <class F> inline Dual<F> operator-(const Dual<F> &a, float b)
{
    return {a.value - b, a.by_x, a.by_y};
}

template <class F> inline Dual<F> operator-(float a, const Dual<F> &b)
{
    return {a - b.value, -b.by_x, -b.by_y};
}

template <class F> inline Dual<F> operator*(float a, const Dual<F> &b)
{
    return {a * b.value, a * b.by_x, a * b.by_y};
}

template <class F> inline Dual<F> operator*(const Dual<F> &a, float b) { return b * a; }

template <class F> inline Dual<F> operator/(float a, const Dual<F> &b)
{
    const F quotient = a / b.value;
    return chain(b, quotient, F(-quotient / b.value));
}

template <class F> inline auto operator<(const Dual<F> &a, float b) { return a.value < b; }
template <class F> inline auto operator>(const Dual<F> &a, float b) { return a.value > b; }
template <class F> inline auto operator<(const Dual<F> &a, const Dual<F> &b)
{
    return a.value < b.value;
}
template <class F> inline auto operator==(const Dual<F> &a, const Dual<F> &b)
{
    return a.value == b.value;
}

template <class F> inline Dual<F> log_positive(const Dual<F> &a)
{
    return chain(a, log_positive(a.value), F(1.0f / a.value));
}

/// The slope is the normal density. Beyond |z| = 13 it is 0.
template <class F> inline Dual<F> normal_cdf(const Dual<F> &z)
{
    constexpr float kInvSqrtTwoPi = 0.398942280f;
    const F density = kInvSqrtTwoPi * exp_nonpositive(F(-0.5f * (z.value * z.value)));
    return chain(z, normal_cdf(z.value), density);
}

namespace lane
{

template <class F> inline Dual<float> get(const Dual<F> &a, int i)
{
    return {get(a.value, i), get(a.by_x, i), get(a.by_y, i)};
}

template <class F> inline void set(Dual<F> &a, int i, const Dual<float> &b)
{
    set(a.value, i, b.value);
    set(a.by_x, i, b.by_x);
    set(a.by_y, i, b.by_y);
}

template <class M, class F> inline Dual<F> select(M mask, const Dual<F> &a, const Dual<F> &b)
{
    return {select(mask, a.value, b.value), select(mask, a.by_x, b.by_x),
            select(mask, a.by_y, b.by_y)};
}

/// The value is that of min() for plain numbers. Where the two are equal, the derivatives are b's.
template <class F> inline Dual<F> min(const Dual<F> &a, const Dual<F> &b)
{
    const auto is_a = a.value < b.value;
    return {min(a.value, b.value), select(is_a, a.by_x, b.by_x), select(is_a, a.by_y, b.by_y)};
}

template <class F> inline Dual<F> max(const Dual<F> &a, const Dual<F> &b)
{
    const auto is_a = a.value > b.value;
    return {max(a.value, b.value), select(is_a, a.by_x, b.by_x), select(is_a, a.by_y, b.by_y)};
}

template <class F> inline Dual<F> fma(const Dual<F> &a, const Dual<F> &b, const Dual<F> &c)
{
    return {fma(a.value, b.value, c.value), fma(a.value, b.by_x, fma(a.by_x, b.value, c.by_x)),
            fma(a.value, b.by_y, fma(a.by_y, b.value, c.by_y))};
}

/// At 0 the square root has no derivative. The function returns 0 there: the distance to a point
/// has a kink at the point, and 0 is the mean of the slopes on its two sides.
template <class F> inline Dual<F> sqrt(const Dual<F> &a)
{
    const F root = sqrt(a.value);
    const F one = splat<F>(1.0f);
    const auto is_smooth = root > 0.0f;
    const F slope = select(is_smooth, F(0.5f / select(is_smooth, root, one)), splat<F>(0.0f));
    return chain(a, root, slope);
}

} // namespace lane
} // namespace gpom

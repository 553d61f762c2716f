/// \file chol.hpp
/// Cholesky factor of a small covariance matrix, row by row, on lanes.
#pragma once

#include "src/lane.hpp"

#include <float.h>
#include <stddef.h>

namespace gpom
{

/// Place of row i in a packed lower triangle by rows: A(i, j) at tri(i) + j, j <= i.
constexpr size_t tri(size_t i) { return i * (i + 1) / 2; }

/// L with A = L L^T. The diagonal is kept as its reciprocal.
template <class F> struct Factor {
    F *l;            ///< tri(n) lanes, packed lower by rows.
    F *inv_diagonal; ///< n lanes.
    F bad;           ///< 0, or 1 in lanes where a pivot was not finite and positive.
};

/// start - a . b over n elements.
template <class F> inline F minus_dot(F start, const F *a, const F *b, size_t n)
{
    for (size_t j = 0; j < n; ++j) {
        start = lane::fma(F(-a[j]), b[j], start);
    }
    return start;
}

/// Row i of L from row i of A, which stands in its place, and the rows above (Golub and Van Loan,
/// 4th ed., sec. 4.2). A bad pivot is noted and replaced by 1, so that no NaN spreads.
/// i^2 / 2 multiply-adds.
template <class F> inline void factor_row(Factor<F> &factor, size_t i)
{
    F *const row = factor.l + tri(i);
    for (size_t j = 0; j < i; ++j) {
        row[j] = minus_dot(row[j], row, factor.l + tri(j), j) * factor.inv_diagonal[j];
    }
    const F one = lane::splat<F>(1.0f);
    F pivot = minus_dot(row[i], row, row, i);
    const auto good = (pivot > 0.0f) & (pivot <= FLT_MAX); // a NaN fails both
    factor.bad = lane::select(good, factor.bad, one);
    pivot = lane::select(good, pivot, one);
    factor.inv_diagonal[i] = 1.0f / lane::sqrt(pivot);
}

/// Element i of z in L z = b, from b_i and the elements of z before it.
template <class F> inline F forward(const Factor<F> &factor, size_t i, F b_i, const F *z)
{
    return minus_dot(b_i, factor.l + tri(i), z, i) * factor.inv_diagonal[i];
}

} // namespace gpom

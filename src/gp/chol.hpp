/// \file chol.hpp
/// Cholesky factor of a small covariance matrix, four rows at a time, on lanes.
///
/// The factor stands in block rows of kTile rows, each a panel that is read from front to back: row
/// 4 i + r, column p at panel_at(i) + 4 p + r. What is subtracted from a tile of 4 x 4 elements is
/// summed in registers, so that of the rows above each element is read once for four.
#pragma once

#include "src/lane/lane.hpp"

#include <float.h>
#include <stddef.h>

namespace gpom
{

/// Rows and columns of a tile.
constexpr size_t kTile = 4;

constexpr size_t tile_count(size_t n) { return (n + kTile - 1) / kTile; }

/// Where block row i begins. Those before it end on the diagonal: 4 x 4, 4 x 8, 4 x 12 elements ...
constexpr size_t panel_at(size_t i) { return kTile * kTile * (i * (i + 1) / 2); }

/// L with A = L L^T. The diagonal is kept as its reciprocal; what stands above it is unspecified,
/// and in a bad lane what follows its first bad pivot.
template <class F> struct Factor {
    F *l;  ///< panel_at(tile_count(n)) lanes.
    F bad; ///< 0, or 1 in lanes where a pivot was not finite, normal and positive.
};

/// 4 x 4 elements in registers, by columns as in a panel.
template <class F> struct Tile {
    F at[kTile][kTile];
};

template <class F> inline Tile<F> load_tile(const F *panel)
{
    Tile<F> tile;
#pragma GCC unroll 4
    for (size_t c = 0; c < kTile; ++c) {
#pragma GCC unroll 4
        for (size_t r = 0; r < kTile; ++r) {
            tile.at[c][r] = panel[kTile * c + r];
        }
    }
    return tile;
}

/// Columns [first, end) of tile - A B^T over the first n columns of two panels.
template <size_t first, size_t end, class F>
inline void subtract_from_columns(Tile<F> &tile, const F *a, const F *b, size_t n)
{
    for (size_t p = 0; p < n; ++p, a += kTile, b += kTile) {
#pragma GCC unroll 4
        for (size_t c = first; c < end; ++c) {
#pragma GCC unroll 4
            for (size_t r = 0; r < kTile; ++r) {
                tile.at[c][r] = lane::minus_product(tile.at[c][r], a[r], b[c]);
            }
        }
    }
}

/// tile - A B^T, half of the tile at a time where all of it does not fit in registers.
template <class F> inline void subtract_products(Tile<F> &tile, const F *a, const F *b, size_t n)
{
    constexpr bool fits = kTile * kTile < lane::registers<F>;
    if constexpr (fits) {
        subtract_from_columns<0, kTile>(tile, a, b, n);
    } else {
        subtract_from_columns<0, kTile / 2>(tile, a, b, n);
        subtract_from_columns<kTile / 2, kTile>(tile, a, b, n);
    }
}

/// The same for a tile on the diagonal, of which the lower triangle counts.
template <class F> inline void subtract_squares(Tile<F> &tile, const F *a, size_t n)
{
    for (size_t p = 0; p < n; ++p, a += kTile) {
#pragma GCC unroll 4
        for (size_t c = 0; c < kTile; ++c) {
#pragma GCC unroll 4
            for (size_t r = c; r < kTile; ++r) {
                tile.at[c][r] = lane::minus_product(tile.at[c][r], a[r], a[c]);
            }
        }
    }
}

/// tile L^-T for the triangle of a diagonal tile, put into its place in the panel.
template <class F> inline void solve_tile(Tile<F> &tile, const F *diagonal, F *panel)
{
#pragma GCC unroll 4
    for (size_t c = 0; c < kTile; ++c) {
#pragma GCC unroll 4
        for (size_t p = 0; p < c; ++p) {
#pragma GCC unroll 4
            for (size_t r = 0; r < kTile; ++r) {
                tile.at[c][r] =
                    lane::minus_product(tile.at[c][r], tile.at[p][r], diagonal[kTile * p + c]);
            }
        }
#pragma GCC unroll 4
        for (size_t r = 0; r < kTile; ++r) {
            tile.at[c][r] = tile.at[c][r] * diagonal[kTile * c + c];
        }
    }
#pragma GCC unroll 4
    for (size_t c = 0; c < kTile; ++c) {
#pragma GCC unroll 4
        for (size_t r = 0; r < kTile; ++r) {
            panel[kTile * c + r] = tile.at[c][r];
        }
    }
}

/// Note where a pivot is bad. What its lane computes from then on is not used; that the division
/// does not wait for this is worth 7 % of a solve of 16 points.
template <class F> inline void check_pivot(F pivot, F &bad)
{
    const auto good = (pivot >= FLT_MIN) & (pivot <= FLT_MAX); // a NaN fails both
    bad = lane::select(good, bad, lane::splat<F>(1.0f));
}

/// Factor a tile on the diagonal into its place in the panel. What a column takes away is
/// (a / pivot) a', not l l': so the next pivot waits for a division, and for no root after it.
template <class F> inline void factor_tile(Tile<F> &tile, F *panel, F &bad)
{
#pragma GCC unroll 4
    for (size_t c = 0; c < kTile; ++c) {
        check_pivot(tile.at[c][c], bad);
        const F inverse = 1.0f / tile.at[c][c];
        const F inv_root = lane::sqrt(inverse);
        panel[kTile * c + c] = inv_root;
#pragma GCC unroll 4
        for (size_t r = c + 1; r < kTile; ++r) {
            const F share = tile.at[c][r] * inverse;
            panel[kTile * c + r] = tile.at[c][r] * inv_root;
#pragma GCC unroll 4
            for (size_t p = c + 1; p <= r; ++p) {
                tile.at[p][r] = lane::minus_product(tile.at[p][r], share, tile.at[c][p]);
            }
        }
    }
}

/// Block row i of L from block row i of A, which stands in its place, and the rows above (Golub
/// and Van Loan, 4th ed., sec. 4.2, by blocks). Each element sees the products in the order of
/// their columns, as in the unblocked algorithm. 8 (i + 1)^2 multiply-adds of four.
template <class F> inline void factor_block_row(Factor<F> &factor, size_t i)
{
    F *const panel = factor.l + panel_at(i);
    for (size_t j = 0; j < i; ++j) {
        const F *const above = factor.l + panel_at(j);
        F *const place = panel + kTile * kTile * j;
        Tile<F> tile = load_tile(place);
        subtract_products(tile, panel, above, kTile * j);
        solve_tile(tile, above + kTile * kTile * j, place);
    }
    F *const place = panel + kTile * kTile * i;
    Tile<F> tile = load_tile(place);
    subtract_squares(tile, panel, kTile * i);
    factor_tile(tile, place, factor.bad);
}

/// Elements 4 i to 4 i + 3 of u and v in L u = b and L v = c: in their place stand those of b and
/// c, before them u and v. Each element of L is read once for both.
template <class F> inline void forward_block(const Factor<F> &factor, size_t i, F *u, F *v)
{
    const F *a = factor.l + panel_at(i);
    F *const u_i = u + kTile * i;
    F *const v_i = v + kTile * i;
    F sum_u[kTile] = {u_i[0], u_i[1], u_i[2], u_i[3]};
    F sum_v[kTile] = {v_i[0], v_i[1], v_i[2], v_i[3]};
    for (size_t p = 0; p < kTile * i; ++p, a += kTile) {
#pragma GCC unroll 4
        for (size_t r = 0; r < kTile; ++r) {
            sum_u[r] = lane::minus_product(sum_u[r], a[r], u[p]);
            sum_v[r] = lane::minus_product(sum_v[r], a[r], v[p]);
        }
    }
#pragma GCC unroll 4
    for (size_t c = 0; c < kTile; ++c, a += kTile) {
        u_i[c] = sum_u[c] = sum_u[c] * a[c];
        v_i[c] = sum_v[c] = sum_v[c] * a[c];
#pragma GCC unroll 4
        for (size_t r = c + 1; r < kTile; ++r) {
            sum_u[r] = lane::minus_product(sum_u[r], a[r], sum_u[c]);
            sum_v[r] = lane::minus_product(sum_v[r], a[r], sum_v[c]);
        }
    }
}

} // namespace gpom

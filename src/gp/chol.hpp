/// \file chol.hpp
/// Cholesky factor of a small covariance matrix, four rows at a time, on lanes.
///
/// The factor is stored in block rows of kTile rows. Each block row is a panel that is read from
/// front to back: row 4 i + r, column p is at panel_at(i) + 4 p + r. A tile of 4 x 4 elements stays
/// in registers while products are subtracted from it. So each element of the panels is read once
/// for four products.
#pragma once

#include "src/lane/four.hpp"

#include <float.h>
#include <stddef.h>

namespace gpom
{

/// Rows and columns of a tile.
constexpr size_t kTile = 4;

constexpr size_t tile_count(size_t n) { return (n + kTile - 1) / kTile; }

/// Where block row i begins. Each block row ends on the diagonal, so that the block rows have
/// 4 x 4, 4 x 8, 4 x 12 elements ...
constexpr size_t panel_at(size_t i) { return kTile * kTile * (i * (i + 1) / 2); }

/// L with A = L L^T. The diagonal holds reciprocals. Elements above the diagonal are unspecified.
/// In a bad lane, all elements after the first bad pivot are unspecified too.
template <class F> struct Factor {
    F *l;  ///< panel_at(tile_count(n)) lanes.
    F bad; ///< 0, or 1 in lanes where a pivot was not finite, normal and positive.
};

/// 4 x 4 elements in registers, stored by columns as in a panel.
template <class F> struct Tile {
    F at[kTile][kTile];
};

template <class F> inline Tile<F> load_tile(const F *panel)
{
    Tile<F> tile;
    lane::load_four<0>(panel, tile.at[0]);
    lane::load_four<1>(panel + kTile, tile.at[1]);
    lane::load_four<2>(panel + 2 * kTile, tile.at[2]);
    lane::load_four<3>(panel + 3 * kTile, tile.at[3]);
    return tile;
}

/// Columns [first, end) of tile - A B^T. A and B are the first n columns of two panels.
template <size_t first, size_t end, class F>
inline void subtract_from_columns(Tile<F> &tile, const F *a, const F *b, size_t n)
{
    for (size_t p = 0; p < n; ++p, a += kTile, b += kTile) {
        F a_p[kTile];
        lane::load_four<4>(a, a_p);
        F b_p[kTile];
        lane::load_four<5>(b, b_p);
#pragma GCC unroll 4
        for (size_t c = first; c < end; ++c) {
#pragma GCC unroll 4
            for (size_t r = 0; r < kTile; ++r) {
                tile.at[c][r] = lane::minus_product(tile.at[c][r], a_p[r], b_p[c]);
            }
        }
    }
}

/// tile - A B^T. If the tile does not fit in registers, its two halves are computed one after the
/// other.
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

/// tile - A A^T for a tile on the diagonal. Only the lower triangle is computed.
template <class F> inline void subtract_squares(Tile<F> &tile, const F *a, size_t n)
{
    for (size_t p = 0; p < n; ++p, a += kTile) {
        F a_p[kTile];
        lane::load_four<4>(a, a_p);
#pragma GCC unroll 4
        for (size_t c = 0; c < kTile; ++c) {
#pragma GCC unroll 4
            for (size_t r = c; r < kTile; ++r) {
                tile.at[c][r] = lane::minus_product(tile.at[c][r], a_p[r], a_p[c]);
            }
        }
    }
}

/// tile L^-T, where L is the triangle of a diagonal tile. The result is stored in the panel.
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
    lane::store_four<0>(tile.at[0], panel);
    lane::store_four<1>(tile.at[1], panel + kTile);
    lane::store_four<2>(tile.at[2], panel + 2 * kTile);
    lane::store_four<3>(tile.at[3], panel + 3 * kTile);
}

/// Mark the lanes whose pivot is bad. Later results of a bad lane are not used. The division by the
/// pivot does not wait for this check, which saves 7 % of the time of a solve of 16 points.
template <class F> inline void check_pivot(F pivot, F &bad)
{
    const auto good = (pivot >= FLT_MIN) & (pivot <= FLT_MAX); // a NaN fails both
    bad = lane::select(good, bad, lane::splat<F>(1.0f));
}

/// Factor a tile on the diagonal and store the factor in the panel. A column subtracts
/// (a / pivot) a' from the columns after it, not l l'. So the next pivot waits for a division, but
/// not for a square root after the division.
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

/// Replace block row i of A by block row i of L (Golub and Van Loan, 4th ed., sec. 4.2, by blocks).
/// The block rows above hold L already. Products are subtracted from an element in the order of
/// their columns, as in the algorithm without blocks.
/// Cost: 8 (i + 1)^2 multiply-adds of four elements.
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

/// Solve L u = b and L v = c for the elements 4 i to 4 i + 3 of u and v. On entry these elements
/// hold b and c, and the elements before them hold u and v. Each element of L is read once for both
/// systems.
template <class F> inline void forward_block(const Factor<F> &factor, size_t i, F *u, F *v)
{
    const F *a = factor.l + panel_at(i);
    F *const u_i = u + kTile * i;
    F *const v_i = v + kTile * i;
    F sum_u[kTile] = {u_i[0], u_i[1], u_i[2], u_i[3]};
    F sum_v[kTile] = {v_i[0], v_i[1], v_i[2], v_i[3]};
    for (size_t p = 0; p < kTile * i; ++p, a += kTile) {
        F a_p[kTile];
        lane::load_four<4>(a, a_p);
#pragma GCC unroll 4
        for (size_t r = 0; r < kTile; ++r) {
            sum_u[r] = lane::minus_product(sum_u[r], a_p[r], u[p]);
            sum_v[r] = lane::minus_product(sum_v[r], a_p[r], v[p]);
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

/// \file sparse_gp.hpp
/// The Gaussian process of one large neighbourhood whose covariance has compact support. Most
/// elements of K + N are zero, so that K + N is stored and factored as a sparse matrix
/// (SuiteSparse: AMD and LDL).
///
/// The hot path is compiled for several instruction sets, each time in another namespace. The code
/// here is compiled once and is called from each of these namespaces. So its names are outside of
/// namespaces, as in hot_path.hpp.
#pragma once

#include <stddef.h>
#include <stdint.h>

#ifndef GPOM_SPARSE
#define GPOM_SPARSE 0 ///< 1: the library is linked with SuiteSparse.
#endif

/// One training point, relative to the query [m].
struct gpom_sparse_point {
    float x_m, y_m;
    float label; ///< +1 occupied, -1 free.
    float noise; ///< Noise variance.
};

/// k(r) = sf2 (1 - r / ell)^3 for r < ell, else 0 (Askey).
struct gpom_compact_kernel {
    float sf2, ell_m;
};

struct gpom_sparse_moments {
    float mean, variance;
    bool is_good; ///< K + N was positive definite. If not: mean and variance of the prior.
};

/// The points of a query, and memory for the solve.
struct gpom_sparse_system {
    gpom_sparse_point *points; ///< n_points, none of them absent. The solve changes their order.
    size_t n_points;
    void *mem; ///< gpom_sparse_bytes(n_points) bytes, 8-byte aligned.
};

/// Byte offsets of the arrays of a sparse solve. K + N and L are in CSC form (compressed columns).
/// The graph that AMD overwrites shares its memory with the values of L, which come later.
struct gpom_sparse_layout {
    size_t values, l_values, vectors, rows, l_rows, lists, total;
};

constexpr size_t kSparseVectors = 4; ///< d, y, u, v.
constexpr size_t kSparseLists = 13;  ///< Lists of n + 1 integers.

constexpr gpom_sparse_layout gpom_sparse_layout_of(size_t n)
{
    const size_t below_diagonal = n * (n - 1) / 2;
    gpom_sparse_layout layout = {};
    layout.l_values = layout.values + n * n * sizeof(double);
    layout.vectors = layout.l_values + below_diagonal * sizeof(double);
    layout.l_rows = layout.vectors + kSparseVectors * n * sizeof(double);
    layout.rows = layout.l_rows + below_diagonal * sizeof(int);
    layout.lists = layout.rows + n * n * sizeof(int);
    layout.total = layout.lists + kSparseLists * (n + 1) * sizeof(int);
    return layout;
}

constexpr size_t gpom_sparse_bytes(size_t n) { return gpom_sparse_layout_of(n).total; }

/// Mean and variance at the query (eqs. 2 and 3), computed in double:
///
///     P (K + N) P^T = L D L^T,  v = L^-1 P k*,  u = L^-1 P y
///     mean = sum of v u / D,  variance = k** - sum of v^2 / D
///
/// P puts the points into the order of elimination.
///
/// Cost: O(n log n + nonzeros of K) to assemble, and one multiply-add for each pair of nonzeros in
/// a column of L: at worst n^3 / 6.
gpom_sparse_moments gpom_sparse_predict(const gpom_compact_kernel &kernel,
                                        const gpom_sparse_system &system);

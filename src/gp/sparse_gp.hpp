/// \file sparse_gp.hpp
/// The Gaussian process of one large neighbourhood whose covariance has compact support: most of
/// K + N is zero, so that it is kept and factored as a sparse matrix (SuiteSparse: AMD and LDL).
///
/// The hot path is compiled for several instruction sets, each in a namespace of its own; this is
/// compiled once, and its names stand outside of namespaces as those of hot_path.hpp do.
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
    bool is_good; ///< K + N was positive definite; else mean and variance are the prior's.
};

/// The points of a query and the memory to solve with.
struct gpom_sparse_system {
    gpom_sparse_point *points; ///< n_points, none of them absent; their order is lost.
    size_t n_points;
    void *mem; ///< gpom_sparse_bytes(n_points), 8-byte aligned.
};

/// Byte offsets of what a sparse solve of n points works with. In CSC form: columns of K + N begin
/// at `starts`, row numbers and values follow each other. The graph that AMD consumes lies where L
/// will.
struct gpom_sparse_layout {
    size_t values, l_values, vectors, rows, l_rows, lists, total;
};

constexpr size_t kSparseVectors = 4; ///< d, y, u, v.
constexpr size_t kSparseLists = 13;  ///< Lists of n + 1 whole numbers.

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

/// Mean and variance at the query (eqs. 2 and 3): with P (K + N) P^T = L D L^T, v = L^-1 P k* and
/// u = L^-1 P y, the mean is the sum of v u / D, the variance k** - sum of v^2 / D.
///
/// In double. O(n log n + nonzeros of K) to assemble, then as many multiply-adds as L has pairs of
/// nonzeros in a column; at worst n^3 / 6.
gpom_sparse_moments gpom_sparse_predict(const gpom_compact_kernel &kernel,
                                        const gpom_sparse_system &system);

#include "src/gp/sparse_gp.hpp"

#include "src/base/arena.hpp"

#include <float.h>
#include <math.h>

extern "C" {
#include <suitesparse/amd.h>
#include <suitesparse/ldl.h>
}

namespace gpom
{
namespace
{

/// Both triangles of a symmetric matrix, by columns. Column j holds the entries [starts[j],
/// starts[j + 1]) of `rows` and `values`.
struct SparseMatrix {
    int *starts, *rows;
    double *values;
};

/// The graph of the nonzero elements of the same matrix, without its diagonal. AMD overwrites the
/// graph.
struct Graph {
    int *starts, *sizes, *neighbours;
    int n_edges, room;
};

/// The order of elimination. permutation[i] is the point at place i; inverse[j] is the place of
/// point j.
struct Order {
    int *permutation, *inverse;
};

/// L, by columns, with a diagonal of ones that is not stored, and D.
struct SparseFactor {
    int *starts, *parents, *sizes, *rows;
    double *values, *d;
};

/// All arrays that are carved from the caller's memory.
struct SparseWork {
    SparseMatrix k;
    Graph graph;
    Order order;
    SparseFactor factor;
    int *spare[6]; ///< Working lists of AMD and LDL.
    double *y, *u, *v;
};

SparseWork carve_work(void *mem, size_t n)
{
    const gpom_sparse_layout layout = gpom_sparse_layout_of(n);
    int *const lists = carve<int>(mem, layout.lists);
    double *const vectors = carve<double>(mem, layout.vectors);
    const auto list = [lists, n](size_t i) { return lists + i * (n + 1); };
    SparseWork work = {};
    work.k = {list(0), carve<int>(mem, layout.rows), carve<double>(mem, layout.values)};
    work.graph = {list(1), list(2), carve<int>(mem, layout.l_values), 0, 0};
    work.order = {list(3), list(4)};
    work.factor = {list(1),
                   list(5),
                   list(6),
                   carve<int>(mem, layout.l_rows),
                   carve<double>(mem, layout.l_values),
                   vectors};
    for (size_t i = 0; i < 6; ++i) {
        work.spare[i] = list(7 + i);
    }
    work.y = vectors + n;
    work.u = vectors + 2 * n;
    work.v = vectors + 3 * n;
    return work;
}

double covariance_at(const gpom_compact_kernel &kernel, double dx_m, double dy_m)
{
    const double ell_m = static_cast<double>(kernel.ell_m);
    const double u = 1.0 - sqrt(dx_m * dx_m + dy_m * dy_m) / ell_m;
    return u > 0.0 ? static_cast<double>(kernel.sf2) * u * u * u : 0.0;
}

/// Sort the points by x, so that points near each other are near in memory (Shell sort with the
/// gaps of Ciura, 2001).
void sort_by_x(gpom_sparse_point *points, size_t n)
{
    constexpr size_t kGaps[] = {301, 132, 57, 23, 10, 4, 1};
    for (const size_t gap : kGaps) {
        for (size_t i = gap; i < n; ++i) {
            const gpom_sparse_point moved = points[i];
            size_t j = i;
            for (; j >= gap && points[j - gap].x_m > moved.x_m; j -= gap) {
                points[j] = points[j - gap];
            }
            points[j] = moved;
        }
    }
}

/// Assemble K + N and its graph column by column. Points are sorted by x, so that a column needs to
/// look only at the points that are at most ell_m away along x.
void assemble(const gpom_compact_kernel &kernel, const gpom_sparse_system &system, SparseWork &work)
{
    const gpom_sparse_point *const points = system.points;
    SparseMatrix &k = work.k;
    Graph &graph = work.graph;
    int n_entries = 0;
    size_t first = 0;
    for (size_t j = 0; j < system.n_points; ++j) {
        k.starts[j] = n_entries;
        graph.starts[j] = graph.n_edges;
        const gpom_sparse_point own = points[j];
        while (own.x_m - points[first].x_m > kernel.ell_m) {
            ++first;
        }
        for (size_t i = first; i < system.n_points && !(points[i].x_m - own.x_m > kernel.ell_m);
             ++i) {
            const double dx_m = static_cast<double>(points[i].x_m - own.x_m);
            const double dy_m = static_cast<double>(points[i].y_m - own.y_m);
            const double covariance = covariance_at(kernel, dx_m, dy_m);
            if (i != j && !(covariance > 0.0)) {
                continue;
            }
            k.rows[n_entries] = static_cast<int>(i);
            k.values[n_entries++] =
                i == j ? covariance + static_cast<double>(own.noise) : covariance;
            if (i != j) {
                graph.neighbours[graph.n_edges++] = static_cast<int>(i);
            }
        }
        graph.sizes[j] = graph.n_edges - graph.starts[j];
    }
    k.starts[system.n_points] = n_entries;
    graph.room = graph.n_edges + static_cast<int>(system.n_points);
}

/// Find the order of elimination by approximate minimum degree (Amestoy, Davis and Duff 1996).
/// amd_2() is the entry point that allocates nothing.
void order_points(SparseWork &work, int n)
{
    const Graph &graph = work.graph;
    amd_2(n, graph.starts, graph.neighbours, graph.sizes, graph.room, graph.n_edges, work.spare[0],
          work.order.inverse, work.order.permutation, work.spare[1], work.spare[2], work.spare[3],
          work.spare[4], nullptr, nullptr);
}

/// Factor P (K + N) P^T = L D L^T (Davis 2005). Returns false if the matrix is not positive
/// definite.
bool factor(SparseWork &work, int n)
{
    const SparseMatrix &k = work.k;
    const SparseFactor &l = work.factor;
    ldl_symbolic(n, k.starts, k.rows, l.starts, l.parents, l.sizes, work.spare[0],
                 work.order.permutation, work.order.inverse);
    const int n_done = ldl_numeric(n, k.starts, k.rows, k.values, l.starts, l.parents, l.sizes,
                                   l.rows, l.values, l.d, work.y, work.spare[1], work.spare[0],
                                   work.order.permutation, work.order.inverse);
    for (int i = 0; i < n_done; ++i) {
        if (!(l.d[i] > 0.0 && l.d[i] <= DBL_MAX)) { // negated on purpose: NaN fails too
            return false;
        }
    }
    return n_done == n;
}

} // namespace
} // namespace gpom

gpom_sparse_moments gpom_sparse_predict(const gpom_compact_kernel &kernel,
                                        const gpom_sparse_system &system)
{
    using namespace gpom;
    const int n = static_cast<int>(system.n_points);
    if (n == 0) {
        return {0.0f, kernel.sf2, true};
    }
    SparseWork work = carve_work(system.mem, system.n_points);
    sort_by_x(system.points, system.n_points);
    assemble(kernel, system, work);
    order_points(work, n);
    if (!factor(work, n)) {
        return {0.0f, kernel.sf2, false};
    }
    for (int i = 0; i < n; ++i) {
        const gpom_sparse_point &point = system.points[work.order.permutation[i]];
        work.v[i] =
            covariance_at(kernel, static_cast<double>(point.x_m), static_cast<double>(point.y_m));
        work.u[i] = static_cast<double>(point.label);
    }
    const SparseFactor &l = work.factor;
    ldl_lsolve(n, work.v, l.starts, l.rows, l.values);
    ldl_lsolve(n, work.u, l.starts, l.rows, l.values);
    double mean = 0.0, explained = 0.0;
    for (int i = 0; i < n; ++i) {
        mean += work.v[i] * work.u[i] / l.d[i];
        explained += work.v[i] * work.v[i] / l.d[i];
    }
    const double variance = static_cast<double>(kernel.sf2) - explained;
    return {static_cast<float>(mean), static_cast<float>(variance > 0.0 ? variance : 0.0), true};
}

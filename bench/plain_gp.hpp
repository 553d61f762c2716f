// A straightforward program to compare with: Eigen of dynamic size, libm, one query at a time.
#ifndef GPOM_BENCH_PLAIN_GP_HPP
#define GPOM_BENCH_PLAIN_GP_HPP

#include "src/map/map.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gpom_bench
{

struct Neighbour {
    float d2;
    Eigen::Vector2f at; ///< Relative to the query.
};

template <class Part>
Neighbour neighbour_of(const Part &part, const gpom::Beam &beam, const gpom::Offset<float> &at)
{
    const gpom::Offset<float> to = gpom::to_segment(at, gpom::splat<float>(part(beam)));
    return {to.distance2(), {to.x_m, to.y_m}};
}

/// The k nearest beams, by comparing with all beams one by one.
template <class Part>
std::vector<Neighbour> nearest_by_force(const gpom::Index &index, const Part &part,
                                        const gpom::Offset<float> &at, std::size_t k)
{
    std::vector<Neighbour> all;
    for (std::uint32_t i = 0; i < index.n_slots; ++i) {
        if (Part::is_seen(index.beams[i])) {
            all.push_back(neighbour_of(part, index.beams[i], at));
        }
    }
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(std::min(k, all.size()));
    std::partial_sort(all.begin(), middle, all.end(),
                      [](const Neighbour &a, const Neighbour &b) { return a.d2 < b.d2; });
    all.erase(middle, all.end());
    return all;
}

/// The k nearest beams by the library's tree, for one query.
template <class Part>
std::vector<Neighbour> nearest_by_tree(const gpom::Index &index, const Part &part,
                                       const gpom::Offset<float> &at, std::size_t k)
{
    std::vector<gpom::Found<float>> best(k);
    gpom::Subtree stack[gpom::kDepthMax];
    gpom::NearestK<float> nearest = {best.data(), static_cast<std::uint32_t>(k), 0};
    nearest.clear();
    gpom::search(nearest, at, index, part, gpom::from_root(gpom::tree_of(index, part), stack));
    std::vector<Neighbour> found;
    for (const gpom::Found<float> &one : best) {
        if (one.slot >= 0) {
            found.push_back(neighbour_of(part, index.beams[one.slot], at));
        }
    }
    return found;
}

/// Covariance of the neural network (eq. 4), or Matern-1/2 for all other kernels.
inline float plain_covariance(const gpom_params_t &params, const Eigen::Vector2f &p,
                              const Eigen::Vector2f &q)
{
    if (params.kernel == GPOM_KERNEL_NN) {
        const float pq = 2.0f * (params.s0 + params.s1 * p.dot(q));
        const float pp = 2.0f * (params.s0 + params.s1 * p.dot(p));
        const float qq = 2.0f * (params.s0 + params.s1 * q.dot(q));
        return params.sf2 * std::asin(pq / std::sqrt((1.0f + pp) * (1.0f + qq)));
    }
    return params.sf2 * std::exp(-(p - q).norm() / params.ell_m);
}

/// Probability by eqs. 1-3 and 7 in the query's frame.
inline float plain_probability(const gpom_params_t &params, const std::vector<Neighbour> &hits,
                               const std::vector<Neighbour> &free)
{
    std::vector<Neighbour> points = hits;
    points.insert(points.end(), free.begin(), free.end());
    const auto n = static_cast<Eigen::Index>(points.size());
    const auto n_hits = static_cast<Eigen::Index>(hits.size());
    Eigen::MatrixXf K(n, n);
    Eigen::VectorXf ks(n), y(n);
    const Eigen::Vector2f query(0.0f, 0.0f);
    for (Eigen::Index i = 0; i < n; ++i) {
        const Eigen::Vector2f &p = points[static_cast<std::size_t>(i)].at;
        for (Eigen::Index j = 0; j < n; ++j) {
            K(i, j) = plain_covariance(params, p, points[static_cast<std::size_t>(j)].at);
        }
        K(i, i) += i < n_hits ? params.sn2 : params.sn2_free;
        ks(i) = plain_covariance(params, p, query);
        y(i) = i < n_hits ? 1.0f : -1.0f;
    }
    const Eigen::LLT<Eigen::MatrixXf> llt(K);
    const float mean = ks.dot(llt.solve(y));
    const float variance = plain_covariance(params, query, query) - ks.dot(llt.solve(ks));
    const float spread = std::sqrt(1.0f + params.alpha * params.alpha * variance);
    return 0.5f * std::erfc(-(params.alpha * mean + params.beta) / spread / std::sqrt(2.0f));
}

} // namespace gpom_bench

#endif

#include "tools/eval/neighbour_check.hpp"

#include "tools/map/host_map.hpp"
#include "tools/map/parallel.hpp"
#include "tools/map/raster_csv.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace gpom_tools
{
namespace
{

using Places = Eigen::Matrix2Xd;

/// Covariance by eq. 4 and Rasmussen & Williams (2006), eqs. 4.9, 4.14, 4.17. Askey as in
/// gpom/params.h.
double covariance(const gpom_params_t &p, const Eigen::Vector2d &a, const Eigen::Vector2d &b)
{
    const double sf2 = double{p.sf2}, s = (a - b).norm() / double{p.ell_m};
    switch (p.kernel) {
    case GPOM_KERNEL_NN: {
        const auto form = [&p](const Eigen::Vector2d &u, const Eigen::Vector2d &v) {
            return 2.0 * (double{p.s0} + double{p.s1} * u.dot(v));
        };
        const double sine = form(a, b) / std::sqrt((1.0 + form(a, a)) * (1.0 + form(b, b)));
        return sf2 * std::asin(std::clamp(sine, -1.0, 1.0));
    }
    case GPOM_KERNEL_MATERN12:
        return sf2 * std::exp(-s);
    case GPOM_KERNEL_MATERN32:
        return sf2 * (1.0 + std::sqrt(3.0) * s) * std::exp(-std::sqrt(3.0) * s);
    case GPOM_KERNEL_SE:
        return sf2 * std::exp(-0.5 * s * s);
    default:
        return s < 1.0 ? sf2 * std::pow(1.0 - s, 3.0) : 0.0;
    }
}

/// Training set of one query: places relative to the query or to the map's origin, labels, noises.
struct DenseSet {
    Places places;
    Eigen::VectorXd labels, noises;
    Eigen::Vector2d query;
};

DenseSet dense_set(const gpom_params_t &p, const std::vector<gpom_beam_t> &beams,
                   const Eigen::Vector2d &query, const Eigen::Vector2d &origin)
{
    const Eigen::Vector2d zero = p.frame == GPOM_FRAME_MAP ? origin : query;
    const auto n_max = static_cast<Eigen::Index>(2 * beams.size());
    DenseSet set{Places(2, n_max), Eigen::VectorXd(n_max), Eigen::VectorXd(n_max), query - zero};
    Eigen::Index n = 0;
    const auto add = [&](const Eigen::Vector2d &place, double label, float noise) {
        set.places.col(n) = place - zero;
        set.labels[n] = label;
        set.noises[n++] = double{noise};
    };
    for (const gpom_beam_t &beam : beams) {
        const Eigen::Vector2d start(beam.x_m, beam.y_m);
        const Eigen::Vector2d direction(double{beam.dir_x}, double{beam.dir_y});
        const double range_m = double{beam.range_m};
        const double gap_m = beam.returned != 0 ? double{p.gap_m} : 0.0;
        const double free_m = std::max(range_m - gap_m, 0.0);
        const double way_m = std::clamp(direction.dot(query - start), 0.0, free_m);
        if (beam.is_free != 0) {
            add(start + way_m * direction, -1.0, beam.free_noise);
        }
        if (beam.is_hit != 0 && beam.provisional == 0) {
            add(start + range_m * direction, 1.0, beam.hit_noise);
        }
    }
    set.places.conservativeResize(2, n);
    set.labels.conservativeResize(n);
    set.noises.conservativeResize(n);
    return set;
}

DenseMoments solve(const gpom_params_t &p, const DenseSet &set)
{
    const Eigen::Index n = set.labels.size();
    Eigen::MatrixXd k(n, n);
    Eigen::VectorXd k_star(n);
    for (Eigen::Index j = 0; j < n; ++j) {
        for (Eigen::Index i = j; i < n; ++i) { // the factorisation reads only the lower triangle
            k(i, j) = covariance(p, set.places.col(i), set.places.col(j));
        }
        k(j, j) += set.noises[j];
        k_star[j] = covariance(p, set.places.col(j), set.query);
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(k);
    const double prior = covariance(p, set.query, set.query);
    return {k_star.dot(factor.solve(set.labels)),
            std::max(prior - k_star.dot(factor.solve(k_star)), 0.0)};
}

/// Eq. 7, with its square root.
double squash(const gpom_params_t &p, const DenseMoments &moments)
{
    const double alpha = double{p.alpha};
    const double z =
        (alpha * moments.mean + double{p.beta}) / std::sqrt(1.0 + alpha * alpha * moments.variance);
    return 0.5 * std::erfc(-z / std::sqrt(2.0));
}

std::vector<gpom_beam_t> beams_in(const HostMap &map)
{
    std::vector<gpom_beam_t> beams(gpom_map_slot_count(map.get()));
    for (std::uint32_t i = 0; i < beams.size(); ++i) {
        if (gpom_map_beam(map.get(), i, &beams[i]) != GPOM_OK) {
            throw std::runtime_error("a beam of the map cannot be read");
        }
    }
    return beams;
}

TestSet points_to_check(const EvalOptions &options, const TestSet &all)
{
    TestSet test;
    for (std::size_t i = 0; i < all.points.size(); ++i) {
        if (all.near_beam[i] && test.points.size() < options.n_dense_points) {
            test.points.push_back(all.points[i]);
        }
    }
    return test;
}

} // namespace

gpom_params_t plain_params(const gpom_params_t &params)
{
    gpom_params_t plain;
    gpom_params_init(&plain);
    plain.kernel = params.kernel;
    plain.frame = params.frame;
    plain.sf2 = params.sf2;
    plain.s0 = params.s0;
    plain.s1 = params.s1;
    plain.ell_m = params.ell_m;
    plain.sn2 = params.sn2;
    plain.sn2_free = params.sn2_free;
    plain.alpha = params.alpha;
    plain.beta = params.beta;
    plain.gap_m = params.gap_m;
    plain.p_occupied = params.p_occupied;
    plain.p_free = params.p_free;
    return plain;
}

std::vector<DenseMoments> dense_moments(const gpom_params_t &params,
                                        const std::vector<gpom_beam_t> &beams,
                                        const std::vector<gpom_point_t> &points,
                                        gpom_point_t origin)
{
    std::vector<DenseMoments> moments(points.size());
    for_chunks(points.size(), 0, [&](std::size_t, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            moments[i] = solve(params, dense_set(params, beams, {points[i].x_m, points[i].y_m},
                                                 {origin.x_m, origin.y_m}));
        }
    });
    return moments;
}

void require_neighbours(const EvalOptions &options, const gpom_params_t &params)
{
    gpom_params_t plain = plain_params(params);
    for (const unsigned n_each : options.neighbours) {
        plain.n_hits = plain.n_free = static_cast<std::uint16_t>(n_each);
        const char *problem = nullptr;
        if (gpom_params_check(&plain, &problem) != GPOM_OK) {
            throw std::runtime_error("--neighbours " + std::to_string(n_each) + ": " + problem);
        }
    }
}

std::vector<NeighbourRow> check_neighbours(const EvalOptions &options, const Trial &trial,
                                           const gpom_params_t &params)
{
    const TestSet test = points_to_check(options, trial.test);
    const std::vector<gpom_point_t> places = places_of(test);
    const gpom_point_t origin = middle_of(trial.scans);
    gpom_params_t plain = plain_params(params);
    std::vector<NeighbourRow> rows;
    std::vector<DenseMoments> dense;
    for (const unsigned n_each : options.neighbours) {
        plain.n_hits = plain.n_free = static_cast<std::uint16_t>(n_each);
        HostMap map(plain, beam_count(trial.scans), origin);
        map.insert(trial.scans);
        dense = dense.empty() ? dense_moments(plain, beams_in(map), places, origin) : dense;
        NeighbourRow row{n_each, {}, 0.0};
        append_text(row.method.label, "%u + %u", n_each, n_each);
        for (const gpom_answer_t &answer : map.query(places)) {
            const double mean = dense[row.method.probabilities.size()].mean;
            row.mean_error_max = std::max(row.mean_error_max, std::abs(double{answer.mean} - mean));
            row.method.probabilities.push_back(double{answer.probability});
        }
        row.method = judged(std::move(row.method), test);
        rows.push_back(std::move(row));
    }
    NeighbourRow all{0, {}, 0.0};
    all.method.label = "all beams";
    for (const DenseMoments &moments : dense) {
        all.method.probabilities.push_back(squash(plain, moments));
    }
    all.method = judged(std::move(all.method), test);
    rows.push_back(std::move(all));
    return rows;
}

std::string neighbour_table(const std::vector<NeighbourRow> &rows)
{
    std::string text;
    append_text(text, "\n%-12s %7s %7s %9s  (%zu points near beams, paper's model)\n", "neighbours",
                "AUC", "NLL", "max|dmu|", rows.empty() ? 0 : rows.front().method.all.n_points);
    for (const NeighbourRow &row : rows) {
        append_text(text, "%-12s %7.4f %7.4f %9.4f\n", row.method.label.c_str(), row.method.all.auc,
                    row.method.all.nll, row.mean_error_max);
    }
    return text;
}

nlohmann::ordered_json neighbour_json(const std::vector<NeighbourRow> &rows)
{
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (const NeighbourRow &row : rows) {
        json.push_back({{"neighbours", row.n_each},
                        {"label", row.method.label},
                        {"points", row.method.all.n_points},
                        {"auc", row.method.all.auc},
                        {"fp_at_tp95", row.method.all.false_positive_rate},
                        {"nll", row.method.all.nll},
                        {"mean_error_max", row.mean_error_max}});
    }
    return json;
}

} // namespace gpom_tools

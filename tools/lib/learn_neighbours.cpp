#include "tools/lib/learn_neighbours.hpp"

#include "tools/lib/learn_parallel.hpp"
#include "tools/lib/learn_params.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace gpom_tools
{
namespace
{

constexpr double kScatterSoftening = 0.01; ///< Added to squared distances in the weights [m2].
constexpr double kScatterMin = 1e-12;      ///< Below, the hits have no main axis.
constexpr double kVoteDistanceMin = 1e-6;  ///< Nearer hits have no side [m].
constexpr double kLineScale = 0.05;        ///< Distance at which a line is sure of its side [m].

/// A beam's closest point to the query, relative to it.
struct Candidate {
    double d2;
    std::size_t id;
    Eigen::Vector2d at;

    bool operator<(const Candidate &other) const
    {
        return d2 < other.d2 || (d2 == other.d2 && id < other.id);
    }
};

/// Closest point, relative to the query, of the beam's part from `from_m` to `to_m`.
Candidate closest(const LearnBeam &beam, std::size_t id, const LearnPlace &query, double from_m,
                  double to_m)
{
    const Eigen::Vector2d origin(beam.x_m - query.x_m, beam.y_m - query.y_m);
    const Eigen::Vector2d direction(beam.dir_x, beam.dir_y);
    const double along_m = std::clamp(-origin.dot(direction), from_m, to_m);
    const Eigen::Vector2d at = origin + along_m * direction;
    return {at.squaredNorm(), id, at};
}

/// The k best of those offered, kept in a heap whose top is the worst.
class Nearest {
public:
    explicit Nearest(std::size_t k) : k_(k) {}

    void offer(const Candidate &candidate)
    {
        if (best_.size() == k_ && !(candidate < best_.front())) {
            return;
        }
        if (best_.size() == k_) {
            std::pop_heap(best_.begin(), best_.end());
            best_.pop_back();
        }
        best_.push_back(candidate);
        std::push_heap(best_.begin(), best_.end());
    }

    std::vector<Candidate> sorted()
    {
        std::sort_heap(best_.begin(), best_.end());
        return std::move(best_);
    }

private:
    std::size_t k_;
    std::vector<Candidate> best_;
};

/// At most scan_points_max of one scan, in order, until n are chosen.
std::vector<Candidate> capped(const LearnWorld &world, std::vector<Candidate> pool, std::size_t n,
                              std::size_t scan_points_max)
{
    std::map<std::size_t, std::size_t> n_taken;
    std::vector<Candidate> chosen;
    for (const Candidate &candidate : pool) {
        if (chosen.size() < n && ++n_taken[world[candidate.id].i_scan] <= scan_points_max) {
            chosen.push_back(candidate);
        }
    }
    return chosen;
}

struct Chosen {
    std::vector<Candidate> hits, free;
};

Chosen choose(const LearnWorld &world, const LearnPlace &query, const NeighbourRule &rule)
{
    const bool cap = rule.scan_points_max > 0;
    Nearest hits(cap ? rule.n_hits + rule.n_hits / 2 : rule.n_hits);
    Nearest free(cap ? rule.n_free + rule.n_free / 2 : rule.n_free);
    for (std::size_t i = 0; i < world.size(); ++i) {
        if (i == query.own) {
            continue;
        }
        const LearnBeam &beam = world[i];
        if (beam.free) {
            const double gap_m = beam.returned ? rule.gap_m : 0.0;
            free.offer(closest(beam, i, query, 0.0, std::max(beam.range_m - gap_m, 0.0)));
        }
        if (beam.hit) {
            hits.offer(closest(beam, i, query, beam.range_m, beam.range_m + rule.depth_m));
        }
    }
    Chosen chosen{hits.sorted(), free.sorted()};
    if (cap) {
        chosen.hits = capped(world, std::move(chosen.hits), rule.n_hits, rule.scan_points_max);
        chosen.free = capped(world, std::move(chosen.free), rule.n_free, rule.scan_points_max);
    }
    return chosen;
}

struct Axis {
    Eigen::Vector2d direction{1.0, 0.0};
    double ratio = 1.0;
    Eigen::Vector2d mean{0.0, 0.0}; ///< Of the hits, weighted.
};

/// Main axis of the hits: eigenvectors of their scatter about their mean, the nearer the heavier.
Axis main_axis(const std::vector<Candidate> &hits)
{
    double weight = 0.0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Candidate &hit : hits) {
        const double w = 1.0 / (kScatterSoftening + hit.d2);
        weight += w;
        mean += w * hit.at;
    }
    mean /= std::max(weight, std::numeric_limits<double>::min());
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const Candidate &hit : hits) {
        const Eigen::Vector2d off = hit.at - mean;
        scatter += off * off.transpose() / (kScatterSoftening + hit.d2) / weight;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter);
    if (hits.size() < 2 || solver.eigenvalues()(1) <= kScatterMin) {
        return {};
    }
    const double ratio2 = std::max(solver.eigenvalues()(0), 0.0) / solver.eigenvalues()(1);
    return {solver.eigenvectors().col(1), std::sqrt(ratio2), mean};
}

/// Whether the query lies straight behind the hits' surfaces (+1) or in front of them (-1).
double vote_of(const LearnWorld &world, const std::vector<Candidate> &hits)
{
    if (hits.empty()) {
        return 0.0;
    }
    double sum = 0.0;
    for (const Candidate &hit : hits) {
        const double distance_m = std::sqrt(hit.d2);
        const Eigen::Vector2d direction(world[hit.id].dir_x, world[hit.id].dir_y);
        sum -= distance_m < kVoteDistanceMin ? 0.0 : direction.dot(hit.at) / distance_m;
    }
    const double fading = std::max(0.0, 1.0 - std::sqrt(hits.front().d2) / kLogDistanceMax);
    return fading * sum / static_cast<double>(hits.size());
}

/// The line through the hits, its normal n along their mean beam direction b: t is how far the
/// query is behind it. (1 - ratio) (n . b) t / sqrt(t^2 + s^2) with s = kLineScale.
double line_of(const LearnWorld &world, const std::vector<Candidate> &hits, const Axis &axis)
{
    if (hits.empty()) {
        return 0.0;
    }
    Eigen::Vector2d beam = Eigen::Vector2d::Zero();
    for (const Candidate &hit : hits) {
        beam += Eigen::Vector2d(world[hit.id].dir_x, world[hit.id].dir_y);
    }
    beam /= static_cast<double>(hits.size());
    const Eigen::Vector2d normal(-axis.direction.y(), axis.direction.x()); // of either sign
    const double behind_m = -normal.dot(axis.mean);
    const double side = behind_m / std::hypot(behind_m, kLineScale);
    const double fading = std::max(0.0, 1.0 - std::sqrt(hits.front().d2) / kLogDistanceMax);
    return fading * (1.0 - axis.ratio) * normal.dot(beam) * side;
}

/// Log distance to the i-th point, or that of the end of all distances if there is none.
double log_distance(const std::vector<Candidate> &points, std::size_t i)
{
    const double distance_m = i < points.size() ? std::sqrt(points[i].d2) : kLogDistanceMax;
    return std::log(std::min(distance_m, kLogDistanceMax) + kLogDistanceMin);
}

struct Kind {
    const std::vector<Candidate> &points;
    double label;
};

void append_points(Neighbourhood &to, const LearnWorld &world, const Kind &kind, const Axis &axis)
{
    const double label = kind.label;
    const Eigen::Vector2d across(-axis.direction.y(), axis.direction.x());
    for (const Candidate &point : kind.points) {
        const HitNoise noise = label > 0.0 ? world[point.id].noise : HitNoise::kSeen;
        const double along_m = axis.direction.dot(point.at);
        const double across_m = across.dot(point.at);
        const auto same = std::find_if(to.points.begin(), to.points.end(), [&](const auto &p) {
            return p.along_m == along_m && p.across_m == across_m && p.label == label &&
                   p.noise == noise;
        });
        if (same != to.points.end()) {
            same->count += 1.0;
        } else {
            to.points.push_back({along_m, across_m, label, noise, 1.0});
        }
    }
}

Neighbourhood neighbourhood_of(const LearnWorld &world, const LearnPlace &query,
                               const NeighbourRule &rule)
{
    const Chosen chosen = choose(world, query, rule);
    const Axis axis = main_axis(chosen.hits);
    Neighbourhood result;
    append_points(result, world, {chosen.hits, 1.0}, axis);
    append_points(result, world, {chosen.free, -1.0}, axis);
    result.axis_ratio = axis.ratio;
    result.vote = vote_of(world, chosen.hits);
    result.line = line_of(world, chosen.hits, axis);
    result.log_distances = {
        log_distance(chosen.hits, 0), log_distance(chosen.hits, rule.n_hits - 1),
        log_distance(chosen.free, 0), log_distance(chosen.free, rule.n_free - 1)};
    result.occupied = query.occupied;
    return result;
}

} // namespace

std::vector<Neighbourhood> neighbourhoods_of(const std::vector<LearnWorld> &worlds,
                                             const std::vector<LearnPlace> &places,
                                             const NeighbourRule &rule, unsigned n_threads)
{
    std::vector<Neighbourhood> result(places.size());
    for_chunks(places.size(), n_threads, [&](std::size_t, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            result[i] = neighbourhood_of(worlds[places[i].i_world], places[i], rule);
        }
    });
    return result;
}

} // namespace gpom_tools

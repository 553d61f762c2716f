#include "tools/learn/neighbours.hpp"

#include "tools/learn/params.hpp"
#include "tools/map/parallel.hpp"

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
constexpr double kScatterMin = 1e-12;      ///< Below this scatter the hits have no main axis.
constexpr double kVoteDistanceMin = 1e-6;  ///< Hits nearer than this have no side [m].
constexpr double kWeightMin = 1e-6;        ///< Least weight of a fading neighbour.
constexpr double kLineScale = 0.05;        ///< Distance at which the side of a line becomes certain
                                           ///< [m].

/// Closest point of a beam to the query, relative to the query.
struct Candidate {
    double d2;
    std::size_t id;
    Eigen::Vector2d at;
    double weight = 1.0;

    double distance_m() const { return std::sqrt(d2); }
    bool operator<(const Candidate &other) const
    {
        return d2 < other.d2 || (d2 == other.d2 && id < other.id);
    }
};

/// Closest point to the query of a beam's part from `from_m` to `to_m`, relative to the query.
Candidate closest(const LearnBeam &beam, std::size_t id, const LearnPlace &query, double from_m,
                  double to_m)
{
    const Eigen::Vector2d origin(beam.x_m - query.x_m, beam.y_m - query.y_m);
    const Eigen::Vector2d direction(beam.dir_x, beam.dir_y);
    const double along_m = std::clamp(-origin.dot(direction), from_m, to_m);
    const Eigen::Vector2d at = origin + along_m * direction;
    return {at.squaredNorm(), id, at};
}

/// Keeps the k best candidates in a heap. The top is the worst of them.
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

/// Weight 1 up to from_m, then 1 - t^2, where t rises to 1 at end_m. If both distances are equal,
/// the weight is 1.
double fading_weight(double distance_m, double from_m, double end_m)
{
    if (distance_m <= from_m || end_m <= from_m) {
        return 1.0;
    }
    const double t = (distance_m - from_m) / (end_m - from_m);
    return std::max(1.0 - t * t, kWeightMin);
}

/// For each scan with at least `cap` points: the last point within the cap fades. Its fading range
/// begins at the point before it. It ends at the first point that is left out, or at the pool's
/// end.
void fade_in_scans(const LearnWorld &world, std::vector<Candidate> &pool, std::size_t cap,
                   double pool_end_m)
{
    std::map<std::size_t, std::vector<std::size_t>> places;
    for (std::size_t i = 0; i < pool.size(); ++i) {
        places[world[pool[i].id].i_scan].push_back(i);
    }
    for (const auto &[i_scan, own] : places) {
        if (own.size() >= cap) {
            Candidate &last = pool[own[cap - 1]];
            const double from_m = cap > 1 ? pool[own[cap - 2]].distance_m() : 0.0;
            const double end_m = own.size() > cap ? pool[own[cap]].distance_m() : pool_end_m;
            last.weight = fading_weight(last.distance_m(), from_m, end_m);
        }
    }
}

/// At most scan_points_max candidates of each scan, in order.
std::vector<Candidate> capped(const LearnWorld &world, const std::vector<Candidate> &pool,
                              std::size_t scan_points_max)
{
    std::map<std::size_t, std::size_t> n_taken;
    std::vector<Candidate> chosen;
    for (const Candidate &candidate : pool) {
        if (++n_taken[world[candidate.id].i_scan] <= scan_points_max) {
            chosen.push_back(candidate);
        }
    }
    return chosen;
}

/// How many neighbours of one kind are needed, and the number of nearest points they are chosen
/// from.
struct Wanted {
    std::size_t n, n_pool;
};

Wanted wanted(std::size_t n, const NeighbourRule &rule)
{
    const std::size_t n_capped = rule.scan_points_max > 0 ? n + n / 2 : n;
    return {n, rule.n_fading > 0 && n_capped == n ? n + 1 : n_capped};
}

/// The neighbours and their weights, from an ordered pool.
std::vector<Candidate> chosen_of(const LearnWorld &world, std::vector<Candidate> pool,
                                 const Wanted &wanted, const NeighbourRule &rule)
{
    const bool fades = rule.n_fading > 0 && pool.size() == wanted.n_pool;
    const double pool_end_m = fades ? pool.back().distance_m() : 0.0;
    const double from_m = fades ? pool[wanted.n - rule.n_fading - 1].distance_m() : 0.0;
    if (rule.scan_points_max > 0) {
        if (fades) {
            fade_in_scans(world, pool, rule.scan_points_max, pool_end_m);
        }
        pool = capped(world, pool, rule.scan_points_max);
    }
    const double end_m = pool.size() > wanted.n ? pool[wanted.n].distance_m() : pool_end_m;
    pool.resize(std::min(pool.size(), wanted.n));
    for (Candidate &point : pool) {
        point.weight *= fades ? fading_weight(point.distance_m(), from_m, end_m) : 1.0;
    }
    return pool;
}

struct Chosen {
    std::vector<Candidate> hits, free;
};

Chosen choose(const LearnWorld &world, const LearnPlace &query, const NeighbourRule &rule)
{
    const Wanted n_hits = wanted(rule.n_hits, rule);
    const Wanted n_free = wanted(rule.n_free, rule);
    Nearest hits(n_hits.n_pool);
    Nearest free(n_free.n_pool);
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
    return {chosen_of(world, hits.sorted(), n_hits, rule),
            chosen_of(world, free.sorted(), n_free, rule)};
}

struct Axis {
    Eigen::Vector2d direction{1.0, 0.0};
    double ratio = 1.0;
    Eigen::Vector2d mean{0.0, 0.0}; ///< Weighted mean of the hits.
};

/// Main axis of the hits: eigenvectors of their scatter about their mean. Nearer hits have a larger
/// weight.
Axis main_axis(const std::vector<Candidate> &hits)
{
    double weight = 0.0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Candidate &hit : hits) {
        const double w = hit.weight / (kScatterSoftening + hit.d2);
        weight += w;
        mean += w * hit.at;
    }
    mean /= std::max(weight, std::numeric_limits<double>::min());
    Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
    for (const Candidate &hit : hits) {
        const Eigen::Vector2d off = hit.at - mean;
        scatter += hit.weight / (kScatterSoftening + hit.d2) / weight * off * off.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(scatter);
    if (hits.size() < 2 || solver.eigenvalues()(1) <= kScatterMin) {
        return {};
    }
    const double ratio2 = std::max(solver.eigenvalues()(0), 0.0) / solver.eigenvalues()(1);
    return {solver.eigenvectors().col(1), std::sqrt(ratio2), mean};
}

/// +1 if the query lies straight behind the surfaces of the hits, -1 if in front of them. Where
/// neighbours fade, the cosine changes sign over a few centimetres at a hit.
double vote_of(const LearnWorld &world, const std::vector<Candidate> &hits, bool fades)
{
    if (hits.empty()) {
        return 0.0;
    }
    const double softness_m = fades ? kLogDistanceMin : 0.0;
    double sum = 0.0;
    double weight = 0.0;
    for (const Candidate &hit : hits) {
        const double distance_m = std::hypot(hit.distance_m(), softness_m);
        const Eigen::Vector2d direction(world[hit.id].dir_x, world[hit.id].dir_y);
        const double along_m = -direction.dot(hit.at);
        sum += distance_m < kVoteDistanceMin ? 0.0 : hit.weight * along_m / distance_m;
        weight += hit.weight;
    }
    const double fading = std::max(0.0, 1.0 - hits.front().distance_m() / kLogDistanceMax);
    return fading * sum / std::max(weight, 1.0);
}

/// Side of the line through the hits. n is its normal along their mean beam direction b, and t is
/// how far the query is behind the line. The value is (1 - ratio) (n . b) t / sqrt(t^2 + s^2) with
/// s = kLineScale.
double line_of(const LearnWorld &world, const std::vector<Candidate> &hits, const Axis &axis)
{
    if (hits.empty()) {
        return 0.0;
    }
    Eigen::Vector2d beam = Eigen::Vector2d::Zero();
    double weight = 0.0;
    for (const Candidate &hit : hits) {
        beam += hit.weight * Eigen::Vector2d(world[hit.id].dir_x, world[hit.id].dir_y);
        weight += hit.weight;
    }
    beam /= std::max(weight, 1.0);
    const Eigen::Vector2d normal(-axis.direction.y(), axis.direction.x()); // the sign may be either
    const double behind_m = -normal.dot(axis.mean);
    const double side = behind_m / std::hypot(behind_m, kLineScale);
    const double fading = std::max(0.0, 1.0 - std::sqrt(hits.front().d2) / kLogDistanceMax);
    return fading * (1.0 - axis.ratio) * normal.dot(beam) * side;
}

/// Log distance to the i-th point. If there is no such point: log distance of the end of all
/// distances.
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
                   p.noise == noise && p.weight == point.weight;
        });
        if (same != to.points.end()) {
            same->count += 1.0;
        } else {
            to.points.push_back({along_m, across_m, label, noise, 1.0, point.weight});
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
    result.vote = vote_of(world, chosen.hits, rule.n_fading > 0);
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

#include "tools/slam/errors.hpp"

#include "ports/host/text_lines.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <string_view>

namespace gpom_tools
{

namespace
{

/// Visited scans with a corrected pose.
struct Pair {
    Pose found, corrected;
};

std::vector<Pair> pairs_of(const std::vector<DrivenScan> &log, const std::vector<Visited> &way)
{
    std::vector<Pair> pairs;
    for (const Visited &visited : way) {
        if (log[visited.i_scan].corrected) {
            pairs.push_back({visited.pose, *log[visited.i_scan].corrected});
        }
    }
    return pairs;
}

struct Spread {
    double mean = 0.0, sd = 0.0;
};

Spread spread_of(const std::vector<double> &values)
{
    Spread spread;
    const double n = static_cast<double>(values.size());
    for (const double value : values) {
        spread.mean += value / n;
    }
    for (const double value : values) {
        spread.sd += (value - spread.mean) * (value - spread.mean) / n;
    }
    spread.sd = std::sqrt(spread.sd);
    return spread;
}

} // namespace

double absolute_rms_m(const std::vector<DrivenScan> &log, const std::vector<Visited> &way)
{
    const std::vector<Pair> pairs = pairs_of(log, way);
    if (pairs.size() < 2) {
        return std::numeric_limits<double>::quiet_NaN();
    }
    const double n = static_cast<double>(pairs.size());
    Eigen::Vector2d found_mean(0.0, 0.0), corrected_mean(0.0, 0.0);
    for (const Pair &pair : pairs) {
        found_mean += Eigen::Vector2d(pair.found.x_m, pair.found.y_m) / n;
        corrected_mean += Eigen::Vector2d(pair.corrected.x_m, pair.corrected.y_m) / n;
    }
    double cosine = 0.0, sine = 0.0;
    for (const Pair &pair : pairs) {
        const Eigen::Vector2d a = Eigen::Vector2d(pair.found.x_m, pair.found.y_m) - found_mean;
        const Eigen::Vector2d b =
            Eigen::Vector2d(pair.corrected.x_m, pair.corrected.y_m) - corrected_mean;
        cosine += a.dot(b);
        sine += a.x() * b.y() - a.y() * b.x();
    }
    const Eigen::Rotation2Dd turn(std::atan2(sine, cosine));
    double sum_m2 = 0.0;
    for (const Pair &pair : pairs) {
        const Eigen::Vector2d a = Eigen::Vector2d(pair.found.x_m, pair.found.y_m) - found_mean;
        const Eigen::Vector2d b =
            Eigen::Vector2d(pair.corrected.x_m, pair.corrected.y_m) - corrected_mean;
        sum_m2 += (turn * a - b).squaredNorm();
    }
    return std::sqrt(sum_m2 / n);
}

RelativeError relative_error(const std::vector<DrivenScan> &log, const std::vector<Visited> &way,
                             double length_m)
{
    const std::vector<Pair> pairs = pairs_of(log, way);
    std::vector<double> way_m(pairs.size(), 0.0);
    for (std::size_t i = 1; i < pairs.size(); ++i) {
        way_m[i] =
            way_m[i - 1] + between_poses(pairs[i - 1].corrected, pairs[i].corrected).distance_m();
    }
    RelativeError error;
    std::size_t j = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        while (j < pairs.size() && way_m[j] < way_m[i] + length_m) {
            ++j;
        }
        if (j == pairs.size()) {
            break;
        }
        const Pose off = between_poses(between_poses(pairs[i].corrected, pairs[j].corrected),
                                       between_poses(pairs[i].found, pairs[j].found));
        error.place_m += off.distance_m();
        error.yaw_rad += std::abs(off.yaw_rad);
        ++error.n;
    }
    const double n = static_cast<double>(error.n);
    error.place_m /= n;
    error.yaw_rad /= n;
    return error;
}

std::vector<Relation> read_relations(const std::string &path)
{
    std::vector<Relation> relations;
    LineReader reader(path, "relations");
    std::string line;
    std::vector<std::string_view> fields;
    while (reader.next(line)) {
        split_blanks(line, fields);
        if (fields.empty() || fields[0][0] == '#') {
            continue;
        }
        if (fields.size() != 8) {
            reader.place().fail("not a relation; write: t0 t1 x y z roll pitch yaw");
        }
        double value[8];
        for (std::size_t i = 0; i < 8; ++i) {
            value[i] = parse_finite(fields[i], "relation", reader.place());
        }
        relations.push_back({value[0], value[1], {value[2], value[3], value[7]}});
    }
    return relations;
}

RelationError relation_error(const std::vector<Relation> &relations,
                             const std::vector<DrivenScan> &log, const std::vector<Visited> &way)
{
    std::map<long long, Pose> at_ms;
    for (const Visited &visited : way) {
        at_ms[std::llround(1e3 * log[visited.i_scan].scan.t_s)] = visited.pose;
    }
    const auto find = [&](double t_s) {
        const auto found = at_ms.lower_bound(std::llround(1e3 * t_s) - 1);
        return found != at_ms.end() &&
                       std::abs(1e-3 * static_cast<double>(found->first) - t_s) < 0.002
                   ? &found->second
                   : nullptr;
    };
    std::vector<double> places, yaws;
    for (const Relation &relation : relations) {
        const Pose *const from = find(relation.from_s), *const to = find(relation.to_s);
        if (from != nullptr && to != nullptr) {
            const Pose off = between_poses(relation.step, between_poses(*from, *to));
            places.push_back(off.distance_m());
            yaws.push_back(std::abs(off.yaw_rad));
        }
    }
    const Spread place = spread_of(places), yaw = spread_of(yaws);
    return {place.mean, place.sd, yaw.mean, yaw.sd, places.size()};
}

} // namespace gpom_tools

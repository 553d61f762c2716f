// The robot's way through a graph of crossings and street sections, in the right-hand lane.
#include "tools/sim/street.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace gpom_tools
{
namespace
{

constexpr double kLaneMain = 1.8;   ///< Distance of the lane's centre from the street's middle
                                    ///< line, on main streets [m].
constexpr double kLaneSide = 0.3;   ///< The same on side streets, where parked cars leave one lane
                                    ///< [m].
constexpr double kTurnRadius = 4.0; ///< [m]; smaller in narrow U-turns
constexpr double kStartFromEdge = 2.0;
constexpr double kTurnFromEdge = 5.0;

struct Vec {
    double x, y;
};

Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y}; }
Vec operator*(double s, Vec a) { return {s * a.x, s * a.y}; }
double cross(Vec a, Vec b) { return a.x * b.y - a.y * b.x; }
double length(Vec a) { return std::sqrt(a.x * a.x + a.y * a.y); }
Vec unit(Vec a) { return (1.0 / length(a)) * a; }
Vec right_of(Vec direction) { return {direction.y, -direction.x}; }

struct Section {
    std::size_t ends[2];
    double lane_m;
    int n_driven;
};

struct Crossing {
    Vec at;
    std::vector<std::size_t> sections;
};

struct Graph {
    std::vector<Crossing> crossings;
    std::vector<Section> sections;

    std::size_t other_end(std::size_t i_section, std::size_t i_crossing) const
    {
        const Section &section = sections[i_section];
        return section.ends[section.ends[0] == i_crossing ? 1 : 0];
    }
    bool dead_end(std::size_t i_crossing) const
    {
        return crossings[i_crossing].sections.size() == 1;
    }
};

/// Positions along a street where the robot can turn: crossings, and street ends at the area's
/// edge.
std::vector<double> stops_along(const Street &street, const StreetWorld &world)
{
    const double extent_m = street.vertical ? world.height_m : world.width_m;
    std::vector<double> stops;
    for (const Street &other : world.streets) {
        if (other.kind != StreetKind::alley && streets_meet(street, other)) {
            stops.push_back(other.centre_m);
        }
    }
    if (street.from_m <= 0.0) {
        stops.push_back(0.0);
    }
    if (street.to_m >= extent_m) {
        stops.push_back(extent_m);
    }
    std::sort(stops.begin(), stops.end());
    stops.erase(std::unique(stops.begin(), stops.end()), stops.end());
    return stops;
}

Graph make_graph(const StreetWorld &world)
{
    Graph graph;
    // Exact keys: the centres of both streets.
    std::map<std::pair<double, double>, std::size_t> known;
    const auto crossing_at = [&](Vec at) {
        const auto found = known.emplace(std::make_pair(at.x, at.y), graph.crossings.size());
        if (found.second) {
            graph.crossings.push_back({at, {}});
        }
        return found.first->second;
    };
    for (const Street &street : world.streets) {
        if (street.kind == StreetKind::alley) {
            continue;
        }
        const std::vector<double> stops = stops_along(street, world);
        for (std::size_t i = 1; i < stops.size(); ++i) {
            const auto at = [&](double u) {
                return street.vertical ? Vec{street.centre_m, u} : Vec{u, street.centre_m};
            };
            const std::size_t a = crossing_at(at(stops[i - 1])), b = crossing_at(at(stops[i]));
            graph.crossings[a].sections.push_back(graph.sections.size());
            graph.crossings[b].sections.push_back(graph.sections.size());
            const double lane_m = street.kind == StreetKind::main ? kLaneMain : kLaneSide;
            graph.sections.push_back({{a, b}, lane_m, 0});
        }
    }
    return graph;
}

/// State of the drive: the section, and the crossing ahead.
struct Walker {
    std::size_t section;
    std::size_t towards;
};

int least_driven(const Graph &graph)
{
    const auto less = [](const Section &a, const Section &b) { return a.n_driven < b.n_driven; };
    return std::min_element(graph.sections.begin(), graph.sections.end(), less)->n_driven;
}

/// For each crossing, the number of sections to the nearest section that was driven least often.
std::vector<int> hops_to_new(const Graph &graph, int n_least)
{
    std::vector<int> hops(graph.crossings.size(), -1);
    std::vector<std::size_t> queue;
    for (const Section &section : graph.sections) {
        for (const std::size_t end : section.ends) {
            if (section.n_driven == n_least && hops[end] < 0) {
                hops[end] = 0;
                queue.push_back(end);
            }
        }
    }
    for (std::size_t i_queue = 0; i_queue < queue.size(); ++i_queue) { // breadth first
        const std::size_t at = queue[i_queue];
        for (const std::size_t section : graph.crossings[at].sections) {
            const std::size_t next = graph.other_end(section, at);
            if (hops[next] < 0) {
                hops[next] = hops[at] + 1;
                queue.push_back(next);
            }
        }
    }
    return hops;
}

/// Choose a section that was driven least often if one begins here, but rarely a dead end.
/// Otherwise choose the way to the nearest one. Turn back only if there is no other way.
std::size_t choose_section(const Graph &graph, const Walker &walker, StreetRandom &random)
{
    const int n_least = least_driven(graph);
    const std::vector<int> hops = hops_to_new(graph, n_least);
    std::size_t best = walker.section;
    double best_cost = 1e9;
    for (const std::size_t i : graph.crossings[walker.towards].sections) {
        const std::size_t end = graph.other_end(i, walker.towards);
        const int n_hops = graph.sections[i].n_driven == n_least ? 0 : 1 + hops[end];
        const double dead_end = graph.dead_end(end) ? 0.5 : 0.0;
        const double cost = n_hops + dead_end + random.uniform(0.0, 0.8);
        if (i != walker.section && cost < best_cost) {
            best = i;
            best_cost = cost;
        }
    }
    return best;
}

Walker start_walk(const Graph &graph, StreetRandom &random)
{
    std::vector<std::size_t> starts;
    for (std::size_t i = 0; i < graph.crossings.size(); ++i) {
        const std::size_t section = graph.crossings[i].sections[0];
        if (graph.dead_end(i) && graph.sections[section].lane_m == kLaneMain) {
            starts.push_back(i);
        }
    }
    const double draw = random.uniform(0.0, static_cast<double>(starts.size()));
    const std::size_t start = starts[static_cast<std::size_t>(draw)];
    const std::size_t section = graph.crossings[start].sections[0];
    return {section, graph.other_end(section, start)};
}

Vec direction_of(const Graph &graph, const Walker &walker)
{
    const Vec from = graph.crossings[graph.other_end(walker.section, walker.towards)].at;
    return unit(graph.crossings[walker.towards].at - from);
}

/// Append the corners of the lane where one section follows another.
void append_corners(const Graph &graph, const Walker &now, const Walker &next,
                    std::vector<Vec> &corners)
{
    const Vec at = graph.crossings[now.towards].at;
    const Vec d1 = direction_of(graph, now), d2 = direction_of(graph, next);
    const double lane1_m = graph.sections[now.section].lane_m;
    const double lane2_m = graph.sections[next.section].lane_m;
    if (now.section == next.section) { // U-turn
        corners.push_back(at - kTurnFromEdge * d1 + lane1_m * right_of(d1));
        corners.push_back(at - kTurnFromEdge * d1 - lane1_m * right_of(d1));
    } else if (std::fabs(cross(d1, d2)) > 0.5) {
        corners.push_back(at + lane1_m * right_of(d1) + lane2_m * right_of(d2));
    }
}

/// Corners of a line in the lane that is at least way_m long, with its first point.
std::vector<Vec> walk_corners(const StreetWorld &world, double way_m, StreetRandom &random)
{
    Graph graph = make_graph(world);
    Walker walker = start_walk(graph, random);
    const Vec start = graph.crossings[graph.other_end(walker.section, walker.towards)].at;
    const Vec direction = direction_of(graph, walker);
    std::vector<Vec> corners{start + kStartFromEdge * direction + kLaneMain * right_of(direction)};
    double walked_m = 0.0;
    while (walked_m < way_m) {
        ++graph.sections[walker.section].n_driven;
        const std::size_t section = choose_section(graph, walker, random);
        const Walker next{section, graph.other_end(section, walker.towards)};
        const std::size_t n_before = corners.size();
        append_corners(graph, walker, next, corners);
        for (std::size_t i = n_before; i < corners.size(); ++i) {
            // Rounding a corner of 90 degrees shortens the way by (2 - pi / 2) radii.
            walked_m += length(corners[i] - corners[i - 1]) - 0.43 * kTurnRadius;
        }
        walker = next;
    }
    return corners;
}

/// A straight (curvature 0) or circular piece of the way.
struct Piece {
    Vec from;
    double theta_rad, curvature_1_m, length_m;
};

StreetPose pose_along(const Piece &piece, double s_m)
{
    const double theta_rad = piece.theta_rad + piece.curvature_1_m * s_m;
    const Vec d0{std::cos(piece.theta_rad), std::sin(piece.theta_rad)};
    if (piece.curvature_1_m == 0.0) {
        return {piece.from.x + s_m * d0.x, piece.from.y + s_m * d0.y, theta_rad};
    }
    const double radius_m = 1.0 / piece.curvature_1_m;
    return {piece.from.x + radius_m * (std::sin(theta_rad) - d0.y),
            piece.from.y - radius_m * (std::cos(theta_rad) - d0.x), theta_rad};
}

/// Round the corners off with quarter circles.
std::vector<Piece> round_corners(const std::vector<Vec> &corners)
{
    constexpr double kPi = 3.14159265358979323846;
    std::vector<Piece> pieces;
    Vec from = corners[0];
    for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
        const Vec in = corners[i] - corners[i - 1], out = corners[i + 1] - corners[i];
        const double radius_m = std::min(kTurnRadius, 0.5 * std::min(length(in), length(out)));
        const Vec arc_from = corners[i] - radius_m * unit(in);
        const double theta_rad = std::atan2(in.y, in.x);
        const double turn = cross(in, out) > 0.0 ? 1.0 : -1.0;
        pieces.push_back({from, theta_rad, 0.0, length(arc_from - from)});
        pieces.push_back({arc_from, theta_rad, turn / radius_m, 0.5 * kPi * radius_m});
        from = corners[i] + radius_m * unit(out);
    }
    const Vec last = corners.back() - from;
    pieces.push_back({from, std::atan2(last.y, last.x), 0.0, length(last)});
    return pieces;
}

} // namespace

std::vector<StreetPose> drive_streets(const StreetWorld &world, const StreetConfig &config)
{
    constexpr double kHalfTurn_rad = 3.14159265358979323846;
    const int n_there = config.there_and_back ? (config.n_scans + 1) / 2 : config.n_scans;
    StreetRandom random(config.seed, StreetRandom::Stream::drive);
    const double way_m = n_there * config.step_m;
    const std::vector<Vec> corners = walk_corners(world, way_m + 2.0 * kTurnRadius, random);
    const std::vector<Piece> pieces = round_corners(corners);
    std::vector<StreetPose> poses;
    std::size_t i_piece = 0;
    double piece_start_m = 0.0;
    for (int i = 0; i < n_there; ++i) {
        const double s_m = i * config.step_m;
        while (i_piece + 1 < pieces.size() && s_m > piece_start_m + pieces[i_piece].length_m) {
            piece_start_m += pieces[i_piece].length_m;
            ++i_piece;
        }
        poses.push_back(pose_along(pieces[i_piece], s_m - piece_start_m));
    }
    for (int i = n_there; i < config.n_scans; ++i) {
        const StreetPose there = poses[static_cast<std::size_t>(config.n_scans - 1 - i)];
        poses.push_back({there.x_m, there.y_m, there.theta_rad + kHalfTurn_rad});
    }
    return poses;
}

} // namespace gpom_tools

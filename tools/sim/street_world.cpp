// Layout of the streets, and the obstacles between and on them. Lengths are those of European
// towns.
#include "tools/sim/street.hpp"

#include <algorithm>
#include <cmath>

namespace gpom_tools
{
namespace
{

using Random = StreetRandom;

// Streets.
constexpr double kMainSpacing[2] = {64.0, 80.0};
constexpr double kMainFromEdge[2] = {18.0, 42.0}; ///< Middle line of the first main street.
constexpr double kMainToEdge = 16.0;              ///< Least distance of the last one from the edge.
constexpr double kMainHalf[2] = {6.7, 7.3};
constexpr double kSideHalf[2] = {4.0, 4.5};
constexpr double kAlleyHalf[2] = {1.5, 2.0};
constexpr double kSideChance = 0.55;
constexpr double kAlleyChance = 0.35;
constexpr double kSideBlockMin = 40.0;  ///< Narrower blocks are not split by a side street.
constexpr double kAlleyBlockMin = 30.0; ///< Narrower blocks are not split by an alley.

// Buildings.
constexpr double kSetbackMax = 2.0;
constexpr double kLotWidth[2] = {7.0, 16.0};
constexpr double kYardWidth[2] = {4.0, 8.0};
constexpr double kYardChance = 0.08;
constexpr double kFrontDepthMax = 7.0; ///< Depth of the front lots. The core of the block is solid.
constexpr double kOverlap = 0.05;      ///< Overlap of fronts and core, so that no beam passes
                                       ///< between them.

// Parked vehicles.
constexpr double kCarSize[2] = {4.4, 1.8};
constexpr double kVanSize[2] = {5.5, 2.1};
constexpr double kVanChance = 0.2;
constexpr double kCrossingClear = 5.0;

enum class Edge { border, street, alley };
enum Side { kLeft, kRight, kBottom, kTop };

/// An area between streets, and what each of its sides faces.
struct Block {
    Rect area;
    Edge edges[4];
};

double uniform(Random &random, const double (&limits)[2])
{
    return random.uniform(limits[0], limits[1]);
}

std::vector<Street> main_streets(bool vertical, const StreetConfig &config, Random &random)
{
    const double extent_m = vertical ? config.width_m : config.height_m;
    const double length_m = vertical ? config.height_m : config.width_m;
    std::vector<Street> streets;
    double centre_m = std::min(uniform(random, kMainFromEdge), 0.5 * extent_m);
    while (centre_m <= extent_m - kMainToEdge) {
        const double half_m = uniform(random, kMainHalf);
        streets.push_back({StreetKind::main, vertical, centre_m, half_m, 0.0, length_m});
        centre_m += uniform(random, kMainSpacing);
    }
    return streets;
}

/// A gap between neighbouring main streets. The side streets of all blocks along the gap are on one
/// line, so that they continue straight across main streets.
struct Gap {
    double from_m, to_m, side_line_m;
    Edge edge_from, edge_to;
};

std::vector<Gap> gaps_between(const std::vector<Street> &streets, double extent_m, Random &random)
{
    std::vector<Gap> gaps;
    double from_m = 0.0;
    for (std::size_t i = 0; i <= streets.size(); ++i) {
        const bool last = i == streets.size();
        const double to_m = last ? extent_m : streets[i].centre_m - streets[i].half_width_m;
        const double line_m = from_m + random.uniform(0.38, 0.62) * (to_m - from_m);
        gaps.push_back({from_m, to_m, line_m, i == 0 ? Edge::border : Edge::street,
                        last ? Edge::border : Edge::street});
        from_m = last ? extent_m : streets[i].centre_m + streets[i].half_width_m;
    }
    return gaps;
}

/// Split a block in two by a street along `centre`. The first part replaces the block.
Block split_block(Block &block, const Street &street)
{
    const Edge edge = street.kind == StreetKind::alley ? Edge::alley : Edge::street;
    Block second = block;
    if (street.vertical) {
        block.area.x1_m = street.centre_m - street.half_width_m;
        second.area.x0_m = street.centre_m + street.half_width_m;
        block.edges[kRight] = second.edges[kLeft] = edge;
    } else {
        block.area.y1_m = street.centre_m - street.half_width_m;
        second.area.y0_m = street.centre_m + street.half_width_m;
        block.edges[kTop] = second.edges[kBottom] = edge;
    }
    return second;
}

Street street_through(const Block &block, StreetKind kind, bool vertical, double centre_m)
{
    const Rect &area = block.area;
    return {kind,
            vertical,
            centre_m,
            0.0,
            vertical ? area.y0_m : area.x0_m,
            vertical ? area.y1_m : area.x1_m};
}

/// With some probability, add a side street through a block on the side lines of its gaps.
void add_side_street(std::vector<Block> &blocks, const Gap &column, const Gap &row,
                     StreetWorld &world, Random &random)
{
    const bool can_vertical = column.to_m - column.from_m >= kSideBlockMin;
    const bool can_horizontal = row.to_m - row.from_m >= kSideBlockMin;
    const bool wanted = random.chance(kSideChance);
    const bool prefer_vertical = random.chance(0.5);
    const double half_m = uniform(random, kSideHalf);
    if (!wanted || (!can_vertical && !can_horizontal)) {
        return;
    }
    const bool vertical = can_vertical && (prefer_vertical || !can_horizontal);
    Street street = street_through(blocks.back(), StreetKind::side, vertical,
                                   vertical ? column.side_line_m : row.side_line_m);
    street.half_width_m = half_m;
    world.streets.push_back(street);
    const Block second = split_block(blocks.back(), street);
    blocks.push_back(second);
}

/// With some probability, split a block by an alley across its longer side.
void add_alley(std::vector<Block> &blocks, std::size_t i_block, StreetWorld &world, Random &random)
{
    const Rect area = blocks[i_block].area;
    const double size_m[2] = {area.x1_m - area.x0_m, area.y1_m - area.y0_m};
    const bool vertical = size_m[0] >= size_m[1];
    const double from_m = vertical ? area.x0_m : area.y0_m;
    const double long_m = std::max(size_m[0], size_m[1]);
    if (long_m < kAlleyBlockMin || !random.chance(kAlleyChance)) {
        return;
    }
    Street street = street_through(blocks[i_block], StreetKind::alley, vertical,
                                   from_m + random.uniform(0.4, 0.6) * long_m);
    street.half_width_m = uniform(random, kAlleyHalf);
    world.streets.push_back(street);
    const Block second = split_block(blocks[i_block], street);
    blocks.push_back(second);
}

std::vector<Block> lay_out(const StreetConfig &config, StreetWorld &world, Random &random)
{
    const std::vector<Street> vertical = main_streets(true, config, random);
    const std::vector<Street> horizontal = main_streets(false, config, random);
    world.streets = vertical;
    world.streets.insert(world.streets.end(), horizontal.begin(), horizontal.end());
    const std::vector<Gap> columns = gaps_between(vertical, config.width_m, random);
    const std::vector<Gap> rows = gaps_between(horizontal, config.height_m, random);
    std::vector<Block> blocks;
    for (const Gap &row : rows) {
        for (const Gap &column : columns) {
            blocks.push_back({{column.from_m, row.from_m, column.to_m, row.to_m},
                              {column.edge_from, column.edge_to, row.edge_from, row.edge_to}});
            add_side_street(blocks, column, row, world, random);
        }
    }
    const std::size_t n_blocks = blocks.size();
    for (std::size_t i = 0; i < n_blocks; ++i) {
        add_alley(blocks, i, world, random);
    }
    return blocks;
}

/// Distance from the building line to a facade. It is mostly small, and at most kSetbackMax.
double setback_m(Edge edge, Random &random)
{
    const double u = random.uniform(0.0, 1.0);
    return edge == Edge::border ? 0.0 : (edge == Edge::alley ? 0.25 : 1.0) * kSetbackMax * u * u;
}

/// One side of a block as a strip. u runs along the side, depth into the block.
struct Front {
    Rect area;
    Side side;
    double depth_m;

    Rect rect(double u0, double u1, double depth0, double depth1) const
    {
        switch (side) {
        case kLeft:
            return {area.x0_m + depth0, u0, area.x0_m + depth1, u1};
        case kRight:
            return {area.x1_m - depth1, u0, area.x1_m - depth0, u1};
        case kBottom:
            return {u0, area.y0_m + depth0, u1, area.y0_m + depth1};
        default:
            return {u0, area.y1_m - depth1, u1, area.y1_m - depth0};
        }
    }
};

/// A part of a front, and the distance of its facade from the building line.
struct Lot {
    double u0, u1, setback_m;
};

/// Add a building on a lot: a body, and one to three projections (bays, porches) in front of it.
void add_building(const Front &front, const Lot &lot, StreetWorld &world, Random &random)
{
    const double body_m = lot.setback_m + random.uniform(0.15, 0.5);
    const double inner_m = front.depth_m + kOverlap;
    world.obstacles.push_back(front.rect(lot.u0, lot.u1, body_m, inner_m));
    const int n_projections = 1 + static_cast<int>(random.uniform(0.0, 3.0));
    for (int i = 0; i < n_projections; ++i) {
        const double width_m = random.uniform(1.0, 3.0);
        const double u = random.uniform(lot.u0, std::max(lot.u0, lot.u1 - width_m));
        world.obstacles.push_back(
            front.rect(u, std::min(u + width_m, lot.u1), lot.setback_m, body_m + kOverlap));
    }
}

/// Divide a front into lots with buildings and a few open yards.
void fill_front(const Front &front, Edge edge, Lot span, StreetWorld &world, Random &random)
{
    const double first = span.u0;
    while (span.u0 < span.u1) {
        const bool yard = span.u0 > first && random.chance(kYardChance);
        double u_end = span.u0 + (yard ? uniform(random, kYardWidth) : uniform(random, kLotWidth));
        const bool last = span.u1 - u_end < kLotWidth[0];
        u_end = last ? span.u1 : u_end;
        if (yard && !last) {
            const double depth_m = random.uniform(std::min(4.0, front.depth_m), front.depth_m);
            world.obstacles.push_back(
                front.rect(span.u0, u_end, depth_m, front.depth_m + kOverlap));
        } else {
            add_building(front, {span.u0, u_end, setback_m(edge, random)}, world, random);
        }
        span.u0 = u_end;
    }
}

void fill_block(const Block &block, StreetWorld &world, Random &random)
{
    const Rect &area = block.area;
    const double size_m = std::min(area.x1_m - area.x0_m, area.y1_m - area.y0_m);
    const double depth_m = std::min(0.35 * size_m, kFrontDepthMax);
    world.obstacles.push_back(
        {area.x0_m + depth_m, area.y0_m + depth_m, area.x1_m - depth_m, area.y1_m - depth_m});
    for (const Side side : {kBottom, kTop, kLeft, kRight}) {
        const bool along_x = side == kBottom || side == kTop;
        Lot span = along_x ? Lot{area.x0_m, area.x1_m, 0.0}
                           : Lot{area.y0_m + depth_m, area.y1_m - depth_m, 0.0};
        if (along_x) { // corner lots also face the street around the corner
            span.u0 += setback_m(block.edges[kLeft], random);
            span.u1 -= setback_m(block.edges[kRight], random);
        }
        const Front front{area, side, depth_m};
        if (block.edges[side] == Edge::border) {
            world.obstacles.push_back(front.rect(span.u0, span.u1, 0.0, depth_m + kOverlap));
        } else {
            fill_front(front, block.edges[side], span, world, random);
        }
    }
}

/// Parts of a street without vehicles: crossings and mouths, and some space before them.
std::vector<Lot> mouths(const Street &street, const std::vector<Street> &streets)
{
    std::vector<Lot> spans;
    for (const Street &other : streets) {
        if (streets_meet(street, other)) {
            const double clear_m = other.kind == StreetKind::alley ? 1.5 : kCrossingClear;
            const double reach_m = other.half_width_m + clear_m;
            spans.push_back({other.centre_m - reach_m, other.centre_m + reach_m, 0.0});
        }
    }
    return spans;
}

/// Park vehicles along one kerb. side -1: at lower coordinates across the street, +1: at higher
/// ones.
void park_along(const Street &street, int side, const std::vector<Lot> &kept_free,
                StreetWorld &world, Random &random)
{
    const bool main_street = street.kind == StreetKind::main;
    const double pavement_m = main_street ? 1.9 : 0.9;
    const double density = random.uniform(0.35, 0.85) * (main_street ? 1.0 : 0.7);
    for (double u = street.from_m + random.uniform(1.0, 5.0); u < street.to_m;) {
        const auto &size = random.chance(kVanChance) ? kVanSize : kCarSize;
        const double u_end = u + size[0];
        const double gap_m = random.uniform(0.6, 1.8);
        const double kerb_m = street.half_width_m - pavement_m - random.uniform(0.0, 0.15);
        const bool parked = random.chance(density);
        const bool blocks_mouth =
            std::any_of(kept_free.begin(), kept_free.end(),
                        [&](const Lot &span) { return u < span.u1 && u_end > span.u0; });
        if (parked && !blocks_mouth && u_end < street.to_m - 1.0) {
            const double a = street.centre_m + side * kerb_m;
            const double b = street.centre_m + side * (kerb_m - size[1]);
            const double low_m = std::min(a, b), high_m = std::max(a, b);
            world.obstacles.push_back(street.vertical ? Rect{low_m, u, high_m, u_end}
                                                      : Rect{u, low_m, u_end, high_m});
        }
        u = (blocks_mouth ? u + 1.0 : u_end + gap_m);
    }
}

void park_vehicles(StreetWorld &world, Random &random)
{
    for (const Street &street : world.streets) {
        if (street.kind == StreetKind::alley) {
            continue;
        }
        const std::vector<Lot> kept_free = mouths(street, world.streets);
        // Side streets have parked vehicles on one side only.
        const int only_side = random.chance(0.5) ? 1 : -1;
        for (const int side : {-1, 1}) {
            if (street.kind == StreetKind::main || side == only_side) {
                park_along(street, side, kept_free, world, random);
            }
        }
    }
}

} // namespace

bool streets_meet(const Street &a, const Street &b)
{
    const auto reaches = [](const Street &s, const Street &other) {
        const double reach_m = other.half_width_m + 0.01;
        return other.centre_m > s.from_m - reach_m && other.centre_m < s.to_m + reach_m;
    };
    return a.vertical != b.vertical && reaches(a, b) && reaches(b, a);
}

StreetWorld make_street_world(const StreetConfig &config)
{
    Random random(config.seed, Random::Stream::world);
    StreetWorld world{config.width_m, config.height_m, {}, {}, 0};
    for (const Block &block : lay_out(config, world, random)) {
        fill_block(block, world, random);
    }
    world.n_buildings = world.obstacles.size();
    park_vehicles(world, random);
    return world;
}

StreetWorld without_vehicles(StreetWorld world)
{
    world.obstacles.resize(world.n_buildings);
    return world;
}

} // namespace gpom_tools

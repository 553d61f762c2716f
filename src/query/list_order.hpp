/// \file list_order.hpp
/// Sorts the points of a list so that neighbours are in one packet and share their search.
#pragma once

#include "src/query/workspace.hpp"

#include <float.h>

namespace gpom
{

/// At most kListBlock points of a list.
struct ListBlock {
    const gpom_point_t *points;
    size_t n;
};

/// A place on the Z curve is a number of two digits. Each digit has this many bits.
constexpr uint32_t kDigitBits = 8;
static_assert((1u << kDigitBits) <= kListBlock, "ListOrder::counts has no room for the digits");

/// The bits of a byte, with a zero bit before each bit.
constexpr uint32_t spread_bits(uint32_t byte)
{
    byte = (byte | byte << 4) & 0x0f0fu;
    byte = (byte | byte << 2) & 0x3333u;
    return (byte | byte << 1) & 0x5555u;
}

/// Divides an axis into 256 equal parts, from `low` on. Coordinates outside the axis get the first
/// or the last part, and a NaN gets the first part. This is good enough, because the order of the
/// points changes only the speed.
struct CodeAxis {
    double low, cells_per_m;

    uint32_t operator()(double x) const
    {
        const double cell = (x - low) * cells_per_m;
        return cell > 0.0 ? static_cast<uint32_t>(cell < 255.0 ? cell : 255.0) : 0;
    }
};

/// The axis from the least to the greatest coordinate of the points.
inline CodeAxis code_axis(const ListBlock &block, double gpom_point_t::*coordinate)
{
    double low = DBL_MAX, high = -DBL_MAX;
    for (size_t i = 0; i < block.n; ++i) {
        const double x = block.points[i].*coordinate;
        low = x < low ? x : low;
        high = x > high ? x : high;
    }
    return {low, high > low ? 255.0 / (high - low) : 0.0};
}

/// One pass of a radix sort, by one digit of the codes. Points with equal digits keep their order.
inline void sort_by_digit(ListOrder &order, size_t n, uint32_t shift, const uint16_t *from,
                          uint16_t *to)
{
    const auto digit = [&order, shift](uint16_t i) {
        return order.codes[i] >> shift & ((1u << kDigitBits) - 1);
    };
    for (uint16_t &count : order.counts) {
        count = 0;
    }
    for (size_t i = 0; i < n; ++i) {
        ++order.counts[digit(from[i])];
    }
    uint16_t n_before = 0;
    for (uint16_t &count : order.counts) {
        const uint16_t n_equal = count;
        count = n_before;
        n_before = static_cast<uint16_t>(n_before + n_equal);
    }
    for (size_t i = 0; i < n; ++i) {
        to[order.counts[digit(from[i])]++] = from[i];
    }
}

/// Put the numbers of the points into order.places, in the order of the Z curve.
/// Cost: O(n).
inline void order_along_curve(ListOrder &order, const ListBlock &block)
{
    const CodeAxis along_x = code_axis(block, &gpom_point_t::x_m);
    const CodeAxis along_y = code_axis(block, &gpom_point_t::y_m);
    for (size_t i = 0; i < block.n; ++i) {
        const gpom_point_t &point = block.points[i];
        const uint32_t code = spread_bits(along_x(point.x_m)) | spread_bits(along_y(point.y_m))
                                                                    << 1;
        order.codes[i] = static_cast<uint16_t>(code);
        order.places[i] = static_cast<uint16_t>(i);
    }
    sort_by_digit(order, block.n, 0, order.places, order.spare);
    sort_by_digit(order, block.n, kDigitBits, order.spare, order.places);
}

} // namespace gpom

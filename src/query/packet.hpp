/// \file packet.hpp
/// Packets of queries: from a list of points to packets, and from a packet to answers.
#pragma once

#include "src/gp/classify.hpp"
#include "src/query/hot_path.hpp"
#include "src/query/list_order.hpp"
#include "src/query/neighbours.hpp"

namespace gpom
{

inline void clear(Packet &packet)
{
    packet.at = {lane::splat<F>(0.0f), lane::splat<F>(0.0f)};
    packet.out_of_reach = lane::splat_int<I>(0);
    packet.n = 0;
}

/// Add a query. The first query also fills the other lanes, because some may stay unused.
inline void add(Packet &packet, const gpom_map &map, const gpom_point_t &point, size_t i_answer)
{
    const double dx_m = point.x_m - map.config.origin_x_m;
    const double dy_m = point.y_m - map.config.origin_y_m;
    const bool in_reach = dx_m * dx_m + dy_m * dy_m <= GPOM_REACH_M * GPOM_REACH_M;
    const float x_m = in_reach ? static_cast<float>(dx_m) : 0.0f;
    const float y_m = in_reach ? static_cast<float>(dy_m) : 0.0f;
    if (packet.n == 0) {
        packet.at = {lane::splat<F>(x_m), lane::splat<F>(y_m)};
    }
    lane::set(packet.at.x_m, packet.n, x_m);
    lane::set(packet.at.y_m, packet.n, y_m);
    lane::set(packet.out_of_reach, packet.n, static_cast<int32_t>(in_reach ? 0 : 1));
    packet.i_answer[packet.n++] = i_answer;
}

inline gpom_answer_t prior_answer(const gpom_map &map, unsigned flag)
{
    gpom_answer_t answer = {};
    answer.variance = map.prior_variance;
    answer.probability = map.prior_probability;
    answer.cls = static_cast<uint8_t>(class_of(map.config.params, answer.probability));
    answer.flags = static_cast<uint8_t>(flag);
    return answer;
}

/// The answers of a packet, before they are written lane by lane.
struct Answers {
    Moments<F> moments;
    F probability, n_hits, n_free;
    bool is_cut;
};

/// A count in one byte. 255 means 255 or more.
inline uint8_t count_in_byte(float n) { return static_cast<uint8_t>(lane::min(n, 255.0f)); }

[[gnu::noinline]] inline gpom_answer_t answer_of(const gpom_map &map, const Packet &packet,
                                                 const Answers &answers, int i)
{
    if (lane::get(packet.out_of_reach, i) != 0) {
        return prior_answer(map, GPOM_ANSWER_OUT_OF_REACH);
    }
    gpom_answer_t answer = {};
    answer.mean = lane::get(answers.moments.mean, i);
    answer.variance = lane::get(answers.moments.variance, i);
    answer.probability = lane::get(answers.probability, i);
    if (lane::get(answers.moments.bad, i) > 0.0f) {
        answer.probability = map.prior_probability;
        answer.flags = GPOM_ANSWER_PIVOT;
    }
    if (answers.is_cut) {
        answer.flags = static_cast<uint8_t>(answer.flags | GPOM_ANSWER_CUT);
    }
    answer.cls = static_cast<uint8_t>(class_of(map.config.params, answer.probability));
    answer.n_hits = count_in_byte(lane::get(answers.n_hits, i));
    answer.n_free = count_in_byte(lane::get(answers.n_free, i));
    return answer;
}

/// Make a packet that holds one query of another packet in all lanes.
inline void take_one(Packet &packet, const Packet &from, int i)
{
    packet.at = {lane::splat<F>(lane::get(from.at.x_m, i)),
                 lane::splat<F>(lane::get(from.at.y_m, i))};
    packet.out_of_reach = lane::splat_int<I>(lane::get(from.out_of_reach, i));
    packet.i_answer[0] = from.i_answer[i];
    packet.n = 1;
}

/// Answers a packet whose neighbours were found, and writes to `out`. Returns the bitwise or of the
/// flags of the answers.
template <class Out> using AnswerFound = unsigned (*)(const gpom_map &, Workspace &, const Out &);

/// Search for the neighbours of a packet, and answer it. Returns what answer_found() returns.
///
/// If the walks down a tree are too few for the packet, each query is searched alone, with the same
/// number of walks. So a cut answer does not depend on the other queries of the packet.
template <class Out>
unsigned answer_packet(const gpom_map &map, Workspace &work, AnswerFound<Out> answer_found,
                       const Out &out)
{
    work.is_cut = !search_both(map, work);
    if (!work.is_cut || work.packet->n == 1) {
        return answer_found(map, work, out);
    }
    *work.cut = *work.packet;
    unsigned flags = 0;
    for (int i = 0; i < work.cut->n; ++i) {
        take_one(*work.packet, *work.cut, i);
        work.has_searched = false; // no earlier result is used, as for a query that is asked alone
        work.is_cut = !search_both(map, work);
        flags |= answer_found(map, work, out);
    }
    return flags;
}

/// Put the points of a list into packets, and answer them. Returns the bitwise or of the flags.
template <class Out>
unsigned answer_list(const gpom_map &map, Workspace &work, const gpom_point_list &points,
                     AnswerFound<Out> answer_found, const Out &out)
{
    unsigned flags = 0;
    for (size_t first = 0; first < points.n; first += kListBlock) {
        const size_t n_left = points.n - first;
        const ListBlock block = {points.points + first, n_left < kListBlock ? n_left : kListBlock};
        const bool is_ordered = kLanes > 1 && block.n > static_cast<size_t>(kLanes);
        if (is_ordered) {
            order_along_curve(*work.order, block);
        }
        for (size_t i = 0; i < block.n;) {
            clear(*work.packet);
            for (; i < block.n && work.packet->n < kLanes; ++i) {
                const size_t place = is_ordered ? work.order->places[i] : i;
                add(*work.packet, map, block.points[place], first + place);
            }
            flags |= answer_packet(map, work, answer_found, out);
        }
    }
    lane::clear_upper_parts();
    return flags;
}

} // namespace gpom

#include "ports/linux/map/answers.hpp"

#include <algorithm>
#include <cmath>

namespace gpomd
{

namespace
{

using Points = gpom_point_t[GPOM_WIRE_POINTS_MAX];

double distance_m(const gpom_point_t &a, const gpom_point_t &b)
{
    return std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
}

/// Points on a polyline at arc length 0, step, 2 step, … and at its end.
gpom_wire_answer_status_t walk(const gpom_wire_query_t &query, Points &places, std::uint32_t &n)
{
    const auto step_m = static_cast<double>(query.step_m);
    n = 0;
    if (!(step_m > 0.0 && std::isfinite(step_m))) {
        return GPOM_WIRE_ANSWER_BAD_STEP;
    }
    double arc_m = 0.0; // arc length up to the start of the stretch
    for (std::uint32_t i = 0; i + 1 < query.n_points; ++i) {
        const gpom_point_t &from = query.points[i];
        const gpom_point_t &to = query.points[i + 1];
        const double length_m = distance_m(from, to);
        if (!std::isfinite(length_m)) {
            return GPOM_WIRE_ANSWER_OUT_OF_REACH;
        }
        for (double next_m = n * step_m; next_m < arc_m + length_m; next_m = n * step_m) {
            if (n == GPOM_WIRE_POINTS_MAX) {
                return GPOM_WIRE_ANSWER_TOO_MANY;
            }
            const double part = (next_m - arc_m) / length_m;
            places[n++] = {from.x_m + part * (to.x_m - from.x_m),
                           from.y_m + part * (to.y_m - from.y_m)};
        }
        arc_m += length_m;
    }
    if (query.n_points > 0) { // the end of the polyline
        if (n == GPOM_WIRE_POINTS_MAX) {
            return GPOM_WIRE_ANSWER_TOO_MANY;
        }
        places[n++] = query.points[query.n_points - 1];
    }
    return GPOM_WIRE_ANSWER_OK;
}

/// The points that a query asks about.
gpom_wire_answer_status_t places_of(const gpom_wire_query_t &query, Points &places,
                                    std::uint32_t &n)
{
    if (query.kind == GPOM_WIRE_QUERY_PATH) {
        return walk(query, places, n);
    }
    std::copy_n(query.points, query.n_points, places);
    n = query.n_points;
    return GPOM_WIRE_ANSWER_OK;
}

} // namespace

void QueryQueue::init(Memory &memory)
{
    slots_ = memory.take<QuerySlot>(kSlots);
    free.init(memory, kSlots);
    ready.init(memory, kSlots);
    for (std::uint32_t i = 0; i < kSlots; ++i) {
        slots_[i].query.points = slots_[i].points;
        free.push(i);
    }
}

const char *QueryQueue::push(const std::uint8_t *bytes, std::size_t n_bytes, bool is_crc_optional,
                             bool &has_slot)
{
    std::uint32_t i_slot = 0;
    has_slot = free.pop(i_slot, 0);
    if (!has_slot) {
        return "32 queries wait already: ask less often, or ask about more points at once";
    }
    QuerySlot &slot = slots_[i_slot];
    gpom_wire_fault_t fault = gpom_wire_query_decode(&slot.query, bytes, n_bytes);
    const bool is_typed =
        fault == GPOM_WIRE_CRC &&
        gpom_wire_query_decode_without_crc(&slot.query, bytes, n_bytes) == GPOM_WIRE_OK;
    if (fault != GPOM_WIRE_OK && !is_typed) {
        free.push(i_slot);
        has_slot = false;
        return gpom_wire_fault_str(fault);
    }
    slot.lacks_crc = is_typed && !is_crc_optional;
    ready.push(i_slot);
    return slot.lacks_crc ? "crc32 is 0, as lcm-gen's publish leaves it: compute it "
                            "(lcmtypes/README.md), or set publish.query_crc_optional = true"
                          : nullptr;
}

std::size_t answer(const QuerySlot &slot, const AnswerContext &context, std::uint8_t *bytes,
                   gpom_wire_answer_status_t &status)
{
    Points places;
    gpom_answer_t answers[GPOM_WIRE_POINTS_MAX];
    std::uint32_t n = 0;
    const gpom_wire_query_t &query = slot.query;
    status = slot.lacks_crc ? GPOM_WIRE_ANSWER_NO_CRC : places_of(query, places, n);
    if (status != GPOM_WIRE_ANSWER_OK) {
        n = 0;
    }
    const gpom_status_t result =
        gpom_query_points(context.map, places, n, answers, context.scratch);
    if (result == GPOM_ERR_REACH) { // flagged points have the prior, because nothing is known there
        status = GPOM_WIRE_ANSWER_OUT_OF_REACH;
    }
    for (std::uint32_t i = 0; i < n; ++i) {
        if ((answers[i].flags & GPOM_ANSWER_OUT_OF_REACH) != 0) {
            answers[i].cls = GPOM_WIRE_UNKNOWN;
        }
    }
    const gpom_wire_answer_t message = {context.wall_us,
                                        context.map_stamp_us,
                                        query.client,
                                        query.sequence,
                                        context.frame_epoch,
                                        static_cast<std::uint8_t>(status),
                                        answers,
                                        n};
    return gpom_wire_answer_encode(&message, bytes, GPOM_WIRE_ANSWER_BYTES(GPOM_WIRE_POINTS_MAX));
}

} // namespace gpomd

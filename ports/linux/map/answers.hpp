// Queries from the bus, and answers from the map.
#ifndef GPOM_LINUX_ANSWERS_HPP
#define GPOM_LINUX_ANSWERS_HPP

#include "ports/codec/codec.h"
#include "ports/linux/base/memory.hpp"
#include "ports/linux/lcm/scan_queue.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A query in a slot.
struct QuerySlot {
    gpom_wire_query_t query;
    bool lacks_crc; ///< The query must have a CRC-32 and has none. The answer says so.
    gpom_point_t points[GPOM_WIRE_POINTS_MAX];
};

/// Queries on their way to the mapping thread.
class QueryQueue {
public:
    static constexpr std::size_t kSlots = 32;
    static std::size_t need()
    {
        return Memory::need<QuerySlot>(kSlots) + 2 * SlotList::need(kSlots);
    }
    void init(Memory &memory);

    /// Decode a message into a slot. A query without CRC-32 is refused unless the CRC-32 is
    /// optional. A refused query may still have a slot, because it gets an answer that says so.
    /// Returns NULL, or one sentence that says why the query is refused, in static storage.
    const char *push(const std::uint8_t *bytes, std::size_t n_bytes, bool is_crc_optional,
                     bool &has_slot);
    QuerySlot &slot(std::uint32_t i) { return slots_[i]; }

    SlotList free;
    SlotList ready;

private:
    QuerySlot *slots_ = nullptr;
};

/// State of the map that an answer reports.
struct AnswerContext {
    const gpom_map_t *map;
    const gpom_scratch_t *scratch;
    std::int64_t wall_us;
    std::int64_t map_stamp_us;
    std::int32_t frame_epoch;
};

/// Answer a query. Returns the number of bytes written into `bytes`, which has room for
/// GPOM_WIRE_ANSWER_BYTES of GPOM_WIRE_POINTS_MAX points. `status` says whether the query was
/// refused.
std::size_t answer(const QuerySlot &slot, const AnswerContext &context, std::uint8_t *bytes,
                   gpom_wire_answer_status_t &status);

} // namespace gpomd

#endif

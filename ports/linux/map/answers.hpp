// Questions from the bus, and what the map says.
#ifndef GPOM_LINUX_ANSWERS_HPP
#define GPOM_LINUX_ANSWERS_HPP

#include "ports/codec/codec.h"
#include "ports/linux/base/memory.hpp"
#include "ports/linux/lcm/scan_queue.hpp"

#include <cstddef>
#include <cstdint>

namespace gpomd
{

/// A question in a slot.
struct QuerySlot {
    gpom_wire_query_t query;
    bool lacks_crc; ///< And must have one: to be answered so.
    gpom_point_t points[GPOM_WIRE_POINTS_MAX];
};

/// Questions on their way to the thread that maps.
class QueryQueue {
public:
    static constexpr std::size_t kSlots = 32;
    static std::size_t need()
    {
        return Memory::need<QuerySlot>(kSlots) + 2 * SlotList::need(kSlots);
    }
    void init(Memory &memory);

    /// Decode a message into a slot. A query without CRC-32 is refused unless that is optional, but
    /// has a slot all the same, to be answered so. NULL, or in words why it is refused; static
    /// storage.
    const char *push(const std::uint8_t *bytes, std::size_t n_bytes, bool is_crc_optional,
                     bool &has_slot);
    QuerySlot &slot(std::uint32_t i) { return slots_[i]; }

    SlotList free;
    SlotList ready;

private:
    QuerySlot *slots_ = nullptr;
};

/// What an answer says of the map it was taken from.
struct AnswerContext {
    const gpom_map_t *map;
    const gpom_scratch_t *scratch;
    std::int64_t wall_us;
    std::int64_t map_stamp_us;
    std::int32_t frame_epoch;
};

/// Answer a question. Bytes written into `bytes`, which holds GPOM_WIRE_ANSWER_BYTES of
/// GPOM_WIRE_POINTS_MAX points. `status` tells if it was refused.
std::size_t answer(const QuerySlot &slot, const AnswerContext &context, std::uint8_t *bytes,
                   gpom_wire_answer_status_t &status);

} // namespace gpomd

#endif

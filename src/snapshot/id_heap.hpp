/// \file id_heap.hpp
/// Slots of the beam store in order of their beams' ids.
#pragma once

#include "src/beams/beam.hpp"

namespace gpom
{

/// A binary heap with the slot of the least id on top (Williams 1964).
struct IdHeap {
    uint32_t *slots;
    uint32_t n;
    const Beam *beams;

    uint32_t id(uint32_t i) const { return beams[slots[i]].id; }

    void swap(uint32_t i, uint32_t j)
    {
        const uint32_t kept = slots[i];
        slots[i] = slots[j];
        slots[j] = kept;
    }

    void push(uint32_t slot)
    {
        uint32_t i = n++;
        slots[i] = slot;
        for (; i > 0 && id(i) < id((i - 1) / 2); i = (i - 1) / 2) {
            swap(i, (i - 1) / 2);
        }
    }

    /// Restore the heap's order after the id of its top has grown.
    void sink()
    {
        uint32_t i = 0;
        for (uint32_t child = 1; child < n; child = 2 * i + 1) {
            child += child + 1 < n && id(child + 1) < id(child) ? 1u : 0u;
            if (id(i) <= id(child)) {
                return;
            }
            swap(i, child);
            i = child;
        }
    }

    uint32_t pop()
    {
        const uint32_t top = slots[0];
        slots[0] = slots[--n];
        sink();
        return top;
    }
};

} // namespace gpom

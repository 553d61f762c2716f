/// \file arena.hpp
/// Carve the caller's memory once. Layouts are constexpr functions of byte offsets; see MapLayout.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace gpom
{

constexpr size_t align_up(size_t bytes, size_t alignment)
{
    return (bytes + alignment - 1) / alignment * alignment;
}

constexpr size_t align8(size_t bytes) { return align_up(bytes, 8); }

/// Address `offset` bytes into `mem` as an array of T.
template <class T> T *carve(void *mem, size_t offset)
{
    return reinterpret_cast<T *>(static_cast<unsigned char *>(mem) + offset);
}

inline bool is_aligned(const void *mem, size_t alignment)
{
    return reinterpret_cast<uintptr_t>(mem) % alignment == 0;
}

} // namespace gpom

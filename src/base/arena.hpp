/// \file arena.hpp
/// Divides the caller's memory into arrays, once. A constexpr layout function computes the byte
/// offset of each array (example: map_layout() in map.hpp).
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

/// The array of T that starts `offset` bytes after `mem`.
template <class T> T *carve(void *mem, size_t offset)
{
    return reinterpret_cast<T *>(static_cast<unsigned char *>(mem) + offset);
}

inline bool is_aligned(const void *mem, size_t alignment)
{
    return reinterpret_cast<uintptr_t>(mem) % alignment == 0;
}

} // namespace gpom

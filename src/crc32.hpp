/// \file crc32.hpp
/// CRC-32 as in IEEE 802.3: reflected polynomial 0xedb88320, initial and final value all ones.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace gpom
{

/// What crc32() gives for the bytes so far (0 for none) and those that follow. Four bits at a time:
/// a table of 64 bytes, 2 steps a byte.
inline uint32_t crc32_continue(uint32_t crc_so_far, const uint8_t *bytes, size_t n_bytes)
{
    // kTable[i]: what four steps of the shift register make of the low bits i.
    static constexpr uint32_t kTable[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac,
                                            0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
                                            0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                            0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    uint32_t crc = ~crc_so_far;
    for (size_t i = 0; i < n_bytes; ++i) {
        crc ^= bytes[i];
        crc = (crc >> 4) ^ kTable[crc & 15u];
        crc = (crc >> 4) ^ kTable[crc & 15u];
    }
    return ~crc;
}

inline uint32_t crc32(const uint8_t *bytes, size_t n_bytes)
{
    return crc32_continue(0, bytes, n_bytes);
}

} // namespace gpom

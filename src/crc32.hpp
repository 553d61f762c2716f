/// \file crc32.hpp
/// CRC-32 as in IEEE 802.3: reflected polynomial 0xedb88320, initial and final value all ones.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace gpom
{

/// Bit by bit: records are small and tables cost flash. 8 steps a byte.
inline uint32_t crc32(const uint8_t *bytes, size_t n_bytes)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < n_bytes; ++i) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; ++bit) {
            const uint32_t polynomial = (crc & 1u) != 0 ? UINT32_C(0xedb88320) : 0u;
            crc = (crc >> 1) ^ polynomial;
        }
    }
    return ~crc;
}

} // namespace gpom

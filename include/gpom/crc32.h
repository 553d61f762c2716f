/** \file crc32.h
 *  The checksum of stored records and of gpom's own messages: CRC-32 as in IEEE 802.3 (reflected
 *  polynomial 0xedb88320, initial and final value all ones), the one of zlib and Ethernet. */
#ifndef GPOM_CRC32_H
#define GPOM_CRC32_H

#include <stddef.h>
#include <stdint.h>

/** CRC-32 of n_bytes bytes; 0 for none. Bit by bit, 8 steps a byte: tables cost flash. In the
 *  header, so that core and ports share it without one linking the other. */
static inline uint32_t gpom_crc32(const uint8_t *bytes, size_t n_bytes)
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

#endif

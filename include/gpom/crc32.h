/** \file crc32.h
 *  Checksum of stored records and of gpom's own messages: CRC-32 as in IEEE 802.3, zlib and
 *  Ethernet. The polynomial is 0xedb88320 (reflected); initial and final value are all ones. */
#ifndef GPOM_CRC32_H
#define GPOM_CRC32_H

#include <stddef.h>
#include <stdint.h>

/** Continue a CRC-32. Returns what gpom_crc32() gives for all bytes together: those before, and the
 *  n_bytes bytes given here. crc_so_far is the CRC-32 of the bytes before; 0 if there are none.
 *
 *  The table has 64 bytes and handles four bits at a time. The function is in the header, so that
 *  core and ports share it without linking each other.
 *
 *  Cost: 2 steps of a table for each byte. */
static inline uint32_t gpom_crc32_continue(uint32_t crc_so_far, const uint8_t *bytes,
                                           size_t n_bytes)
{
    /* What four steps of the shift register make of its low four bits. */
    static const uint32_t table[16] = {0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu,
                                       0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
                                       0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu,
                                       0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu};
    uint32_t crc = ~crc_so_far;
    for (size_t i = 0; i < n_bytes; ++i) {
        crc ^= bytes[i];
        crc = (crc >> 4) ^ table[crc & 15u];
        crc = (crc >> 4) ^ table[crc & 15u];
    }
    return ~crc;
}

/** CRC-32 of n_bytes bytes; 0 if n_bytes is 0.
 *
 *  Cost: as gpom_crc32_continue(). */
static inline uint32_t gpom_crc32(const uint8_t *bytes, size_t n_bytes)
{
    return gpom_crc32_continue(0, bytes, n_bytes);
}

#endif

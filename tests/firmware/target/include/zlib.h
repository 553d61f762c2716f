/* The one function of zlib that the codec's tests use as their oracle, bit by bit: there is no zlib
 * for a microcontroller. */
#ifndef TARGET_ZLIB_H
#define TARGET_ZLIB_H

#include <stddef.h>
#include <stdint.h>

typedef unsigned char Bytef;
typedef unsigned int uInt;
typedef unsigned long uLong;

static inline uLong crc32(uLong before, const Bytef *bytes, uInt n_bytes)
{
    uint32_t crc = ~(uint32_t)before;
    for (uInt i = 0; bytes != NULL && i < n_bytes; ++i) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; ++bit) {
            crc = crc >> 1 ^ (crc % 2 ? UINT32_C(0xedb88320) : 0);
        }
    }
    return bytes != NULL ? (uint32_t)~crc : 0;
}

#endif

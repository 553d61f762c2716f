/// \file little_endian.hpp
/// Writes and reads the numbers of stored records. The low byte comes first on every processor. A
/// float is stored as its IEEE 754 bits.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <type_traits>

namespace gpom
{

template <size_t kBytes>
using BitsOf = std::conditional_t<
    kBytes == 1, uint8_t,
    std::conditional_t<kBytes == 2, uint16_t, std::conditional_t<kBytes == 4, uint32_t, uint64_t>>>;

/// Writes one number after another. The caller makes sure that there is room.
struct Encoder {
    uint8_t *at;

    template <class T> void operator()(const T &value)
    {
        BitsOf<sizeof(T)> bits;
        static_assert(sizeof bits == sizeof value && std::is_arithmetic_v<T>, "not a number");
        memcpy(&bits, &value, sizeof bits);
        for (size_t i = 0; i < sizeof bits; ++i) {
            *at++ = static_cast<uint8_t>(bits >> (8 * i));
        }
    }
};

/// Reads one number after another. It is called like Encoder, so that one list of fields serves
/// both directions.
struct Decoder {
    const uint8_t *at;

    template <class T> void operator()(T &value)
    {
        BitsOf<sizeof(T)> bits = 0;
        static_assert(sizeof bits == sizeof value && std::is_arithmetic_v<T>, "not a number");
        for (size_t i = 0; i < sizeof bits; ++i) {
            const auto byte = static_cast<BitsOf<sizeof(T)>>(*at++);
            bits = static_cast<BitsOf<sizeof(T)>>(bits | (byte << (8 * i)));
        }
        memcpy(&value, &bits, sizeof bits);
    }
};

/// Read the next number, which is of type T.
template <class T> T take(Decoder &from)
{
    T value;
    from(value);
    return value;
}

} // namespace gpom

// Every type of the codec, to be decoded and encoded again by its fingerprint.
#pragma once

#include "ports/codec/codec.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

using Bytes = std::vector<std::uint8_t>;

/// A message is also decoded without arrays for its elements, which are skipped then.
struct Reencoded {
    gpom_wire_fault_t fault; // GPOM_WIRE_FAULTS: skipping took what is no message
    Bytes bytes;             // empty after a fault
};

struct Type {
    const char *name;
    std::uint64_t fingerprint;
    bool has_crc;
    Reencoded (*reencode)(const std::uint8_t *bytes, std::size_t n_bytes);
};

extern const std::array<Type, 12> kTypes;

/// The type of a message, or NULL.
const Type *type_of(const Bytes &message);

/// Big-endian.
void append(Bytes &bytes, std::uint64_t value, std::size_t n_bytes);

/// Makes the CRC-32 at the end of a message fit, by zlib.
void mend_crc(Bytes &message);

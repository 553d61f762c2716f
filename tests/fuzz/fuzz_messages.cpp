// Any bytes to a decoder: a fault, or a message that is encoded to the same bytes again.
//
// FUZZ_TYPE names the type whose decoder is tried (FUZZ_TYPE=list prints them all); without it the
// input's first byte chooses.
#include "tests/codec/types.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace
{

const Type *chosen = nullptr;

void check(const Type &type, const Bytes &message)
{
    const Reencoded again = type.reencode(message.data(), message.size());
    if (again.fault == GPOM_WIRE_FAULTS ||
        (again.fault == GPOM_WIRE_OK && again.bytes != message)) {
        std::abort();
    }
}

/// Input for a valid tile of 3 x 2 cells: what stands between fingerprint and checksum.
Bytes input_of_tile()
{
    const std::uint8_t codes[] = {0, 127, 254, 255, 1, 2};
    const std::uint8_t variances[] = {0, 1, 2, 3, 0, 1};
    gpom_wire_map_t tile = {};
    tile.n_tiles = 1;
    tile.map_nx = tile.nx = 3;
    tile.map_ny = tile.ny = 2;
    tile.probability = codes;
    tile.variance_class = variances;
    Bytes message(GPOM_WIRE_MAP_BYTES(6));
    if (gpom_wire_map_encode(&tile, message.data(), message.size()) != message.size()) {
        std::abort();
    }
    Bytes input = {1}; // kTypes[1]
    input.insert(input.end(), message.begin() + 8, message.end() - 4);
    return input;
}

} // namespace

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t *data, std::size_t size, std::size_t max_size);

// The fields of a tile must fit each other in so many ways that chance does not find one: every so
// often start from one.
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t *data, std::size_t size,
                                               std::size_t max_size, unsigned seed)
{
    static const Bytes tile = input_of_tile();
    const bool is_map_wanted = chosen == nullptr || chosen == &kTypes[1];
    if (is_map_wanted && seed % 16 == 0 && tile.size() <= max_size) {
        std::copy(tile.begin(), tile.end(), data);
        size = tile.size();
    }
    return LLVMFuzzerMutate(data, size, max_size);
}

extern "C" int LLVMFuzzerInitialize(int *, char ***)
{
    const char *const wanted = std::getenv("FUZZ_TYPE");
    if (wanted == nullptr) {
        return 0;
    }
    for (const Type &type : kTypes) {
        if (wanted == std::string("list")) {
            std::puts(type.name);
        } else if (wanted == std::string(type.name)) {
            chosen = &type;
        }
    }
    if (chosen == nullptr) {
        std::exit(wanted == std::string("list") ? 0 : 2);
    }
    return 0;
}

// Fingerprint and checksum are put around the input, so that the fuzzer reaches the fields.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size)
{
    if (size == 0) {
        return 0;
    }
    const Type &type = chosen != nullptr ? *chosen : kTypes[data[0] % kTypes.size()];
    check(type, Bytes(data, data + size)); // as it is
    Bytes message;
    append(message, type.fingerprint, 8);
    message.insert(message.end(), data + 1, data + size);
    check(type, message);
    if (type.has_crc) {
        message.resize(message.size() + 4);
        mend_crc(message);
        check(type, message);
    }
    return 0;
}

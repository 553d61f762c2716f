// Any bytes to a decoder: a fault, or a message that is encoded to the same bytes again.
//
// FUZZ_TYPE names the type whose decoder is tried (FUZZ_TYPE=list prints them all); without it the
// input's first byte chooses.
#include "tests/codec/types.hpp"

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

} // namespace

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

#include "ports/codec/wire.h"

const char *gpom_wire_fault_str(gpom_wire_fault_t fault)
{
    switch (fault) {
    case GPOM_WIRE_OK:
        return "a message";
    case GPOM_WIRE_ARG:
        return "null pointer";
    case GPOM_WIRE_TYPE:
        return "another type: fingerprint or magic number differs";
    case GPOM_WIRE_SHORT:
        return "ends before its fields do";
    case GPOM_WIRE_LONG:
        return "has bytes after its last field";
    case GPOM_WIRE_CRC:
        return "damaged: CRC-32 does not fit";
    case GPOM_WIRE_COUNT:
        return "a count is negative or contradicts another";
    case GPOM_WIRE_CAPACITY:
        return "more elements than the receiving memory holds";
    case GPOM_WIRE_VALUE:
        return "a field has a value that its definition does not know";
    case GPOM_WIRE_FAULTS:
        break;
    }
    return "not a fault";
}

uint64_t gpom_wire_fingerprint(const uint8_t *bytes, size_t n_bytes)
{
    uint64_t fingerprint = 0;
    if (bytes == NULL || n_bytes < sizeof fingerprint) {
        return 0;
    }
    for (size_t i = 0; i < sizeof fingerprint; ++i) {
        fingerprint = (fingerprint << 8) | bytes[i];
    }
    return fingerprint;
}

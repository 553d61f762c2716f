#include "gpom/params.h"

#include "gpom/crc32.h"

#include <string.h>

namespace
{

constexpr uint32_t kMagic = 0x504d5047; // "GPMP" in the order of the bytes
constexpr uint16_t kVersion = 2;        // 1 knew no fade_m

/// The float fields in the record's order, which never changes within a version.
constexpr float gpom_params_t::*kFloats[] = {&gpom_params_t::sf2,
                                             &gpom_params_t::s0,
                                             &gpom_params_t::s1,
                                             &gpom_params_t::ell_m,
                                             &gpom_params_t::sn2,
                                             &gpom_params_t::sn2_free,
                                             &gpom_params_t::alpha,
                                             &gpom_params_t::beta,
                                             &gpom_params_t::gap_m,
                                             &gpom_params_t::p_occupied,
                                             &gpom_params_t::p_free,
                                             &gpom_params_t::depth_m,
                                             &gpom_params_t::anisotropy,
                                             &gpom_params_t::vote,
                                             &gpom_params_t::log_hit_first,
                                             &gpom_params_t::log_hit_last,
                                             &gpom_params_t::log_free_first,
                                             &gpom_params_t::log_free_last,
                                             &gpom_params_t::fade_m};
constexpr uint16_t gpom_params_t::*kCounts[] = {&gpom_params_t::n_hits, &gpom_params_t::n_free,
                                                &gpom_params_t::scan_points_max};

// magic, version, kernel, frame, counts, floats, CRC
constexpr size_t kHeadBytes = 4 + 2;
constexpr size_t kFloatsAt = kHeadBytes + 1 + 1 + 2 * 3;
static_assert(kFloatsAt + 4 * 19 + 4 == GPOM_PARAMS_RECORD_BYTES, "the header says another size");
static_assert(sizeof kFloats / sizeof kFloats[0] == 19, "a field is missing");

/// Little-endian, whatever the processor.
void put(uint8_t *&to, uint32_t value, int n_bytes)
{
    for (int i = 0; i < n_bytes; ++i) {
        *to++ = static_cast<uint8_t>(value >> (8 * i));
    }
}

uint32_t take(const uint8_t *&from, int n_bytes)
{
    uint32_t value = 0;
    for (int i = 0; i < n_bytes; ++i) {
        value |= static_cast<uint32_t>(*from++) << (8 * i);
    }
    return value;
}

const char *problem_of_record(const uint8_t *record, size_t record_bytes)
{
    constexpr const char *kWrongSize = "record: not of GPOM_PARAMS_RECORD_BYTES";
    if (record_bytes < kHeadBytes) {
        return kWrongSize;
    }
    const uint8_t *at = record;
    if (take(at, 4) != kMagic) {
        return "record: does not begin with GPMP";
    }
    if (take(at, 2) != kVersion) {
        return "version: not one this library knows";
    }
    if (record_bytes != GPOM_PARAMS_RECORD_BYTES) {
        return kWrongSize;
    }
    const uint8_t *crc_at = record + GPOM_PARAMS_RECORD_BYTES - 4;
    if (take(crc_at, 4) != gpom_crc32(record, GPOM_PARAMS_RECORD_BYTES - 4)) {
        return "crc: does not fit the record, which is damaged";
    }
    return nullptr;
}

gpom_params_t unpack(const uint8_t *record)
{
    gpom_params_t params;
    gpom_params_init(&params);
    const uint8_t *at = record + kHeadBytes;
    params.kernel = static_cast<int32_t>(take(at, 1));
    params.frame = static_cast<int32_t>(take(at, 1));
    for (const auto field : kCounts) {
        params.*field = static_cast<uint16_t>(take(at, 2));
    }
    for (const auto field : kFloats) {
        const uint32_t bits = take(at, 4);
        memcpy(&(params.*field), &bits, sizeof bits);
    }
    return params;
}

} // namespace

gpom_status_t gpom_params_save(const gpom_params_t *params, uint8_t *record)
{
    if (record == nullptr) {
        return GPOM_ERR_ARG;
    }
    const gpom_status_t status = gpom_params_check(params, nullptr);
    if (status != GPOM_OK) {
        return status;
    }
    uint8_t *to = record;
    put(to, kMagic, 4);
    put(to, kVersion, 2);
    put(to, static_cast<uint32_t>(params->kernel), 1);
    put(to, static_cast<uint32_t>(params->frame), 1);
    for (const auto field : kCounts) {
        put(to, params->*field, 2);
    }
    for (const auto field : kFloats) {
        uint32_t bits;
        memcpy(&bits, &(params->*field), sizeof bits);
        put(to, bits, 4);
    }
    put(to, gpom_crc32(record, GPOM_PARAMS_RECORD_BYTES - 4), 4);
    return GPOM_OK;
}

gpom_status_t gpom_params_load(gpom_params_t *params, const uint8_t *record, size_t record_bytes,
                               const char **problem)
{
    if (problem != nullptr) {
        *problem = nullptr;
    }
    if (params == nullptr || record == nullptr) {
        return GPOM_ERR_ARG;
    }
    const char *const found = problem_of_record(record, record_bytes);
    if (found != nullptr) {
        if (problem != nullptr) {
            *problem = found;
        }
        return GPOM_ERR_FORMAT;
    }
    const gpom_params_t loaded = unpack(record);
    const gpom_status_t status = gpom_params_check(&loaded, problem);
    if (status == GPOM_OK) {
        *params = loaded;
    }
    return status;
}

#include "gpom/params.h"

#include "gpom/crc32.h"
#include "src/little_endian.hpp"

using gpom::Decoder;
using gpom::Encoder;
using gpom::take;

namespace
{

constexpr uint32_t kMagic = 0x504d5047; // "GPMP" in the order of the bytes
constexpr uint16_t kVersion = 3;        // 1 knew no fade_m, 2 knew no sn2_once

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
                                             &gpom_params_t::fade_m,
                                             &gpom_params_t::sn2_once};
constexpr uint16_t gpom_params_t::*kCounts[] = {&gpom_params_t::n_hits, &gpom_params_t::n_free,
                                                &gpom_params_t::scan_points_max};

// magic, version, kernel, frame, counts, floats, CRC
constexpr size_t kHeadBytes = 4 + 2;
constexpr size_t kFloatsAt = kHeadBytes + 1 + 1 + 2 * 3;
static_assert(kFloatsAt + 4 * 20 + 4 == GPOM_PARAMS_RECORD_BYTES, "the header says another size");
static_assert(sizeof kFloats / sizeof kFloats[0] == 20, "a field is missing");

const char *problem_of_record(const uint8_t *record, size_t record_bytes)
{
    constexpr const char *kWrongSize = "record: not of GPOM_PARAMS_RECORD_BYTES";
    if (record_bytes < kHeadBytes) {
        return kWrongSize;
    }
    Decoder from = {record};
    if (take<uint32_t>(from) != kMagic) {
        return "record: does not begin with GPMP";
    }
    if (take<uint16_t>(from) != kVersion) {
        return "version: not one this library knows";
    }
    if (record_bytes != GPOM_PARAMS_RECORD_BYTES) {
        return kWrongSize;
    }
    Decoder crc_from = {record + GPOM_PARAMS_RECORD_BYTES - 4};
    if (take<uint32_t>(crc_from) != gpom_crc32(record, GPOM_PARAMS_RECORD_BYTES - 4)) {
        return "crc: does not fit the record, which is damaged";
    }
    return nullptr;
}

gpom_params_t unpack(const uint8_t *record)
{
    gpom_params_t params;
    gpom_params_init(&params);
    Decoder from = {record + kHeadBytes};
    params.kernel = take<uint8_t>(from);
    params.frame = take<uint8_t>(from);
    for (const auto field : kCounts) {
        from(params.*field);
    }
    for (const auto field : kFloats) {
        from(params.*field);
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
    Encoder to = {record};
    to(kMagic);
    to(kVersion);
    to(static_cast<uint8_t>(params->kernel));
    to(static_cast<uint8_t>(params->frame));
    for (const auto field : kCounts) {
        to(params->*field);
    }
    for (const auto field : kFloats) {
        to(params->*field);
    }
    to(gpom_crc32(record, GPOM_PARAMS_RECORD_BYTES - 4));
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

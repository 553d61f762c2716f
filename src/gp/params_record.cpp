#include "gpom/params.h"

#include "gpom/crc32.h"
#include "src/base/little_endian.hpp"
#include "src/gp/params_record.hpp"

using gpom::Decoder;
using gpom::Encoder;
using gpom::kRecordBytesBefore;
using gpom::kRecordCrcBytes;
using gpom::kRecordHeadBytes;
using gpom::take;

namespace
{

constexpr uint32_t kMagic = 0x504d5047; // "GPMP" in the order of the bytes
constexpr uint16_t kVersion = 4;
constexpr uint16_t kVersionBefore = 3; // without n_fading, beta_far and line

/// The float fields in the order of the record. The order never changes within a version.
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
/// The counts in the order of the record.
constexpr uint16_t gpom_params_t::*kCounts[] = {&gpom_params_t::n_hits, &gpom_params_t::n_free,
                                                &gpom_params_t::scan_points_max};

/// The fields that the version before did not have.
constexpr uint16_t gpom_params_t::*kNewCounts[] = {&gpom_params_t::n_fading};
constexpr float gpom_params_t::*kNewFloats[] = {&gpom_params_t::beta_far, &gpom_params_t::line};

template <class T, size_t n> constexpr uint32_t count_of(T (&)[n]) { return n; }

// A record holds magic, version, kernel, frame, counts, floats, new counts, new floats, CRC.
constexpr uint32_t kNewAt =
    kRecordHeadBytes + 1 + 1 + 2 * count_of(kCounts) + 4 * count_of(kFloats);
static_assert(kNewAt + kRecordCrcBytes == kRecordBytesBefore, "a field of old is missing");
static_assert(kNewAt + 2 * count_of(kNewCounts) + 4 * count_of(kNewFloats) + kRecordCrcBytes ==
                  GPOM_PARAMS_RECORD_BYTES,
              "the header says another size");

const char *problem_of_record(const uint8_t *record, size_t record_bytes)
{
    constexpr const char *kWrongSize = "record: not of the size of its version";
    if (record_bytes < kRecordHeadBytes) {
        return kWrongSize;
    }
    Decoder from = {record};
    if (take<uint32_t>(from) != kMagic) {
        return "record: does not begin with GPMP";
    }
    const auto version = take<uint16_t>(from);
    if (version != kVersion && version != kVersionBefore) {
        return "version: not one this library knows";
    }
    if (record_bytes != (version == kVersion ? GPOM_PARAMS_RECORD_BYTES : kRecordBytesBefore)) {
        return kWrongSize;
    }
    Decoder crc_from = {record + record_bytes - kRecordCrcBytes};
    if (take<uint32_t>(crc_from) != gpom_crc32(record, record_bytes - kRecordCrcBytes)) {
        return "crc: does not fit the record, which is damaged";
    }
    return nullptr;
}

/// Read the fields of a record. A record of the version before has no new fields: they keep their
/// neutral default.
gpom_params_t unpack(const uint8_t *record, size_t record_bytes)
{
    gpom_params_t params;
    gpom_params_init(&params);
    Decoder from = {record + kRecordHeadBytes};
    params.kernel = take<uint8_t>(from);
    params.frame = take<uint8_t>(from);
    for (const auto field : kCounts) {
        from(params.*field);
    }
    for (const auto field : kFloats) {
        from(params.*field);
    }
    if (record_bytes == GPOM_PARAMS_RECORD_BYTES) {
        for (const auto field : kNewCounts) {
            from(params.*field);
        }
        for (const auto field : kNewFloats) {
            from(params.*field);
        }
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
    for (const auto field : kNewCounts) {
        to(params->*field);
    }
    for (const auto field : kNewFloats) {
        to(params->*field);
    }
    to(gpom_crc32(record, GPOM_PARAMS_RECORD_BYTES - kRecordCrcBytes));
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
    const gpom_params_t loaded = unpack(record, record_bytes);
    const gpom_status_t status = gpom_params_check(&loaded, problem);
    if (status == GPOM_OK) {
        *params = loaded;
    }
    return status;
}

// The stored record of hyperparameters: what is written is read, and nothing else is.
#include "gpom/params.h"

#include <doctest/doctest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

namespace
{

gpom_params_t busy_params()
{
    gpom_params_t p;
    gpom_params_init(&p);
    p.kernel = GPOM_KERNEL_ASKEY;
    p.ell_m = 23.5f;
    p.sn2 = 0.125f;
    p.sn2_free = 0.0625f;
    p.alpha = 3.0f;
    p.beta = -0.25f;
    p.n_hits = 12;
    p.n_free = 7;
    p.scan_points_max = 3;
    p.depth_m = 0.5f;
    p.sf2 = 1.0f;
    p.anisotropy = 0.75f;
    p.vote = -1.5f;
    p.log_hit_first = 0.001f;
    p.log_hit_last = -0.002f;
    p.log_free_first = 0.003f;
    p.log_free_last = -0.004f;
    p.fade_m = 21.0f;
    p.sn2_once = 0.375f;
    p.n_fading = 5;
    p.beta_far = 0.0625f;
    p.line = 1.0f;
    return p;
}

std::vector<std::uint8_t> record_of(const gpom_params_t &p)
{
    std::vector<std::uint8_t> record(GPOM_PARAMS_RECORD_BYTES);
    REQUIRE(gpom_params_save(&p, record.data()) == GPOM_OK);
    return record;
}

/// Make the checksum fit again, by zlib's CRC-32.
void mend_crc(std::vector<std::uint8_t> &record)
{
    const std::size_t n = record.size() - 4;
    const auto crc = static_cast<std::uint32_t>(crc32(0, record.data(), static_cast<unsigned>(n)));
    for (std::size_t i = 0; i < 4; ++i) {
        record[n + i] = static_cast<std::uint8_t>(crc >> (8 * i));
    }
}

/// Status and problem of loading; on failure the target must keep its bytes.
gpom_status_t load(const std::vector<std::uint8_t> &record, std::string &problem)
{
    gpom_params_t p;
    std::memset(&p, 0x5a, sizeof p);
    const gpom_params_t before = p;
    const char *text = nullptr;
    const gpom_status_t status = gpom_params_load(&p, record.data(), record.size(), &text);
    problem = text != nullptr ? text : "";
    if (status != GPOM_OK) {
        CHECK(std::memcmp(&p, &before, sizeof p) == 0);
    }
    return status;
}

} // namespace

// Every field survives.
TEST_CASE("a record gives back the parameters it was made of")
{
    const gpom_params_t p = busy_params();
    const std::vector<std::uint8_t> record = record_of(p);
    gpom_params_t read;
    std::memset(&read, 0, sizeof read);
    CHECK(gpom_params_load(&read, record.data(), record.size(), nullptr) == GPOM_OK);
    CHECK(record_of(read) == record);
    CHECK(read.kernel == p.kernel);
    CHECK(read.n_free == p.n_free);
    CHECK(read.scan_points_max == p.scan_points_max);
    CHECK(read.ell_m == p.ell_m);
    CHECK(read.log_free_last == p.log_free_last);
    CHECK(read.fade_m == p.fade_m);
    CHECK(read.sn2_once == p.sn2_once);
    CHECK(read.n_fading == p.n_fading);
    CHECK(read.beta_far == p.beta_far);
    CHECK(read.line == p.line);
}

// The layout is fixed on every processor: magic, version, and fields low byte first.
TEST_CASE("a record has a fixed layout")
{
    const std::vector<std::uint8_t> record = record_of(busy_params());
    const std::vector<std::uint8_t> head = {
        'G', 'P', 'M', 'P', 4, 0, GPOM_KERNEL_ASKEY, GPOM_FRAME_QUERY, 12, 0, 7, 0, 3, 0};
    CHECK(std::equal(head.begin(), head.end(), record.begin()));
    const std::vector<std::uint8_t> one = {0x00, 0x00, 0x80, 0x3f}; // sf2 = 1
    CHECK(std::equal(one.begin(), one.end(), record.begin() + 14));
    const std::vector<std::uint8_t> last = {5,    0,    0x00, 0x00, 0x80, 0x3d, // beta_far = 1 / 16
                                            0x00, 0x00, 0x80, 0x3f};            // line = 1
    CHECK(std::equal(last.begin(), last.end(), record.end() - 14));
    std::vector<std::uint8_t> mended = record;
    mend_crc(mended);
    CHECK(mended == record);
}

// No damaged bit goes unnoticed, and no length but the right one is read.
TEST_CASE("a damaged or cut record is refused")
{
    const std::vector<std::uint8_t> good = record_of(busy_params());
    std::string problem;
    for (std::size_t i = 0; i < 8 * good.size(); ++i) {
        std::vector<std::uint8_t> bad = good;
        bad[i / 8] = static_cast<std::uint8_t>(bad[i / 8] ^ (1u << (i % 8)));
        CHECK(load(bad, problem) == GPOM_ERR_FORMAT);
        CHECK_FALSE(problem.empty());
    }
    for (std::size_t n = 0; n < good.size(); ++n) {
        const std::vector<std::uint8_t> cut(good.begin(),
                                            good.begin() + static_cast<std::ptrdiff_t>(n));
        std::vector<std::uint8_t> padded = cut;
        padded.reserve(1); // data() is then not null
        CHECK(load(padded, problem) == GPOM_ERR_FORMAT);
    }
    std::vector<std::uint8_t> longer = good;
    longer.push_back(0);
    CHECK(load(longer, problem) == GPOM_ERR_FORMAT);
}

// What was stored before this version has the same fields but for the last, which are neutral.
TEST_CASE("a record of the version before is read, and new fields are neutral")
{
    gpom_params_t p = busy_params();
    std::vector<std::uint8_t> record = record_of(p);
    record.resize(98);
    record[4] = 3;
    mend_crc(record);
    gpom_params_t read;
    CHECK(gpom_params_load(&read, record.data(), record.size(), nullptr) == GPOM_OK);
    CHECK(read.n_fading == 0);
    CHECK(read.beta_far == 0.0f);
    CHECK(read.line == 0.0f);
    p.n_fading = 0;
    p.beta_far = 0.0f;
    p.line = 0.0f;
    CHECK(record_of(read) == record_of(p));
    record.resize(GPOM_PARAMS_RECORD_BYTES);
    mend_crc(record);
    std::string problem;
    CHECK(load(record, problem) == GPOM_ERR_FORMAT); // not of the size of its version
}

// Another version is refused by name even if its checksum fits, whatever its length.
TEST_CASE("a record of another version is refused")
{
    for (const std::uint8_t version : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{5}}) {
        std::vector<std::uint8_t> record = record_of(busy_params());
        record.resize(version == 1 ? 90u : version == 2 ? 94u : record.size());
        record[4] = version;
        mend_crc(record);
        std::string problem;
        CHECK(load(record, problem) == GPOM_ERR_FORMAT);
        CHECK(problem.rfind("version", 0) == 0);
    }
}

// A whole record can still hold values that are refused; the problem names the field.
TEST_CASE("a record with values out of range is refused by field")
{
    struct Bad {
        std::size_t at;
        std::uint8_t value;
        const char *field;
    };
    for (const Bad &bad : {Bad{6, 9, "kernel"}, Bad{7, 2, "frame"}, Bad{8, 0, "hits"},
                           Bad{12, 65, "scan_points_max"}, Bad{17, 0xff, "sf2"}}) {
        std::vector<std::uint8_t> record = record_of(busy_params());
        record[bad.at] = bad.value;
        mend_crc(record);
        std::string problem;
        CHECK(load(record, problem) == GPOM_ERR_PARAMS);
        CHECK(problem.rfind(bad.field, 0) == 0);
    }
}

// Parameters that are refused are not written.
TEST_CASE("refused parameters leave the record untouched")
{
    gpom_params_t p = busy_params();
    p.alpha = NAN;
    std::vector<std::uint8_t> record(GPOM_PARAMS_RECORD_BYTES, 0x77);
    const std::vector<std::uint8_t> before = record;
    CHECK(gpom_params_save(&p, record.data()) == GPOM_ERR_PARAMS);
    CHECK(gpom_params_save(&p, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_params_save(nullptr, record.data()) == GPOM_ERR_ARG);
    CHECK(record == before);
    CHECK(gpom_params_load(nullptr, record.data(), record.size(), nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_params_load(&p, nullptr, record.size(), nullptr) == GPOM_ERR_ARG);
}

// What a query leaves in the processor's registers.
#include "tests/common/reference.hpp"

#if defined(__x86_64__)

#include <cpuid.h>

using namespace reference;

namespace
{

/// Upper parts of vector registers, as XGETBV tells which are in use: of ymm, and of zmm0 to 15.
constexpr std::uint32_t kUpperParts = 1u << 2 | 1u << 6;

/// True if the processor tells what is in use, and has upper parts.
bool tells_what_is_in_use()
{
    std::uint32_t a = 0, b = 0, c = 0, d = 0;
    const bool has_avx =
        __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_OSXSAVE) != 0 && (c & bit_AVX) != 0;
    return has_avx && __get_cpuid_count(0xd, 1, &a, &b, &c, &d) != 0 && (a & 1u << 2) != 0;
}

bool has_upper_parts_in_use()
{
    std::uint32_t low = 0, high = 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(1));
    return (low & kUpperParts) != 0;
}

void use_upper_parts() { __asm__ volatile("vpcmpeqd %%ymm1, %%ymm1, %%ymm1" ::: "xmm1"); }

} // namespace

// A caller's SSE instructions would take twice their time and more: each has to wait for the upper
// part that it leaves as it is.
TEST_CASE("queries leave no upper part of a register in use")
{
    if (gpom_lanes() < 8 || !tells_what_is_in_use()) {
        MESSAGE("left out: no AVX, or the processor does not tell what is in use");
        return;
    }
    Random random(7);
    TestMap map(config_of(params_of(GPOM_KERNEL_NN)));
    REQUIRE(yard_scan(random, 0, {0, 0}).insert_into(map.get()) == GPOM_OK);
    std::vector<std::uint8_t> memory(gpom_scratch_bytes(map.get()));
    const gpom_scratch_t scratch = {memory.data(), memory.size()};
    std::vector<gpom_answer_t> answers(300);
    const std::vector<gpom_point_t> points = random_points(8, answers.size(), 16.0, {6.0, 0.0});
    for (const std::size_t n : {1u, 16u, 300u}) {
        use_upper_parts();
        const bool is_seen = has_upper_parts_in_use();
        REQUIRE(is_seen);
        const gpom_status_t status =
            gpom_query_points(map.get(), points.data(), n, answers.data(), &scratch);
        const bool is_in_use = has_upper_parts_in_use();
        CHECK(status == GPOM_OK);
        CHECK_FALSE(is_in_use);
    }
    const gpom_raster_t raster = {0.0, -4.0, 0.5, 17, 16};
    use_upper_parts();
    const gpom_status_t status = gpom_query_raster(map.get(), &raster, answers.data(), &scratch);
    const bool is_in_use = has_upper_parts_in_use();
    CHECK(status == GPOM_OK);
    CHECK_FALSE(is_in_use);
}

#endif

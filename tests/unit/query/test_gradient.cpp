// Gradients: what they share with queries. That they equal central differences of the oracle is in
// tests/tools/test_gradient.py.
#include "tests/common/models.hpp"

#include <array>

using namespace reference;

namespace
{

/// Gradients and the status they came with; scratch of the exact size between canaries.
struct Gradients {
    std::vector<gpom_gradient_t> all;
    gpom_status_t status;
};

Gradients query_gradients(const gpom_map_t *map, const std::vector<gpom_point_t> &points)
{
    GuardedMemory memory(gpom_gradient_bytes(map), 1); // no alignment is asked for
    const gpom_scratch_t scratch = {memory.mem(), memory.bytes()};
    Gradients gradients = {std::vector<gpom_gradient_t>(points.size()), GPOM_OK};
    gradients.status =
        gpom_query_gradients(map, points.data(), points.size(), gradients.all.data(), &scratch);
    CHECK(memory.is_intact());
    return gradients;
}

std::array<float, 6> slopes_of(const gpom_gradient_t &g)
{
    return {g.mean_x, g.mean_y, g.variance_x, g.variance_y, g.probability_x, g.probability_y};
}

bool are_zero(const gpom_gradient_t &g)
{
    const auto all = slopes_of(g);
    return std::all_of(all.begin(), all.end(), [](float slope) { return slope == 0.0f; });
}

bool are_finite(const gpom_gradient_t &g)
{
    const auto all = slopes_of(g);
    return std::all_of(all.begin(), all.end(), [](float slope) { return std::isfinite(slope); });
}

} // namespace

TEST_CASE("answers with derivatives are those without, to the last bit")
{
    for_all_models([](const gpom_params_t &p) {
        TestMap map(config_of(p));
        fill(map, Built::half);
        std::vector<gpom_point_t> points = yard_points(map, 100);
        points.push_back({static_cast<double>(kNan), 0.0});
        const Answers plain = query_points(map.get(), points);
        const Gradients got = query_gradients(map.get(), points);
        CHECK(got.status == plain.status);
        std::size_t n_equal = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            n_equal += same_bits(got.all[i].answer, plain.all[i]) ? 1 : 0;
        }
        CHECK(n_equal == points.size());
    });
}

TEST_CASE("a gradient does not depend on the list it is asked in, and is finite anywhere")
{
    for_all_models([](const gpom_params_t &p) {
        TestMap map(config_of(p));
        fill(map, Built::yes);
        const std::vector<gpom_point_t> points = yard_points(map, 60);
        const Gradients together = query_gradients(map.get(), points);
        std::size_t n_equal = 0, n_finite = 0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            const Gradients alone = query_gradients(map.get(), {points[i]});
            const auto a = slopes_of(together.all[i]);
            const auto b = slopes_of(alone.all[0]);
            n_equal += std::memcmp(a.data(), b.data(), sizeof a) == 0 ? 1 : 0;
            n_finite += are_finite(together.all[i]) ? 1 : 0;
        }
        CHECK(n_equal == points.size());
        CHECK(n_finite == points.size());
    });
}

TEST_CASE("where the answer is the prior, all derivatives are 0")
{
    gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
    p.fade_m = 5.0f;
    TestMap map(config_of(p));
    CHECK(are_zero(query_gradients(map.get(), {{1.0, 2.0}}).all[0]));
    fill(map, Built::yes);
    const Gradients got = query_gradients(
        map.get(), {{400.0, -300.0}, {static_cast<double>(kInf), 0.0}, {1e9, 0.0}, {0.0, 0.0}});
    CHECK(got.status == GPOM_ERR_REACH);
    CHECK(are_zero(got.all[0]));
    CHECK(are_zero(got.all[1]));
    CHECK(are_zero(got.all[2]));
    CHECK_FALSE(are_zero(got.all[3]));
}

// Matern-1/2 and Askey have a kink at a hit. A beam along x puts a hit at exactly (4, 0), so that
// the two sides are places at equal distances before and behind it.
TEST_CASE("on a hit a derivative is the mean of those on its two sides")
{
    for (const gpom_kernel_t kernel : {GPOM_KERNEL_MATERN12, GPOM_KERNEL_ASKEY}) {
        TestMap map(config_of(params_of(kernel)));
        TestScan s;
        s.ranges_m = {4.0f};
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
        const double step_m = 1.0 / 65536.0;
        const std::vector<gpom_gradient_t> all =
            query_gradients(map.get(), {{4.0, 0.0}, {4.0 - step_m, 0.0}, {4.0 + step_m, 0.0}}).all;
        const auto on = slopes_of(all[0]), before = slopes_of(all[1]), behind = slopes_of(all[2]);
        CHECK(std::abs(behind[0] - before[0]) > 0.2f); // the kink of the mean along x
        for (std::size_t i = 0; i < on.size(); ++i) {
            CHECK(on[i] == doctest::Approx(0.5 * double{before[i] + behind[i]}).epsilon(2e-3));
        }
    }
}

TEST_CASE("gradients refuse bad arguments and short scratch")
{
    TestMap map(config_of(params_of(GPOM_KERNEL_SE)));
    fill(map, Built::yes);
    std::vector<std::uint8_t> memory(gpom_gradient_bytes(map.get()));
    const gpom_point_t point = {0.0, 0.0};
    gpom_gradient_t gradient = {};
    const gpom_scratch_t whole = {memory.data(), memory.size()};
    const gpom_scratch_t cut = {memory.data(), memory.size() - 1};
    const gpom_scratch_t none = {nullptr, memory.size()};
    CHECK(gpom_query_gradients(nullptr, &point, 1, &gradient, &whole) == GPOM_ERR_ARG);
    CHECK(gpom_query_gradients(map.get(), nullptr, 1, &gradient, &whole) == GPOM_ERR_ARG);
    CHECK(gpom_query_gradients(map.get(), &point, 1, nullptr, &whole) == GPOM_ERR_ARG);
    CHECK(gpom_query_gradients(map.get(), &point, 1, &gradient, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_query_gradients(map.get(), &point, 1, &gradient, &cut) == GPOM_ERR_MEM);
    CHECK(gpom_query_gradients(map.get(), &point, 1, &gradient, &none) == GPOM_ERR_MEM);
    CHECK(gpom_query_gradients(map.get(), nullptr, 0, nullptr, &whole) == GPOM_OK);
    CHECK(gpom_gradient_bytes(nullptr) == 0);
    CHECK(gpom_gradient_bytes(map.get()) <=
          GPOM_GRADIENT_BYTES(16, static_cast<std::size_t>(gpom_lanes())));
}

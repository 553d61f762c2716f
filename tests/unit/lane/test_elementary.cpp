// The elementary functions against the C library's in double, over their whole ranges.
#include "tests/common/reference.hpp"

#include "src/lane/elementary.hpp"

using namespace reference;

namespace
{

/// Floats from `low` to `high` (both positive or zero), equally spaced among the representable
/// ones, both ends and the kEnd values next to them included.
std::vector<float> float_range(float low, float high, std::uint32_t stride)
{
    std::uint32_t first, last;
    std::memcpy(&first, &low, sizeof first);
    std::memcpy(&last, &high, sizeof last);
    std::vector<float> xs;
    const auto push = [&xs](std::uint32_t bits) {
        float x;
        std::memcpy(&x, &bits, sizeof x);
        xs.push_back(x);
    };
    constexpr std::uint32_t kEnd = 2000;
    for (std::uint32_t i = 0; i < kEnd; ++i) {
        push(first + i);
        push(last - i);
    }
    for (std::uint32_t bits = first; bits < last; bits += std::min(stride, last - bits)) {
        push(bits);
    }
    return xs;
}

std::vector<float> even_range(double low, double high, int n)
{
    std::vector<float> xs;
    for (int i = 0; i <= n; ++i) {
        xs.push_back(static_cast<float>(low + (high - low) * i / n));
    }
    return xs;
}

std::vector<float> with_negatives(std::vector<float> xs)
{
    const std::size_t n = xs.size();
    for (std::size_t i = 0; i < n; ++i) {
        xs.push_back(-xs[i]);
    }
    return xs;
}

const std::vector<float> &unit_interval()
{
    static const std::vector<float> xs = [] {
        std::vector<float> all = float_range(0.0f, 1.0f, 4001);
        const std::vector<float> even = even_range(0.0, 1.0, 100000);
        all.insert(all.end(), even.begin(), even.end());
        return with_negatives(all);
    }();
    return xs;
}

const std::vector<float> &exponents()
{
    static const std::vector<float> xs = [] {
        std::vector<float> all = float_range(0.0f, 87.0f, 4001);
        const std::vector<float> even = even_range(0.0, 87.0, 100000);
        all.insert(all.end(), even.begin(), even.end());
        for (float &x : all) {
            x = -x;
        }
        return all;
    }();
    return xs;
}

const std::vector<float> kOutside = {-1.5f, 1.5f,  -100.0f, 100.0f, -1e30f, 1e30f,
                                     kInf,  -kInf, -0.0f,   0.0f,   1e-45f, -1e-45f};

auto asin_fn = [](auto q) { return gpom::asin_of_complement(q); };
auto exp_fn = [](auto x) { return gpom::exp_nonpositive(x); };
auto exp2_fn = [](auto u) { return gpom::exp2_negated(u); };
auto cdf_fn = [](auto x) { return gpom::normal_cdf(x); };
auto log_fn = [](auto x) { return gpom::log_positive(x); };

/// The bits at widths 4, 8 and 16 are those at width 1.
template <class Fn> void check_widths(const std::vector<float> &xs, Fn f)
{
    const std::vector<float> scalar = on_lanes<1>(xs, f);
    CHECK(same_bits(on_lanes<4>(xs, f), scalar));
    CHECK(same_bits(on_lanes<8>(xs, f), scalar));
    CHECK(same_bits(on_lanes<16>(xs, f), scalar));
}

} // namespace

// The arcsine keeps its stated absolute error over [-1, 1]: q = 1 - x in [0, 2].
TEST_CASE("asin_of_complement is within 2.8e-7 of libm")
{
    double worst = 0.0;
    for (const float x : unit_interval()) {
        const float q = 1.0f - x;
        worst = std::max(worst, std::abs(static_cast<double>(gpom::asin_of_complement(q)) -
                                         std::asin(1.0 - static_cast<double>(q))));
    }
    CHECK(worst <= 2.8e-7);
}

// Where the arcsine is steepest, at 1, the distance from pi/2 keeps float32's absolute precision
// however small q is: the reason for this form.
TEST_CASE("asin_of_complement loses nothing near 1")
{
    for (const float q : {0.0f, 1e-12f, 1e-9f, 1e-7f, 1e-5f}) {
        const double exact =
            std::acos(0.0) - 2.0 * std::asin(std::sqrt(static_cast<double>(q) / 2));
        CHECK(std::abs(static_cast<double>(gpom::asin_of_complement(q)) - exact) <= 2.8e-7);
    }
}

// An argument that rounding takes beyond 2, where eq. 4 ends, counts as one as far below it.
TEST_CASE("asin_of_complement bears an argument rounded beyond 2")
{
    for (const float beyond : {2.5e-7f, 1e-6f, 1e-5f}) {
        const double exact = std::asin(-1.0 + static_cast<double>((2.0f + beyond) - 2.0f));
        CHECK(std::abs(static_cast<double>(gpom::asin_of_complement(2.0f + beyond)) - exact) <=
              2.8e-7);
    }
    CHECK(gpom::asin_of_complement(2.0f) == doctest::Approx(-kPi / 2).epsilon(1e-7));
    CHECK(gpom::asin_of_complement(1.0f) == doctest::Approx(0.0).epsilon(1e-12));
}

// The exponential keeps its stated error in units of the last place from 0 down to -87.
TEST_CASE("exp_nonpositive is within 1.3 units in the last place of libm")
{
    double worst_ulp = 0.0;
    for (const float x : exponents()) {
        const double exact = std::exp(static_cast<double>(x));
        const double ulp = std::ldexp(1.0, std::ilogb(exact) - 23);
        worst_ulp = std::max(worst_ulp,
                             std::abs(static_cast<double>(gpom::exp_nonpositive(x)) - exact) / ulp);
    }
    CHECK(worst_ulp <= 1.3);
}

// Below -87 the exponential is exactly 0, at minus infinity too: far covariances are 0, not NaN.
TEST_CASE("exp_nonpositive is 0 below -87 and 1 at 0")
{
    for (const float x : {step_float(-87.0f, -1), -88.0f, -104.0f, -1e10f, -3.4e38f, -kInf}) {
        CHECK(same_bits(gpom::exp_nonpositive(x), 0.0f));
    }
    CHECK(gpom::exp_nonpositive(0.0f) == 1.0f);
    CHECK(gpom::exp_nonpositive(-0.0f) == 1.0f);
    CHECK(gpom::exp_nonpositive(-87.0f) > 0.0f);
}

// 2^-u keeps its stated error in units of the last place from 0 to 125.
TEST_CASE("exp2_negated is within 2.2 units in the last place of libm")
{
    double worst_ulp = 0.0;
    for (const float u : even_range(0.0, 125.0, 1000000)) {
        const double exact = std::exp2(-static_cast<double>(u));
        const double ulp = std::ldexp(1.0, std::ilogb(exact) - 23);
        worst_ulp =
            std::max(worst_ulp, std::abs(static_cast<double>(gpom::exp2_negated(u)) - exact) / ulp);
    }
    CHECK(worst_ulp <= 2.2);
}

// From 127 on the power is exactly 0, at infinity too; on the way there it stays small.
TEST_CASE("exp2_negated is 0 from 127 on and 1 at 0")
{
    for (const float u : {127.0f, 128.0f, 1e10f, 3.4e38f, kInf}) {
        CHECK(same_bits(gpom::exp2_negated(u), 0.0f));
    }
    for (const float u : even_range(125.0, 127.0, 1001)) {
        const float power = gpom::exp2_negated(u);
        CHECK(std::abs(static_cast<double>(power) - std::exp2(-static_cast<double>(u))) <=
              0x1p-126);
    }
    CHECK(gpom::exp2_negated(0.0f) == 1.0f);
    CHECK(gpom::exp2_negated(-0.0f) == 1.0f);
}

// Phi keeps its stated absolute error, infinities included, and never leaves [0, 1].
TEST_CASE("normal_cdf is within 2.4e-7 of libm")
{
    std::vector<float> zs = even_range(-15.0, 15.0, 300000);
    const std::vector<float> tiny = with_negatives(float_range(0.0f, 1.0f, 40009));
    zs.insert(zs.end(), tiny.begin(), tiny.end());
    zs.insert(zs.end(), kOutside.begin(), kOutside.end());
    double worst = 0.0;
    bool in_range = true;
    for (const float z : zs) {
        const float p = gpom::normal_cdf(z);
        worst =
            std::max(worst, std::abs(static_cast<double>(p) - normal_cdf(static_cast<double>(z))));
        in_range = in_range && p >= 0.0f && p <= 1.0f;
    }
    CHECK(worst <= 2.4e-7);
    CHECK(in_range);
    CHECK(gpom::normal_cdf(-kInf) == 0.0f);
    CHECK(gpom::normal_cdf(kInf) == 1.0f);
}

// The lower tail keeps its relative error, so that small probabilities can be compared.
TEST_CASE("normal_cdf's lower tail is within 7e-6, relatively, down to -13")
{
    double worst = 0.0;
    for (const float z : even_range(-13.0, -0.0, 200000)) {
        const double exact = normal_cdf(static_cast<double>(z));
        worst = std::max(worst, std::abs(static_cast<double>(gpom::normal_cdf(z)) / exact - 1.0));
    }
    CHECK(worst <= 7e-6);
}

// The logarithm keeps its stated error over the distances that context sees, 1 cm to 100 m.
TEST_CASE("log_positive is within 4e-7 of libm")
{
    double worst = 0.0;
    for (const float log_x : even_range(-4.6, 4.6, 400000)) {
        const float x = std::exp(log_x);
        worst = std::max(worst, std::abs(static_cast<double>(gpom::log_positive(x)) -
                                         std::log(static_cast<double>(x))));
    }
    CHECK(worst <= 4e-7);
    CHECK(gpom::log_positive(1.0f) == 0.0f);
}

// A NaN that reaches an elementary function must come out as one: a clamp that quietly turns it
// into "fully correlated" or "surely occupied" would hide the fault.
TEST_CASE("a NaN does not become a number")
{
    CHECK(std::isnan(gpom::asin_of_complement(kNan)));
    CHECK(std::isnan(gpom::exp_nonpositive(kNan)));
    CHECK(std::isnan(gpom::exp2_negated(kNan)));
    CHECK(std::isnan(gpom::normal_cdf(kNan)));
    const std::vector<float> nans(5, kNan);
    const std::vector<float> ps = on_lanes<4>(nans, cdf_fn);
    CHECK(std::all_of(ps.begin(), ps.end(), [](float p) { return std::isnan(p); }));
}

// A query's answer may not depend on the width of the build.
TEST_CASE("elementary functions give the same bits at every lane width")
{
    std::vector<float> xs = even_range(-1.1, 1.1, 5003);
    xs.insert(xs.end(), kOutside.begin(), kOutside.end());
    check_widths(even_range(-0.1, 2.1, 5003), asin_fn);
    check_widths(xs, cdf_fn);
    std::vector<float> negative = even_range(-130.0, 0.0, 5003);
    negative.push_back(-kInf);
    check_widths(negative, exp_fn);
    check_widths(negative, exp2_fn);
    check_widths(even_range(-15.0, 15.0, 5003), cdf_fn);
    check_widths(even_range(0.01, 40.0, 5003), log_fn);
}

// Directions keep their stated error for any yaw a pose may have, and are unit vectors.
TEST_CASE("direction_of is within 1e-7 of libm up to 1e6 rad")
{
    GPOM_TELL_SEED();
    Random random(1);
    double worst = 0.0;
    const auto look = [&worst](double angle_rad) {
        const gpom::Direction d = gpom::direction_of(angle_rad);
        worst = std::max({worst, std::abs(static_cast<double>(d.x) - std::cos(angle_rad)),
                          std::abs(static_cast<double>(d.y) - std::sin(angle_rad))});
    };
    for (int i = -200000; i <= 200000; ++i) {
        look(i * 4e-5);
    }
    for (int i = 0; i < 200000; ++i) {
        look(random.uniform(-1e6, 1e6));
        look(random.uniform(-10.0, 10.0) * 1e-5);
    }
    for (int quarter = -640000; quarter <= 640000; quarter += 97) { // where the branches meet
        look((quarter + 0.5) * kPi / 2);
        look(quarter * kPi / 2);
    }
    look(1e6);
    look(-1e6);
    CHECK(worst <= 1e-7);
}

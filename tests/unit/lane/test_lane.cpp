// Lanes: each does what a plain float would, whatever stands beside it.
#include "tests/common/reference.hpp"

#include "src/lane/four.hpp"

namespace lane = gpom::lane;
using namespace reference;

namespace
{

const std::vector<float> kValues = {0.0f,   -0.0f,  1.0f,    -1.0f,  1.5f,       -2.25f,
                                    1e-30f, -1e30f, 3.4e38f, 1e-45f, kInf,       -kInf,
                                    kNan,   0.333f, 7.0f,    -7.0f,  16777216.0f};

/// f(a, b) over all pairs of kValues, computed W at a time.
template <int W, class Fn> std::vector<float> on_pairs(Fn f)
{
    using F = Lanes<W>;
    std::vector<float> out;
    for (const float b : kValues) {
        const std::vector<float> row =
            on_lanes<W>(kValues, [&](F a) { return f(a, lane::splat<F>(b)); });
        out.insert(out.end(), row.begin(), row.end());
    }
    return out;
}

/// NaN payloads are no part of the promise.
bool same_numbers(const std::vector<float> &a, const std::vector<float> &b)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](float x, float y) {
        return same_bits(x, y) || (std::isnan(x) && std::isnan(y));
    });
}

template <class Fn> void check_pairs(Fn f)
{
    const std::vector<float> scalar = on_pairs<1>(f);
    CHECK(same_numbers(on_pairs<4>(f), scalar));
    CHECK(same_numbers(on_pairs<8>(f), scalar));
    CHECK(same_numbers(on_pairs<16>(f), scalar));
}

/// With GPOM_MINNUM a plain float's min and max know neither the sign of zero nor a NaN beside a
/// number: f(a, b) for b that are numbers, and without the sign of zero.
template <class Fn> void check_pairs_of_numbers(Fn f)
{
    check_pairs([f](auto a, auto b) { return f(a, lane::select(b == b, b, a)) + 0.0f; });
}

/// Move values 1 to 4 of six from one array to another; the first and last stay what they were.
template <int block, int W> void check_four(std::size_t first)
{
    using F = Lanes<W>;
    F from[6], to[6];
    for (std::size_t i = 0; i < 6; ++i) {
        from[i] = lane::splat<F>(kValues[(first + i) % kValues.size()]);
        to[i] = lane::splat<F>(-123.0f);
    }
    F four[4];
    lane::load_four<block>(from + 1, four);
    lane::store_four<block>(four, to + 1);
    for (std::size_t i = 0; i < 6; ++i) {
        const F expected = i == 0 || i == 5 ? lane::splat<F>(-123.0f) : from[i];
        CHECK(std::memcmp(&to[i], &expected, sizeof expected) == 0);
    }
}

template <int W> void check_fours()
{
    for (std::size_t first = 0; first < kValues.size(); ++first) {
        check_four<0, W>(first);
        check_four<1, W>(first);
        check_four<2, W>(first);
        check_four<3, W>(first);
        check_four<4, W>(first);
        check_four<5, W>(first);
    }
}

template <int W> void check_any()
{
    using F = Lanes<W>;
    const F zero = lane::splat<F>(0.0f);
    CHECK_FALSE(lane::any(zero > 0.0f));
    CHECK(lane::any(zero == 0.0f));
    for (int i = 0; i < W; ++i) {
        F x = zero;
        lane::set(x, i, 1.0f);
        CHECK(lane::any(x > 0.0f));
        CHECK(lane::any(x == zero) == (W > 1));
        CHECK(lane::get(x, i) == 1.0f);
    }
}

template <int W> void check_integers()
{
    using I = typename lane::Lane<W>::I;
    I x = lane::splat_int<I>(-7);
    lane::set(x, W - 1, INT32_MAX);
    CHECK(lane::get(x, W - 1) == INT32_MAX);
    CHECK(lane::get(x, 0) == (W == 1 ? INT32_MAX : -7));
    CHECK(lane::width<Lanes<W>> == W);
    CHECK(sizeof(I) == sizeof(Lanes<W>));
}

} // namespace

// Every operation gives in a lane of any width the bits that it gives for a plain float.
TEST_CASE("lane operations are those of a plain float at every width")
{
    check_pairs_of_numbers([](auto a, auto b) { return lane::min(a, b); });
    check_pairs_of_numbers([](auto a, auto b) { return lane::max(a, b); });
    check_pairs([](auto a, auto b) { return lane::select(a <= b, a, b); });
    check_pairs([](auto a, auto b) { return lane::with_sign(lane::abs(a), b); });
    check_pairs([](auto a, auto b) { return lane::fma(a, b, a); });
    check_pairs([](auto a, auto) { return lane::sqrt(lane::abs(a)); });
}

// min and max take the smaller and the greater; of equal or unordered arguments, the second, but
// with GPOM_MINNUM the one that is a number.
TEST_CASE("min and max of a NaN and a number")
{
    CHECK(lane::min(1.0f, 2.0f) == 1.0f);
    CHECK(lane::min(2.0f, 1.0f) == 1.0f);
    CHECK(lane::max(1.0f, 2.0f) == 2.0f);
    CHECK(lane::max(-kInf, -1.0f) == -1.0f);
    CHECK(lane::min(kNan, 1.0f) == 1.0f);
    CHECK(lane::max(kNan, 1.0f) == 1.0f);
    CHECK(std::isnan(lane::min(1.0f, kNan)) == (GPOM_MINNUM == 0));
    CHECK(std::isnan(lane::max(1.0f, kNan)) == (GPOM_MINNUM == 0));
    CHECK(same_bits(lane::min(0.0f, -0.0f), -0.0f));
    CHECK(same_bits(lane::max(-0.0f, 0.0f), 0.0f));
}

// abs clears the sign of everything, with_sign puts it back.
TEST_CASE("abs and with_sign touch the sign bit alone")
{
    for (const float x : kValues) {
        CHECK_FALSE(std::signbit(lane::abs(x)));
        if (!std::isnan(x)) {
            CHECK(same_bits(lane::abs(x), std::fabs(x)));
            CHECK(same_bits(lane::with_sign(lane::abs(x), x), x));
        }
    }
}

// The square root is correctly rounded, as IEEE 754 has it.
TEST_CASE("sqrt rounds correctly")
{
    Random random(2);
    GPOM_TELL_SEED();
    bool is_exact = true;
    for (int i = 0; i < 20000; ++i) {
        const float x = random.uniform_f(0.0, 1.0) *
                        std::ldexp(1.0f, static_cast<int>(random.below(200)) - 100);
        const float root = static_cast<float>(std::sqrt(static_cast<double>(x)));
        is_exact = is_exact && same_bits(lane::sqrt(x), root);
    }
    CHECK(is_exact);
    CHECK(std::isnan(lane::sqrt(-1.0f)));
}

// The exponent's step multiplies by a power of two, reading n from the low bits only.
TEST_CASE("scale_exponent multiplies by 2^n")
{
    for (int n = -125; n <= 126; ++n) {
        CHECK(lane::scale_exponent(1.25f, n) == std::ldexp(1.25f, n));
        CHECK(lane::scale_exponent(1.25f, n + 0x4b400000) == std::ldexp(1.25f, n));
    }
}

// fma is one rounding where the build says so and two where it does not; nothing in between.
TEST_CASE("fma fuses exactly if GPOM_FMA is set")
{
    const float a = 1.0f + 0x1p-12f;
    const float c = -(1.0f + 0x1p-11f);
    const float fused = lane::fma(a, a, c); // exact: 2^-24, lost if the product is rounded
    CHECK(fused == (GPOM_FMA == 0 ? 0.0f : 0x1p-24f));
}

// any() sees every lane, and get and set address just one.
TEST_CASE("any, get and set reach every lane")
{
    check_any<1>();
    check_any<4>();
    check_any<8>();
    check_any<16>();
    check_integers<1>();
    check_integers<4>();
    check_integers<8>();
    check_integers<16>();
}

// Four values come as they are from memory and go there as they are, through each block of
// registers, and nothing beside them changes.
TEST_CASE("load_four and store_four move four values bit by bit")
{
    check_fours<1>();
    check_fours<4>();
    check_fours<16>();
}

// Selection against std::sort, on the inputs that quicksorts are afraid of.
#include "tests/unit/reference.hpp"

#include "src/select.hpp"

#include <functional>
#include <numeric>

using namespace reference;

namespace
{

using Values = std::vector<float>;

Values sorted_values(std::uint32_t n)
{
    Values v(n);
    std::iota(v.begin(), v.end(), 0.0f);
    return v;
}

Values reversed_values(std::uint32_t n)
{
    Values v = sorted_values(n);
    std::reverse(v.begin(), v.end());
    return v;
}

Values organ_pipe(std::uint32_t n)
{
    Values v(n);
    for (std::uint32_t i = 0; i < n; ++i) {
        v[i] = static_cast<float>(std::min(i, n - i));
    }
    return v;
}

Values all_equal(std::uint32_t n) { return Values(n, 3.5f); }

Values few_values(std::uint32_t n)
{
    Random random(3);
    Values v(n);
    for (float &x : v) {
        x = static_cast<float>(random.below(3));
    }
    return v;
}

Values random_values(std::uint32_t n)
{
    Random random(4);
    Values v(n);
    for (float &x : v) {
        x = random.uniform_f(-1e3, 1e3);
    }
    return v;
}

/// Musser's (1997) permutation against the median of the first, middle and last of an even number:
/// 1, k + 1, 3, k + 3, ..., then 2, 4, 6, ...
Values musser_killer(std::uint32_t n)
{
    Values v(n);
    const std::uint32_t k = n / 2;
    for (std::uint32_t i = 0; i < k; ++i) {
        v[i] = static_cast<float>(i % 2 == 0 ? i + 1 : k + i + i % 2);
        v[k + i] = static_cast<float>(2 * (i + 1));
    }
    return v;
}

const std::vector<std::function<Values(std::uint32_t)>> kInputs = {
    sorted_values, reversed_values, organ_pipe,   all_equal,
    few_values,    random_values,   musser_killer};

std::vector<std::uint32_t> identity(std::uint32_t n)
{
    std::vector<std::uint32_t> order(n);
    std::iota(order.begin(), order.end(), 0u);
    return order;
}

/// Is order[nth] what sorting puts there, with nothing greater before and nothing less behind?
bool is_selected(const std::vector<std::uint32_t> &order, const Values &values, std::uint32_t nth)
{
    const auto less = [&values](std::uint32_t a, std::uint32_t b) {
        return values[a] != values[b] ? values[a] < values[b] : a < b;
    };
    std::vector<std::uint32_t> sorted = order;
    std::sort(sorted.begin(), sorted.end(), less);
    const auto at = order.begin() + nth;
    return order[nth] == sorted[nth] &&
           std::all_of(order.begin(), at, [&](std::uint32_t i) { return less(i, order[nth]); }) &&
           std::all_of(at + 1, order.end(), [&](std::uint32_t i) { return less(order[nth], i); });
}

bool is_permutation_of_identity(std::vector<std::uint32_t> order)
{
    std::sort(order.begin(), order.end());
    return order == identity(static_cast<std::uint32_t>(order.size()));
}

/// McIlroy's (1999) adversary: keys are decided while they are compared, as late as possible, so
/// that every pivot turns out to be almost the least. Ids are the entries themselves.
class Adversary {
public:
    explicit Adversary(std::uint32_t n) : values_(n, kGas) {}

    gpom::SortKey operator()(std::uint32_t i) const
    {
        ++n_calls;
        if (values_[i] == kGas && last_ != i && values_[last_] == kGas) {
            values_[candidate_is_last_ ? last_ : i] = next_;
            next_ += 1.0f;
        }
        candidate_is_last_ = values_[i] == kGas;
        last_ = i;
        return {values_[i], i};
    }

    mutable std::uint64_t n_calls = 0;

private:
    static constexpr float kGas = 1e30f;
    mutable Values values_;
    mutable float next_ = 0.0f;
    mutable std::uint32_t last_ = 0;
    mutable bool candidate_is_last_ = false;
};

/// Calls of key() that selecting the middle of `values` costs.
std::uint64_t cost_of(const Values &values)
{
    std::uint64_t n_calls = 0;
    const auto n = static_cast<std::uint32_t>(values.size());
    std::vector<std::uint32_t> order = identity(n);
    gpom::select_nth(order.data(), n, n / 2, [&](std::uint32_t i) {
        ++n_calls;
        return gpom::SortKey{values[i], i};
    });
    CHECK(is_selected(order, values, n / 2));
    return n_calls;
}

} // namespace

// For every size up to 200 and many places: a permutation comes out, with the nth entry where
// sorting puts it and the others on their side of it.
TEST_CASE("select_nth puts the nth smallest at its place")
{
    GPOM_TELL_SEED();
    for (const auto &input : kInputs) {
        for (std::uint32_t n = 1; n <= 200; ++n) {
            const Values values = input(n);
            for (std::uint32_t nth = 0; nth < n; nth += 1 + n / 9) {
                std::vector<std::uint32_t> order = identity(n);
                gpom::select_nth(order.data(), n, nth, [&](std::uint32_t i) {
                    return gpom::SortKey{values[i], i};
                });
                REQUIRE(is_permutation_of_identity(order));
                REQUIRE(is_selected(order, values, nth));
            }
        }
    }
}

// Whatever the input, the cost stays within the bound for the rounds that are allowed plus the heap
// sort behind them; on usual inputs it is a small multiple of n.
TEST_CASE("select_nth's cost is bounded on inputs made against it")
{
    GPOM_TELL_SEED();
    constexpr std::uint32_t kN = 20000;
    const double heap = 4.0 * kN * std::log2(kN); // two keys a comparison, two comparisons a level
    for (const auto &input : kInputs) {
        CHECK(static_cast<double>(cost_of(input(kN))) <= 64.0 * kN + 2.0 * heap);
    }
    CHECK(cost_of(random_values(kN)) <= 8 * kN);
    CHECK(cost_of(sorted_values(kN)) <= 8 * kN);
}

// An opponent that fixes the keys during the comparisons cannot make it quadratic.
TEST_CASE("select_nth stays far from quadratic against an adversary")
{
    constexpr std::uint32_t kN = 4000;
    const Adversary adversary(kN);
    std::vector<std::uint32_t> order = identity(kN);
    gpom::select_nth(order.data(), kN, kN - 1,
                     [&adversary](std::uint32_t i) { return adversary(i); });
    const double heap = 4.0 * kN * std::log2(kN);
    CHECK(static_cast<double>(adversary.n_calls) <= 64.0 * kN + 2.0 * heap);
    CHECK(adversary.n_calls >= kN);
    CHECK(is_permutation_of_identity(order));
}

// The heap sort sorts, for any size.
TEST_CASE("heap_sort sorts")
{
    for (const auto &input : kInputs) {
        for (std::uint32_t n = 0; n <= 70; ++n) {
            const Values values = input(n);
            std::vector<std::uint32_t> order = identity(n);
            gpom::heap_sort(order.data(), n, [&](std::uint32_t i) {
                return gpom::SortKey{values[i], i};
            });
            REQUIRE(is_permutation_of_identity(order));
            for (std::uint32_t i = 1; i < n; ++i) {
                const bool in_order =
                    values[order[i - 1]] < values[order[i]] ||
                    (values[order[i - 1]] == values[order[i]] && order[i - 1] < order[i]);
                REQUIRE(in_order);
            }
        }
    }
}

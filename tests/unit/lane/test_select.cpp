// Selection in slices against std::sort, on the inputs that quicksorts are afraid of.
#include "tests/common/reference.hpp"

#include "src/lane/select.hpp"

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

/// What a selection, in slices of random size up to slice_max, came to.
struct Outcome {
    std::uint64_t n_comparisons = 0;
    std::uint32_t n_splits = 0;
};

template <class KeyOf>
Outcome select_in_slices(std::vector<std::uint32_t> &order, std::uint32_t nth, const KeyOf &key,
                         std::uint32_t slice_max)
{
    Random random(5);
    Outcome outcome;
    auto s = gpom::selection_of(0, static_cast<std::uint32_t>(order.size()), nth);
    while (!gpom::is_done(s)) {
        const std::uint32_t budget = 1 + random.below(slice_max);
        const std::uint32_t used = gpom::select_some(s, order.data(), key, budget);
        REQUIRE(used >= 1); // or it would never end
        REQUIRE(used <= budget);
        outcome.n_comparisons += used;
    }
    outcome.n_splits = s.round;
    return outcome;
}

/// Select the middle of `values` at once.
Outcome outcome_of(const Values &values)
{
    const auto n = static_cast<std::uint32_t>(values.size());
    std::vector<std::uint32_t> order = identity(n);
    const auto key = [&](std::uint32_t i) { return gpom::SortKey{values[i], i}; };
    const Outcome outcome = select_in_slices(order, n / 2, key, UINT32_MAX - 1);
    CHECK(is_permutation_of_identity(order));
    CHECK((outcome.n_splits == gpom::kSplitsMax || is_selected(order, values, n / 2)));
    return outcome;
}

} // namespace

// For every size up to 200, many places and any slices: a permutation comes out, with the nth entry
// where sorting puts it and the others on their side of it, unless the splits were used up.
TEST_CASE("selection in slices puts the nth smallest at its place")
{
    GPOM_TELL_SEED();
    int n_given_up = 0, n_selected = 0;
    for (const auto &input : kInputs) {
        for (std::uint32_t n = 1; n <= 200; ++n) {
            const Values values = input(n);
            const auto key = [&](std::uint32_t i) { return gpom::SortKey{values[i], i}; };
            for (std::uint32_t nth = 0; nth < n; nth += 1 + n / 9) {
                const std::uint32_t slice_max = nth % 3 == 0 ? 1 : nth % 3 == 1 ? 17 : 1000;
                std::vector<std::uint32_t> order = identity(n);
                const Outcome outcome = select_in_slices(order, nth, key, slice_max);
                REQUIRE(is_permutation_of_identity(order));
                const bool is_given_up = outcome.n_splits == gpom::kSplitsMax;
                REQUIRE((is_given_up || is_selected(order, values, nth)));
                ++(is_given_up ? n_given_up : n_selected);
            }
        }
    }
    CHECK(n_given_up * 20 < n_selected); // adversarial orders alone get there
}

// Selecting inside a stretch moves nothing outside it.
TEST_CASE("selection stays in its stretch")
{
    GPOM_TELL_SEED();
    const Values values = random_values(100);
    std::vector<std::uint32_t> order = identity(100);
    auto s = gpom::selection_of(30, 40, 11);
    gpom::select_some(
        s, order.data(),
        [&](std::uint32_t i) {
            return gpom::SortKey{values[i], i};
        },
        UINT32_MAX);
    REQUIRE(gpom::is_done(s));
    for (std::uint32_t i = 0; i < 100; ++i) {
        CHECK((i >= 30 && i < 70) == (order[i] >= 30 && order[i] < 70));
        CHECK((i >= 30 && i < 70) >= (order[i] != i));
    }
    std::vector<std::uint32_t> inside(order.begin() + 30, order.begin() + 70);
    for (std::uint32_t &i : inside) {
        i -= 30;
    }
    CHECK(is_selected(inside, Values(values.begin() + 30, values.begin() + 70), 11));
}

// The same slices or others: the same comparisons are made and the same order comes out.
TEST_CASE("slices do not change what selection does")
{
    GPOM_TELL_SEED();
    for (const auto &input : kInputs) {
        const Values values = input(500);
        const auto key = [&](std::uint32_t i) { return gpom::SortKey{values[i], i}; };
        std::vector<std::uint32_t> at_once = identity(500);
        const Outcome expected = select_in_slices(at_once, 123, key, UINT32_MAX - 1);
        for (const std::uint32_t slice_max : {1u, 2u, 50u, 600u}) {
            std::vector<std::uint32_t> order = identity(500);
            const Outcome outcome = select_in_slices(order, 123, key, slice_max);
            CHECK(order == at_once);
            CHECK(outcome.n_comparisons == expected.n_comparisons);
        }
    }
}

// Keys that change at random between slices, as those of slots that get another beam, harm neither
// the permutation nor the bound of the work.
TEST_CASE("keys that change between slices leave a permutation")
{
    GPOM_TELL_SEED();
    constexpr std::uint32_t kN = 300;
    Random random(6);
    for (int round = 0; round < 200; ++round) {
        Values values = random_values(kN);
        std::vector<std::uint32_t> order = identity(kN);
        auto s = gpom::selection_of(0, kN, random.below(kN));
        std::uint64_t n_comparisons = 0;
        while (!gpom::is_done(s)) {
            const auto key = [&](std::uint32_t i) { return gpom::SortKey{values[i], i}; };
            n_comparisons += gpom::select_some(s, order.data(), key, 1 + random.below(60));
            for (int i = 0; i < 100; ++i) {
                values[random.below(kN)] = random.uniform_f(-1e3, 1e3);
            }
            REQUIRE(is_permutation_of_identity(order));
        }
        CHECK(n_comparisons <= std::uint64_t{gpom::kSplitsMax} * kN);
    }
}

// Whatever the input, the work is bounded by the splits that are allowed; on usual inputs it is a
// small multiple of n and the splits suffice by far.
TEST_CASE("selection's cost is bounded on inputs made against it")
{
    GPOM_TELL_SEED();
    constexpr std::uint32_t kN = 20000;
    for (const auto &input : kInputs) {
        CHECK(outcome_of(input(kN)).n_comparisons <= gpom::kSplitsMax * kN);
    }
    for (const Values &usual : {random_values(kN), sorted_values(kN), reversed_values(kN)}) {
        const Outcome outcome = outcome_of(usual);
        CHECK(outcome.n_comparisons <= 6 * kN);
        CHECK(outcome.n_splits < gpom::kSplitsMax);
    }
}

// An opponent that fixes the keys during the comparisons cannot make it quadratic; it uses all
// splits up.
TEST_CASE("selection stays far from quadratic against an adversary")
{
    constexpr std::uint32_t kN = 4000;
    const Adversary adversary(kN);
    std::vector<std::uint32_t> order = identity(kN);
    const auto key = [&adversary](std::uint32_t i) { return adversary(i); };
    const Outcome outcome = select_in_slices(order, kN - 1, key, UINT32_MAX - 1);
    CHECK(outcome.n_splits == gpom::kSplitsMax);
    CHECK(outcome.n_comparisons <= gpom::kSplitsMax * kN);
    CHECK(adversary.n_calls <= outcome.n_comparisons + 8 * gpom::kSplitsMax);
    CHECK(is_permutation_of_identity(order));
}

/// \file select.hpp
/// Selection in slices: put the nth smallest key at its place. Each slice makes a bounded number of
/// comparisons. Nothing is allocated.
#pragma once

#include <stdint.h>

namespace gpom
{

/// A sort key. If two values are equal, the id of the beam decides, so that the order is strict and
/// total.
struct SortKey {
    float value;
    uint32_t id;
};

inline bool operator<(const SortKey &a, const SortKey &b)
{
    return a.value < b.value || (a.value == b.value && a.id < b.id);
}

inline void swap(uint32_t &a, uint32_t &b)
{
    const uint32_t kept = a;
    a = b;
    b = kept;
}

/// Compare the keys of the first, middle and last entry. Returns the index of the entry whose key
/// is between the other two.
template <class KeyOf> uint32_t median_of_three(const uint32_t *order, uint32_t n, const KeyOf &key)
{
    uint32_t low = 0;
    uint32_t middle = n / 2;
    const uint32_t last = n - 1;
    if (key(order[middle]) < key(order[low])) {
        swap(low, middle);
    }
    if (key(order[middle]) < key(order[last])) {
        return middle;
    }
    return key(order[low]) < key(order[last]) ? last : low;
}

/// A selection in progress (Hoare's quickselect). It looks for the nth entry of
/// order[first .. first + n). Entries outside this stretch are already on their side of it.
/// Cost: 3 n comparisons on average.
struct Selection {
    uint32_t first, n, nth;
    uint32_t round;     ///< Splits done.
    uint32_t i, n_less; ///< Split in progress: entries compared, and entries below the pivot.
    SortKey pivot;
};

/// A selection ends after this many splits, even if the nth entry is not exact yet. The split of a
/// tree is then not at the median, but searches stay exact. Only adversarial orders need so many
/// splits.
constexpr uint32_t kSplitsMax = 32;

inline Selection selection_of(uint32_t first, uint32_t n, uint32_t nth)
{
    return {first, n, nth, 0, 0, 0, {}};
}

inline bool is_done(const Selection &s) { return s.n <= 1 || s.round == kSplitsMax; }

/// Keep only the part of the stretch, before or after the pivot, that holds the nth entry.
inline void narrow(Selection &s)
{
    if (s.nth == s.n_less) {
        s.n = 0;
    } else if (s.nth < s.n_less) {
        s.n = s.n_less;
    } else {
        s.first += s.n_less + 1;
        s.n -= s.n_less + 1;
        s.nth -= s.n_less + 1;
    }
    ++s.round;
    s.i = 0;
    s.n_less = 0;
}

/// Continue a selection for at most `budget` comparisons. Returns the number of comparisons made.
/// If keys change between slices, `order` stays a permutation and the work stays bounded.
template <class KeyOf>
uint32_t select_some(Selection &s, uint32_t *order, const KeyOf &key, uint32_t budget)
{
    uint32_t used = 0;
    while (!is_done(s) && used < budget) {
        uint32_t *const open = order + s.first;
        if (s.i == 0) {
            swap(open[median_of_three(open, s.n, key)], open[s.n - 1]);
            s.pivot = key(open[s.n - 1]);
        }
        for (; s.i + 1 < s.n && used < budget; ++s.i, ++used) {
            if (key(open[s.i]) < s.pivot) {
                swap(open[s.i], open[s.n_less++]);
            }
        }
        if (s.i + 1 == s.n) {
            swap(open[s.n_less], open[s.n - 1]);
            narrow(s);
        }
    }
    return used;
}

} // namespace gpom

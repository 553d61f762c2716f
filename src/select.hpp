/// \file select.hpp
/// Selection: put the nth smallest key at its place, in bounded time and without a heap.
#pragma once

#include <stdint.h>

namespace gpom
{

/// A sort key with the beam's id as the tie-breaker: a strict total order.
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

/// Move order[root] down a max-heap of n entries.
template <class KeyOf> void sift_down(uint32_t *order, uint32_t root, uint32_t n, const KeyOf &key)
{
    for (uint32_t child = 2 * root + 1; child < n; child = 2 * root + 1) {
        if (child + 1 < n && key(order[child]) < key(order[child + 1])) {
            ++child;
        }
        if (!(key(order[root]) < key(order[child]))) {
            return;
        }
        swap(order[root], order[child]);
        root = child;
    }
}

template <class KeyOf> void heap_sort(uint32_t *order, uint32_t n, const KeyOf &key)
{
    for (uint32_t root = n / 2; root-- > 0;) {
        sift_down(order, root, n, key);
    }
    for (uint32_t end = n; end-- > 1;) {
        swap(order[0], order[end]);
        sift_down(order, 0, end, key);
    }
}

/// Index, among the first, middle and last entry, of the one with the middle key.
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

/// Split order[0 .. n) about the median of three of its keys. Returns that key's place: all before
/// it are less, all behind it greater (ids make keys distinct).
template <class KeyOf> uint32_t partition(uint32_t *order, uint32_t n, const KeyOf &key)
{
    swap(order[median_of_three(order, n, key)], order[n - 1]);
    const SortKey pivot = key(order[n - 1]);
    uint32_t n_less = 0;
    for (uint32_t i = 0; i + 1 < n; ++i) {
        if (key(order[i]) < pivot) {
            swap(order[i], order[n_less++]);
        }
    }
    swap(order[n_less], order[n - 1]);
    return n_less;
}

/// Permute order[0 .. n) so that order[nth] is what sorting would put there, with nothing greater
/// before it and nothing less behind: Hoare's quickselect, 3 n comparisons on average. Should the
/// splits be so uneven that kRoundsMax do not suffice, heap sort finishes what is left, so that the
/// worst case is O(n log n) (Musser's introspective selection, 1997).
template <class KeyOf> void select_nth(uint32_t *order, uint32_t n, uint32_t nth, const KeyOf &key)
{
    constexpr int kRoundsMax = 64;
    for (int round = 0; round < kRoundsMax; ++round) {
        const uint32_t split = partition(order, n, key);
        if (split == nth) {
            return;
        }
        if (nth < split) {
            n = split;
        } else {
            order += split + 1;
            n -= split + 1;
            nth -= split + 1;
        }
    }
    heap_sort(order, n, key);
}

} // namespace gpom

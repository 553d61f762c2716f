/// \file nn_block.hpp
/// The neural-network covariances of four points for one lane, as on a microcontroller.
///
/// One pair at a time, half of the instructions would load points and test for obtuse pairs. With
/// four points together, each other point is loaded once, and one test serves four pairs.
#pragma once

#include "src/gp/chol.hpp"
#include "src/gp/kernel.hpp"

namespace gpom
{

/// asin_of_complement() of four separations, with the same results. Only if one of the pairs is
/// obtuse, the steps for obtuse pairs are done. `spare` has room for four numbers.
[[gnu::always_inline]] inline void asin_of_four(float (&q)[4], float *spare)
{
    const bool has_obtuse = lane::max(lane::max(q[0], q[1]), lane::max(q[2], q[3])) > 1.0f;
    if (__builtin_expect(has_obtuse, 0)) {
#pragma GCC unroll 4
        for (int r = 0; r < 4; ++r) {
            spare[r] = 1.0f - q[r];
            q[r] = lane::min(lane::abs(2.0f - q[r]), q[r]);
        }
    }
#pragma GCC unroll 4
    for (int r = 0; r < 4; ++r) {
        q[r] = acute_asin_of_complement(q[r]);
    }
    if (__builtin_expect(has_obtuse, 0)) {
#pragma GCC unroll 4
        for (int r = 0; r < 4; ++r) {
            q[r] = spare[r] < 0.0f ? -q[r] : q[r];
        }
    }
}

/// Block row i of K / sf2: k(x, x') of four points with the query, in v[4 i + r], and with all
/// points up to the four themselves, in panel[4 p + r]. Elements above the diagonal are computed
/// too, because a tile in four steps is as quick as ten pairs one by one.
///
/// all  the features of all points.
[[gnu::noinline]] inline void nn_block_row(const Feature<float> *all, const Feature<float> &query,
                                           size_t i, float *v, float *panel)
{
    const Feature<float> *const own = all + kTile * i;
    const Feature<float> own_0 = own[0];
    const Feature<float> own_1 = own[1];
    const Feature<float> own_2 = own[2];
    const Feature<float> own_3 = own[3];
    const Feature<float> *at = &query;
    float *place = v + kTile * i;
    for (size_t p = 0; p <= kTile * (i + 1); ++p) {
        float abcd[4];
        lane::load_four<4>(&at->a, abcd);
        const Feature<float> other = {abcd[0], abcd[1], abcd[2], abcd[3]};
        float q[] = {
            separation<GPOM_KERNEL_NN>(own_0, other), separation<GPOM_KERNEL_NN>(own_1, other),
            separation<GPOM_KERNEL_NN>(own_2, other), separation<GPOM_KERNEL_NN>(own_3, other)};
        asin_of_four(q, place);
        lane::store_four<5>(q, place);
        at = all + p; // the query comes first, then column p
        place = panel + kTile * p;
    }
}

} // namespace gpom

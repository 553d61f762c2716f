/// \file visits.hpp
/// Counts of what searches visit. Only bench/count_visits.cpp and the library that it is linked
/// with count; in every other build the functions are empty.
#pragma once

#include "src/beams/beam.hpp"

#ifdef GPOM_COUNT_VISITS
/// What searches of one kind of part did since the counts were set to 0.
struct gpom_visits {
    uint64_t boxes;  ///< Boxes that were compared with the queries of a packet.
    uint64_t items;  ///< Parts of beams whose distances to the queries were computed.
    uint64_t offers; ///< Parts that were near enough to be offered to the lists of nearest.
};
inline gpom_visits gpom_hit_visits, gpom_free_visits;
#endif

namespace gpom
{

#ifdef GPOM_COUNT_VISITS
inline gpom_visits &visits_of(const HitPart &) { return gpom_hit_visits; }
inline gpom_visits &visits_of(const FreePart &) { return gpom_free_visits; }
#endif

template <class Part> inline void note_boxes(const Part &part, uint32_t n)
{
#ifdef GPOM_COUNT_VISITS
    visits_of(part).boxes += n;
#else
    (void)part;
    (void)n;
#endif
}

/// n_offers of n_items were offered.
template <class Part> inline void note_items(const Part &part, uint32_t n_items, uint32_t n_offers)
{
#ifdef GPOM_COUNT_VISITS
    visits_of(part).items += n_items;
    visits_of(part).offers += n_offers;
#else
    (void)part;
    (void)n_items;
    (void)n_offers;
#endif
}

} // namespace gpom

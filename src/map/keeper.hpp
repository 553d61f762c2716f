/// \file keeper.hpp
/// State of the insertion that lasts from beam to beam and from scan to scan.
///
/// New beams are judged in groups of GPOM_LANES_MAX, whatever the width of the build's lanes, so
/// that the same scans give the same map on every build.
#pragma once

#include "gpom/query.h"
#include "src/beams/beam.hpp"
#include "src/beams/kdtree.hpp"

namespace gpom
{

constexpr uint32_t kGroup = GPOM_LANES_MAX;

/// New beams of one scan that wait until their group is complete.
struct Group {
    Beam beams[kGroup];
    uint32_t n;
    uint32_t returned; ///< Bit i: beam i ends at a surface.
    uint32_t sure;     ///< Bit i: the place of beam i is known well enough to speak against others.
    uint32_t isolated; ///< Bit i: both neighbours of beam i in the scan look past its hit.
};

/// Where a beam of a scan runs.
struct Ray {
    float x_m, y_m, dir_x, dir_y, range_m;
};

/// A provisional beam. If another beam took its slot, the ids differ.
struct Waiting {
    uint32_t slot, id;
};

/// Lets a new beam begin late (late_start.hpp).
using BeginLate = void (*)(gpom_map &map, Beam &beam);

struct Keeper {
    Group group;
    Ray last[2];            ///< The two newest beams of the scan: beam n is at n modulo 2.
    uint32_t n_rays;        ///< Beams of the scan so far.
    uint32_t moves;         ///< 1: each beam of the scan has a start of its own.
    uint32_t scan_first_id; ///< Beams of the scan that is inserted have this id or a greater one.
    uint32_t time_number;   ///< How many different stamps there were.
    uint16_t time_mark;     ///< The mark of the newest stamp (Beam::hit_time).
    Waiting *provisional;   ///< The youngest provisional beams, a ring.
    uint32_t provisional_max;
    uint32_t n_provisional; ///< Beams that entered the ring since the map was empty.
    BeginLate begin_late;   ///< nullptr: no beam begins late.
    float late_m;           ///< Side of the cells that begin_late() looks at.
    uint32_t hand;          ///< The next slot that eviction looks at. It goes round the store.
    Point robot;            ///< At the newest scan.
    int64_t stamp_us;       ///< Of the newest scan.
    uint32_t stamp_ms;      ///< The same time, counted from stamp0_us.
    Subtree hit_stack[kDepthMax];
    Subtree inner_stack[kDepthMax]; ///< For a traversal that starts inside one of hits.
};

/// How many provisional beams a map of beam_max beams holds.
constexpr uint32_t provisional_capacity(uint32_t beam_max) { return beam_max / 16 + 8; }

} // namespace gpom

/// \file keep.hpp
/// Which beams are worth keeping.
///
/// A return near a kept hit only confirms it; a beam that runs past a kept hit speaks against it.
/// What scans of several times say of a hit or a free segment decides whether it stands, so that
/// parked cars and doors clear while a single wrong return erodes nothing, and one that its own
/// scan looks past is not seen. Hits that no longer stand are past: queries see them with more
/// noise. When the store is full, the least useful beam makes room.
///
/// New beams are judged in groups of GPOM_LANES_MAX, whatever the width of the build's lanes, so
/// that the same scans give the same map on every build.
#pragma once

#include "gpom/query.h"
#include "src/beams/beam.hpp"
#include "src/beams/index.hpp"

struct gpom_map;

namespace gpom
{

constexpr uint32_t kGroup = GPOM_LANES_MAX;

/// New beams of one scan, waiting for their group to be complete.
struct Group {
    Beam beams[kGroup];
    uint32_t n;
    uint32_t returned;       ///< Bit i: it ends at a surface.
    uint32_t sure;           ///< Bit i: its place is known well enough to speak against others.
    uint32_t isolated;       ///< Bit i: its neighbours in the scan look past its hit.
    uint32_t known;          ///< Bit i: it ends at a kept hit.
    uint32_t against;        ///< Bit i: it runs past a kept hit that stands all the same.
    uint32_t clearing;       ///< Bit i: it is the last of those that cleared a hit.
    uint32_t renews[kGroup]; ///< Slot of the oldest hit that beam i ends at, or kNoSlot.
};

/// Where a beam of a scan runs.
struct Ray {
    float x_m, y_m, dir_x, dir_y, range_m;
};

/// A provisional beam; another in its slot has another id.
struct Waiting {
    uint32_t slot, id;
};

/// State of the choice.
struct Keeper {
    Group group;
    Ray last[2];            ///< The newest beams of the scan, the nth at n modulo 2.
    uint32_t n_rays;        ///< How many there were.
    uint32_t moves;         ///< 1: beams of the scan start from places of their own.
    uint32_t scan_first_id; ///< Beams of the scan being inserted have this id or a greater one.
    uint32_t time_number;   ///< Different stamps seen so far.
    uint16_t time_mark;     ///< What stands for it in Beam.
    Waiting *provisional;   ///< The youngest provisional beams, a ring.
    uint32_t provisional_max;
    uint32_t n_provisional; ///< Ever entered into the ring.
    uint32_t hand;          ///< Slot at which the next search for the least useful starts.
    Point robot;            ///< At the newest scan.
    int64_t stamp_us;       ///< Of the newest scan.
    uint32_t stamp_ms;      ///< The same, from stamp0_us on.
    Subtree hit_stack[kDepthMax];
    Subtree inner_stack[kDepthMax]; ///< For a walk that one over hits starts.
};

/// Provisional beams that a map of beam_max beams holds at most.
constexpr uint32_t provisional_capacity(uint32_t beam_max) { return beam_max / 16 + 8; }

/// Take a new beam of the current scan into consideration; it is settled with its group.
/// sure: its place is known well enough to speak against others.
void consider(gpom_map &map, const Beam &beam, bool sure);

/// Settle the beams that still wait: the scan is complete.
void settle(gpom_map &map);

/// Take a hit, a free segment or a whole beam away, and tell the low-resolution map.
void drop_hit(gpom_map &map, uint32_t slot);
void drop_free(gpom_map &map, uint32_t slot);
void drop_beam(gpom_map &map, uint32_t slot);

/// Take all beams away, and with them those that wait; the low-resolution map is not told.
void drop_all(gpom_map &map);

/// A hit that scans of several times, the last just now, saw through is past, or goes if another
/// past one is nearer than keep_m: that something may stand there is said once.
void retire_hit(gpom_map &map, uint32_t slot);

/// Tell the low-resolution map that a beam came, goes or counts anew, or its hit alone.
void mark_beam(gpom_map &map, const Beam &beam);
void mark_hit(gpom_map &map, const Beam &beam);

} // namespace gpom

// Random messages made by lcm-gen's C code, an implementation that shares nothing with the codec.
#pragma once

#include "tests/codec/types.hpp"

#include <random>

extern "C" {
#include "peer_bot_core_planar_lidar_t.h"
#include "peer_bot_core_pose_t.h"
#include "peer_gpom_answer_t.h"
#include "peer_gpom_distances_t.h"
#include "peer_gpom_map_t.h"
#include "peer_gpom_query_t.h"
#include "peer_gpom_scan_t.h"
#include "peer_gpom_status_t.h"
#include "peer_mbot_lcm_msgs_lidar_t.h"
#include "peer_mbot_lcm_msgs_occupancy_grid_t.h"
#include "peer_mbot_lcm_msgs_pose2D_t.h"
#include "peer_occ_map_pixel_map_t.h"
}

using Random = std::mt19937_64;

/// The generator of a test: GPOM_SEED replays a run.
Random make_random();

/// A message as lcm-gen's struct, what its pointers refer to, and its bytes. CRC-32 by zlib.
template <class Peer> struct Sample {
    Peer peer = {};
    std::array<std::vector<float>, 3> floats;
    std::vector<std::int64_t> times;
    std::array<Bytes, 2> codes;
    std::array<std::vector<std::int16_t>, 4> offsets;
    std::vector<peer_gpom_point_t> points;
    std::vector<peer_gpom_point_answer_t> answers;
    Bytes bytes;

    Sample() = default;
    Sample(const Sample &) = delete; // peer points into the rest
    Sample &operator=(const Sample &) = delete;
};

void make(Sample<peer_gpom_scan_t> &sample, Random &random);
void make(Sample<peer_gpom_map_t> &sample, Random &random);
void make(Sample<peer_gpom_distances_t> &sample, Random &random);
void make(Sample<peer_gpom_status_t> &sample, Random &random);
void make(Sample<peer_gpom_query_t> &sample, Random &random);
void make(Sample<peer_gpom_answer_t> &sample, Random &random);
void make(Sample<peer_bot_core_planar_lidar_t> &sample, Random &random);
void make(Sample<peer_bot_core_pose_t> &sample, Random &random);
void make(Sample<peer_mbot_lcm_msgs_lidar_t> &sample, Random &random);
void make(Sample<peer_mbot_lcm_msgs_pose2D_t> &sample, Random &random);
void make(Sample<peer_mbot_lcm_msgs_occupancy_grid_t> &sample, Random &random);
void make(Sample<peer_occ_map_pixel_map_t> &sample, Random &random);

/// One message of each type, in the order of kTypes.
std::vector<Bytes> one_of_each(Random &random);

#include "tests/codec/samples.hpp"

#include <doctest/doctest.h>
#include <zlib.h>

#include <cstdlib>
#include <limits>
#include <string>
#include <type_traits>

namespace
{

template <class T> T below(Random &random, T n)
{
    return static_cast<T>(random() % static_cast<std::uint64_t>(n));
}

template <class T> void fill_one(Random &random, T &value)
{
    if constexpr (std::is_integral_v<T>) {
        value = static_cast<T>(random());
    } else {
        const T special[] = {std::numeric_limits<T>::quiet_NaN(),
                             std::numeric_limits<T>::infinity(), -T(0), T(1e-30)};
        value = random() % 8 == 0 ? special[random() % 4]
                                  : std::uniform_real_distribution<T>(-1000, 1000)(random);
    }
}
template <class T, std::size_t n> void fill_one(Random &random, T (&values)[n])
{
    for (T &value : values) {
        fill_one(random, value);
    }
}
template <class T> void fill_one(Random &random, std::vector<T> &values)
{
    for (T &value : values) {
        fill_one(random, value);
    }
}

/// Anything fits in.
template <class... T> void fill(Random &random, T &...values) { (fill_one(random, values), ...); }

/// A float array of n elements.
float *floats(Random &random, std::vector<float> &values, std::int32_t n)
{
    values.resize(static_cast<std::size_t>(n));
    fill(random, values);
    return values.data();
}

template <class S, class Size, class Encode> void encode(S &sample, Size size, Encode encode_peer)
{
    const int n_bytes = size(&sample.peer);
    sample.bytes.resize(static_cast<std::size_t>(n_bytes));
    REQUIRE(encode_peer(sample.bytes.data(), 0, n_bytes, &sample.peer) == n_bytes);
}

template <class S, class Size, class Encode>
void encode_with_crc(S &sample, Size size, Encode encode_peer)
{
    encode(sample, size, encode_peer);
    const auto n_bytes = static_cast<uInt>(sample.bytes.size() - 4);
    sample.peer.crc32 = static_cast<std::int32_t>(crc32(0, sample.bytes.data(), n_bytes));
    encode(sample, size, encode_peer);
}

template <class Peer> Bytes bytes_of(Random &random)
{
    Sample<Peer> sample;
    make(sample, random);
    return sample.bytes;
}

} // namespace

Random make_random()
{
    const char *const seed = std::getenv("GPOM_SEED");
    return Random(seed != nullptr ? std::stoull(seed) : 1);
}

void make(Sample<peer_gpom_scan_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.sequence, p.sensor_id, p.pose, p.pose_cov, p.angle_min, p.angle_step);
    p.n_ranges = below(random, 400);
    p.ranges = floats(random, sample.floats[0], p.n_ranges);
    encode_with_crc(sample, peer_gpom_scan_t_encoded_size, peer_gpom_scan_t_encode);
}

void make(Sample<peer_gpom_map_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.map_sequence, p.frame_epoch, p.pose, p.corner, p.cell_m,
         p.prior_variance);
    p.n_tiles = static_cast<std::int16_t>(1 + below(random, 100));
    p.i_tile = below(random, p.n_tiles);
    p.keyframe = static_cast<std::int8_t>(below(random, 2));
    p.nx = below<std::int16_t>(random, 26);
    p.ny = below<std::int16_t>(random, 26);
    p.ix0 = below<std::int16_t>(random, 1000);
    p.iy0 = below<std::int16_t>(random, 1000);
    p.map_nx = static_cast<std::int16_t>(p.ix0 + p.nx + below(random, 100));
    p.map_ny = static_cast<std::int16_t>(p.iy0 + p.ny + below(random, 100));
    p.n_cells = p.nx * p.ny;
    for (Bytes &codes : sample.codes) {
        codes.resize(static_cast<std::size_t>(p.n_cells));
        fill(random, codes);
    }
    for (std::size_t i = 0; i < sample.codes[0].size(); ++i) { // unknown in both or in neither
        std::uint8_t &variance_class = sample.codes[1][i];
        const bool is_unknown = (variance_class & 3) == PEER_GPOM_MAP_T_CLASS_UNKNOWN;
        sample.codes[0][i] = is_unknown ? PEER_GPOM_MAP_T_PROBABILITY_UNKNOWN
                                        : static_cast<std::uint8_t>(below(random, 255));
    }
    p.probability = sample.codes[0].data();
    p.variance_class = sample.codes[1].data();
    encode_with_crc(sample, peer_gpom_map_t_encoded_size, peer_gpom_map_t_encode);
}

void make(Sample<peer_gpom_distances_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.sequence, p.frame_epoch, p.corner, p.cell_m);
    p.n_tiles = static_cast<std::int16_t>(1 + below(random, 100));
    p.i_tile = below(random, p.n_tiles);
    p.keyframe = static_cast<std::int8_t>(below(random, 2));
    p.nx = below<std::int16_t>(random, 13);
    p.ny = below<std::int16_t>(random, 13);
    p.ix0 = below<std::int16_t>(random, 1000);
    p.iy0 = below<std::int16_t>(random, 1000);
    p.map_nx = static_cast<std::int16_t>(p.ix0 + p.nx + below(random, 100));
    p.map_ny = static_cast<std::int16_t>(p.iy0 + p.ny + below(random, 100));
    p.n_cells = p.nx * p.ny;
    std::int16_t **const fields[] = {&p.occupied_dx, &p.occupied_dy, &p.not_free_dx,
                                     &p.not_free_dy};
    for (std::size_t k = 0; k < 4; ++k) {
        sample.offsets[k].resize(static_cast<std::size_t>(p.n_cells));
        *fields[k] = sample.offsets[k].data();
    }
    for (std::size_t i = 0; i < sample.offsets[0].size(); ++i) { // to a cell of the map, or none
        const int ix = p.ix0 + static_cast<int>(i) % p.nx;
        const int iy = p.iy0 + static_cast<int>(i) / p.nx;
        for (std::size_t k = 0; k < 4; k += 2) {
            const bool is_none = below(random, 8) == 0;
            const int dx = below<int>(random, p.map_nx) - ix;
            const int dy = below<int>(random, p.map_ny) - iy;
            sample.offsets[k][i] = static_cast<std::int16_t>(is_none ? INT16_MIN : dx);
            sample.offsets[k + 1][i] = static_cast<std::int16_t>(is_none ? INT16_MIN : dy);
        }
    }
    encode_with_crc(sample, peer_gpom_distances_t_encoded_size, peer_gpom_distances_t_encode);
}

void make(Sample<peer_gpom_status_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.sequence, p.version, p.map_format, p.frame_epoch, p.uptime_us,
         p.scan_utime, p.scan_lag_us, p.scan_lag_us_max, p.scan_rate_hz, p.pose_rate_hz,
         p.map_rate_hz, p.query_rate_hz, p.n_beams, p.beam_max, p.n_cells_dirty, p.map_bytes,
         p.process_bytes, p.counts);
    p.state = static_cast<std::int8_t>(below(random, 4));
    encode_with_crc(sample, peer_gpom_status_t_encoded_size, peer_gpom_status_t_encode);
}

void make(Sample<peer_gpom_query_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.client, p.sequence, p.step_m);
    p.kind = static_cast<std::int8_t>(below(random, 2));
    p.n_points = below(random, PEER_GPOM_QUERY_T_POINTS_MAX + 1);
    sample.points.resize(static_cast<std::size_t>(p.n_points));
    for (auto &point : sample.points) {
        fill(random, point.x, point.y);
    }
    p.points = sample.points.data();
    encode_with_crc(sample, peer_gpom_query_t_encoded_size, peer_gpom_query_t_encode);
}

void make(Sample<peer_gpom_answer_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.map_utime, p.client, p.sequence, p.frame_epoch);
    p.status = static_cast<std::int8_t>(below(random, 4));
    p.n_points = below(random, PEER_GPOM_QUERY_T_POINTS_MAX + 1);
    sample.answers.resize(static_cast<std::size_t>(p.n_points));
    for (auto &answer : sample.answers) {
        fill(random, answer.mean, answer.variance, answer.probability);
        answer.cls = static_cast<std::int8_t>(below(random, 4));
    }
    p.points = sample.answers.data();
    encode_with_crc(sample, peer_gpom_answer_t_encoded_size, peer_gpom_answer_t_encode);
}

void make(Sample<peer_bot_core_planar_lidar_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.rad0, p.radstep);
    p.nranges = below(random, 1100);
    p.ranges = floats(random, sample.floats[0], p.nranges);
    p.nintensities = below(random, 1100);
    p.intensities = floats(random, sample.floats[1], p.nintensities);
    encode(sample, peer_bot_core_planar_lidar_t_encoded_size, peer_bot_core_planar_lidar_t_encode);
}

void make(Sample<peer_bot_core_pose_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.pos, p.vel, p.orientation, p.rotation_rate, p.accel);
    encode(sample, peer_bot_core_pose_t_encoded_size, peer_bot_core_pose_t_encode);
}

void make(Sample<peer_mbot_lcm_msgs_lidar_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime);
    p.num_ranges = below(random, 300);
    p.ranges = floats(random, sample.floats[0], p.num_ranges);
    p.thetas = floats(random, sample.floats[1], p.num_ranges);
    p.intensities = floats(random, sample.floats[2], p.num_ranges);
    sample.times.resize(static_cast<std::size_t>(p.num_ranges));
    fill(random, sample.times);
    p.times = sample.times.data();
    encode(sample, peer_mbot_lcm_msgs_lidar_t_encoded_size, peer_mbot_lcm_msgs_lidar_t_encode);
}

void make(Sample<peer_mbot_lcm_msgs_pose2D_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.x, p.y, p.theta);
    encode(sample, peer_mbot_lcm_msgs_pose2D_t_encoded_size, peer_mbot_lcm_msgs_pose2D_t_encode);
}

void make(Sample<peer_mbot_lcm_msgs_occupancy_grid_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.origin_x, p.origin_y, p.meters_per_cell);
    p.width = 1 + below(random, 60);
    p.height = 1 + below(random, 60);
    p.num_cells = p.width * p.height;
    sample.codes[0].resize(static_cast<std::size_t>(p.num_cells));
    fill(random, sample.codes[0]);
    p.cells = reinterpret_cast<std::int8_t *>(sample.codes[0].data());
    encode(sample, peer_mbot_lcm_msgs_occupancy_grid_t_encoded_size,
           peer_mbot_lcm_msgs_occupancy_grid_t_encode);
}

void make(Sample<peer_occ_map_pixel_map_t> &sample, Random &random)
{
    auto &p = sample.peer;
    fill(random, p.utime, p.xy0, p.xy1, p.mpp);
    p.dimensions[0] = below(random, 20);
    p.dimensions[1] = below(random, 20);
    p.compressed = static_cast<std::uint8_t>(below(random, 2));
    p.data_type = static_cast<std::int8_t>(1 + below(random, 8));
    const int pixel_bytes[] = {0, 4, 8, 4, 4, 2, 2, 1, 1};
    p.datasize = p.compressed == 1 ? below(random, 500)
                                   : p.dimensions[0] * p.dimensions[1] * pixel_bytes[p.data_type];
    sample.codes[0].resize(static_cast<std::size_t>(p.datasize));
    fill(random, sample.codes[0]);
    p.mapData = sample.codes[0].data();
    encode(sample, peer_occ_map_pixel_map_t_encoded_size, peer_occ_map_pixel_map_t_encode);
}

std::vector<Bytes> one_of_each(Random &random)
{
    return {bytes_of<peer_gpom_scan_t>(random),
            bytes_of<peer_gpom_map_t>(random),
            bytes_of<peer_gpom_status_t>(random),
            bytes_of<peer_gpom_query_t>(random),
            bytes_of<peer_gpom_answer_t>(random),
            bytes_of<peer_bot_core_planar_lidar_t>(random),
            bytes_of<peer_bot_core_pose_t>(random),
            bytes_of<peer_mbot_lcm_msgs_lidar_t>(random),
            bytes_of<peer_mbot_lcm_msgs_pose2D_t>(random),
            bytes_of<peer_mbot_lcm_msgs_occupancy_grid_t>(random),
            bytes_of<peer_occ_map_pixel_map_t>(random),
            bytes_of<peer_gpom_distances_t>(random)};
}

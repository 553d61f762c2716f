// A snapshot made or read on this processor, to compare with another one's.
//
// usage: snapshot_bytes write PATH    insert fixed scans, write two snapshots to PATH.0 and PATH.1
//        snapshot_bytes read PATH     read the newest
// Both print the bits of the map's answers to fixed queries, one hexadecimal word a line.
#include "gpom/gpom.h"
#include "ports/host/snapshot_file.hpp"

#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{

constexpr std::uint32_t kBeamMax = 500;

/// Numbers that are the same everywhere: Numerical Recipes' linear congruential generator.
struct Random {
    std::uint32_t state = 1;

    double uniform(double low, double high)
    {
        state = state * 1664525u + 1013904223u;
        return low + (high - low) * (state >> 8) / 16777216.0;
    }
};

class Map {
public:
    Map()
    {
        gpom_config_t config;
        gpom_config_init(&config);
        config.beam_max = kBeamMax;
        config.keep_m = 0.25f;
        config.clear_scans = 2;
        config.origin_x_m = -3.0e5;
        config.origin_y_m = 4.5e6;
        memory_.resize(gpom_map_bytes(&config) / sizeof(std::uint64_t) + 1);
        check(gpom_map_init(&map_, &config, memory_.data(), memory_.size() * 8), "gpom_map_init");
    }

    static void check(gpom_status_t status, const char *what)
    {
        if (status != GPOM_OK) {
            throw std::runtime_error(std::string(what) + ": " + gpom_status_str(status));
        }
    }

    void drive(Random &random, int first, int end)
    {
        gpom_sensor_t sensor;
        gpom_sensor_init(&sensor);
        std::vector<float> ranges_m(60);
        const float cov[9] = {1e-4f, 0.0f, 0.0f, 0.0f, 1e-4f, 0.0f, 0.0f, 0.0f, 1e-6f};
        for (int i = first; i < end; ++i) {
            for (float &range_m : ranges_m) {
                range_m = static_cast<float>(random.uniform(1.0, 32.0));
            }
            const gpom_scan_t scan = {1600000000000000 + i * 100000, -3.0, 0.1, ranges_m.data(),
                                      static_cast<std::uint32_t>(ranges_m.size())};
            const gpom_pose_t pose = {-3.0e5 + random.uniform(-4.0, 4.0),
                                      4.5e6 + random.uniform(-4.0, 4.0), random.uniform(-3.0, 3.0),
                                      cov};
            check(gpom_scan_insert(map_, &scan, &sensor, &pose), "gpom_scan_insert");
        }
    }

    void write_to(const std::string &path)
    {
        gpom_tools::SnapshotFile file(path, kBeamMax, true);
        const gpom_snapshot_io_t io = file.io();
        gpom_snapshot_t snapshot;
        check(gpom_snapshot_write_begin(&snapshot, map_, &io), "gpom_snapshot_write_begin");
        check(gpom_snapshot_write_step(&snapshot, map_, UINT32_MAX), "gpom_snapshot_write_step");
    }

    void read_from(const std::string &path)
    {
        gpom_tools::SnapshotFile file(path, kBeamMax, false);
        const gpom_snapshot_io_t io = file.io();
        gpom_snapshot_t snapshot;
        check(gpom_snapshot_read_begin(&snapshot, map_, &io), "gpom_snapshot_read_begin");
        check(gpom_snapshot_read_step(&snapshot, map_, UINT32_MAX), "gpom_snapshot_read_step");
    }

    void print_answers() const
    {
        Random random;
        std::vector<gpom_point_t> points(100);
        for (gpom_point_t &point : points) {
            point = {-3.0e5 + random.uniform(-20.0, 20.0), 4.5e6 + random.uniform(-20.0, 20.0)};
        }
        std::vector<gpom_answer_t> answers(points.size());
        std::vector<std::uint8_t> scratch_bytes(gpom_scratch_bytes(map_));
        const gpom_scratch_t scratch = {scratch_bytes.data(), scratch_bytes.size()};
        check(gpom_query_points(map_, points.data(), points.size(), answers.data(), &scratch),
              "gpom_query_points");
        for (const gpom_answer_t &answer : answers) {
            for (const float value : {answer.mean, answer.variance, answer.probability}) {
                std::uint32_t bits;
                std::memcpy(&bits, &value, sizeof bits);
                std::printf("%08x\n", static_cast<unsigned>(bits));
            }
        }
    }

private:
    std::vector<std::uint64_t> memory_;
    gpom_map_t *map_ = nullptr;
};

int run(const std::string &verb, const std::string &path)
{
    Map map;
    if (verb == "write") {
        Random random;
        map.drive(random, 0, 15);
        map.write_to(path);
        map.drive(random, 15, 30);
        map.write_to(path);
    } else if (verb == "read") {
        map.read_from(path);
    } else {
        throw std::runtime_error(verb + ": not a verb; use write or read");
    }
    map.print_answers();
    return 0;
}

} // namespace

int main(int argc, char **argv)
{
    try {
        if (argc != 3) {
            throw std::runtime_error("give a verb, write or read, and a path");
        }
        return run(argv[1], argv[2]);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "snapshot_bytes: %s\n", error.what());
        return 1;
    }
}

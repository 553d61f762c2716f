// Ask gpomd about places, by lcm-gen's own types and publish.
// lcm-gen -x --cpp-hpath build/types lcmtypes/gpom_*.lcm
// c++ -std=c++17 -Ibuild/types examples/query_map.cpp -llcm -o build/query_map
// build/query_map udpm://239.255.76.67:7667?ttl=0 X Y...
//
// publish() cannot compute crc32 over what it encodes and leaves it at 0: gpomd answers that where
// its lcm_url has ttl=0, or where publish.query_crc_optional is set; else it says NO_CRC.
#include "gpom/answer_t.hpp"
#include "gpom/query_t.hpp"

#include <lcm/lcm-cpp.hpp>

#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace
{

constexpr int kWait_ms = 1000;

/// Waits for the answer to one query.
struct Client {
    gpom::query_t query = {};
    bool is_answered = false;

    void take(const lcm::ReceiveBuffer * /*buffer*/, const std::string & /*channel*/,
              const gpom::answer_t *answer)
    {
        if (answer->client != query.client || answer->sequence != query.sequence) {
            return; // another's
        }
        is_answered = true;
        if (answer->n_points == 0) {
            std::printf("refused with status %d, see lcmtypes/gpom_answer_t.lcm\n",
                        static_cast<int>(answer->status));
        }
        constexpr const char *kClasses[] = {"free", "unsure", "occupied", "unknown"};
        for (int i = 0; i < answer->n_points; ++i) {
            const gpom::point_answer_t &point = answer->points[i];
            std::printf("%g %g: p = %.3f, %s\n", query.points[i].x, query.points[i].y,
                        static_cast<double>(point.probability), kClasses[point.cls & 3]);
        }
    }
};

} // namespace

int main(int argc, char **argv)
{
    lcm::LCM bus(argc > 1 ? argv[1] : "");
    Client client;
    if (argc < 4 || !bus.good()) {
        std::fprintf(stderr, "usage: query_map URL X Y [X Y]...\n");
        return 2;
    }
    for (int i = 2; i + 1 < argc; i += 2) {
        client.query.points.push_back({std::atof(argv[i]), std::atof(argv[i + 1])});
    }
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    client.query.utime = std::chrono::duration_cast<std::chrono::microseconds>(now).count();
    client.query.client = client.query.utime; // any number that others do not use
    client.query.kind = gpom::query_t::POINTS;
    client.query.n_points = static_cast<int>(client.query.points.size());
    bus.subscribe("GPOM_ANSWER", &Client::take, &client);
    bus.publish("GPOM_QUERY", &client.query);
    while (!client.is_answered) {
        if (bus.handleTimeout(kWait_ms) <= 0) {
            std::fprintf(stderr, "no answer: gpomd is not running, or on another network\n");
            return 1;
        }
    }
    return 0;
}

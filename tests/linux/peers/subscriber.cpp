// A subscriber as lcm-gen makes them in C++, of all that gpomd publishes: prints each message's
// channel and, in hexadecimal, what it encodes to again.
#include "gpom/answer_t.hpp"
#include "gpom/map_t.hpp"
#include "gpom/status_t.hpp"
#include "mbot_lcm_msgs/occupancy_grid_t.hpp"
#include "occ_map/pixel_map_t.hpp"

#include <lcm/lcm-cpp.hpp>

#include <cstdio>
#include <string>
#include <vector>

namespace
{

template <class Message>
void print(const lcm::ReceiveBuffer * /*buffer*/, const std::string &channel,
           const Message *message, int /*unused*/)
{
    std::vector<unsigned char> bytes(static_cast<std::size_t>(message->getEncodedSize()));
    const int n_bytes = message->encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    std::printf("%s ", channel.c_str());
    for (int i = 0; i < n_bytes; ++i) {
        std::printf("%02x", bytes[static_cast<std::size_t>(i)]);
    }
    std::printf("\n");
    std::fflush(stdout);
}

} // namespace

int main(int argc, char **argv)
{
    lcm::LCM bus(argc > 1 ? argv[1] : "");
    if (!bus.good()) {
        return 1;
    }
    bus.subscribeFunction("GPOM_MAP", print<gpom::map_t>, 0);
    bus.subscribeFunction("GPOM_STATUS", print<gpom::status_t>, 0);
    bus.subscribeFunction("GPOM_ANSWER", print<gpom::answer_t>, 0);
    bus.subscribeFunction("SLAM_MAP", print<mbot_lcm_msgs::occupancy_grid_t>, 0);
    bus.subscribeFunction("PIXEL_MAP", print<occ_map::pixel_map_t>, 0);
    while (bus.handle() == 0) {
    }
    return 1;
}

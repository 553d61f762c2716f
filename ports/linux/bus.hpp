// liblcm as transport: messages out. Its types are not used, and it receives nothing.
#ifndef GPOM_LINUX_BUS_HPP
#define GPOM_LINUX_BUS_HPP

#include "ports/linux/counts.hpp"

#include <lcm/lcm.h>

#include <cstddef>
#include <cstdint>

namespace gpomd
{

class Bus {
public:
    /// What the system refuses is counted in `counts`, which outlives the bus; NULL: nowhere.
    explicit Bus(Counts *counts = nullptr) : counts_(counts) {}
    ~Bus();
    Bus(const Bus &) = delete;
    Bus &operator=(const Bus &) = delete;

    /// Join the network. NULL, or in one sentence what is wrong and what to do; static storage.
    const char *open(const char *url);

    /// Send a message; any thread may. False: the system refused it.
    bool send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes);

private:
    lcm_t *lcm_ = nullptr;
    Counts *counts_;
};

} // namespace gpomd

#endif

#include "ports/linux/bus.hpp"

#include "ports/linux/network.hpp"

namespace gpomd
{

Bus::~Bus()
{
    if (lcm_ != nullptr) {
        lcm_destroy(lcm_);
    }
}

const char *Bus::open(const char *url)
{
    // What would make liblcm fail with a page of text is told in a sentence.
    const char *const problem = is_multicast_url(url) ? network_problem(url) : nullptr;
    if (problem != nullptr) {
        return problem;
    }
    lcm_ = lcm_create(url);
    return lcm_ != nullptr ? nullptr : "liblcm refuses the URL; its reason is above";
}

bool Bus::send(const char *channel, const std::uint8_t *bytes, std::size_t n_bytes)
{
    const bool is_sent = lcm_publish(lcm_, channel, bytes, static_cast<unsigned int>(n_bytes)) == 0;
    if (!is_sent && counts_ != nullptr) {
        counts_->add(GPOM_WIRE_MESSAGES_NOT_SENT);
    }
    return is_sent;
}

} // namespace gpomd

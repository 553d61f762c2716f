// LCM's name of a network: udpm://ADDRESS:PORT?ttl=N&recv_buf_size=BYTES.
#ifndef GPOM_LINUX_NETWORK_HPP
#define GPOM_LINUX_NETWORK_HPP

#include <netinet/in.h>

namespace gpomd
{

struct Network {
    sockaddr_in group;
    int buffer_bytes; ///< Of the receiving socket; 0: not said.
    int ttl;          ///< Networks that a datagram may pass; 0: it stays on this machine.
};

/// Does a URL name a network of UDP multicast, whatever else is in it?
bool is_multicast_url(const char *url);

/// Take a URL apart as liblcm does, with its own group where none is named. False: not such a URL.
bool parse_network(const char *url, Network &network);

/// NULL, or in one sentence what is wrong with a URL, whatever networks there are; static storage.
const char *url_problem(const char *url);

/// NULL, or in one sentence why nothing can be sent there and what to do; static storage.
const char *network_problem(const char *url);

} // namespace gpomd

#endif

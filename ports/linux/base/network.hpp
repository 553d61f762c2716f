// LCM's URL of a network: udpm://ADDRESS:PORT?ttl=N&recv_buf_size=BYTES.
#ifndef GPOM_LINUX_NETWORK_HPP
#define GPOM_LINUX_NETWORK_HPP

#include <netinet/in.h>

namespace gpomd
{

struct Network {
    sockaddr_in group;
    int buffer_bytes; ///< Buffer of the receiving socket. 0: the URL does not give it.
    int ttl;          ///< Number of networks that a datagram may cross. 0: it stays on this
                      ///< machine.
};

/// True if a URL begins like that of a UDP multicast network. The rest of the URL may be wrong.
bool is_multicast_url(const char *url);

/// Parse a URL as liblcm does. A URL without an address means LCM's default group. False: the URL
/// is not one of a multicast network.
bool parse_network(const char *url, Network &network);

/// NULL if a URL is good, else one sentence that says what is wrong with it, in static storage. The
/// networks of this machine do not matter.
const char *url_problem(const char *url);

/// NULL if datagrams can be sent to a URL, else one sentence that says why not and what to do, in
/// static storage.
const char *network_problem(const char *url);

} // namespace gpomd

#endif

#include "ports/linux/base/network.hpp"

#include <arpa/inet.h>
#include <doctest/doctest.h>

#include <string>

namespace
{

/// "ADDRESS PORT BUFFER TTL", or nothing if it is refused.
std::string parsed(const char *url)
{
    gpomd::Network network;
    if (!gpomd::parse_network(url, network)) {
        return "";
    }
    return std::string(inet_ntoa(network.group.sin_addr)) + " " +
           std::to_string(ntohs(network.group.sin_port)) + " " +
           std::to_string(network.buffer_bytes) + " " + std::to_string(network.ttl);
}

} // namespace

// What a URL leaves out is liblcm's own; options may stand in any order.
TEST_CASE("URLs of UDP multicast are taken apart as liblcm does")
{
    CHECK(parsed("udpm://") == "239.255.76.67 7667 0 0");
    CHECK(parsed("udpm://?ttl=1") == "239.255.76.67 7667 0 1");
    CHECK(parsed("udpm://239.1.2.3") == "239.1.2.3 7667 0 0");
    CHECK(parsed("udpm://239.1.2.3:65535?ttl=0") == "239.1.2.3 65535 0 0");
    CHECK(parsed("udpm://239.1.2.3:80?recv_buf_size=5000&ttl=0") == "239.1.2.3 80 5000 0");
    CHECK(parsed("udpm://:0x50?ttl=0&recv_buf_size=99999999999") ==
          "239.255.76.67 80 2147483647 0");
    CHECK(parsed("udpm://?ttl=300") == "239.255.76.67 7667 0 255");
    CHECK(parsed("udpm://?my_recv_buf_size=5&recv_buf_size=-1") == "239.255.76.67 7667 0 0");
}

TEST_CASE("what is no such URL is refused")
{
    for (const char *const url :
         {"", "udpm:/", "tcpq://239.1.2.3:80", "udpm://239.1.2.3:0", "udpm://239.1.2.3:65536",
          "udpm://239.1.2.3:-1", "udpm://239.1.2.3:", "udpm://nonsense", "udpm://239.1.2.300",
          "udpm://239.255.255.255.255.255.255"}) {
        CAPTURE(url);
        CHECK(parsed(url).empty());
    }
}

// A misspelt option would be ignored, and a range of 1 become that of this machine alone.
TEST_CASE("a URL whose options are not all known, with numbers that they may have, has a problem")
{
    for (const char *const options :
         {"", "?ttl=0", "?ttl=255&recv_buf_size=4096", "?recv_buf_size=0x1000&ttl=1"}) {
        CAPTURE(options);
        CHECK(gpomd::url_problem(("udpm://239.1.2.3:80" + std::string(options)).c_str()) ==
              nullptr);
    }
    for (const char *const options :
         {"?", "?tll=1", "?ttl", "?ttl=", "?ttl=x", "?ttl=1x", "?ttl=256", "?ttl=-1", "?ttl=1&",
          "?recv_buf_size=4M", "?recv_buf_size=99999999999", "?ttl=1&x=2", "?xttl=1"}) {
        CAPTURE(options);
        CHECK(gpomd::url_problem(("udpm://239.1.2.3:80" + std::string(options)).c_str()) !=
              nullptr);
    }
}

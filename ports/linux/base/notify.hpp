// Sends service states to systemd without systemd's library: datagrams to the socket that systemd
// names.
#ifndef GPOM_LINUX_NOTIFY_HPP
#define GPOM_LINUX_NOTIFY_HPP

#include <cstdint>

namespace gpomd
{

/// True if a service manager waits for states (environment variable NOTIFY_SOCKET is set).
bool is_managed();

/// Send "READY=1", "WATCHDOG=1", "STOPPING=1" or "STATUS=…" to the service manager (sd_notify(3)).
/// False: there is no service manager, it does not listen, or its queue is full. Does not wait.
bool notify(const char *state);

/// Period in which WATCHDOG=1 is expected (WATCHDOG_USEC, if it is meant for this process). 0:
/// never.
std::int64_t watchdog_us();

} // namespace gpomd

#endif

// What systemd wants to hear, without its library: datagrams to the socket it names.
#ifndef GPOM_LINUX_NOTIFY_HPP
#define GPOM_LINUX_NOTIFY_HPP

#include <cstdint>

namespace gpomd
{

/// Is there a service manager to tell (NOTIFY_SOCKET)?
bool is_managed();

/// Tell the service manager "READY=1", "WATCHDOG=1", "STOPPING=1" or "STATUS=…" (sd_notify(3)).
/// False: it does not listen, its queue is full, or nobody asked. Does not wait.
bool notify(const char *state);

/// How often WATCHDOG=1 is expected (WATCHDOG_USEC, if it is meant for this process); 0: never.
std::int64_t watchdog_us();

} // namespace gpomd

#endif

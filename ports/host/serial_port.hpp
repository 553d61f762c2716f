// Opens a serial port of this machine.
#ifndef GPOM_PORTS_HOST_SERIAL_PORT_HPP
#define GPOM_PORTS_HOST_SERIAL_PORT_HPP

#include <string>

namespace gpom_tools
{

/// True if serial ports have this rate.
bool is_baud_rate(unsigned baud);

/// The rates that there are, as "9600, 19200, ...".
std::string baud_rates();

/// Open a port with 8 bits without parity, and neither wait for a carrier nor in reads and writes.
/// `baud` is one of baud_rates(). Returns its descriptor. -1: `problem` says why not, in static
/// storage or until the next call of strerror().
int open_serial_port(const char *path, unsigned baud, const char *&problem);

} // namespace gpom_tools

#endif

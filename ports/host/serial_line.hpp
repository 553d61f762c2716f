// A line to a device: a serial port, or the socket by which QEMU gives its UART away.
#ifndef GPOM_PORTS_HOST_SERIAL_LINE_HPP
#define GPOM_PORTS_HOST_SERIAL_LINE_HPP

#include <cstddef>
#include <cstdint>
#include <string>

namespace gpom_tools
{

class SerialLine {
public:
    /// "unix:PATH", "tcp:HOST:PORT", or the path of a serial port, which is set to 8 bits without
    /// parity at `baud`. Throws std::runtime_error with a line of text.
    SerialLine(const std::string &name, unsigned baud);
    ~SerialLine();
    SerialLine(const SerialLine &) = delete;
    SerialLine &operator=(const SerialLine &) = delete;

    /// Wait for bytes; how many came, 0: none in time. Throws if the line ended.
    std::size_t read(std::uint8_t *bytes, std::size_t n_max, int wait_ms);

    /// Send bytes, waiting for the line between them. False: it did not move for so long; part of
    /// the bytes may be sent. Throws if the line ended.
    bool write(const std::uint8_t *bytes, std::size_t n_bytes, int wait_ms);

private:
    [[noreturn]] void fail(const char *what) const;

    std::string name_;
    int fd_ = -1;
};

} // namespace gpom_tools

#endif

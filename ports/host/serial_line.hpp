// A line to a device: a serial port, or the socket to which QEMU connects its UART.
#ifndef GPOM_PORTS_HOST_SERIAL_LINE_HPP
#define GPOM_PORTS_HOST_SERIAL_LINE_HPP

#include <cstddef>
#include <cstdint>
#include <string>

namespace gpom_tools
{

class SerialLine {
public:
    /// `name` is "unix:PATH", "tcp:HOST:PORT", or the path of a serial port. The port is set to 8
    /// bits without parity at `baud`. Throws std::runtime_error with one line of text.
    SerialLine(const std::string &name, unsigned baud);
    ~SerialLine();
    SerialLine(const SerialLine &) = delete;
    SerialLine &operator=(const SerialLine &) = delete;

    /// Wait for bytes. Returns how many came. 0: none came in time. Throws if the line ended.
    std::size_t read(std::uint8_t *bytes, std::size_t n_max, int wait_ms);

    /// Send bytes. Waits when the line is busy. False: the line was busy for wait_ms, and part of
    /// the bytes may have been sent. Throws if the line ended.
    bool write(const std::uint8_t *bytes, std::size_t n_bytes, int wait_ms);

private:
    [[noreturn]] void fail(const char *what) const;

    std::string name_;
    int fd_ = -1;
};

} // namespace gpom_tools

#endif

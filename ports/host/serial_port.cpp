#include "ports/host/serial_port.hpp"

#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>

namespace gpom_tools
{

namespace
{

struct Speed {
    unsigned baud;
    speed_t code;
};
constexpr Speed kSpeeds[] = {{9600, B9600},       {19200, B19200},     {38400, B38400},
                             {57600, B57600},     {115200, B115200},   {230400, B230400},
                             {460800, B460800},   {500000, B500000},   {921600, B921600},
                             {1000000, B1000000}, {1500000, B1500000}, {3000000, B3000000}};

const Speed *find_speed(unsigned baud)
{
    return std::find_if(std::begin(kSpeeds), std::end(kSpeeds),
                        [baud](const Speed &candidate) { return candidate.baud == baud; });
}

bool set_up(int fd, speed_t speed, const char *&problem)
{
    termios settings = {};
    if (tcgetattr(fd, &settings) != 0) {
        problem = errno == ENOTTY ? "is no serial port" : std::strerror(errno);
        return false;
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    cfsetspeed(&settings, speed);
    if (tcsetattr(fd, TCSANOW, &settings) != 0) {
        problem = "refuses the baud rate";
        return false;
    }
    return true;
}

} // namespace

bool is_baud_rate(unsigned baud) { return find_speed(baud) != std::end(kSpeeds); }

std::string baud_rates()
{
    std::string rates;
    for (const Speed &speed : kSpeeds) {
        rates += (rates.empty() ? "" : ", ") + std::to_string(speed.baud);
    }
    return rates;
}

int open_serial_port(const char *path, unsigned baud, const char *&problem)
{
    const int fd = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) {
        problem = std::strerror(errno);
        return -1;
    }
    if (!set_up(fd, find_speed(baud)->code, problem)) {
        close(fd);
        return -1;
    }
    return fd;
}

} // namespace gpom_tools

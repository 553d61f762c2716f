#include "ports/linux/base/memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>

namespace gpomd
{

bool Memory::reserve(std::size_t n_bytes)
{
    void *const block = mmap(nullptr, n_bytes, PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (block == MAP_FAILED) {
        return false;
    }
    begin_ = static_cast<std::uint8_t *>(block);
    n_bytes_ = n_bytes;
    return true;
}

void *Memory::take_bytes(std::size_t n_bytes)
{
    const std::size_t need = rounded(n_bytes);
    if (need > n_bytes_ - n_taken_) {
        std::abort(); // the sum that was reserved is wrong: an error of this program
    }
    void *const piece = begin_ + n_taken_;
    n_taken_ += need;
    return piece;
}

std::int64_t resident_bytes()
{
    char text[128] = {};
    const int fd = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (fd < 0) {
        return 0;
    }
    const ssize_t n = read(fd, text, sizeof text - 1);
    close(fd);
    char *end = text;
    std::strtol(text, &end, 10); // total size first, resident pages second
    return n > 0 ? std::strtol(end, nullptr, 10) * sysconf(_SC_PAGESIZE) : 0;
}

} // namespace gpomd

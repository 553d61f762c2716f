#include "tools/lib/snapshot_file.hpp"

#include "tools/lib/file_error.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace gpom_tools
{

namespace
{

constexpr std::size_t kBlock = GPOM_SNAPSHOT_BLOCK_BYTES;

std::string folder_of(const std::string &path)
{
    const std::size_t slash = path.rfind('/');
    return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

/// Move all bytes of a block by pread() or pwrite(), which may stop halfway or be interrupted.
template <class Move> gpom_status_t move_block(const Move &move)
{
    for (std::size_t done = 0; done < kBlock;) {
        const ssize_t n = move(done);
        if (n > 0) {
            done += static_cast<std::size_t>(n);
        } else if (n == 0 || errno != EINTR) {
            return GPOM_ERR_IO;
        }
    }
    return GPOM_OK;
}

} // namespace

SnapshotFile::SnapshotFile(const std::string &path, uint32_t beam_max, bool for_writing)
    : slot_bytes_(GPOM_SNAPSHOT_SLOT_BYTES(beam_max))
{
    for (int slot = 0; slot < 2; ++slot) {
        const std::string name = path + "." + std::to_string(slot);
        const int flags = for_writing ? O_RDWR | O_CREAT : O_RDONLY;
        fds_[slot] = open(name.c_str(), flags | O_CLOEXEC, 0666);
        if (fds_[slot] < 0 && (for_writing || errno != ENOENT)) {
            const int error = errno;
            close_all();
            throw FileError(name, 0, std::string("cannot open: ") + std::strerror(error));
        }
    }
    if (for_writing) {
        if (flock(fds_[0], LOCK_EX | LOCK_NB) != 0) { // the system gives it back, however we end
            const bool is_taken = errno == EWOULDBLOCK;
            close_all();
            throw FileError(path + ".0", 0,
                            is_taken ? "another process writes its snapshots here; give each its "
                                       "own path, or stop the other"
                                     : "cannot lock this file");
        }
        folder_fd_ = open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (folder_fd_ < 0) {
            const int error = errno;
            close_all();
            throw FileError(folder_of(path), 0, std::string("cannot open: ") + strerror(error));
        }
    }
}

SnapshotFile::~SnapshotFile() { close_all(); }

void SnapshotFile::close_all()
{
    for (const int fd : {fds_[0], fds_[1], folder_fd_}) {
        if (fd >= 0) {
            close(fd);
        }
    }
}

gpom_snapshot_io_t SnapshotFile::io()
{
    return {this, slot_bytes_, read, folder_fd_ >= 0 ? write : nullptr, flush};
}

gpom_status_t SnapshotFile::read(void *ctx, uint32_t slot, uint32_t offset_bytes, uint8_t *block)
{
    const int fd = static_cast<SnapshotFile *>(ctx)->fds_[slot];
    return move_block([&](std::size_t done) {
        return pread(fd, block + done, kBlock - done,
                     static_cast<off_t>(offset_bytes) + static_cast<off_t>(done));
    });
}

gpom_status_t SnapshotFile::write(void *ctx, uint32_t slot, uint32_t offset_bytes,
                                  const uint8_t *block)
{
    const int fd = static_cast<SnapshotFile *>(ctx)->fds_[slot];
    return move_block([&](std::size_t done) {
        return pwrite(fd, block + done, kBlock - done,
                      static_cast<off_t>(offset_bytes) + static_cast<off_t>(done));
    });
}

gpom_status_t SnapshotFile::flush(void *ctx, uint32_t slot)
{
    const auto &self = *static_cast<SnapshotFile *>(ctx);
    const bool is_kept = fsync(self.fds_[slot]) == 0 && fsync(self.folder_fd_) == 0;
    return is_kept ? GPOM_OK : GPOM_ERR_IO;
}

} // namespace gpom_tools

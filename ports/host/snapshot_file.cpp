#include "ports/host/snapshot_file.hpp"

#include "ports/host/file_error.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
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

/// Read or write a whole block by pread() or pwrite(), which may stop halfway or be interrupted.
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

std::string name_of(const std::string &path, uint32_t slot)
{
    return path + "." + std::to_string(slot);
}

std::string error_text() { return std::strerror(errno); }

/// Size of a file in whole blocks, at most what the largest map needs. 0: there is no file.
uint32_t whole_blocks(int fd)
{
    constexpr uint32_t kMost = GPOM_SNAPSHOT_SLOT_BYTES(GPOM_BEAM_MAX);
    struct stat about = {};
    if (fd < 0 || fstat(fd, &about) != 0) {
        return 0;
    }
    return static_cast<uint32_t>(std::min<off_t>(about.st_size, kMost) / kBlock * kBlock);
}

} // namespace

SnapshotFile::SnapshotFile(const std::string &path, uint32_t beam_max, bool for_writing)
    : path_(path), need_bytes_(GPOM_SNAPSHOT_SLOT_BYTES(beam_max)), slot_bytes_(need_bytes_)
{
    try {
        for (uint32_t slot = 0; slot < 2; ++slot) {
            open_slot(slot, for_writing ? O_RDWR | O_CREAT | O_NOFOLLOW : O_RDONLY);
            if (for_writing) {
                lock_slot(slot);
            }
            slot_bytes_ = std::max(slot_bytes_, whole_blocks(fds_[slot]));
        }
        if (for_writing) {
            folder_fd_ = open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
            if (folder_fd_ < 0) {
                throw FileError(folder_of(path), 0, "cannot open: " + error_text());
            }
        }
    } catch (...) {
        close_all();
        throw;
    }
}

/// Open PATH.slot. If it is opened for reading, it need not exist. O_NONBLOCK makes open() return
/// at once for a pipe, which is then refused.
void SnapshotFile::open_slot(uint32_t slot, int flags)
{
    const std::string name = name_of(path_, slot);
    const bool may_lack = (flags & O_CREAT) == 0;
    fds_[slot] = open(name.c_str(), flags | O_CLOEXEC | O_NONBLOCK, 0600);
    if (fds_[slot] < 0) {
        if (may_lack && errno == ENOENT) {
            return;
        }
        throw FileError(name, 0,
                        errno == ELOOP ? "is a symbolic link: give the path of the file "
                                         "itself, or remove the link"
                                       : "cannot open: " + error_text());
    }
    struct stat about = {};
    if (fstat(fds_[slot], &about) != 0 || !S_ISREG(about.st_mode)) {
        throw FileError(name, 0, "is no regular file");
    }
}

/// Lock a slot. The system releases the lock when the process ends in any way.
void SnapshotFile::lock_slot(uint32_t slot)
{
    if (flock(fds_[slot], LOCK_EX | LOCK_NB) != 0) {
        throw FileError(name_of(path_, slot), 0,
                        errno == EWOULDBLOCK
                            ? "another process writes its snapshots here; give each its own path, "
                              "or stop the other"
                            : "cannot lock this file");
    }
}

std::string SnapshotFile::keep_larger(uint32_t slot)
{
    if (whole_blocks(fds_[slot]) <= need_bytes_) {
        return "";
    }
    const std::string name = name_of(path_, slot);
    const std::string kept = name + ".larger";
    if (link(name.c_str(), kept.c_str()) != 0) { // link() does not replace a file
        throw FileError(kept, 0,
                        errno == EEXIST
                            ? "keeps another snapshot of a larger map already: move it "
                              "away, or set map.beam_max as it was"
                            : "cannot keep the snapshot of a larger map here: " + error_text());
    }
    if (unlink(name.c_str()) != 0) {
        throw FileError(name, 0, "cannot move: " + error_text());
    }
    close(fds_[slot]);
    open_slot(slot, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW);
    lock_slot(slot);
    return kept;
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

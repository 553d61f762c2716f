// Snapshots of a map in two files: the storage that gpom/snapshot.h needs, with POSIX.
#ifndef GPOM_PORTS_HOST_SNAPSHOT_FILE_HPP
#define GPOM_PORTS_HOST_SNAPSHOT_FILE_HPP

#include "gpom/snapshot.h"

#include <string>

namespace gpom_tools
{

/// The two slots PATH.0 and PATH.1. Blocks are written in place. A temporary file is not needed,
/// because the snapshot in the other slot stays whole. The last flush is fsync() of the slot and of
/// its folder. A snapshot that was reported as done therefore survives a loss of power, as far as
/// the disk itself writes what it reports. Both files are locked, so that only one process writes.
/// For writing they are made readable by their owner only, because a map shows where people live
/// and work. Links are not followed, so that a path in another user's folder cannot lead to another
/// file.
class SnapshotFile {
public:
    /// Open, and for writing create and lock, both files. Throws FileError.
    SnapshotFile(const std::string &path, uint32_t beam_max, bool for_writing);
    ~SnapshotFile();
    SnapshotFile(const SnapshotFile &) = delete;
    SnapshotFile &operator=(const SnapshotFile &) = delete;

    /// Access for gpom_snapshot_write_begin() and gpom_snapshot_read_begin(). This object must
    /// outlive its use. The slots are as long as the longer file, and at least as long as beam_max
    /// beams need. So a snapshot of a larger map can be read, too.
    gpom_snapshot_io_t io();

    /// Call this before a slot is written. If its file is longer than beam_max beams need, the file
    /// is kept as PATH.SLOT.larger and a new one begins. Returns the new name, or an empty string.
    /// Throws FileError, also if a file of this name exists.
    std::string keep_larger(uint32_t slot);

private:
    void open_slot(uint32_t slot, int flags);
    void lock_slot(uint32_t slot);
    static gpom_status_t read(void *ctx, uint32_t slot, uint32_t offset_bytes, uint8_t *block);
    static gpom_status_t write(void *ctx, uint32_t slot, uint32_t offset_bytes,
                               const uint8_t *block);
    static gpom_status_t flush(void *ctx, uint32_t slot);
    void close_all();

    std::string path_;
    uint32_t need_bytes_; ///< Size of a slot for beam_max beams.
    uint32_t slot_bytes_;
    int fds_[2] = {-1, -1}; ///< -1: the file does not exist, which reads as damaged.
    int folder_fd_ = -1;    ///< -1: not for writing.
};

} // namespace gpom_tools

#endif

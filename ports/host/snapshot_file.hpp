// Snapshots of a map in two files, for hosts: what gpom/snapshot.h asks of a medium, with POSIX.
#ifndef GPOM_PORTS_HOST_SNAPSHOT_FILE_HPP
#define GPOM_PORTS_HOST_SNAPSHOT_FILE_HPP

#include "gpom/snapshot.h"

#include <string>

namespace gpom_tools
{

/// The two slots PATH.0 and PATH.1. Blocks are written in place: no temporary file is needed, since
/// the snapshot in the other slot stays whole. The flush at the end is fsync() of the slot and of
/// its folder, so that a snapshot that was reported as done is there after a loss of power, as far
/// as the disk keeps its word. One process at a time may write: both are locked. For writing they
/// are made readable by their owner alone, as a map shows where people live and work; links are not
/// followed, so that a path in a folder of others writes to no other file.
class SnapshotFile {
public:
    /// Open, and for writing create and lock, both files. Throws FileError.
    SnapshotFile(const std::string &path, uint32_t beam_max, bool for_writing);
    ~SnapshotFile();
    SnapshotFile(const SnapshotFile &) = delete;
    SnapshotFile &operator=(const SnapshotFile &) = delete;

    /// For gpom_snapshot_write_begin() and gpom_snapshot_read_begin(); this object must stay. Its
    /// slots are as long as the longest file, but no shorter than beam_max beams need: a snapshot
    /// of a larger map is read, too.
    gpom_snapshot_io_t io();

    /// Before a slot is written: if its file is longer than beam_max beams need, keep it as
    /// PATH.SLOT.larger and begin a new one. Returns that name, or nothing. Throws FileError, also
    /// if there is such a file already.
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
    uint32_t need_bytes_; ///< Of a slot for beam_max beams.
    uint32_t slot_bytes_;
    int fds_[2] = {-1, -1}; ///< -1: not there, which reads as damaged.
    int folder_fd_ = -1;    ///< -1: not for writing.
};

} // namespace gpom_tools

#endif

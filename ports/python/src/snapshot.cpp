// Snapshots as bytes.
#include "ports/python/src/parts.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace gpom_python
{

namespace
{

constexpr std::uint32_t kBlock = GPOM_SNAPSHOT_BLOCK_BYTES;
/// Blocks of one call; only one call is made for a map, so all that a map can have.
constexpr std::uint32_t kAllBlocks = UINT32_MAX;

/// The two slots of a snapshot, in memory. A slot that was never written reads as damaged.
struct MemorySlots {
    std::array<std::vector<std::uint8_t>, 2> slots;

    static gpom_status_t read(void *ctx, std::uint32_t slot, std::uint32_t offset,
                              std::uint8_t *block)
    {
        const std::vector<std::uint8_t> &bytes = static_cast<MemorySlots *>(ctx)->slots[slot];
        if (bytes.size() < std::size_t{offset} + kBlock) {
            return GPOM_ERR_IO;
        }
        std::memcpy(block, bytes.data() + offset, kBlock);
        return GPOM_OK;
    }
    static gpom_status_t write(void *ctx, std::uint32_t slot, std::uint32_t offset,
                               const std::uint8_t *block)
    {
        std::vector<std::uint8_t> &bytes = static_cast<MemorySlots *>(ctx)->slots[slot];
        bytes.resize(std::max(bytes.size(), std::size_t{offset} + kBlock));
        std::memcpy(bytes.data() + offset, block, kBlock);
        return GPOM_OK;
    }
    std::uint32_t slot_bytes(std::uint32_t least) const
    {
        const std::size_t longest = std::max(slots[0].size(), slots[1].size());
        return std::max(least, static_cast<std::uint32_t>(
                                   std::min<std::size_t>(longest, UINT32_MAX / kBlock * kBlock)));
    }
    gpom_snapshot_io_t io(std::uint32_t beam_max)
    {
        return {this, slot_bytes(GPOM_SNAPSHOT_SLOT_BYTES(beam_max)), &read, &write, nullptr};
    }
};

nb::bytes snapshot(const Map &map)
{
    MemorySlots memory;
    gpom_snapshot_t writing;
    const gpom_snapshot_io_t io = memory.io(map.config.beam_max);
    require(reading(map,
                    [&] {
                        gpom_status_t status = gpom_snapshot_write_begin(&writing, map.map, &io);
                        while (status == GPOM_OK && writing.report.is_done == 0) {
                            status = gpom_snapshot_write_step(&writing, map.map, kAllBlocks);
                        }
                        return status;
                    }),
            "snapshot");
    const std::vector<std::uint8_t> &bytes = memory.slots[writing.report.slot];
    return nb::bytes(bytes.data(), bytes.size());
}

std::vector<std::uint8_t> vector_of_bytes(const nb::bytes &bytes)
{
    const auto *const first = static_cast<const std::uint8_t *>(bytes.data());
    return {first, first + bytes.size()};
}

nb::dict restore(Map &map, const nb::bytes &bytes, const nb::bytes &other)
{
    MemorySlots memory = {{vector_of_bytes(bytes), vector_of_bytes(other)}};
    gpom_snapshot_t snap;
    const gpom_snapshot_io_t io = memory.io(map.config.beam_max);
    require(changing(map,
                     [&] {
                         gpom_status_t status = gpom_snapshot_read_begin(&snap, map.map, &io);
                         while (status == GPOM_OK && snap.report.is_done == 0) {
                             status = gpom_snapshot_read_step(&snap, map.map, kAllBlocks);
                         }
                         return status;
                     }),
            "restore");
    nb::dict report;
    report["n_beams"] = snap.report.n_beams;
    report["n_dropped"] = snap.report.n_dropped;
    report["sequence"] = snap.report.sequence;
    report["params_differ"] = snap.report.params_differ != 0;
    return report;
}

} // namespace

void add_snapshots(nb::class_<Map> &map)
{
    map.def("snapshot", &snapshot,
            "The map as bytes: one slot of gpom/snapshot.h, the same on every processor. gpomd\n"
            "reads it as a file NAME.0. The configuration and the low-resolution map are not in "
            "it.");
    map.def("restore", &restore, nb::arg("snapshot"), nb::arg("other") = nb::bytes("", 0),
            "Replace the map's beams by those of a snapshot; of two, the newer whole one. Answers\n"
            "are those of the written map, bit for bit.\n"
            "Returns a dict: n_beams, n_dropped, sequence, params_differ.\n"
            "Raises Error: neither holds a whole snapshot; the map is unchanged.");
}

} // namespace gpom_python

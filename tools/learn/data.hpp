// What is learnt from: beams of logs and streets, and places whose occupancy is known.
#ifndef GPOM_TOOLS_LEARN_DATA_HPP
#define GPOM_TOOLS_LEARN_DATA_HPP

#include "ports/host/scan_log.hpp"
#include "tools/learn/neighbours.hpp"
#include "tools/map/host_map.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace gpom_tools
{

struct LearnSource {
    std::string scans_path;
    std::string truth_path; ///< Empty: places on the beams themselves.
};

struct DataOptions {
    ReadOptions reading;
    double first_m = 0.0;       ///< Only this much of the way driven; 0: all.
    double fraction = 1.0;      ///< Share of the beams that make a map which keeps them all.
    std::size_t n_places = 0;   ///< To learn from, of each source.
    std::size_t n_held_out = 0; ///< To judge by, of each source that has any.
    std::uint64_t seed = 0;
    LiveConfig live;                          ///< Of live_data().
    double gap_m = 0.05;                      ///< Of the live map; it keeps almost the same beams
                                              ///< with any other.
    std::optional<std::uint64_t> training_of; ///< Of a log only the returns that split_log() with
                                              ///< kTrainingShareMax and this seed trains with.
};

struct LearnData {
    std::vector<LearnWorld> worlds;
    std::vector<LearnPlace> learning;
    std::vector<LearnPlace> held_out;
    std::vector<LearnPlace> anywhere; ///< Of the streets to learn from, over the whole area.
    std::string how_held_out;         ///< A phrase for reports.
};

/// Places on whole beams left out, as gpom-eval draws its own (protocol.hpp). At most 600 scans a
/// log, evenly taken, of which every return makes the map with the probability `fraction` (drawn as
/// split_log() does). To learn from: beams of the map, in four fifths of the scans. Held out: any
/// returns in the other fifth, in runs. A place's own beam is never in its neighbourhood.
/// Throws std::runtime_error or FileError.
LearnData log_data(const std::vector<LearnSource> &sources, const DataOptions &options);

/// Places as log_data() draws them, in live maps of the logs: nine returns in ten of all scans in
/// their order go into a live map, whose kept beams are what is learnt on; the tenth gives the
/// places, in four fifths of the scans to learn from, in the other fifth, in runs, to judge by.
/// Throws std::runtime_error or FileError.
LearnData live_data(const std::vector<LearnSource> &sources, const DataOptions &options);

/// Random places within kNearBeam of a beam with their true occupancy, and as many anywhere on the
/// streets to learn from. Held out: the last street, or of a single one the places whose nearest
/// scan lies in a fifth of the scans, in runs.
LearnData street_data(const std::vector<LearnSource> &sources, const DataOptions &options);

/// Runs of consecutive scans, every fifth of 15 held out.
bool is_held_out(std::size_t i_scan, std::size_t n_scans);

} // namespace gpom_tools

#endif

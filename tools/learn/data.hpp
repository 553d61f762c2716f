// The data to learn from: beams of logs and streets, and places whose occupancy is known.
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
    std::string truth_path;       ///< Empty: the places lie on the beams themselves.
    std::vector<Scan> scans = {}; ///< In place of a file, if there are any; the path is their name.
};

struct DataOptions {
    ReadOptions reading;
    double first_m = 0.0;       ///< Use only this first part of the way. 0: the whole way.
    double fraction = 1.0;      ///< Share of the beams in a map that keeps all of its beams.
    std::size_t n_places = 0;   ///< Places to learn from, for each source.
    std::size_t n_held_out = 0; ///< Places to judge by, for each source that has held-out places.
    std::uint64_t seed = 0;
    LiveConfig live;                          ///< Settings of the live map, for live_data().
    double gap_m = 0.05;                      ///< gap_m of the live map. With another gap the map
                                              ///< keeps almost the same beams.
    std::optional<std::uint64_t> training_of; ///< Use only those returns of a log that split_log()
                                              ///< with kTrainingShareMax and this seed uses for
                                              ///< training.
};

struct LearnData {
    std::vector<LearnWorld> worlds;
    std::vector<LearnPlace> learning;
    std::vector<LearnPlace> held_out;
    std::vector<LearnPlace> anywhere; ///< For streets: places to learn from in the whole area.
    std::string how_held_out;         ///< How places were held out, as a phrase for reports.
};

/// Places on left-out beams, drawn as gpom-eval draws its test points (protocol.hpp). Takes at most
/// 600 scans of a log, evenly. Every return goes into the map with the probability `fraction`, as
/// in split_log(). Places to learn from lie on beams of the map, in four fifths of the scans.
/// Held-out places lie on any returns in the other fifth, in runs. A place's own beam is never in
/// its neighbourhood. Throws std::runtime_error or FileError.
LearnData log_data(const std::vector<LearnSource> &sources, const DataOptions &options);

/// Places drawn as by log_data(), in live maps of the logs. Nine of ten returns of all scans go
/// into a live map, in order. The model is learnt on the kept beams of this map. The other returns
/// give the places: in four fifths of the scans to learn from, in the other fifth, in runs, to
/// judge by. Throws std::runtime_error or FileError.
LearnData live_data(const std::vector<LearnSource> &sources, const DataOptions &options);

/// Random places within kNearBeam of a beam with their true occupancy, and the same number anywhere
/// on the streets. Held out is the last street. With a single street it is the places whose nearest
/// scan lies in a fifth of the scans, in runs.
LearnData street_data(const std::vector<LearnSource> &sources, const DataOptions &options);

/// True for every fifth run of 15 runs of consecutive scans.
bool is_held_out(std::size_t i_scan, std::size_t n_scans);

} // namespace gpom_tools

#endif

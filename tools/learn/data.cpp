#include "tools/learn/data.hpp"

#include "tools/eval/protocol.hpp"
#include "tools/eval/stretch.hpp"
#include "tools/sim/truth.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace gpom_tools
{
namespace
{

constexpr std::size_t kRuns = 15;
constexpr std::size_t kHitsMin = 50; ///< Fewer returns are not enough to learn from.
/// Offset of the seed for live splits, so that they differ from those of gpom-live judge with usual
/// seeds.
constexpr std::uint64_t kLiveSplitSeed = 1000;
/// Random cells tried for each place near a beam.
constexpr std::size_t kTriesPerPlace = 200;
/// Random stream for places anywhere.
constexpr std::uint64_t kAnywhereSeed = 3000;

LearnBeam beam_of(const Scan &scan, std::size_t i_scan, std::size_t i_beam)
{
    const double bearing_rad =
        scan.theta_rad + scan.angle_min_rad + static_cast<double>(i_beam) * scan.angle_step_rad;
    const double range_m = double{scan.ranges_m[i_beam]};
    const bool hit = range_m < scan.range_max_m;
    return {scan.x_m,
            scan.y_m,
            std::cos(bearing_rad),
            std::sin(bearing_rad),
            hit ? range_m : scan.range_max_m,
            i_scan,
            hit};
}

/// Read the part of a log that is used for learning.
std::vector<Scan> read_source(const LearnSource &source, const DataOptions &options)
{
    std::vector<Scan> scans =
        source.scans.empty() ? read_log(source.scans_path, options.reading) : source.scans;
    return options.training_of ? split_log(scans, kTrainingShareMax, *options.training_of).training
                               : scans;
}

/// Take some scans of a log evenly, and only then cut the first part of the way. So the scans of
/// this part are as dense as those of the whole log.
std::vector<Scan> scans_of(const LearnSource &source, const DataOptions &options)
{
    const bool is_log = source.truth_path.empty();
    return first_metres(is_log ? evenly_taken(read_source(source, options), kLogScansMax)
                        : source.scans.empty() ? read_scans(source.scans_path, options.reading)
                                               : source.scans,
                        options.first_m);
}

void require_hits(const LearnSource &source, const LearnWorld &world)
{
    const auto n_hits = static_cast<std::size_t>(
        std::count_if(world.begin(), world.end(), [](const LearnBeam &beam) { return beam.hit; }));
    if (n_hits < kHitsMin) {
        throw std::runtime_error(source.scans_path + ": only " + std::to_string(n_hits) +
                                 " hits to learn from, " + std::to_string(kHitsMin) +
                                 " needed; give more scans or a larger --fraction");
    }
}

/// A return, and its beam in the map, or kNoBeam.
struct Return {
    LearnBeam beam;
    std::size_t in_map;
};

enum class Place { kOccupied, kFree, kFreeInBand };

LearnPlace place_on(const Return &chosen, Place kind, std::size_t i_world, ProtocolRandom &random)
{
    const LearnBeam &beam = chosen.beam;
    const bool occupied = kind == Place::kOccupied;
    const double along_m =
        occupied ? beam.range_m + kBeyondReturn
                 : free_distance(beam.range_m, kind == Place::kFreeInBand, random.uniform());
    return {beam.x_m + along_m * beam.dir_x, beam.y_m + along_m * beam.dir_y, occupied, i_world,
            chosen.in_map};
}

void draw_places(std::vector<LearnPlace> &places, const std::vector<Return> &returns, std::size_t n,
                 std::size_t i_world, ProtocolRandom &random)
{
    constexpr Place kInTurn[] = {Place::kOccupied, Place::kFree, Place::kOccupied,
                                 Place::kFreeInBand};
    for (std::size_t i = 0; i < n && !returns.empty(); ++i) {
        const Return &chosen = returns[random.below(returns.size())];
        places.push_back(place_on(chosen, kInTurn[i % 4], i_world, random));
    }
}

void add_log(LearnData &data, const LearnSource &source, const DataOptions &options)
{
    const std::vector<Scan> scans = scans_of(source, options);
    ProtocolRandom random(options.seed);
    LearnWorld world;
    std::vector<Return> learning, held_out;
    for (std::size_t i_scan = 0; i_scan < scans.size(); ++i_scan) {
        const Scan &scan = scans[i_scan];
        const bool out = is_held_out(i_scan, scans.size());
        for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
            const double range_m = double{scan.ranges_m[i]};
            if (!(range_m > kLogRangeMin && range_m < scan.range_max_m)) {
                continue;
            }
            const LearnBeam beam = beam_of(scan, i_scan, i);
            const bool in_map = random.uniform() < options.fraction;
            const std::size_t id = in_map ? world.size() : kNoBeam;
            if (in_map) {
                world.push_back(beam);
            }
            if (out) {
                held_out.push_back({beam, id});
            } else if (in_map) {
                learning.push_back({beam, id});
            }
        }
    }
    require_hits(source, world);
    ProtocolRandom places(options.seed + 1);
    draw_places(data.learning, learning, options.n_places, data.worlds.size(), places);
    draw_places(data.held_out, held_out, options.n_held_out, data.worlds.size(), places);
    data.worlds.push_back(std::move(world));
}

/// Insert the scans into a live map in order, and return its kept beams as queries see them.
LearnWorld live_world(const std::vector<Scan> &scans, const DataOptions &options)
{
    gpom_params_t params;
    gpom_params_init(&params);
    params.gap_m = static_cast<float>(options.gap_m);
    HostMap map(live_config(params, options.live, middle_of(scans)), options.live.late_m);
    for (const Scan &scan : scans) {
        map.insert(scan);
        map.step(options.live.step_ops);
    }
    std::vector<gpom_beam_t> kept = map.kept();
    std::sort(kept.begin(), kept.end(),
              [](const gpom_beam_t &a, const gpom_beam_t &b) { return a.id < b.id; });
    LearnWorld world;
    for (const gpom_beam_t &beam : kept) {
        const bool hit = beam.is_hit != 0 && beam.provisional == 0;
        const HitNoise noise = beam.past != 0       ? HitNoise::kPast
                               : beam.n_agreed == 0 ? HitNoise::kOnce
                                                    : HitNoise::kSeen;
        world.push_back({beam.x_m, beam.y_m, double{beam.dir_x}, double{beam.dir_y},
                         double{beam.range_m}, static_cast<std::size_t>(beam.stamp_us), hit,
                         beam.returned != 0, beam.is_free != 0, noise});
    }
    return world;
}

void add_live(LearnData &data, const LearnSource &source, const DataOptions &options)
{
    const std::vector<Scan> scans = first_metres(read_source(source, options), options.first_m);
    const LogSplit split = split_log(scans, kTrainingShareMax, options.seed + kLiveSplitSeed);
    LearnWorld world = live_world(split.training, options);
    require_hits(source, world);
    std::vector<Return> learning, held_out;
    for (std::size_t i_scan = 0; i_scan < scans.size(); ++i_scan) {
        const std::vector<float> &ranges_m = split.others[i_scan].ranges_m;
        for (std::size_t i = 0; i < ranges_m.size(); ++i) {
            if (ranges_m[i] > 0.0F) { // not NaN: a return of the held-out tenth
                const LearnBeam beam = beam_of(scans[i_scan], i_scan, i);
                (is_held_out(i_scan, scans.size()) ? held_out : learning)
                    .push_back({beam, kNoBeam});
            }
        }
    }
    ProtocolRandom places(options.seed + 1);
    draw_places(data.learning, learning, options.n_places, data.worlds.size(), places);
    draw_places(data.held_out, held_out, options.n_held_out, data.worlds.size(), places);
    data.worlds.push_back(std::move(world));
}

/// Both parts must have occupied and free places.
LearnData checked(LearnData data)
{
    for (const auto *places : {&data.learning, &data.held_out}) {
        const auto n = static_cast<std::size_t>(
            std::count_if(places->begin(), places->end(),
                          [](const LearnPlace &place) { return place.occupied; }));
        if (n == 0 || n == places->size()) {
            throw std::runtime_error(std::string("no ") + (n == 0 ? "occupied" : "free") +
                                     " places to " +
                                     (places == &data.learning ? "learn from" : "judge by") +
                                     "; give more scans: a fifth of them is held out, in runs");
        }
    }
    return data;
}

std::size_t nearest_scan(const std::vector<Scan> &scans, const LearnPlace &place)
{
    const auto nearer = [&](const Scan &a, const Scan &b) {
        return std::hypot(a.x_m - place.x_m, a.y_m - place.y_m) <
               std::hypot(b.x_m - place.x_m, b.y_m - place.y_m);
    };
    return static_cast<std::size_t>(std::min_element(scans.begin(), scans.end(), nearer) -
                                    scans.begin());
}

/// Random places near beams, with their true occupancy.
std::vector<LearnPlace> near_places(const LearnSource &source, const std::vector<Scan> &scans,
                                    std::size_t n, std::uint64_t seed)
{
    const std::vector<GridBeam> beams = beams_of(scans, kHalfSpacing);
    std::vector<LearnPlace> places;
    for (const TestPoint &point :
         street_points(read_truth(source.truth_path), n * kTriesPerPlace, seed)) {
        if (places.size() == n) {
            break;
        }
        if (is_near(point.at, beams, kNearBeam)) {
            places.push_back({point.at.x_m, point.at.y_m, point.occupied, 0, kNoBeam});
        }
    }
    if (places.size() < n) {
        throw std::runtime_error(source.truth_path +
                                 ": hardly any of it is within 5 m of a beam "
                                 "of " +
                                 source.scans_path);
    }
    return places;
}

void add_street(LearnData &data, const LearnSource &source, const DataOptions &options,
                std::size_t n_sources)
{
    const std::vector<Scan> scans = scans_of(source, options);
    const std::size_t i_world = data.worlds.size();
    ProtocolRandom random(options.seed);
    LearnWorld world;
    for (std::size_t i_scan = 0; i_scan < scans.size(); ++i_scan) {
        for (std::size_t i = 0; i < scans[i_scan].ranges_m.size(); ++i) {
            if (scans[i_scan].ranges_m[i] > 0.0F && random.uniform() < options.fraction) {
                world.push_back(beam_of(scans[i_scan], i_scan, i));
            }
        }
    }
    require_hits(source, world);
    const bool all_out = n_sources > 1 && i_world + 1 == n_sources;
    const std::size_t n = all_out ? options.n_held_out : options.n_places;
    for (LearnPlace &place : near_places(source, scans, n, options.seed + i_world + 1)) {
        const bool out =
            n_sources > 1 ? all_out : is_held_out(nearest_scan(scans, place), scans.size());
        place.i_world = i_world;
        (out ? data.held_out : data.learning).push_back(place);
    }
    for (const TestPoint &point : street_points(read_truth(source.truth_path), all_out ? 0 : n,
                                                options.seed + kAnywhereSeed + i_world)) {
        data.anywhere.push_back({point.at.x_m, point.at.y_m, point.occupied, i_world, kNoBeam});
    }
    data.worlds.push_back(std::move(world));
}

} // namespace

bool is_held_out(std::size_t i_scan, std::size_t n_scans)
{
    const std::size_t run = std::max<std::size_t>(n_scans / kRuns, 1);
    return i_scan / run % 5 == 2;
}

LearnData log_data(const std::vector<LearnSource> &sources, const DataOptions &options)
{
    LearnData data;
    data.how_held_out = "beams of a fifth of the scans, in runs";
    for (const LearnSource &source : sources) {
        add_log(data, source, options);
    }
    return checked(std::move(data));
}

LearnData live_data(const std::vector<LearnSource> &sources, const DataOptions &options)
{
    LearnData data;
    data.how_held_out = "beams of a fifth of the scans, in runs";
    for (const LearnSource &source : sources) {
        add_live(data, source, options);
    }
    return checked(std::move(data));
}

LearnData street_data(const std::vector<LearnSource> &sources, const DataOptions &options)
{
    LearnData data;
    data.how_held_out = sources.size() > 1 ? "places of the last street"
                                           : "places near a fifth of the scans, in runs";
    for (const LearnSource &source : sources) {
        add_street(data, source, options, sources.size());
    }
    return checked(std::move(data));
}

} // namespace gpom_tools

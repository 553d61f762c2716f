#include "tools/eval/profile.hpp"

#include "tools/eval/surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gpom_tools
{
namespace
{

/// Profiles use a random stream of their own, so that other users of the seed are not affected.
constexpr std::uint64_t kProfileSeed = 3000;

/// A grid stores log odds in single precision, so its probability after one return, 0.7 for
/// OctoMap, is not exact.
constexpr double kRounding = 1e-6;

constexpr double kDistanceRounding = 1e-9; ///< Rounding error of offsets [m].

std::optional<double> crossing_of(const std::vector<ProfileRow> &rows)
{
    for (std::size_t i = 1; i < rows.size(); ++i) {
        const double before = rows[i - 1].mean_probability - 0.5;
        const double here = rows[i].mean_probability - 0.5;
        if (before < 0.0 && here >= 0.0) {
            const double share = before / (before - here);
            return rows[i - 1].offset_m + share * (rows[i].offset_m - rows[i - 1].offset_m);
        }
    }
    return std::nullopt;
}

bool is_inside(const Truth &truth, gpom_point_t at)
{
    const double u = (at.x_m - truth.x0_m) / truth.cell_m, v = (at.y_m - truth.y0_m) / truth.cell_m;
    return u >= 0.0 && v >= 0.0 && u < truth.nx && v < truth.ny;
}

/// Add the places of one surface, in order of distance.
void add_across(const SurfacePlace &surface, const Truth &truth, std::vector<ProfilePlace> &places)
{
    for (std::size_t i = 0; i < kProfileOffsets.size(); ++i) {
        const double offset_m = kProfileOffsets[i];
        const gpom_point_t at = {surface.at.x_m + offset_m * surface.normal_x,
                                 surface.at.y_m + offset_m * surface.normal_y};
        const double reach_m = std::abs(offset_m) + truth.cell_m;
        if (is_inside(truth, at) &&
            std::abs(signed_distance(truth, at, reach_m) - offset_m) < kDistanceRounding) {
            places.push_back({at, i});
        }
    }
}

} // namespace

std::vector<ProfilePlace> profile_along(std::vector<GridBeam> beams, std::uint64_t seed)
{
    ProtocolRandom random(seed + kProfileSeed);
    beams.erase(
        std::remove_if(beams.begin(), beams.end(), [](const GridBeam &beam) { return !beam.hit; }),
        beams.end());
    const std::size_t n = std::min(kProfileSurfaces, beams.size());
    choose_first(beams, n, random);
    beams.resize(n);
    std::vector<ProfilePlace> places;
    for (GridBeam beam : beams) {
        const double return_m = beam.range_m;
        for (std::size_t i = 0; i < kProfileOffsets.size(); ++i) {
            beam.range_m = return_m + kProfileOffsets[i];
            if (beam.range_m > 0.0) {
                places.push_back({end_of(beam), i});
            }
        }
    }
    return places;
}

std::vector<ProfilePlace> profile_across(const Truth &truth, const std::vector<Scan> &scans,
                                         std::uint64_t seed)
{
    ProtocolRandom random(seed + kProfileSeed);
    std::vector<SurfacePlace> surfaces = surface_places(truth);
    choose_first(surfaces, surfaces.size(), random);
    std::vector<ProfilePlace> places;
    std::size_t n_seen = 0;
    for (SurfacePlace &surface : surfaces) {
        if (n_seen == kProfileSurfaces) {
            break;
        }
        if (is_in_view(surface, truth, scans)) {
            const double along_m = (random.uniform() - 0.5) * truth.cell_m;
            surface.at.x_m += along_m * surface.normal_y;
            surface.at.y_m += along_m * surface.normal_x;
            add_across(surface, truth, places);
            ++n_seen;
        }
    }
    return places;
}

Profile profile_of(const std::vector<ProfilePlace> &places,
                   const std::vector<double> &probabilities)
{
    Profile profile;
    for (const double offset_m : kProfileOffsets) {
        profile.rows.push_back({offset_m, 0, 0.0, 0.0, 0.0});
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
        const double p = probabilities[i];
        ProfileRow &row = profile.rows[places[i].i_offset];
        ++row.n_places;
        row.mean_probability += p;
        row.share_free += p <= kProfileFree + kRounding ? 1.0 : 0.0;
        row.share_occupied += p >= kProfileOccupied - kRounding ? 1.0 : 0.0;
    }
    profile.rows.erase(std::remove_if(profile.rows.begin(), profile.rows.end(),
                                      [](const ProfileRow &row) { return row.n_places == 0; }),
                       profile.rows.end());
    for (ProfileRow &row : profile.rows) {
        const double n = static_cast<double>(row.n_places);
        row.mean_probability /= n;
        row.share_free /= n;
        row.share_occupied /= n;
    }
    profile.crossing_m = crossing_of(profile.rows);
    return profile;
}

std::vector<gpom_point_t> places_of(const TestSet &test)
{
    std::vector<gpom_point_t> places = places_of(test.points);
    for (const ProfilePlace &place : test.profile) {
        places.push_back(place.at);
    }
    return places;
}

} // namespace gpom_tools

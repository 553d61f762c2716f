#include "ports/host/laser_angles.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gpom_tools
{
namespace
{

struct UsualLaser {
    std::size_t n_beams;
    double first_deg;
    double step_deg;
};

constexpr double kUrgStep_deg = 360.0 / 1024.0;
constexpr UsualLaser kUsualLasers[] = {
    // SICK LMS 2xx with its narrow field of view
    {100, -50.0, 1.0},
    {101, -50.0, 1.0},
    {200, -50.0, 0.5},
    {201, -50.0, 0.5},
    {400, -50.0, 0.25},
    {401, -50.0, 0.25},
    // SICK LMS 2xx and PLS
    {180, -90.0, 1.0},
    {181, -90.0, 1.0},
    {360, -90.0, 0.5},
    {361, -90.0, 0.5},
    // SICK LMS 5xx
    {381, -95.0, 0.5},
    {761, -95.0, 0.25},
    // SICK TiM
    {271, -135.0, 1.0},
    {811, -135.0, 1.0 / 3.0},
    // SICK S300, LMS 1xx
    {540, -135.0, 0.5},
    {541, -135.0, 0.5},
    // SICK LMS 1xx, Hokuyo UTM-30LX and UST
    {1080, -135.0, 0.25},
    {1081, -135.0, 0.25},
    // Hokuyo URG-04LX. Its data sheet gives steps 44 to 725, with step 384 ahead. The last line has
    // all steps
    {682, -340.0 * kUrgStep_deg, kUrgStep_deg},
    {683, -340.0 * kUrgStep_deg, kUrgStep_deg},
    {768, -384.0 * kUrgStep_deg, kUrgStep_deg},
    {769, -384.0 * kUrgStep_deg, kUrgStep_deg},
};

/// Number of steps from the first beam to the end of the field of view.
double steps_of(std::size_t n_beams)
{
    const std::size_t n_steps = n_beams % 2 == 0 ? n_beams : n_beams - 1;
    return static_cast<double>(std::max<std::size_t>(n_steps, 1));
}

} // namespace

LaserAngles angles_over(double fov_rad, std::size_t n_beams)
{
    return {-0.5 * fov_rad, fov_rad / steps_of(n_beams)};
}

double angle_of(double step_rad, std::size_t n_beams) { return step_rad * steps_of(n_beams); }

bool do_angles_fit(double fov_rad, double step_rad, std::size_t n_beams)
{
    constexpr double kTurn_rad = 360.5 * kDegree; // a file may round a whole turn up
    const double n_steps = fov_rad / step_rad;
    return step_rad > 0.0 && fov_rad <= kTurn_rad &&
           std::abs(n_steps + 0.5 - static_cast<double>(n_beams)) < 1.0;
}

std::optional<LaserAngles> usual_angles(std::size_t n_beams)
{
    const auto *const end = std::end(kUsualLasers);
    const auto *const found = std::find_if(
        std::begin(kUsualLasers), end, [&](const UsualLaser &u) { return u.n_beams == n_beams; });
    if (found == end) {
        return {};
    }
    return LaserAngles{found->first_deg * kDegree, found->step_deg * kDegree};
}

} // namespace gpom_tools

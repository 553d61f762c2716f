// Where the beams of a laser point, by the log or by their number.
#ifndef GPOM_PORTS_HOST_LASER_ANGLES_HPP
#define GPOM_PORTS_HOST_LASER_ANGLES_HPP

#include <cstddef>
#include <optional>

namespace gpom_tools
{

constexpr double kDegree = 3.14159265358979323846 / 180.0; ///< [rad]

/// Bearing of the first beam, and step to the next one, counter-clockwise from the laser's front.
struct LaserAngles {
    double first_rad;
    double step_rad;
};

/// Angles of beams over a field of view that is symmetrical about the front. An even number of
/// beams leaves out the last beam.
LaserAngles angles_over(double fov_rad, std::size_t n_beams);

/// The field of view of this number of beams with this step.
double angle_of(double step_rad, std::size_t n_beams);

/// True if the step divides the field of view into this number of beams, with the last one or
/// without it.
bool do_angles_fit(double fov_rad, double step_rad, std::size_t n_beams);

/// Angles of the usual laser with this number of beams. Empty: there is no such laser.
std::optional<LaserAngles> usual_angles(std::size_t n_beams);

} // namespace gpom_tools

#endif

// Where the beams of a laser point, by what a log says of it or by their number.
#ifndef GPOM_PORTS_HOST_LASER_ANGLES_HPP
#define GPOM_PORTS_HOST_LASER_ANGLES_HPP

#include <cstddef>
#include <optional>

namespace gpom_tools
{

constexpr double kDegree = 3.14159265358979323846 / 180.0; ///< [rad]

/// Bearing of the first beam and from each to the next, counter-clockwise from the laser's front.
struct LaserAngles {
    double first_rad;
    double step_rad;
};

/// Of an angle that lies evenly about the front. An even number of beams leaves out the last one.
LaserAngles angles_over(double fov_rad, std::size_t n_beams);

/// The angle that so many beams see with such steps.
double angle_of(double step_rad, std::size_t n_beams);

/// True if such steps divide the angle into so many beams, with the last one or without it.
bool do_angles_fit(double fov_rad, double step_rad, std::size_t n_beams);

/// Of the usual lasers with so many beams; none if there is no such laser.
std::optional<LaserAngles> usual_angles(std::size_t n_beams);

} // namespace gpom_tools

#endif

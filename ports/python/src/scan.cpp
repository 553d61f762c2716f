// Scans: sensors, insertion of arrays, files of text.
#include "ports/python/src/parts.hpp"

#include "ports/host/file_error.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>

namespace gpom_python
{

namespace
{

using Masks = std::vector<std::pair<float, float>>;

void set_masks(Sensor &sensor, const Masks &masks)
{
    sensor.masks.clear();
    for (const auto &[from_rad, to_rad] : masks) {
        sensor.masks.push_back({from_rad, to_rad});
    }
}

Masks masks_of(const Sensor &sensor)
{
    Masks masks;
    for (const gpom_mask_t &mask : sensor.masks) {
        masks.emplace_back(mask.from_rad, mask.to_rad);
    }
    return masks;
}

struct Mount {
    double x_m, y_m, yaw_rad;
};

struct Meanings {
    bool upside_down, zero_is_no_return, too_near_is_no_return;
};

Sensor sensor_of(const Mount &mount, float range_min_m, float range_max_m, float range_var_m2,
                 const Masks &masks, const Meanings &meanings)
{
    Sensor sensor;
    gpom_sensor_init(&sensor.values);
    sensor.values.x_m = mount.x_m;
    sensor.values.y_m = mount.y_m;
    sensor.values.yaw_rad = mount.yaw_rad;
    sensor.values.range_min_m = range_min_m;
    sensor.values.range_max_m = range_max_m;
    sensor.values.range_var_m2 = range_var_m2;
    sensor.values.upside_down = meanings.upside_down;
    sensor.values.zero_is_no_return = meanings.zero_is_no_return;
    sensor.values.too_near_is_no_return = meanings.too_near_is_no_return;
    set_masks(sensor, masks);
    return sensor;
}

template <class Number>
void add_number(nb::class_<Sensor> &type, const char *name, Number gpom_sensor_t::*field,
                const char *doc)
{
    type.def_prop_rw(
        name, [field](const Sensor &s) { return s.values.*field; },
        [field](Sensor &s, Number value) { s.values.*field = value; }, doc);
}

void add_flag(nb::class_<Sensor> &type, const char *name, std::uint8_t gpom_sensor_t::*field,
              const char *doc)
{
    type.def_prop_rw(
        name, [field](const Sensor &s) { return s.values.*field != 0; },
        [field](Sensor &s, bool value) { s.values.*field = value; }, doc);
}

void add_sensor(nb::module_ &module)
{
    nb::class_<Sensor> type(module, "Sensor",
                            "A range sensor and its place on the robot (gpom_sensor_t in "
                            "gpom/scan.h).");
    type.def(
        "__init__",
        [](Sensor *sensor, double x_m, double y_m, double yaw_rad, float range_min_m,
           float range_max_m, float range_var_m2, const Masks &masks, bool upside_down,
           bool zero_is_no_return, bool too_near_is_no_return) {
            new (sensor)
                Sensor(sensor_of({x_m, y_m, yaw_rad}, range_min_m, range_max_m, range_var_m2, masks,
                                 {upside_down, zero_is_no_return, too_near_is_no_return}));
        },
        nb::arg("x_m") = 0.0, nb::arg("y_m") = 0.0, nb::arg("yaw_rad") = 0.0,
        nb::arg("range_min_m") = 0.02f, nb::arg("range_max_m") = 30.0f,
        nb::arg("range_var_m2") = 0.0f, nb::arg("masks") = Masks(), nb::arg("upside_down") = false,
        nb::arg("zero_is_no_return") = false, nb::arg("too_near_is_no_return") = false);
    add_number(type, "x_m", &gpom_sensor_t::x_m, "Mount, robot frame [m].");
    add_number(type, "y_m", &gpom_sensor_t::y_m, "Mount, robot frame [m].");
    add_number(type, "yaw_rad", &gpom_sensor_t::yaw_rad, "Mount, robot frame [rad].");
    add_number(type, "range_min_m", &gpom_sensor_t::range_min_m, "Readings below it are ignored.");
    add_number(type, "range_max_m", &gpom_sensor_t::range_max_m,
               "Usable maximum [m]; a reading at or beyond it is no return.");
    add_number(type, "range_var_m2", &gpom_sensor_t::range_var_m2, "Variance of a range [m2].");
    add_flag(type, "upside_down", &gpom_sensor_t::upside_down, "Bearings run clockwise.");
    add_flag(type, "zero_is_no_return", &gpom_sensor_t::zero_is_no_return,
             "A reading of 0 is no return; else it is ignored.");
    add_flag(type, "too_near_is_no_return", &gpom_sensor_t::too_near_is_no_return,
             "A reading below range_min_m is no return; else it is ignored.");
    type.def_prop_rw("masks", &masks_of, &set_masks,
                     "Bearings (from_rad, to_rad) at which the sensor sees the vehicle [rad].");
}

void insert_scan(Map &map, const nb::handle &ranges, double angle_min_rad, double angle_step_rad,
                 const nb::handle &pose, std::int64_t stamp_us, const Sensor &sensor,
                 const nb::handle &cov)
{
    const Vector<float> ranges_m = vector_of<float>(ranges, "ranges_m");
    const Pose at(pose, cov);
    const gpom_sensor_t laser = sensor.get();
    const gpom_scan_t scan = {stamp_us, angle_min_rad, angle_step_rad, ranges_m.data(),
                              static_cast<std::uint32_t>(ranges_m.size())};
    require(changing(map, [&] { return gpom_scan_insert(map.map, &scan, &laser, at.get()); }),
            "scan of stamp_us " + std::to_string(stamp_us));
}

std::vector<gpom_pose_t> poses_of(const Table<double> &table)
{
    std::vector<gpom_pose_t> poses;
    for (std::size_t i = 0; i < table.shape(0); ++i) {
        const double *const row = table.data() + 3 * i;
        poses.push_back({row[0], row[1], row[2], nullptr});
    }
    return poses;
}

void insert_sweep(Map &map, const nb::handle &ranges, const nb::handle &bearings,
                  const nb::handle &poses, const nb::handle &pose, std::int64_t stamp_us,
                  const Sensor &sensor)
{
    const Vector<float> ranges_m = vector_of<float>(ranges, "ranges_m");
    const Vector<float> bearings_rad = vector_of<float>(bearings, "bearings_rad");
    const std::vector<gpom_pose_t> beam_poses = poses_of(table_of<double>(poses, 3, "poses"));
    if (bearings_rad.size() != ranges_m.size() || beam_poses.size() != ranges_m.size()) {
        refuse_shape("bearings_rad, poses", "as many as ranges_m");
    }
    const Pose at(pose, nb::none());
    const gpom_sensor_t laser = sensor.get();
    const gpom_sweep_t sweep = {stamp_us, ranges_m.data(), bearings_rad.data(), beam_poses.data(),
                                static_cast<std::uint32_t>(ranges_m.size())};
    require(changing(map, [&] { return gpom_sweep_insert(map.map, &sweep, &laser, at.get()); }),
            "sweep of stamp_us " + std::to_string(stamp_us));
}

nb::object read_text_scans(const std::string &path, double range_max_m,
                           std::optional<double> fov_deg, double range_min_m)
{
    gpom_tools::ReadOptions options;
    options.range_max_m = range_max_m;
    options.fov_deg = fov_deg;
    options.range_min_m = range_min_m;
    gpom_tools::ScanLog log;
    {
        nb::gil_scoped_release no_gil;
        log = gpom_tools::read_scan_log(path, options);
    }
    return nb::make_tuple(scan_tuples(log.scans), log.notes);
}

} // namespace

gpom_sensor_t Sensor::get() const
{
    gpom_sensor_t sensor = values;
    sensor.masks = masks.empty() ? nullptr : masks.data();
    sensor.n_masks = static_cast<std::uint16_t>(masks.size());
    return sensor;
}

void add_scans(nb::module_ &module)
{
    add_sensor(module);
    module.def("read_text_scans", &read_text_scans, nb::arg("path"), nb::arg("range_max_m") = 49.0,
               nb::arg("fov_deg") = nb::none(), nb::arg("range_min_m") = 0.02,
               "Scans of a CSV file or CARMEN log, plain, gzipped or bzip2, and notes.");
    module.def(
        "write_text_scans",
        [](const std::string &path, const nb::handle &scans, const std::string &comment) {
            gpom_tools::write_scans_csv(path, tool_scans(scans), comment);
        },
        nb::arg("path"), nb::arg("scans"), nb::arg("comment") = "",
        "Write a CSV file of scans, either whole or not at all.");
}

void add_insertion(nb::class_<Map> &map)
{
    map.def("insert_scan", &insert_scan, nb::arg("ranges_m"), nb::arg("angle_min_rad"),
            nb::arg("angle_step_rad"), nb::arg("pose"), nb::arg("stamp_us") = 0,
            nb::arg("sensor") = sensor_of({0.0, 0.0, 0.0}, 0.02f, 30.0f, 0.0f, {}, {}),
            nb::arg("cov") = nb::none(),
            "Insert a scan (gpom_scan_insert()).\n\n"
            "ranges_m        n ranges, float32 without a copy [m]; NaN: ignored, inf: no return\n"
            "angle_min_rad   bearing of the first range, sensor frame [rad]\n"
            "angle_step_rad  bearing step, negative if clockwise [rad]\n"
            "pose            robot in the map frame: x [m], y [m], yaw [rad]\n"
            "stamp_us        time of measurement [us]\n"
            "cov             3 x 3 covariance of the pose [m2, m rad, rad2]; None: exact\n\n"
            "Raises Error, ValueError (a shape).");
    map.def("insert_sweep", &insert_sweep, nb::arg("ranges_m"), nb::arg("bearings_rad"),
            nb::arg("poses"), nb::arg("pose"), nb::arg("stamp_us") = 0,
            nb::arg("sensor") = sensor_of({0.0, 0.0, 0.0}, 0.02f, 30.0f, 0.0f, {}, {}),
            "Insert a scan whose beams have poses of their own (gpom_sweep_insert()).\n\n"
            "ranges_m      n ranges [m]\n"
            "bearings_rad  n bearings, sensor frame [rad]\n"
            "poses         n x 3: x [m], y [m], yaw [rad] of the robot at each beam\n"
            "pose          x, y, yaw of the robot at stamp_us\n\n"
            "Raises Error, ValueError (a shape).");
}

} // namespace gpom_python

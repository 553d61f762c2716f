// What the parts of the extension share: arrays of NumPy, errors, a map with its memory.
#ifndef GPOM_PORTS_PYTHON_PARTS_HPP
#define GPOM_PORTS_PYTHON_PARTS_HPP

#include "gpom/gpom.h"
#include "ports/host/scan_log.hpp"

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace gpom_python
{

namespace nb = nanobind;

/// A status of the library that is not GPOM_OK. In Python it is gpom.Error.
class StatusError : public std::runtime_error {
public:
    StatusError(gpom_status_t error_status, const std::string &what);
    gpom_status_t status;
};

/// Throw StatusError "what: text of the status" unless the status is GPOM_OK.
void require(gpom_status_t status, const std::string &what);

/// The same for answers: a matrix that is not positive definite, a search that was cut, and a point
/// out of reach are flags of single answers, not errors.
void require_answers(gpom_status_t status);

/// Parameters of Python. A class of its own, because gpom_params_t is a struct of C.
struct Params {
    gpom_params_t values;
};

/// A range sensor with the memory of its masks.
struct Sensor {
    gpom_sensor_t values;
    std::vector<gpom_mask_t> masks;

    /// The sensor as the library takes it; valid while this object lives and stays in place.
    gpom_sensor_t get() const;
};

/// A map in memory of its own. Calls that change it exclude all others; queries run side by side.
/// So threads of Python may share a map.
struct Map {
    explicit Map(const gpom_config_t &map_config);

    gpom_config_t config;
    std::unique_ptr<std::uint64_t[]> memory;
    gpom_map_t *map = nullptr;
    mutable std::shared_mutex mutex;
};

/// Scratch of one call.
class Scratch {
public:
    explicit Scratch(std::size_t n_bytes);
    explicit Scratch(const Map &map) : Scratch(gpom_scratch_bytes(map.map)) {}
    const gpom_scratch_t *get() const { return &scratch_; }

private:
    std::unique_ptr<std::uint8_t[]> memory_;
    gpom_scratch_t scratch_;
};

/// Run a call that changes the map, without the GIL.
template <class Call> auto changing(const Map &map, const Call &call)
{
    nb::gil_scoped_release no_gil;
    std::unique_lock<std::shared_mutex> lock(map.mutex);
    return call();
}

/// Run a call that only reads the map, without the GIL.
template <class Call> auto reading(const Map &map, const Call &call)
{
    nb::gil_scoped_release no_gil;
    std::shared_lock<std::shared_mutex> lock(map.mutex);
    return call();
}

// --- Arrays ------------------------------------------------------------------------------------

template <class T> using Vector = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <class T> using Table = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// What NumPy calls the type of an element.
template <class T> const char *dtype_name();
template <> inline const char *dtype_name<float>() { return "float32"; }
template <> inline const char *dtype_name<double>() { return "float64"; }
template <> inline const char *dtype_name<std::uint8_t>() { return "uint8"; }

/// `values` as an array of NumPy, in C order and of a type. No copy if it is one already.
nb::object as_numpy(const nb::handle &values, const char *dtype);

/// Throw ValueError.
[[noreturn]] void refuse_shape(const char *name, const char *expected);

/// Numbers in a row. Throws ValueError, which names the argument.
template <class T> Vector<T> vector_of(const nb::handle &values, const char *name)
{
    Vector<T> result;
    if (!nb::try_cast(as_numpy(values, dtype_name<T>()), result)) {
        refuse_shape(name, "n numbers");
    }
    return result;
}

/// Rows of `n_columns` numbers. Throws ValueError, which names the argument.
template <class T>
Table<T> table_of(const nb::handle &values, std::size_t n_columns, const char *name)
{
    Table<T> result;
    if (!nb::try_cast(as_numpy(values, dtype_name<T>()), result) || result.shape(1) != n_columns) {
        const std::string expected =
            "an array of n rows and " + std::to_string(n_columns) + " columns";
        refuse_shape(name, expected.c_str());
    }
    return result;
}

/// Points of an array of n x 2 numbers, in place.
struct Points {
    explicit Points(const nb::handle &values) : table(table_of<double>(values, 2, "points")) {}
    const gpom_point_t *data() const
    {
        static_assert(sizeof(gpom_point_t) == 2 * sizeof(double));
        return reinterpret_cast<const gpom_point_t *>(table.data());
    }
    std::size_t size() const { return table.shape(0); }
    Table<double> table;
};

/// A field of a structured type of NumPy.
struct Field {
    const char *name;
    const char *format;
    std::size_t offset;
};

/// The type of NumPy with the layout of a struct of C.
nb::object struct_dtype(std::initializer_list<Field> fields, std::size_t n_bytes);

/// A new array, and where its elements are.
struct NewArray {
    nb::object array;
    void *data;
};
NewArray new_array(const nb::object &shape, const nb::object &dtype);

/// A pose x, y, yaw, with its covariance if given.
struct Pose {
    Pose(const nb::handle &xyyaw, const nb::handle &cov_or_none);
    const gpom_pose_t *get() const { return &pose_; }

private:
    float cov_[9] = {};
    gpom_pose_t pose_ = {};
};

/// A scan as the tools take it: (t_s, x_m, y_m, theta_rad, angle_min_rad, angle_step_rad,
/// range_max_m, ranges_m), the pose being that of the laser.
gpom_tools::Scan tool_scan(const nb::handle &tuple);
std::vector<gpom_tools::Scan> tool_scans(const nb::handle &tuples);
nb::object scan_tuples(const std::vector<gpom_tools::Scan> &scans);

// --- Parts of the module -----------------------------------------------------------------------

void add_errors(nb::module_ &module);
void add_params(nb::module_ &module);
void add_scans(nb::module_ &module);
void add_map(nb::module_ &module);
void add_insertion(nb::class_<Map> &map);
void add_queries(nb::module_ &module, nb::class_<Map> &map);
void add_planning(nb::class_<Map> &map);
void add_lowres(nb::module_ &module, nb::class_<Map> &map);
void add_snapshots(nb::class_<Map> &map);
void add_learning(nb::module_ &module);
void add_simulator(nb::module_ &module);
void add_octomap(nb::module_ &module);

} // namespace gpom_python

#endif

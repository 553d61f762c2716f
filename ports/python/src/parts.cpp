#include "ports/python/src/parts.hpp"

#include "ports/host/file_error.hpp"

#include <cstring>

namespace gpom_python
{

StatusError::StatusError(gpom_status_t error_status, const std::string &what)
    : std::runtime_error(what + ": " + gpom_status_str(error_status)), status(error_status)
{
}

void require(gpom_status_t status, const std::string &what)
{
    if (status != GPOM_OK) {
        throw StatusError(status, what);
    }
}

void require_answers(gpom_status_t status)
{
    if (status != GPOM_ERR_PIVOT && status != GPOM_ERR_CUT && status != GPOM_ERR_REACH) {
        require(status, "query");
    }
}

Scratch::Scratch(std::size_t n_bytes)
    : memory_(new std::uint8_t[n_bytes]), scratch_{memory_.get(), n_bytes}
{
}

nb::object as_numpy(const nb::handle &values, const char *dtype)
{
    return nb::module_::import_("numpy").attr("ascontiguousarray")(values, dtype);
}

void refuse_shape(const char *name, const char *expected)
{
    throw nb::value_error((std::string(name) + ": must be " + expected).c_str());
}

nb::object struct_dtype(std::initializer_list<Field> fields, std::size_t n_bytes)
{
    nb::list names, formats, offsets;
    for (const Field &field : fields) {
        names.append(field.name);
        formats.append(field.format);
        offsets.append(field.offset);
    }
    nb::dict layout;
    layout["names"] = names;
    layout["formats"] = formats;
    layout["offsets"] = offsets;
    layout["itemsize"] = n_bytes;
    return nb::module_::import_("numpy").attr("dtype")(layout);
}

NewArray new_array(const nb::object &shape, const nb::object &dtype)
{
    nb::object array = nb::module_::import_("numpy").attr("empty")(shape, dtype);
    const auto address = nb::cast<std::uintptr_t>(array.attr("ctypes").attr("data"));
    return {array, reinterpret_cast<void *>(address)};
}

Pose::Pose(const nb::handle &xyyaw, const nb::handle &cov_or_none)
{
    const Vector<double> values = vector_of<double>(xyyaw, "pose");
    if (values.size() != 3) {
        refuse_shape("pose", "three numbers: x [m], y [m], yaw [rad]");
    }
    pose_ = {values.data()[0], values.data()[1], values.data()[2], nullptr};
    if (!cov_or_none.is_none()) {
        const Table<float> cov = table_of<float>(cov_or_none, 3, "cov");
        if (cov.shape(0) != 3) {
            refuse_shape("cov", "3 x 3 numbers [m2, m rad, rad2]");
        }
        std::memcpy(cov_, cov.data(), sizeof cov_);
        pose_.cov = cov_;
    }
}

gpom_tools::Scan tool_scan(const nb::handle &tuple)
{
    const Vector<float> ranges_m = vector_of<float>(tuple[7], "ranges_m");
    return {nb::cast<double>(tuple[0]), nb::cast<double>(tuple[1]),
            nb::cast<double>(tuple[2]), nb::cast<double>(tuple[3]),
            nb::cast<double>(tuple[4]), nb::cast<double>(tuple[5]),
            nb::cast<double>(tuple[6]), {ranges_m.data(), ranges_m.data() + ranges_m.size()}};
}

std::vector<gpom_tools::Scan> tool_scans(const nb::handle &tuples)
{
    std::vector<gpom_tools::Scan> scans;
    for (const nb::handle tuple : tuples) {
        scans.push_back(tool_scan(tuple));
    }
    return scans;
}

nb::object scan_tuples(const std::vector<gpom_tools::Scan> &scans)
{
    const nb::object dtype = nb::cast("float32");
    nb::list list;
    for (const gpom_tools::Scan &scan : scans) {
        const NewArray ranges_m = new_array(nb::make_tuple(scan.ranges_m.size()), dtype);
        std::memcpy(ranges_m.data, scan.ranges_m.data(), sizeof(float) * scan.ranges_m.size());
        list.append(nb::make_tuple(scan.t_s, scan.x_m, scan.y_m, scan.theta_rad, scan.angle_min_rad,
                                   scan.angle_step_rad, scan.range_max_m, ranges_m.array));
    }
    return list;
}

void add_errors(nb::module_ &module)
{
    static nb::handle error, file_error; // the module keeps both for as long as it lives
    const nb::object builtins = nb::module_::import_("builtins");
    const auto make = [&](const char *name, const nb::object &base, const char *doc) {
        nb::dict body;
        body["__doc__"] = doc;
        body["__module__"] = "gpom";
        nb::object type = builtins.attr("type")(name, nb::make_tuple(base), body);
        module.attr(name) = type;
        return type.release();
    };
    error = make("Error", builtins.attr("RuntimeError"),
                 "A status of the library, with its text. `status` is the number in C.");
    file_error = make("FileError", nb::borrow(error),
                      "An error in a file: one line that names file, line and what to do.");
    nb::register_exception_translator([](const std::exception_ptr &thrown, void *) {
        try {
            std::rethrow_exception(thrown);
        } catch (const StatusError &status) {
            const nb::object made = error(status.what());
            made.attr("status") = static_cast<int>(status.status);
            PyErr_SetObject(error.ptr(), made.ptr());
        } catch (const gpom_tools::FileError &file) {
            const nb::object made = file_error(file.what());
            made.attr("status") = nb::none();
            PyErr_SetObject(file_error.ptr(), made.ptr());
        }
    });
}

} // namespace gpom_python

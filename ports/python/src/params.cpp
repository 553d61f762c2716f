// Hyperparameters: fields, TOML, records.
#include "ports/python/src/parts.hpp"

#include "ports/host/params_fields.hpp"
#include "ports/host/params_toml.hpp"
#include "tools/params_tool/params_file.hpp"
#include "tools/params_tool/writer.hpp"

#include <nanobind/stl/string.h>

namespace gpom_python
{

using gpom_tools::ParamField;

namespace
{

/// A number of a named list, such as the kernel's. Throws ValueError with all names.
template <class Row, std::size_t n>
const Row &row_named(const Row (&rows)[n], const std::string &name, const std::string &what)
{
    std::string all;
    for (const Row &row : rows) {
        if (name == row.name) {
            return row;
        }
        all += (all.empty() ? "" : ", ") + std::string(row.name);
    }
    throw nb::value_error((what + ": must be one of " + all + ", is '" + name + "'").c_str());
}

void set_field(Params &params, const std::string &name, const nb::handle &value)
{
    if (name == "kernel") {
        params.values.kernel =
            row_named(gpom_tools::kKernels, nb::cast<std::string>(value), name).kernel;
        return;
    }
    if (name == "frame") {
        params.values.frame =
            row_named(gpom_tools::kFrames, nb::cast<std::string>(value), name).frame;
        return;
    }
    for (const ParamField &field : gpom_tools::kParamFields) {
        if (name == field.field && field.number != nullptr) {
            params.values.*field.number = nb::cast<float>(value);
            return;
        }
        if (name == field.field) {
            params.values.*field.count = nb::cast<std::uint16_t>(value);
            return;
        }
    }
    throw nb::type_error(("Params has no field '" + name + "'; see gpom/params.h").c_str());
}

void add_fields(nb::class_<Params> &type)
{
    for (const ParamField &row : gpom_tools::kParamFields) {
        const ParamField *const field = &row;
        const std::string doc = std::string("See ") + row.field + " in gpom/params.h.";
        if (row.number != nullptr) {
            type.def_prop_rw(
                row.field, [field](const Params &p) { return p.values.*field->number; },
                [field](Params &p, float value) { p.values.*field->number = value; }, doc.c_str());
        } else {
            type.def_prop_rw(
                row.field, [field](const Params &p) { return p.values.*field->count; },
                [field](Params &p, std::uint16_t value) { p.values.*field->count = value; },
                doc.c_str());
        }
    }
    type.def_prop_rw(
        "kernel", [](const Params &p) { return gpom_tools::kernel_name(p.values.kernel); },
        [](Params &p, const std::string &name) {
            p.values.kernel = row_named(gpom_tools::kKernels, name, "kernel").kernel;
        },
        "nn, matern12, matern32, se or askey.");
    type.def_prop_rw(
        "frame", [](const Params &p) { return gpom_tools::frame_name(p.values.frame); },
        [](Params &p, const std::string &name) {
            p.values.frame = row_named(gpom_tools::kFrames, name, "frame").frame;
        },
        "query or map.");
}

void check(const Params &params)
{
    const char *problem = nullptr;
    const gpom_status_t status = gpom_params_check(&params.values, &problem);
    if (status != GPOM_OK) {
        throw StatusError(status, gpom_tools::problem_with_values(
                                      params.values, problem != nullptr ? problem : "params"));
    }
}

Params of_record(const nb::bytes &record)
{
    Params params;
    const char *problem = nullptr;
    const gpom_status_t status = gpom_params_load(
        &params.values, static_cast<const std::uint8_t *>(record.data()), record.size(), &problem);
    require(status, problem != nullptr ? problem : "record");
    return params;
}

} // namespace

namespace
{

void add_files(nb::class_<Params> &type)
{
    type.def(
        "to_toml",
        [](const Params &p, const std::string &comment) {
            check(p);
            return gpom_tools::params_toml(p.values, comment);
        },
        nb::arg("comment") = "", "Text of a parameters file. Raises Error as check().");
    type.def_static(
        "from_toml",
        [](const std::string &text) { return Params{gpom_tools::params_of_toml("params", text)}; },
        nb::arg("text"), "Parameters of a TOML text. Raises FileError.");
    type.def_static(
        "from_file",
        [](const std::string &path) { return Params{gpom_tools::read_params_file(path).params}; },
        nb::arg("path"),
        "Parameters of a file: TOML, C header or record; its content tells which. Raises "
        "FileError.");
    type.def(
        "to_record",
        [](const Params &p) {
            check(p);
            const std::string record = gpom_tools::params_record(p.values);
            return nb::bytes(record.data(), record.size());
        },
        "The bytes of gpom_params_save(), for firmware. Raises Error as check().");
    type.def_static("from_record", &of_record, nb::arg("record"),
                    "Parameters of the bytes of to_record(). Raises Error.");
}

} // namespace

void add_params(nb::module_ &module)
{
    nb::class_<Params> type(
        module, "Params",
        "Hyperparameters of a map. Fields have the names, units and limits of\n"
        "gpom_params_t (gpom/params.h). Keyword arguments set fields; the others "
        "get the\ngeneral setting of gpom_params_init().");
    type.def("__init__", [](Params *params, const nb::kwargs &fields) {
        new (params) Params();
        gpom_params_init(&params->values);
        for (const auto &[name, value] : fields) {
            set_field(*params, nb::cast<std::string>(name), value);
        }
    });
    add_fields(type);
    type.def("check", &check, "Raise Error, which names the field, unless all fields are valid.");
    type.def_prop_ro(
        "prior_variance", [](const Params &p) { return gpom_params_prior_variance(&p.values); },
        "Variance of the latent function where nothing is known [1].");
    type.def_prop_ro(
        "prior_probability",
        [](const Params &p) { return gpom_params_prior_probability(&p.values); },
        "Probability of occupancy where nothing is known.");
    add_files(type);
    type.def("__eq__", [](const Params &a, const Params &b) {
        return gpom_tools::params_toml(a.values, "") == gpom_tools::params_toml(b.values, "");
    });
    type.def("__repr__", [](const Params &p) {
        return std::string("<gpom.Params ") + gpom_tools::kernel_name(p.values.kernel) + ", " +
               std::to_string(p.values.n_hits) + " + " + std::to_string(p.values.n_free) +
               " neighbours>";
    });
}

} // namespace gpom_python

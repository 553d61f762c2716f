// gpom-params: hyperparameters from one kind of file into another, checked and explained.
#include "ports/host/command_line.hpp"
#include "ports/host/file_error.hpp"
#include "tools/params_tool/explain.hpp"
#include "tools/params_tool/params_file.hpp"
#include "tools/params_tool/writer.hpp"

#include <unistd.h>

#include <cctype>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

using namespace gpom_tools;

namespace
{

struct Options {
    std::vector<std::string> paths;
    std::string to, out_path, name;
    bool check = false;
    bool explain = false;
};

void declare_options(CLI::App &app, Options &options)
{
    app.add_option("FILE", options.paths,
                   "TOML, C header or binary record; the content tells which. One, or with\n"
                   "--check any number")
        ->required()
        ->type_name("");
    CLI::Option *const to =
        app.add_option("--to", options.to,
                       "Write it as toml, header (C: the constant gpom_params_NAME) or record (of\n"
                       "gpom_params_save()): the same bits in each")
            ->check(CLI::IsMember({"toml", "header", "record"}))
            ->type_name("KIND");
    app.add_option("--out", options.out_path, "With --to: file to write [standard output]")
        ->type_name("FILE")
        ->needs(to);
    app.add_option("--name", options.name,
                   "With --to header: NAME of the constant [as the file is called]")
        ->needs(to);
    CLI::Option *const check =
        app.add_flag("--check", options.check,
                     "Check the files alone: exit code 0 if all are good, else 2 and for each bad\n"
                     "one a line with file, field, value and bound");
    app.add_flag("--explain", options.explain,
                 "Print each field in words: value, unit, what it does, its neutral value; and\n"
                 "what the thresholds mean")
        ->excludes(to)
        ->excludes(check);
    check->excludes(to);
}

bool is_of_identifier(char c)
{
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// Of the constant in a header: as asked for, or as the written file is called, or the read one.
std::string header_name(const Options &options)
{
    std::string name = options.name;
    if (name.empty()) {
        const std::string &path =
            options.out_path.empty() ? options.paths.front() : options.out_path;
        name = std::filesystem::path(path).stem().string();
        for (char &c : name) {
            c = is_of_identifier(c) ? c : '_';
        }
    }
    for (const char c : name) {
        if (!is_of_identifier(c)) {
            throw std::runtime_error("--name: '" + name +
                                     "' has characters beside letters, digits and _");
        }
    }
    return name;
}

std::string bytes_of(const Options &options, const ParamsFile &file)
{
    if (options.to == "toml") {
        return params_toml(file.params, file.comment);
    }
    if (options.to == "header") {
        return params_header(file.params, header_name(options), file.comment);
    }
    return params_record(file.params);
}

void print(const std::string &bytes)
{
    if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() ||
        std::fflush(stdout) != 0) {
        throw std::runtime_error("standard output: cannot write");
    }
}

void convert(const Options &options)
{
    if (!options.name.empty() && options.to != "header") {
        throw std::runtime_error("--name: with --to header alone");
    }
    const std::string bytes = bytes_of(options, read_params_file(options.paths.front()));
    if (!options.out_path.empty()) {
        replace_files({{options.out_path, bytes}});
        return;
    }
    if (options.to == "record" && isatty(STDOUT_FILENO) != 0) {
        throw std::runtime_error("--to record: not onto a terminal; give --out FILE");
    }
    print(bytes);
}

/// Exit code.
int check(const std::vector<std::string> &paths)
{
    int code = 0;
    for (const std::string &path : paths) {
        try {
            static_cast<void>(read_params_file(path));
            std::printf("%s: good\n", path.c_str());
        } catch (const FileError &error) {
            code = fail("gpom-params", error.what());
        }
    }
    return code;
}

/// Exit code.
int run(const Options &options)
{
    if (options.check) {
        return check(options.paths);
    }
    if (options.to.empty() && !options.explain) {
        throw std::runtime_error("say what to do: --to toml, header or record, --check or "
                                 "--explain; see gpom-params --help");
    }
    if (options.paths.size() > 1) {
        throw std::runtime_error("one file at a time; only --check takes several");
    }
    if (options.explain) {
        print(explained(options.paths.front(), read_params_file(options.paths.front())));
    } else {
        convert(options);
    }
    return 0;
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Turn hyperparameters of one kind (TOML, C header, binary record) into another,\n"
                 "check them, or explain them.",
                 "gpom-params");
    Options options;
    declare_options(app, options);
    int code = 0;
    const int failed = run_tool(app, argc, argv, [&] { code = run(options); });
    return failed != 0 ? failed : code;
}

#include "tools/eval/exact_gp_rival.hpp"

#include "ports/host/file_error.hpp"
#include "tools/map/raster_csv.hpp"

#include <spawn.h>
#include <sys/wait.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

extern char **environ; // NOLINT: no header of POSIX declares it

namespace gpom_tools
{
namespace
{

namespace fs = std::filesystem;

/// A temporary folder that is removed with this object.
class TemporaryFolder {
public:
    TemporaryFolder()
    {
        std::string name = (fs::temp_directory_path() / "gpom-exact-gp-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) {
            throw FileError(name, 0,
                            std::string("cannot make this folder: ") + std::strerror(errno));
        }
        path_ = name;
    }
    ~TemporaryFolder()
    {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder &) = delete;
    TemporaryFolder &operator=(const TemporaryFolder &) = delete;

    std::string file(const char *name) const { return (path_ / name).string(); }

private:
    fs::path path_;
};

/// Run a program with our environment and return its exit code. -1: a signal ended it.
int run_program(std::vector<std::string> words)
{
    std::vector<char *> arguments;
    for (std::string &word : words) {
        arguments.push_back(word.data());
    }
    arguments.push_back(nullptr);
    pid_t pid = 0;
    const int error = posix_spawn(&pid, arguments[0], nullptr, nullptr, arguments.data(), environ);
    if (error != 0) {
        throw FileError(words[0], 0, std::string("cannot run: ") + std::strerror(error));
    }
    int status = 0;
    while (waitpid(pid, &status, 0) < 0) {
        if (errno != EINTR) {
            throw FileError(words[0], 0,
                            std::string("cannot wait for it: ") + std::strerror(errno));
        }
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

std::string beams_csv(const std::vector<GridBeam> &beams)
{
    std::string text = "x,y,bearing,range,hit\n";
    for (const GridBeam &beam : beams) {
        append_text(text, "%.17g,%.17g,%.17g,%.17g,%d\n", beam.x_m, beam.y_m, beam.bearing_rad,
                    beam.range_m, beam.hit ? 1 : 0);
    }
    return text;
}

std::string places_csv(const std::vector<gpom_point_t> &points)
{
    std::string text = "x,y\n";
    for (const gpom_point_t &point : points) {
        append_text(text, "%.17g,%.17g\n", point.x_m, point.y_m);
    }
    return text;
}

std::vector<double> read_probabilities(const std::string &path, std::size_t n)
{
    std::ifstream in(path);
    std::string header;
    std::getline(in, header);
    std::vector<double> probabilities;
    for (double p = 0.0; in >> p;) {
        probabilities.push_back(p);
    }
    if (probabilities.size() != n) {
        throw std::runtime_error("exact-gp answered " + std::to_string(probabilities.size()) +
                                 " of " + std::to_string(n) + " points");
    }
    return probabilities;
}

} // namespace

std::optional<std::vector<double>> exact_gp_probabilities(const std::vector<GridBeam> &beams,
                                                          const std::vector<gpom_point_t> &points)
{
    const fs::path program = fs::read_symlink("/proc/self/exe").replace_filename("exact-gp");
    if (!fs::exists(program)) {
        return std::nullopt;
    }
    const TemporaryFolder folder;
    const std::string out = folder.file("probabilities.csv");
    replace_files({{folder.file("beams.csv"), beams_csv(beams)},
                   {folder.file("points.csv"), places_csv(points)}});
    const int code =
        run_program({program.string(), folder.file("beams.csv"), folder.file("points.csv"), out});
    if (code == kExactGpMissing) {
        return std::nullopt;
    }
    if (code != 0) {
        throw std::runtime_error("exact-gp failed with exit code " + std::to_string(code));
    }
    return read_probabilities(out, points.size());
}

} // namespace gpom_tools

// Snapshots in files: made, found again by another process's eyes, and never lost to a short file.
#include "tests/unit/snapshot_medium.hpp"
#include "tools/lib/file_error.hpp"
#include "tools/lib/snapshot_file.hpp"

#include <filesystem>

using namespace reference;

namespace
{

/// A folder of its own that goes with the test.
struct TestFolder {
    std::filesystem::path path;

    TestFolder()
    {
        std::string name = std::filesystem::temp_directory_path() / "gpom-snapshot-XXXXXX";
        REQUIRE(mkdtemp(name.data()) != nullptr);
        path = name;
    }
    ~TestFolder() { std::filesystem::remove_all(path); }
    TestFolder(const TestFolder &) = delete;
    TestFolder &operator=(const TestFolder &) = delete;

    std::string file() const { return path / "map"; }
};

gpom_status_t write_file(const gpom_map_t *map, const std::string &path)
{
    gpom_tools::SnapshotFile file(path, 300, true);
    const gpom_snapshot_io_t io = file.io();
    gpom_snapshot_t snapshot;
    REQUIRE(gpom_snapshot_write_begin(&snapshot, map, &io) == GPOM_OK);
    return gpom_snapshot_write_step(&snapshot, map, 1000);
}

gpom_status_t read_file(gpom_map_t *map, const std::string &path)
{
    gpom_tools::SnapshotFile file(path, 300, false);
    const gpom_snapshot_io_t io = file.io();
    gpom_snapshot_t snapshot;
    REQUIRE(gpom_snapshot_read_begin(&snapshot, map, &io) == GPOM_OK);
    return gpom_snapshot_read_step(&snapshot, map, 1000);
}

} // namespace

// What is written to files is read from them; a file cut short leaves the one before.
TEST_CASE("a map outlives its process in two files")
{
    GPOM_TELL_SEED();
    const TestFolder folder;
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12), 300));
    TestMap copy(config_of(params_of(GPOM_KERNEL_MATERN12), 300));
    CHECK(read_file(copy.get(), folder.file()) == GPOM_ERR_FORMAT); // no file yet
    drive(map.get(), 500, 2);
    REQUIRE(write_file(map.get(), folder.file()) == GPOM_OK);
    const std::vector<gpom_beam_t> older = beams_of(map.get());
    REQUIRE(read_file(copy.get(), folder.file()) == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), older));
    drive(map.get(), 501, 2);
    REQUIRE(write_file(map.get(), folder.file()) == GPOM_OK);
    REQUIRE(read_file(copy.get(), folder.file()) == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), beams_of(map.get())));
    const std::string newest = folder.file() + ".1";
    std::filesystem::resize_file(newest, std::filesystem::file_size(newest) - 1);
    REQUIRE(read_file(copy.get(), folder.file()) == GPOM_OK);
    CHECK(same_beams(beams_of(copy.get()), older));
}

// A folder that is not there is told by name.
TEST_CASE("files that cannot be opened are named")
{
    const TestFolder folder;
    const std::string path = folder.file() + "/of/no/folder";
    CHECK_THROWS_AS(gpom_tools::SnapshotFile(path, 300, true), gpom_tools::FileError);
}

// Who writes has the files for itself; who reads may do so meanwhile.
TEST_CASE("files that another one writes are refused")
{
    const TestFolder folder;
    {
        const gpom_tools::SnapshotFile first(folder.file(), 300, true);
        CHECK_THROWS_AS(gpom_tools::SnapshotFile(folder.file(), 300, true), gpom_tools::FileError);
        CHECK_NOTHROW(gpom_tools::SnapshotFile(folder.file(), 300, false));
    }
    CHECK_NOTHROW(gpom_tools::SnapshotFile(folder.file(), 300, true));
}

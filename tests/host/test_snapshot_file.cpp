// Snapshots in files: made, found again by another process's eyes, and never lost to a short file.
#include "ports/host/file_error.hpp"
#include "ports/host/snapshot_file.hpp"
#include "tests/common/snapshot_medium.hpp"

#include <sys/stat.h>

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

// Either file alone is taken by who writes: a second one is refused though the other was removed.
TEST_CASE("either of the two files keeps another writer out")
{
    for (const char *const removed : {".0", ".1"}) {
        const TestFolder folder;
        const gpom_tools::SnapshotFile first(folder.file(), 300, true);
        std::filesystem::remove(folder.file() + removed);
        CHECK_THROWS_AS(gpom_tools::SnapshotFile(folder.file(), 300, true), gpom_tools::FileError);
    }
}

// Nobody else may read them, and they are files of their own: no link leads to another one.
TEST_CASE("snapshots are private files and no links")
{
    namespace fs = std::filesystem;
    const TestFolder folder;
    {
        const gpom_tools::SnapshotFile file(folder.file(), 300, true);
    }
    for (const char *const slot : {".0", ".1"}) {
        CHECK(fs::status(folder.file() + slot).permissions() ==
              (fs::perms::owner_read | fs::perms::owner_write));
        fs::remove(folder.file() + slot);
        fs::create_symlink(folder.path / "victim", folder.file() + slot);
        CHECK_THROWS_AS(gpom_tools::SnapshotFile(folder.file(), 300, true), gpom_tools::FileError);
        CHECK(!fs::exists(folder.path / "victim"));
        fs::remove(folder.file() + slot);
        fs::create_directory(folder.file() + slot);
        CHECK_THROWS_AS(gpom_tools::SnapshotFile(folder.file(), 300, false), gpom_tools::FileError);
        fs::remove(folder.file() + slot);
        REQUIRE(mkfifo((folder.file() + slot).c_str(), 0600) == 0);
        CHECK_THROWS_AS(gpom_tools::SnapshotFile(folder.file(), 300, false), gpom_tools::FileError);
        CHECK_THROWS_AS(gpom_tools::SnapshotFile(folder.file(), 300, true), gpom_tools::FileError);
        fs::remove(folder.file() + slot);
    }
}

// A smaller map takes the youngest beams of a larger one's snapshot, whose file stays as it is.
TEST_CASE("a snapshot of a larger map is read and kept")
{
    GPOM_TELL_SEED();
    const TestFolder folder;
    TestMap map(config_of(params_of(GPOM_KERNEL_MATERN12), 300));
    drive(map.get(), 502, 6);
    REQUIRE(write_file(map.get(), folder.file()) == GPOM_OK);
    const auto bytes = std::filesystem::file_size(folder.file() + ".0");
    TestMap small(config_of(params_of(GPOM_KERNEL_MATERN12), 100));
    gpom_tools::SnapshotFile file(folder.file(), 100, true);
    const gpom_snapshot_io_t io = file.io();
    gpom_snapshot_t snapshot;
    REQUIRE(gpom_snapshot_read_begin(&snapshot, small.get(), &io) == GPOM_OK);
    REQUIRE(gpom_snapshot_read_step(&snapshot, small.get(), 1000) == GPOM_OK);
    CHECK(gpom_map_beam_count(small.get()) == 100);
    CHECK(snapshot.report.n_dropped == 200);
    const std::string kept = folder.file() + ".0.larger";
    CHECK(file.keep_larger(0) == kept);
    CHECK(std::filesystem::file_size(kept) == bytes);
    CHECK(file.keep_larger(0) == "");
    REQUIRE(gpom_snapshot_write_begin(&snapshot, small.get(), &io) == GPOM_OK);
    REQUIRE(gpom_snapshot_write_step(&snapshot, small.get(), 1000) == GPOM_OK);
    CHECK(std::filesystem::file_size(kept) == bytes);
    std::filesystem::resize_file(folder.file() + ".1", bytes); // and no second is put in its place
    std::filesystem::rename(kept, folder.file() + ".1.larger");
    CHECK_THROWS_AS(file.keep_larger(1), gpom_tools::FileError);
}

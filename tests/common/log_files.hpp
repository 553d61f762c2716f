// Files for tests of readers: a folder that goes away, and lines of logs.
#ifndef GPOM_TESTS_COMMON_LOG_FILES_HPP
#define GPOM_TESTS_COMMON_LOG_FILES_HPP

#include <bzlib.h>
#include <doctest/doctest.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace fs = std::filesystem;

/// A new folder, gone with its contents at the end of the test.
struct Folder {
    fs::path path;

    Folder()
    {
        std::string name = (fs::temp_directory_path() / "gpom-test-XXXXXX").string();
        REQUIRE(mkdtemp(name.data()) != nullptr);
        path = name;
    }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder &) = delete;
    Folder &operator=(const Folder &) = delete;

    std::string file(const std::string &name, const std::string &bytes) const
    {
        const std::string full = (path / name).string();
        std::ofstream(full, std::ios::binary) << bytes;
        return full;
    }
    std::string gz(const std::string &name, const std::string &bytes) const
    {
        const std::string full = (path / name).string();
        const gzFile out = gzopen(full.c_str(), "wb");
        gzwrite(out, bytes.data(), static_cast<unsigned>(bytes.size()));
        gzclose(out);
        return full;
    }
    std::string bz2(const std::string &name, const std::string &bytes) const
    {
        std::string packed(bytes.size() + bytes.size() / 100 + 600, '\0'); // bzlib's bound
        auto n_packed = static_cast<unsigned>(packed.size());
        std::string from = bytes;
        REQUIRE(BZ2_bzBuffToBuffCompress(packed.data(), &n_packed, from.data(),
                                         static_cast<unsigned>(from.size()), 9, 0, 0) == BZ_OK);
        return file(name, packed.substr(0, n_packed));
    }
};

/// A FLASER line of n ranges, 1 2 3 ..., at a time.
inline std::string flaser(int n, const std::string &time)
{
    std::string line = "FLASER " + std::to_string(n);
    for (int i = 0; i < n; ++i) {
        line += " " + std::to_string(i + 1);
    }
    return line + " 10 20 0.5 11 21 0.6 " + time + " host 99\n";
}

#endif

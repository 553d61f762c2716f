// Reads a file that is plain, gzipped or packed with bzip2. The content decides which.
#ifndef GPOM_PORTS_HOST_PACKED_FILE_HPP
#define GPOM_PORTS_HOST_PACKED_FILE_HPP

#include <bzlib.h>
#include <zlib.h>

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

namespace gpom_tools
{

class PackedFile {
public:
    /// Throws FileError.
    explicit PackedFile(const std::string &path);
    ~PackedFile();
    PackedFile(const PackedFile &) = delete;
    PackedFile &operator=(const PackedFile &) = delete;

    /// Read at most `n_bytes` unpacked bytes. 0: the end. `problem` says what is wrong with the
    /// file, or is empty.
    std::size_t read(char *bytes, std::size_t n_bytes, std::string &problem);

private:
    std::size_t read_gzip(char *bytes, std::size_t n_bytes, std::string &problem);
    std::size_t read_bzip2(char *bytes, std::size_t n_bytes, std::string &problem);
    bool refill();

    gzFile gzip_ = nullptr;     ///< Reads plain files, too.
    std::FILE *file_ = nullptr; ///< The file, if it is bzip2. Other files: null.
    bz_stream stream_ = {};
    bool is_inside_ = false; ///< A bzip2 stream has begun and not ended.
    std::vector<char> packed_;
};

} // namespace gpom_tools

#endif

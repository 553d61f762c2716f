#include "ports/host/packed_file.hpp"

#include "ports/host/file_error.hpp"

namespace gpom_tools
{
namespace
{

constexpr std::size_t kPackedBytes = std::size_t{1} << 16;

/// True if a file begins like bzip2. A pipe cannot be read twice, so it is left to zlib, which
/// finds out what it holds.
bool begins_as_bzip2(std::FILE *file)
{
    struct stat status;
    if (fstat(fileno(file), &status) != 0 || !S_ISREG(status.st_mode)) {
        return false;
    }
    char head[3] = {};
    const std::size_t n = std::fread(head, 1, sizeof head, file);
    std::rewind(file);
    return n == sizeof head && std::memcmp(head, "BZh", sizeof head) == 0;
}

} // namespace

PackedFile::PackedFile(const std::string &path)
{
    file_ = std::fopen(path.c_str(), "rbe");
    if (file_ == nullptr) {
        throw FileError(path, 0, std::string("cannot open: ") + std::strerror(errno));
    }
    if (begins_as_bzip2(file_)) {
        packed_.resize(kPackedBytes);
        return;
    }
    gzip_ = gzdopen(dup(fileno(file_)), "rb");
    std::fclose(file_);
    file_ = nullptr;
    if (gzip_ == nullptr) {
        throw FileError(path, 0, std::string("cannot open: ") + std::strerror(errno));
    }
}

PackedFile::~PackedFile()
{
    if (is_inside_) {
        BZ2_bzDecompressEnd(&stream_);
    }
    if (file_ != nullptr) {
        std::fclose(file_);
    }
    if (gzip_ != nullptr) {
        gzclose_r(gzip_);
    }
}

std::size_t PackedFile::read(char *bytes, std::size_t n_bytes, std::string &problem)
{
    return file_ != nullptr ? read_bzip2(bytes, n_bytes, problem)
                            : read_gzip(bytes, n_bytes, problem);
}

std::size_t PackedFile::read_gzip(char *bytes, std::size_t n_bytes, std::string &problem)
{
    const int n = gzread(gzip_, bytes, static_cast<unsigned>(n_bytes));
    int error = Z_OK;
    const char *const text = gzerror(gzip_, &error);
    if (n < 0 || (n == 0 && error == Z_BUF_ERROR)) {
        problem = error == Z_BUF_ERROR ? "gzip data end too early; the file is truncated"
                  : error == Z_ERRNO   ? std::string("cannot read: ") + std::strerror(errno)
                                       : std::string("gzip data are damaged: ") + text;
        return 0;
    }
    return static_cast<std::size_t>(n);
}

/// Read more packed bytes. False: the end of the file.
bool PackedFile::refill()
{
    if (stream_.avail_in == 0) {
        stream_.next_in = packed_.data();
        stream_.avail_in =
            static_cast<unsigned>(std::fread(packed_.data(), 1, packed_.size(), file_));
    }
    return stream_.avail_in > 0;
}

/// Read unpacked bytes. A file may hold several streams one after the other, because parallel
/// packers write such files.
std::size_t PackedFile::read_bzip2(char *bytes, std::size_t n_bytes, std::string &problem)
{
    stream_.next_out = bytes;
    stream_.avail_out = static_cast<unsigned>(n_bytes);
    while (stream_.avail_out == n_bytes) {
        if (!refill()) {
            if (std::ferror(file_) != 0) {
                problem = std::string("cannot read: ") + std::strerror(errno);
            } else if (is_inside_) {
                problem = "bzip2 data end too early; the file is truncated";
            }
            break;
        }
        if (!is_inside_) {
            is_inside_ = BZ2_bzDecompressInit(&stream_, 0, 0) == BZ_OK;
        }
        const int result = is_inside_ ? BZ2_bzDecompress(&stream_) : BZ_MEM_ERROR;
        if (result == BZ_STREAM_END) {
            BZ2_bzDecompressEnd(&stream_);
            is_inside_ = false;
        } else if (result != BZ_OK) {
            problem = "bzip2 data are damaged";
            break;
        }
    }
    return n_bytes - stream_.avail_out;
}

} // namespace gpom_tools

// Errors in files that the user names, and writing of files that never leaves half a file behind.
#ifndef GPOM_PORTS_HOST_FILE_ERROR_HPP
#define GPOM_PORTS_HOST_FILE_ERROR_HPP

#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace gpom_tools
{

/// An error in a file: what() is "FILE:LINE: message". Line 0 means the whole file, for example a
/// missing file: what() is then "FILE: message".
class FileError : public std::runtime_error {
public:
    FileError(std::string path, int line_number, std::string text)
        : std::runtime_error(path + (line_number > 0 ? ":" + std::to_string(line_number) : "") +
                             ": " + text),
          file(std::move(path)), line(line_number), message(std::move(text))
    {
    }

    std::string file;
    int line;
    std::string message;
};

struct FileContent {
    std::string path;
    std::string bytes;
};

namespace detail
{

/// While this object lives, signals such as Ctrl-C wait. They come before the writing or after it.
class SignalsHeld {
public:
    SignalsHeld()
    {
        sigset_t held;
        sigemptyset(&held);
        for (const int signal_number : {SIGINT, SIGTERM, SIGHUP}) {
            sigaddset(&held, signal_number);
        }
        pthread_sigmask(SIG_BLOCK, &held, &before_);
    }
    ~SignalsHeld() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsHeld(const SignalsHeld &) = delete;
    SignalsHeld &operator=(const SignalsHeld &) = delete;

private:
    sigset_t before_;
};

/// The file that a path means. Links are followed, so that writing keeps the link.
inline std::string link_target(const std::string &path)
{
    char *const resolved = realpath(path.c_str(), nullptr);
    const std::string target = resolved != nullptr ? resolved : path;
    free(resolved);
    struct stat status;
    if (stat(target.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
        throw FileError(path, 0, "is not a regular file; give the name of a file to write");
    }
    return target;
}

/// Write all bytes to a new file. Returns 0 or an errno.
inline int write_new_file(const std::string &path, const std::string &bytes)
{
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd < 0) {
        return errno;
    }
    int error = 0;
    for (std::size_t done = 0; done < bytes.size() && error == 0;) {
        const ssize_t n = write(fd, bytes.data() + done, bytes.size() - done);
        if (n >= 0) {
            done += static_cast<std::size_t>(n);
        } else if (errno != EINTR) {
            error = errno;
        }
    }
    if (close(fd) != 0 && error == 0) {
        error = errno;
    }
    return error;
}

} // namespace detail

/// Replace several files: all or none, as far as the system allows. Each file is written whole
/// under a temporary name beside its target. When all are on disk, they are renamed. Throws
/// FileError.
inline void replace_files(const std::vector<FileContent> &files)
{
    const detail::SignalsHeld held;
    std::vector<std::pair<std::string, std::string>> staged; // temporary name, target
    std::string failed_path;
    int error = 0;
    for (const FileContent &file : files) {
        const std::string target = detail::link_target(file.path);
        staged.emplace_back(target + ".tmp" + std::to_string(getpid()), target);
    }
    for (std::size_t i = 0; i < files.size() && error == 0; ++i) {
        failed_path = files[i].path;
        error = detail::write_new_file(staged[i].first, files[i].bytes);
    }
    for (std::size_t i = 0; i < files.size() && error == 0; ++i) {
        failed_path = files[i].path;
        error = std::rename(staged[i].first.c_str(), staged[i].second.c_str()) == 0 ? 0 : errno;
    }
    if (error != 0) {
        for (const auto &names : staged) {
            unlink(names.first.c_str());
        }
        throw FileError(failed_path, 0, std::string("cannot write: ") + std::strerror(error));
    }
}

} // namespace gpom_tools

#endif

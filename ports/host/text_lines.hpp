// Reads text files line by line, reads and writes numbers, and reports errors with their place.
#ifndef GPOM_PORTS_HOST_TEXT_LINES_HPP
#define GPOM_PORTS_HOST_TEXT_LINES_HPP

#include "ports/host/file_error.hpp"
#include "ports/host/packed_file.hpp"

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace gpom_tools
{

/// A place in a file, for errors.
struct Place {
    const std::string &path;
    int line;

    [[noreturn]] void fail(const std::string &message) const
    {
        throw FileError(path, line, message);
    }
};

/// Reads the lines of a plain, gzipped or bzip2 file and checks that they are text. Throws
/// FileError.
class LineReader {
public:
    /// `expected` names the expected content in errors, for example "CSV scans".
    LineReader(const std::string &path, std::string expected);

    Place place() const { return {path_, n_lines_}; }

    /// Get the next line without its line break. False: the end of the file.
    bool next(std::string &line);

    /// Throw if the file ends without a line break after the last line. Use it where the last field
    /// is a number: the number may be cut, and nothing else shows that.
    void require_line_end() const;

private:
    bool refill();
    bool check_text(std::string &line) const;

    const std::string &path_;
    std::string expected_;
    PackedFile file_;
    std::vector<char> buffer_;
    std::size_t i_next_ = 0;
    bool has_line_end_ = true;
    std::size_t n_bytes_ = 0;
    int n_lines_ = 0;
};

/// The text without blanks at both ends.
std::string_view trimmed(std::string_view text);

void split_commas(std::string_view text, std::vector<std::string_view> &fields);
void split_blanks(std::string_view text, std::vector<std::string_view> &fields);

/// Read a whole field as a number, in the "C" locale, whatever the user's locale is.
template <typename Number>
Number parse_number(std::string_view text, const std::string &name, const Place &place)
{
    Number value{};
    const char *const end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    if (result.ec != std::errc{} || result.ptr != end) {
        place.fail(name + " '" + std::string(text.substr(0, 40)) + "' is not a number");
    }
    return value;
}

double parse_finite(std::string_view text, const std::string &name, const Place &place);

/// Append a number with the fewest digits that read back to the same bits. `nan` has no sign.
template <typename Number> void append_number(std::string &text, Number value)
{
    if (std::isnan(value)) {
        text += "nan";
        return;
    }
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

} // namespace gpom_tools

#endif

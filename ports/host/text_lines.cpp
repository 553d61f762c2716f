#include "ports/host/text_lines.hpp"

namespace gpom_tools
{

namespace
{

constexpr std::size_t kLineBytesMax = std::size_t{1} << 20;

} // namespace

LineReader::LineReader(const std::string &path, std::string expected)
    : path_(path), expected_(std::move(expected)), file_(path), buffer_(std::size_t{1} << 16)
{
}

bool LineReader::next(std::string &line)
{
    line.clear();
    ++n_lines_;
    has_line_end_ = true;
    while (i_next_ < n_bytes_ || refill()) {
        const char *const start = buffer_.data() + i_next_;
        const std::size_t n_left = n_bytes_ - i_next_;
        const void *const end = std::memchr(start, '\n', n_left);
        const std::size_t n =
            end ? static_cast<std::size_t>(static_cast<const char *>(end) - start) : n_left;
        line.append(start, n);
        if (line.size() > kLineBytesMax) {
            place().fail("line is over 1 MiB; expected " + expected_);
        }
        i_next_ += n + (end ? 1 : 0);
        if (end) {
            return check_text(line);
        }
    }
    has_line_end_ = false;
    return !line.empty() && check_text(line);
}

void LineReader::require_line_end() const
{
    if (!has_line_end_) {
        place().fail("the file ends without the end of this line, so that its last number may be "
                     "cut; add a line break if it is whole");
    }
}

bool LineReader::refill()
{
    std::string problem;
    i_next_ = 0;
    n_bytes_ = file_.read(buffer_.data(), buffer_.size(), problem);
    if (!problem.empty()) {
        place().fail(problem);
    }
    return n_bytes_ > 0;
}

/// Check the characters of a line. Comments may hold any bytes except control characters. Data
/// lines are ASCII.
bool LineReader::check_text(std::string &line) const
{
    if (!line.empty() && line.back() == '\r') {
        line.pop_back();
    }
    const std::size_t first = line.find_first_not_of(" \t");
    const bool comment = first != std::string::npos && line[first] == '#';
    for (const char c : line) {
        const auto byte = static_cast<unsigned char>(c);
        if ((byte < 0x20 && c != '\t') || byte == 0x7f || (byte >= 0x80 && !comment)) {
            place().fail("binary bytes; expected " + expected_);
        }
    }
    return true;
}

std::string_view trimmed(std::string_view text)
{
    const std::size_t first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) {
        return {};
    }
    return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

void split_commas(std::string_view text, std::vector<std::string_view> &fields)
{
    fields.clear();
    for (;;) {
        const std::size_t comma = text.find(',');
        fields.push_back(trimmed(text.substr(0, comma)));
        if (comma == std::string_view::npos) {
            return;
        }
        text.remove_prefix(comma + 1);
    }
}

void split_blanks(std::string_view text, std::vector<std::string_view> &fields)
{
    fields.clear();
    for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
        const std::size_t n = std::min(text.find_first_of(" \t"), text.size());
        fields.push_back(text.substr(0, n));
        text.remove_prefix(n);
    }
}

double parse_finite(std::string_view text, const std::string &name, const Place &place)
{
    const double value = parse_number<double>(text, name, place);
    if (!std::isfinite(value)) {
        place.fail(name + " must be finite, is " + std::string(text));
    }
    return value;
}

} // namespace gpom_tools

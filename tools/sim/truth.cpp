#include "tools/sim/truth.hpp"

#include "ports/host/text_lines.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

namespace gpom_tools
{
namespace
{

constexpr char kOccupied = '\0';
constexpr char kFree = '\xff';
constexpr std::size_t kHeaderLineMax = 4096;

/// Reads the lines of the header one by one and counts them.
class Header {
public:
    Header(const std::string &path, std::istream &in) : path_(path), in_(in) {}

    std::string next()
    {
        ++n_lines_;
        std::string line;
        for (char c; line.size() < kHeaderLineMax && in_.get(c);) {
            if (c == '\n') {
                return line;
            }
            line += c;
        }
        fail(in_.bad() || line.empty() ? "file ends within the header (empty or truncated)"
                                       : "not a gpom-truth PGM image");
    }

    [[noreturn]] void fail(const std::string &message) const
    {
        throw FileError(path_, n_lines_, message);
    }

private:
    const std::string &path_;
    std::istream &in_;
    int n_lines_ = 0;
};

template <typename Number> bool parse_word(std::istringstream &words, Number &value)
{
    std::string word;
    words >> word;
    const char *const end = word.data() + word.size();
    const auto result = std::from_chars(word.data(), end, value);
    return !word.empty() && result.ec == std::errc{} && result.ptr == end;
}

bool at_end(std::istringstream &words) { return (words >> std::ws).eof(); }

void parse_geometry(const std::string &line, Truth &truth, const Header &header)
{
    std::istringstream words(line);
    std::string hash, name;
    int version = 0;
    words >> hash >> name;
    if (!parse_word(words, version) || version != 1) {
        header.fail("gpom-truth version is not 1");
    }
    const bool parsed = parse_word(words, truth.x0_m) && parse_word(words, truth.y0_m) &&
                        parse_word(words, truth.cell_m) && at_end(words);
    if (!parsed || !std::isfinite(truth.x0_m) || !std::isfinite(truth.y0_m) ||
        !std::isfinite(truth.cell_m) || !(truth.cell_m > 0.0)) {
        header.fail("expected '# gpom-truth 1 x0_m y0_m cell_m', finite and cell over 0");
    }
}

void parse_size(const std::string &line, Truth &truth, const Header &header)
{
    std::istringstream words(line);
    if (!parse_word(words, truth.nx) || !parse_word(words, truth.ny) || !at_end(words) ||
        truth.nx < 1 || truth.ny < 1) {
        header.fail("expected the image's width and height, two whole numbers over 0");
    }
    if (truth.nx > kTruthCellsMax / truth.ny) {
        header.fail("image is too large");
    }
}

void parse_header(Header &header, Truth &truth)
{
    if (header.next() != "P5") {
        header.fail("not a binary PGM image (first line must be P5)");
    }
    bool placed = false;
    std::string line = header.next();
    for (; !line.empty() && line[0] == '#'; line = header.next()) {
        if (line.rfind("# gpom-truth ", 0) == 0) {
            parse_geometry(line, truth, header);
            placed = true;
        }
    }
    if (!placed) {
        header.fail("no '# gpom-truth 1 x0_m y0_m cell_m' line; not written by gpom");
    }
    parse_size(line, truth, header);
    if (header.next() != "255") {
        header.fail("image's largest value must be 255");
    }
}

/// Copy one row of the image into one row of cells.
void copy_row(const std::string &row, Truth &truth, int iy, const Header &header)
{
    for (int ix = 0; ix < truth.nx; ++ix) {
        const char value = row[static_cast<std::size_t>(ix)];
        if (value != kOccupied && value != kFree) {
            header.fail("image holds values other than 0 (occupied) and 255 (free)");
        }
        truth.occupied[truth.index(ix, iy)] = value == kOccupied ? 1 : 0;
    }
}

} // namespace

Truth read_truth(const std::string &path)
{
    std::ifstream in(path, std::ios::binary);
    if (!in) {
        throw FileError(path, 0, std::string("cannot open: ") + std::strerror(errno));
    }
    Truth truth;
    Header header(path, in);
    parse_header(header, truth);
    std::string row(static_cast<std::size_t>(truth.nx), '\0');
    const std::streamoff start = in.tellg();
    in.seekg(0, std::ios::end); // check the file size before allocating: the header may be wrong
    const std::streamoff n_bytes = std::streamoff(in.tellg()) - start;
    if (n_bytes != std::streamoff(truth.nx) * truth.ny) {
        header.fail("image needs " + std::to_string(std::streamoff(truth.nx) * truth.ny) +
                    " bytes, has " + std::to_string(n_bytes));
    }
    in.seekg(start);
    truth.occupied.resize(truth.index(0, truth.ny));
    for (int iy = truth.ny - 1; iy >= 0; --iy) { // the first row of the image is the northernmost
        if (!in.read(row.data(), truth.nx)) {
            header.fail("cannot read the image");
        }
        copy_row(row, truth, iy, header);
    }
    return truth;
}

std::string truth_pgm(const Truth &truth, const std::string &header_comment)
{
    std::string bytes = "P5\n# gpom-truth 1";
    for (const double value : {truth.x0_m, truth.y0_m, truth.cell_m}) {
        bytes += ' ';
        append_number(bytes, value);
    }
    bytes += "\n# ";
    for (const char c : header_comment) {
        bytes += c;
        bytes += c == '\n' ? "# " : "";
    }
    bytes += '\n' + std::to_string(truth.nx) + ' ' + std::to_string(truth.ny) + "\n255\n";
    for (int iy = truth.ny - 1; iy >= 0; --iy) {
        for (int ix = 0; ix < truth.nx; ++ix) {
            bytes += truth.at(ix, iy) ? kOccupied : kFree;
        }
    }
    return bytes;
}

void write_truth(const std::string &path, const Truth &truth, const std::string &header_comment)
{
    replace_files({{path, truth_pgm(truth, header_comment)}});
}

} // namespace gpom_tools

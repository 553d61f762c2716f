#include "ports/host/toml_table.hpp"

#include "ports/host/nearest_word.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

namespace gpom_tools
{

namespace
{

/// Get the elements of an array of numbers. False: an element is not a number.
bool read_numbers(const toml::array &array, std::vector<double> &numbers)
{
    for (const toml::node &node : array) {
        const auto value = node.value<double>();
        if (!value) {
            return false;
        }
        numbers.push_back(*value);
    }
    return true;
}

/// Our files are smaller.
constexpr std::size_t kFileBytesMax = 1 << 20;

/// True if a line has a character beyond ASCII outside of quotes and comments, or inside a
/// multi-line string. The ends of multi-line strings are not searched for.
bool has_foreign_character(const std::string &line)
{
    char quote = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (quote == 0 && c == '#') {
            return false;
        }
        if (quote == '"' && c == '\\') {
            ++i; // skip the escaped character
        } else if (quote == 0 && (c == '"' || c == '\'')) {
            quote = c;
        } else if (c == quote) {
            quote = 0;
        } else if (quote == 0 && static_cast<unsigned char>(c) > 0x7f) {
            return true;
        }
    }
    return false;
}

/// Refuse characters beyond ASCII that are neither in quotes nor in a comment. At most of them
/// toml++ 3.3.0 runs into code that the compiler takes for unreachable.
void refuse_foreign_characters(const std::string &path, const std::string &text)
{
    std::istringstream lines(text);
    std::string line;
    for (int i_line = 1; std::getline(lines, line); ++i_line) {
        if (has_foreign_character(line)) {
            throw FileError(path, i_line,
                            "not TOML: only words in quotes and comments may have characters "
                            "beyond ASCII");
        }
    }
}

} // namespace

std::string read_small_file(const std::string &path, const std::string &kind)
{
    if (std::error_code error; std::filesystem::is_directory(path, error)) {
        throw FileError(path, 0, "is a directory; give the name of a " + kind + " file");
    }
    std::ifstream stream(path, std::ios::binary);
    if (!stream) {
        throw FileError(path, 0, "cannot open; give the name of a " + kind + " file");
    }
    std::string text(kFileBytesMax + 1, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(stream.gcount()));
    if (stream.bad() || text.empty()) {
        throw FileError(path, 0, "is empty or cannot be read; give a " + kind + " file");
    }
    if (text.size() > kFileBytesMax) {
        throw FileError(path, 0, "is over 1 MB; give a " + kind + " file");
    }
    return text;
}

toml::table parse_toml_text(const std::string &path, const std::string &text)
{
    refuse_foreign_characters(path, text);
    try {
        return toml::parse(text, path);
    } catch (const toml::parse_error &error) {
        throw FileError(path, static_cast<int>(error.source().begin.line),
                        "not TOML: " + std::string(error.description()));
    }
}

toml::table parse_toml(const std::string &path, const std::string &kind)
{
    return parse_toml_text(path, read_small_file(path, kind));
}

TomlTable::TomlTable(std::string path, const toml::table &table, std::string name)
    : path_(std::move(path)), name_(std::move(name)), table_(table)
{
}

void TomlTable::fail(const std::string &key, const std::string &text) const
{
    const toml::node *node = table_.get(key);
    if (node == nullptr && !name_.empty()) {
        node = &table_;
    }
    const int line = node != nullptr ? static_cast<int>(node->source().begin.line) : 0;
    throw FileError(path_, line, (name_.empty() ? "" : name_ + ".") + text);
}

double TomlTable::number(const std::string &key) const
{
    require(key);
    const auto value = table_[key].value<double>();
    if (!value) {
        fail(key, key + ": must be a number");
    }
    return *value;
}

bool TomlTable::truth(const std::string &key) const
{
    require(key);
    const auto value = table_[key].value_exact<bool>();
    if (!value) {
        fail(key, key + ": must be true or false");
    }
    return *value;
}

std::int64_t TomlTable::whole(const std::string &key, std::int64_t low, std::int64_t high) const
{
    require(key);
    const auto value = table_[key].value_exact<std::int64_t>();
    if (!value || *value < low || *value > high) {
        fail(key, key + ": must be a whole number from " + std::to_string(low) + " to " +
                      std::to_string(high) +
                      (value ? " (here " + std::to_string(*value) + ")" : ""));
    }
    return *value;
}

std::string TomlTable::word(const std::string &key) const
{
    require(key);
    const auto value = table_[key].value<std::string>();
    if (!value) {
        fail(key, key + ": must be a word in quotes");
    }
    return *value;
}

std::vector<double> TomlTable::numbers(const std::string &key) const
{
    require(key);
    std::vector<double> values;
    const toml::array *const array = table_[key].as_array();
    if (array == nullptr || !read_numbers(*array, values)) {
        fail(key, key + ": must be a list of numbers");
    }
    return values;
}

std::vector<std::vector<double>> TomlTable::number_lists(const std::string &key) const
{
    require(key);
    std::vector<std::vector<double>> lists;
    const toml::array *const array = table_[key].as_array();
    bool is_good = array != nullptr;
    for (std::size_t i = 0; is_good && i < array->size(); ++i) {
        const toml::array *const inner = array->get(i)->as_array();
        lists.emplace_back();
        is_good = inner != nullptr && read_numbers(*inner, lists.back());
    }
    if (!is_good) {
        fail(key, key + ": must be a list of lists of numbers");
    }
    return lists;
}

TomlTable TomlTable::table(const std::string &key) const
{
    require(key);
    const toml::table *const inner = table_[key].as_table();
    if (inner == nullptr) {
        fail(key, key + ": must be a table, [" + full(key) + "]");
    }
    return {path_, *inner, full(key)};
}

std::vector<TomlTable> TomlTable::tables(const std::string &key) const
{
    require(key);
    std::vector<TomlTable> found;
    const toml::array *const array = table_[key].as_array();
    for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
        if (const toml::table *const inner = array->get(i)->as_table(); inner != nullptr) {
            found.emplace_back(path_, *inner, full(key) + "[" + std::to_string(i) + "]");
        }
    }
    if (found.empty() || found.size() != array->size()) {
        fail(key, key + ": must be one or more tables, [[" + full(key) + "]]");
    }
    return found;
}

void TomlTable::refuse_keys_beyond(const std::set<std::string> &known,
                                   const std::string &remedy) const
{
    for (const auto &[key, node] : table_) {
        const std::string name(key.str());
        if (known.count(name) == 0) {
            const std::string meant = nearest_word(name, known);
            fail(name, name + ": unknown key" +
                           (meant.empty() ? remedy : "; did you mean " + meant + "?"));
        }
    }
}

void TomlTable::require(const std::string &key) const
{
    if (!has(key)) {
        fail(key, key + ": missing; add it");
    }
}

std::string TomlTable::full(const std::string &key) const
{
    return name_.empty() ? key : name_ + "." + key;
}

} // namespace gpom_tools

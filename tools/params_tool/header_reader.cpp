#include "tools/params_tool/header_reader.hpp"

#include "ports/host/file_error.hpp"
#include "ports/host/nearest_word.hpp"
#include "ports/host/params_fields.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/text_lines.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <limits>
#include <map>
#include <vector>

namespace gpom_tools
{
namespace
{

/// A text of C with comments as blanks; lines stay where they are.
std::string without_comments(std::string text)
{
    for (std::size_t i = 0; i + 1 < text.size(); ++i) {
        std::size_t end = i;
        if (text.compare(i, 2, "/*") == 0) {
            end = text.find("*/", i + 2);
            end = end == std::string::npos ? text.size() : end + 2;
        } else if (text.compare(i, 2, "//") == 0) {
            end = std::min(text.find('\n', i), text.size());
        }
        for (; i < end; ++i) {
            text[i] = text[i] == '\n' ? '\n' : ' ';
        }
    }
    return text;
}

bool is_of_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

int line_at(const std::string &text, std::size_t at)
{
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(at);
    return 1 + static_cast<int>(std::count(text.begin(), end, '\n'));
}

/// `.field = value` and where it stands.
struct Entry {
    std::string value;
    int line;
};

using Entries = std::map<std::string, Entry>;

/// Walks through a text of C without comments.
class Scanner {
public:
    Scanner(const std::string &path, const std::string &text) : path_(path), text_(text) {}

    [[noreturn]] void fail(const std::string &message) const
    {
        throw FileError(path_, line(), message);
    }

    int line() const { return line_at(text_, at_); }

    /// Go behind the next word like this one; false if there is none.
    bool skip_past(const std::string &word)
    {
        for (std::size_t i = text_.find(word, at_); i != std::string::npos;
             i = text_.find(word, i + 1)) {
            const std::size_t end = i + word.size();
            if ((i == 0 || !is_of_word(text_[i - 1])) &&
                (end == text_.size() || !is_of_word(text_[end]))) {
                at_ = end;
                return true;
            }
        }
        return false;
    }

    bool take(char c)
    {
        skip_blanks();
        if (at_ >= text_.size() || text_[at_] != c) {
            return false;
        }
        ++at_;
        return true;
    }

    std::string word()
    {
        skip_blanks();
        const std::size_t begin = at_;
        while (at_ < text_.size() && is_of_word(text_[at_])) {
            ++at_;
        }
        return text_.substr(begin, at_ - begin);
    }

    /// Up to the comma or brace that ends it.
    std::string value()
    {
        skip_blanks();
        const std::size_t begin = at_;
        at_ = std::min(text_.find_first_of(",}", at_), text_.size());
        const std::string found = text_.substr(begin, at_ - begin);
        return found.substr(0, found.find_last_not_of(" \t\r\n") + 1);
    }

private:
    void skip_blanks()
    {
        while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) {
            ++at_;
        }
    }

    const std::string &path_;
    const std::string &text_;
    std::size_t at_ = 0;
};

Entries entries_inside(Scanner &scanner)
{
    Entries entries;
    while (!scanner.take('}')) {
        const bool has_dot = scanner.take('.');
        const int line = scanner.line();
        const std::string field = scanner.word();
        if (!has_dot || field.empty() || !scanner.take('=')) {
            scanner.fail("expected `.field = value`; name each field");
        }
        const std::string value = scanner.value();
        if (value.empty()) {
            scanner.fail(field + ": has no value");
        }
        if (!entries.insert({field, {value, line}}).second) {
            scanner.fail(field + ": given twice");
        }
        static_cast<void>(scanner.take(','));
    }
    return entries;
}

/// Of the one constant in the file.
Entries entries_of(const std::string &path, const std::string &text)
{
    Scanner scanner(path, text);
    Entries found;
    std::string found_name;
    while (scanner.skip_past("gpom_params_t")) {
        const std::string name = scanner.word();
        if (name.empty() || !scanner.take('=') || !scanner.take('{')) {
            continue; // used, not defined
        }
        if (!found_name.empty()) {
            scanner.fail("holds two sets of parameters, " + found_name + " and " + name +
                         "; keep one in each file");
        }
        found_name = name;
        found = entries_inside(scanner);
    }
    if (found_name.empty()) {
        throw FileError(path, 0,
                        "holds no parameters; give a C header with one constant `gpom_params_t "
                        "NAME = { .field = value, ... }`");
    }
    return found;
}

[[noreturn]] void fail_at(const std::string &path, const Entry &entry, const std::string &message)
{
    throw FileError(path, entry.line, message);
}

/// As a C compiler converts the literal to float.
float float_of(const std::string &path, const std::string &field, const Entry &entry)
{
    const bool is_hex = entry.value.find_first_of("xX") != std::string::npos;
    const bool has_suffix = entry.value.find_first_of(is_hex ? "pP" : "fF") != std::string::npos &&
                            std::tolower(entry.value.back()) == 'f';
    const std::string digits = entry.value.substr(0, entry.value.size() - (has_suffix ? 1 : 0));
    char *end = nullptr;
    const float value = has_suffix ? std::strtof(digits.c_str(), &end)
                                   : static_cast<float>(std::strtod(digits.c_str(), &end));
    if (digits.empty() || *end != '\0') {
        fail_at(path, entry, field + ": '" + entry.value + "' is not a number");
    }
    return value;
}

std::uint16_t count_of(const std::string &path, const std::string &field, const Entry &entry)
{
    std::string digits = entry.value;
    while (!digits.empty() && (std::tolower(digits.back()) == 'u')) {
        digits.pop_back();
    }
    char *end = nullptr;
    const long value = std::strtol(digits.c_str(), &end, 0);
    if (digits.empty() || *end != '\0' || value < 0 ||
        value > std::numeric_limits<std::uint16_t>::max()) {
        fail_at(path, entry,
                field + ": '" + entry.value + "' is not a whole number from 0 to 65535");
    }
    return static_cast<std::uint16_t>(value);
}

template <class Named, std::size_t n>
std::int32_t constant_of(const std::string &path, const std::string &field, const Entry &entry,
                         const Named (&known)[n])
{
    std::string names;
    for (std::size_t i = 0; i < n; ++i) {
        if (entry.value == known[i].constant || entry.value == std::to_string(i)) {
            return static_cast<std::int32_t>(i);
        }
        names += (i > 0 ? ", " : "") + std::string(known[i].constant);
    }
    fail_at(path, entry, field + ": '" + entry.value + "' is not one of " + names);
}

void refuse_unknown(const std::string &path, const Entries &entries)
{
    std::vector<std::string> known = {"struct_bytes", "kernel", "frame"};
    for (const ParamField &field : kParamFields) {
        known.emplace_back(field.field);
    }
    for (const auto &[field, entry] : entries) {
        if (std::find(known.begin(), known.end(), field) == known.end()) {
            const std::string meant = nearest_word(field, known);
            fail_at(path, entry,
                    field + ": unknown field" +
                        (meant.empty() ? "; remove it" : "; did you mean " + meant + "?"));
        }
    }
}

gpom_params_t params_from(const std::string &path, const Entries &entries)
{
    gpom_params_t params = {};
    params.struct_bytes = sizeof params;
    for (const auto &[name, entry] : entries) {
        if (name == "kernel") {
            params.kernel = constant_of(path, name, entry, kKernels);
        } else if (name == "frame") {
            params.frame = constant_of(path, name, entry, kFrames);
        }
        for (const ParamField &field : kParamFields) {
            if (name == field.field && field.number != nullptr) {
                params.*field.number = float_of(path, name, entry);
            } else if (name == field.field) {
                params.*field.count = count_of(path, name, entry);
            }
        }
    }
    return params;
}

/// Where the field stands that a problem text names first; 0: it is left out.
int line_of(const std::string &problem, const Entries &entries)
{
    const std::string key = problem.substr(0, problem.find_first_of(":,"));
    for (const ParamField &field : kParamFields) {
        if (const auto found = entries.find(field.field);
            key == field.key && found != entries.end()) {
            return found->second.line;
        }
    }
    return 0;
}

} // namespace

bool looks_like_header(const std::string &text)
{
    const std::string code = without_comments(text);
    std::string other_lines;
    for (std::size_t i = 0; i < code.size();) {
        const std::size_t end = std::min(code.find('\n', i), code.size());
        const std::string line(trimmed(code.substr(i, end - i)));
        if (line.rfind("#include <", 0) == 0 || line.rfind("#include \"", 0) == 0) {
            return true;
        }
        other_lines += line.rfind('#', 0) == 0 ? "\n" : line + "\n";
        i = end + 1;
    }
    return Scanner("", other_lines).skip_past("gpom_params_t");
}

gpom_params_t params_of_header(const std::string &path, const std::string &text)
{
    const Entries entries = entries_of(path, without_comments(text));
    refuse_unknown(path, entries);
    gpom_params_t params = params_from(path, entries);
    const char *problem = nullptr;
    if (gpom_params_check(&params, &problem) != GPOM_OK) {
        throw FileError(path, line_of(problem, entries), problem_with_values(params, problem));
    }
    reset_unused(params);
    return params;
}

} // namespace gpom_tools

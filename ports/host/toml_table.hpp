// Tables of a TOML file. Errors name file, line and key.
#ifndef GPOM_PORTS_HOST_TOML_TABLE_HPP
#define GPOM_PORTS_HOST_TOML_TABLE_HPP

#include "ports/host/file_error.hpp"

// At some texts, such as "[^" and "a=[}", an assertion of toml++ 3.3.0 would fail. Without
// assertions toml++ refuses these texts itself.
#define TOML_ASSERT(...) static_cast<void>(0)
#include <toml++/toml.h>

#include <cstdint>
#include <set>
#include <string>
#include <vector>

namespace gpom_tools
{

/// The whole of a file of at most 1 MB. `kind` says in errors what it should be, e.g. "parameters".
/// Throws FileError: missing, a directory, empty, larger or endless.
std::string read_small_file(const std::string &path, const std::string &kind);

/// Parse a text; `path` is for errors alone. Throws FileError: TOML syntax.
toml::table parse_toml_text(const std::string &path, const std::string &text);

/// Parse a file. `kind` says in errors what it should be, e.g. "parameters". Throws FileError:
/// missing, empty or endless file, TOML syntax.
toml::table parse_toml(const std::string &path, const std::string &kind);

/// A whole file or a table in it. A missing key or a value of a wrong type throws FileError with
/// the line of the key. If the key is missing, it is the line of the table, or no line for the
/// whole file.
class TomlTable {
public:
    /// `name` stands before the keys in errors, for example "sensor[1]". Empty: the whole file.
    TomlTable(std::string path, const toml::table &table, std::string name = "");

    [[noreturn]] void fail(const std::string &key, const std::string &text) const;

    bool has(const std::string &key) const { return table_.contains(key); }
    double number(const std::string &key) const;
    bool truth(const std::string &key) const;
    std::int64_t whole(const std::string &key, std::int64_t low, std::int64_t high) const;
    std::string word(const std::string &key) const;
    /// An array of numbers.
    std::vector<double> numbers(const std::string &key) const;
    /// An array of arrays of numbers.
    std::vector<std::vector<double>> number_lists(const std::string &key) const;

    /// A table inside this one.
    TomlTable table(const std::string &key) const;
    /// An array of tables inside this one, [[key]].
    std::vector<TomlTable> tables(const std::string &key) const;

    /// Refuse unknown keys. The error suggests the key that was probably meant, or gives `remedy`.
    void refuse_keys_beyond(const std::set<std::string> &known, const std::string &remedy) const;

private:
    void require(const std::string &key) const;
    std::string full(const std::string &key) const;

    std::string path_;
    std::string name_;
    const toml::table &table_;
};

} // namespace gpom_tools

#endif

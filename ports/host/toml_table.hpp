// Tables of a TOML file, read with errors that name file, line and key.
#ifndef GPOM_PORTS_HOST_TOML_TABLE_HPP
#define GPOM_PORTS_HOST_TOML_TABLE_HPP

#include "ports/host/file_error.hpp"

// Two assertions of toml++ 3.3.0 fail at texts that it then refuses itself ("[^", "a=[}").
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

/// A whole table or one inside it. Whatever is missing or of another type throws FileError with the
/// line of the key, or of the table if the key is missing (none for the whole file).
class TomlTable {
public:
    /// `name` goes before the keys in errors, "sensor[1]" say; empty: the whole file.
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

    /// A table inside.
    TomlTable table(const std::string &key) const;
    /// An array of tables inside, [[key]].
    std::vector<TomlTable> tables(const std::string &key) const;

    /// Behind "unknown key" the key is put that was meant, or `remedy` if none is like it.
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

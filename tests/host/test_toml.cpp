// TOML texts that are none: whatever they are, they are refused with their line.
#include "ports/host/toml_table.hpp"

#include <doctest/doctest.h>

#include <unistd.h>

#include <fstream>
#include <string>

using gpom_tools::FileError;
using gpom_tools::parse_toml;

namespace
{

struct TextFile {
    explicit TextFile(const std::string &text) { std::ofstream(path, std::ios::binary) << text; }
    ~TextFile() { unlink(path.c_str()); }

    std::string path = "/tmp/gpom_test_toml_" + std::to_string(getpid()) + ".toml";
};

/// What is said of a text; empty: it is TOML.
std::string refusal_of(const std::string &text)
{
    const TextFile file(text);
    try {
        parse_toml(file.path, "test");
        return "";
    } catch (const FileError &error) {
        return "line " + std::to_string(error.line) + ": " + error.message;
    }
}

void check_is_toml_or_refused(const std::string &text)
{
    const std::string refusal = refusal_of(text);
    REQUIRE((refusal.empty() || refusal.find("not TOML: ") != std::string::npos));
}

} // namespace

// In builds with assertions some of these ended the program; in others a character beyond ASCII led
// into code that the compiler takes for unreachable.
TEST_CASE("every text of one byte is TOML or refused")
{
    for (int a = 0; a < 256; ++a) {
        check_is_toml_or_refused(std::string(1, static_cast<char>(a)));
    }
    CHECK(refusal_of("[^") == "line 1: not TOML: Error while parsing key: expected bare key "
                              "starting character or string delimiter, saw '^'");
}

TEST_CASE("every text of two bytes is TOML or refused" * doctest::test_suite("campaign"))
{
    for (int pair = 0; pair < 256 * 256; ++pair) {
        check_is_toml_or_refused({static_cast<char>(pair / 256), static_cast<char>(pair % 256)});
    }
}

TEST_CASE("characters beyond ASCII stand in quotes and comments only")
{
    for (const char *const good :
         {"a = \"\u00fc\" # \u00fc\n", "# '\u00fc\na = '\\\\\u00fc'", "a = \"\\\"\u00fc\""}) {
        CAPTURE(good);
        CHECK(refusal_of(good).empty());
    }
    for (const char *const bad :
         {"a = 1\n\u00fc = 2", "a = 'x'\nb = 'x' \u00d7", "\na\u00d7 = 1", "# '\n[\u00fc]"}) {
        CAPTURE(bad);
        CHECK(refusal_of(bad) == "line 2: not TOML: only words in quotes and comments may have "
                                 "characters beyond ASCII");
    }
}

TEST_CASE("a file without end, or far too long, is refused")
{
    CHECK_THROWS_WITH_AS(parse_toml("/dev/zero", "test"),
                         "/dev/zero: is over 1 MB; give a test file", FileError);
    CHECK(refusal_of(std::string(1 << 20, '\n')).empty());
    CHECK(refusal_of(std::string((1 << 20) + 1, '\n')) == "line 0: is over 1 MB; give a test file");
}

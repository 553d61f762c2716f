// What the main() functions of all tools share: one-line errors and exit codes.
#ifndef GPOM_PORTS_HOST_COMMAND_LINE_HPP
#define GPOM_PORTS_HOST_COMMAND_LINE_HPP

#include "ports/host/nearest_word.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <vector>

namespace gpom_tools
{

/// Exit code of a usage error, a bad file or a refused value.
constexpr int kExitUsage = 2;

/// Print "TOOL: TEXT" on stderr on one line. Returns kExitUsage.
inline int fail(const std::string &tool, std::string text)
{
    while (!text.empty() && text.back() == '\n') {
        text.pop_back();
    }
    for (char &c : text) {
        c = c == '\n' ? ' ' : c;
    }
    std::fprintf(stderr, "%s: %s\n", tool.c_str(), text.c_str());
    return kExitUsage;
}

/// Options and subcommands of the command that was called.
inline std::vector<std::string> known_words(const CLI::App &app)
{
    std::vector<std::string> words;
    for (const CLI::Option *const option : app.get_options()) {
        for (const std::string &name : option->get_lnames()) {
            words.push_back("--" + name);
        }
    }
    for (const CLI::App *const subcommand :
         app.get_subcommands([](const CLI::App *) { return true; })) {
        words.push_back(subcommand->get_name());
    }
    return words;
}

/// "; did you mean --scans?" for the first unexpected word. Empty: no known word is similar.
inline std::string meant_instead(const CLI::App &app)
{
    for (const CLI::App *const called : app.get_subcommands()) {
        const std::string meant = meant_instead(*called);
        if (!meant.empty()) {
            return meant;
        }
    }
    for (const std::string &word : app.remaining()) {
        const std::string name = word.substr(0, word.find('='));
        const std::string meant = nearest_word(name, known_words(app));
        if (!meant.empty()) {
            return "; did you mean " + meant + "?";
        }
    }
    return "";
}

/// Check for a number in a range, both ends included. CLI::Range is not used, because it accepts
/// NaN.
inline CLI::Validator between(double low, double high)
{
    return CLI::Validator(
        [low, high](std::string &text) {
            double value = 0.0;
            const bool is_number = CLI::detail::lexical_cast(text, value);
            if (is_number && value >= low && value <= high) {
                return std::string();
            }
            char range[60];
            std::snprintf(range, sizeof range, " is not a number from %g to %g", low, high);
            return text + range;
        },
        "");
}

/// Parse the command line, then run the body. Help goes to stdout with exit code 0. Any error is
/// one line on stderr and exit code 2. The tool's name is the application's name.
inline int run_tool(CLI::App &app, int argc, const char *const *argv,
                    const std::function<void()> &body)
{
    const std::string tool = app.get_name();
    try {
        app.parse(argc, argv);
        body();
        return 0;
    } catch (const CLI::CallForHelp &) {
        std::fputs(app.help().c_str(), stdout);
        return 0;
    } catch (const CLI::ParseError &error) {
        return fail(tool, error.what() + meant_instead(app) + "; see " + tool + " --help");
    } catch (const std::exception &error) {
        return fail(tool, error.what());
    }
}

} // namespace gpom_tools

#endif

#include "tools/params_tool/params_file.hpp"

#include "ports/host/file_error.hpp"
#include "ports/host/params_fields.hpp"
#include "ports/host/params_toml.hpp"
#include "ports/host/text_lines.hpp"
#include "ports/host/toml_table.hpp"
#include "tools/params_tool/header_reader.hpp"
#include "tools/params_tool/writer.hpp"

#include <algorithm>
#include <sstream>

namespace gpom_tools
{
namespace
{

constexpr const char *kRecordMagic = "GPMP";

ParamsKind kind_of(const std::string &path, const std::string &bytes)
{
    if (bytes.rfind(kRecordMagic, 0) == 0) {
        return ParamsKind::kRecord;
    }
    if (bytes.find('\0') != std::string::npos) {
        throw FileError(path, 0,
                        "is neither text nor a record, which begins with GPMP; give TOML, a C "
                        "header or a record of gpom_params_save()");
    }
    return looks_like_header(bytes) ? ParamsKind::kHeader : ParamsKind::kToml;
}

gpom_params_t params_of_record(const std::string &path, const std::string &bytes)
{
    gpom_params_t params;
    const char *problem = nullptr;
    const gpom_status_t status = gpom_params_load(
        &params, reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size(), &problem);
    if (status != GPOM_OK) {
        throw FileError(path, 0, problem != nullptr ? problem : gpom_status_str(status));
    }
    reset_unused(params);
    return params;
}

/// A line of a comment without its mark and one blank behind that.
std::string without_mark(const std::string &line, std::size_t mark_bytes)
{
    const std::size_t n = std::min(mark_bytes, line.size());
    return line.substr(n < line.size() && line[n] == ' ' ? n + 1 : n) + "\n";
}

std::string toml_comment(const std::string &text)
{
    std::string comment;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line) && line.rfind('#', 0) == 0;) {
        comment += without_mark(line, 1);
    }
    return comment;
}

/// Of the block comment that the text begins with, without the line that params_header() adds.
std::string header_comment(const std::string &text)
{
    if (text.rfind("/*", 0) != 0) {
        return "";
    }
    std::istringstream lines(text.substr(2, text.find("*/") - 2));
    std::string comment, line;
    std::getline(lines, line);
    const bool is_ours = trimmed(line) == kHeaderMark;
    if (!is_ours) {
        comment = without_mark(line, 0);
    }
    for (bool is_first = is_ours; std::getline(lines, line); is_first = false) {
        const std::string inner(trimmed(line));
        if (!(is_first && inner == "*") && !inner.empty()) {
            comment += without_mark(inner, inner.rfind('*', 0) == 0 ? 1 : 0);
        }
    }
    return comment;
}

} // namespace

ParamsFile read_params_file(const std::string &path)
{
    const std::string bytes = read_small_file(path, "parameters");
    const ParamsKind kind = kind_of(path, bytes);
    switch (kind) {
    case ParamsKind::kRecord:
        return {kind, params_of_record(path, bytes), ""};
    case ParamsKind::kHeader:
        return {kind, params_of_header(path, bytes), header_comment(bytes)};
    case ParamsKind::kToml:
        break;
    }
    return {kind, params_of_toml(path, bytes), toml_comment(bytes)};
}

} // namespace gpom_tools

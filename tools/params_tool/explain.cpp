#include "tools/params_tool/explain.hpp"

#include "ports/host/params_fields.hpp"
#include "ports/host/params_toml.hpp"
#include "tools/params_tool/writer.hpp"

#include <iterator>
#include <sstream>
#include <stdexcept>

namespace gpom_tools
{
namespace
{

constexpr std::size_t kColumns = 90;

struct Meaning {
    const char *key;
    const char *unit;
    const char *text;
    const char *neutral;
};

constexpr const char *kNoNeutral = "none; it is always needed";
constexpr const char *kOff = "0: switched off";

constexpr Meaning kMeanings[] = {
    {"sf2", "1",
     "Signal variance: how far the latent function may go from 0, free being -1 and occupied +1. "
     "Greater, compared with sn2: each beam counts more.",
     kNoNeutral},
    {"s0", "1", "Kernel nn alone: variance of the bias weight.", kNoNeutral},
    {"s1", "1/m2",
     "Kernel nn alone: variance of the position weights. Greater: what a beam says reaches less "
     "far.",
     kNoNeutral},
    {"ell_m", "m",
     "Length scale: how far what a beam says reaches. With kernel askey nothing reaches farther "
     "than this.",
     kNoNeutral},
    {"sn2", "1",
     "Noise variance of hits. Greater: one hit is believed less, and several must agree.",
     kNoNeutral},
    {"sn2_free", "1", "Noise variance of the points on free segments, likewise.",
     "the value of sn2, which TOML takes if the key is absent"},
    {"alpha", "1",
     "Slope of the sigmoid that makes a probability of the latent mean and variance. Greater: "
     "probabilities nearer to 0 and 1.",
     kNoNeutral},
    {"beta", "1",
     "Offset of that sigmoid. Greater: all places are likelier occupied, most of all those that "
     "no beam came near.",
     kNoNeutral},
    {"gap_m", "m",
     "A free segment ends this far before its hit, so that the two do not contradict each other.",
     "0: free up to the hit"},
    {"p_occupied", "probability", "A place is of class occupied at or above this probability.",
     kNoNeutral},
    {"p_free", "probability", "A place is of class free at or below this probability.", kNoNeutral},
    {"hits", "count",
     "So many nearest hits take part in one answer. Time grows with the cube of "
     "hits + free.",
     kNoNeutral},
    {"free", "count", "So many nearest free segments take part in one answer.", kNoNeutral},
    {"scan_points_max", "count",
     "Of each kind at most so many points of one scan take part, so that one scan cannot outvote "
     "the others.",
     "0: no limit"},
    {"fading", "count",
     "So many last neighbours of each kind lose weight with their distance, so that answers do "
     "not jump where neighbours change.",
     kOff},
    {"depth_m", "m", "Behind a hit, this far, the place counts as occupied: walls have depth.",
     kOff},
    {"anisotropy", "1",
     "How much distances shrink along the line on which the hits near a place lie: walls go on "
     "in their own direction.",
     kOff},
    {"vote", "1",
     "Weight of the side from which beams came: places behind a surface are likelier occupied, "
     "places before it likelier free.",
     kOff},
    {"log_hit_first", "1", "Weight of the logarithm of the distance to the nearest hit.", kOff},
    {"log_hit_last", "1", "The same of the last hit that takes part.", kOff},
    {"log_free_first", "1", "The same of the nearest free point.", kOff},
    {"log_free_last", "1", "The same of the last free point that takes part.", kOff},
    {"fade_m", "m",
     "What the neighbours say fades with the distance to the nearest of them; from here on the "
     "answer is the prior.",
     "0: never fades"},
    {"beta_far", "1",
     "Added to beta as far as fade_m takes the neighbours away: places far from all beams have an "
     "offset of their own.",
     "0: beta everywhere"},
    {"sn2_once", "1",
     "Live maps alone (keep_m > 0): noise variance of a hit that scans of one time alone saw, "
     "until another time confirms it.",
     "0: as sn2"},
    {"line", "1",
     "Weight of how far a place is behind the line through the hits near it: it makes surfaces "
     "sharper.",
     kOff}};

static_assert(std::size(kMeanings) == std::size(kParamFields), "a field is not explained");

constexpr const char *kKernelMeanings[] = {
    "neural network (the paper's eq. 4): surfaces may be sharp, and what is known reaches far",
    "Matern 1/2, exp(-r / ell_m): rough", "Matern 3/2: once differentiable, smoother",
    "squared exponential: very smooth, which rounds corners",
    "Askey, (1 - r / ell_m)^3: nothing beyond ell_m; more than 64 neighbours are possible"};

constexpr const char *kFrameMeanings[] = {
    "coordinates are relative to the place that is asked for: answers do not depend on where the "
    "map begins",
    "coordinates are relative to the map's origin, as in the paper"};

const Meaning &meaning_of(const ParamField &field)
{
    for (const Meaning &meaning : kMeanings) {
        if (std::string(field.key) == meaning.key) {
            return meaning;
        }
    }
    throw std::runtime_error(std::string(field.key) + ": not explained");
}

/// Lines of at most kColumns, each after an indent.
std::string wrapped(const std::string &text, const std::string &indent)
{
    std::string all, line = indent;
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        if (line.size() > indent.size() && line.size() + 1 + word.size() > kColumns) {
            all += line + "\n";
            line = indent;
        }
        line += (line.size() > indent.size() ? " " : "") + word;
    }
    return all + line + "\n";
}

std::string explained_field(const gpom_params_t &params, const ParamField &field)
{
    const Meaning &meaning = meaning_of(field);
    const std::string value = field.number != nullptr ? number_text(params.*field.number)
                                                      : std::to_string(params.*field.count);
    std::string head = std::string(field.key) + " = " + value + " [" + meaning.unit + "]";
    if (field.field != std::string(field.key)) {
        head += std::string("   (in C: ") + field.field + ")";
    }
    return head + "\n" + wrapped(meaning.text, "    ") +
           wrapped(std::string("Neutral: ") + meaning.neutral + ".", "    ") + "\n";
}

std::string rounded(double value)
{
    char text[40];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
}

std::string consequences(const gpom_params_t &params)
{
    const std::string p_free = number_text(params.p_free);
    const std::string p_occupied = number_text(params.p_occupied);
    std::string text = "What follows from them\n\n";
    text += wrapped("A place that no beam came near has the prior probability " +
                        rounded(double{gpom_params_prior_probability(&params)}) +
                        " of being occupied and the prior variance " +
                        rounded(double{gpom_params_prior_variance(&params)}) +
                        "; it is always of class unsure.",
                    "    ");
    text += wrapped("Free is a place whose probability is at most " + p_free +
                        ", occupied one of at least " + p_occupied +
                        ", and unsure all between. Where probabilities are calibrated, no more "
                        "than " +
                        rounded(100.0 * double{params.p_free}) +
                        " % of the places called free are occupied, and no more than " +
                        rounded(100.0 * (1.0 - double{params.p_occupied})) +
                        " % of those called occupied are free. A lower p_free makes free safer and "
                        "rarer; a higher p_occupied likewise for occupied.",
                    "    ");
    return text;
}

const char *kind_text(ParamsKind kind)
{
    switch (kind) {
    case ParamsKind::kToml:
        return "TOML";
    case ParamsKind::kHeader:
        return "a C header";
    case ParamsKind::kRecord:
        break;
    }
    return "a binary record";
}

} // namespace

std::string explained(const std::string &path, const ParamsFile &file)
{
    const gpom_params_t &params = file.params;
    std::string text = path + ": hyperparameters, " + kind_text(file.kind) + "\n\n";
    std::istringstream comment(file.comment);
    for (std::string line; std::getline(comment, line);) {
        text += line.empty() ? "\n" : "    " + line + "\n";
    }
    text += file.comment.empty() ? "" : "\n";
    text += std::string("kernel = ") + kernel_name(params.kernel) + "\n" +
            wrapped(std::string("Covariance function: ") + kKernelMeanings[params.kernel] + ".",
                    "    ") +
            wrapped("Neutral: none; it is always needed.", "    ") + "\n";
    text +=
        std::string("frame = ") + frame_name(params.frame) + "\n" +
        wrapped(std::string("Of the covariance: ") + kFrameMeanings[params.frame] + ".", "    ") +
        wrapped("Neutral: query, which TOML takes if the key is absent.", "    ") + "\n";
    for (const ParamField &field : kParamFields) {
        if (field.is_used_by(params.kernel)) {
            text += explained_field(params, field);
        }
    }
    return text + consequences(params);
}

} // namespace gpom_tools

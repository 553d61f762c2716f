#include "tools/learn/report.hpp"

#include "ports/host/params_toml.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>

namespace gpom_tools
{
namespace
{

std::string formatted(const char *format, ...) __attribute__((format(printf, 1, 2)));

std::string formatted(const char *format, ...)
{
    char text[400];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

} // namespace

std::string attempts_table(const std::vector<JudgedFit> &fits)
{
    std::string text = "kernel    attempt                fit loss  evaluations\n";
    for (const JudgedFit &judged : fits) {
        for (const FitAttempt &attempt : judged.fit.attempts) {
            text += formatted("%-9s %-22s %8.4f  %11d\n", kernel_name(judged.fit.params.kernel),
                              attempt.label.c_str(), attempt.loss, attempt.n_evaluations);
        }
    }
    return text;
}

std::string figures_table(const std::vector<JudgedFit> &fits, std::size_t i_best)
{
    std::string text = "            fit   held out\n"
                       "kernel     loss      AUC   FP@95     NLL     ECE      p0\n";
    for (std::size_t i = 0; i < fits.size(); ++i) {
        const Metrics &m = fits[i].held_out;
        text += formatted("%-8s %6.4f  %7.4f %7.4f %7.4f %7.4f  %6.3f%s\n",
                          kernel_name(fits[i].fit.params.kernel), fits[i].fit.loss, m.auc,
                          m.false_positive_rate, m.nll, m.calibration_error,
                          prior_probability(fits[i].fit.params),
                          i == i_best && fits.size() > 1 ? "  <- written" : "");
    }
    return text;
}

std::string params_comment(const JudgedFit &best, const std::string &command,
                           const std::string &how_learnt, const std::string &how_held_out)
{
    const Metrics &m = best.held_out;
    return "Learnt by: " + command + "\n" + how_learnt + "\n" +
           formatted("Mean loss of the fit %.4f. Held out (%s, %zu points):\n", best.fit.loss,
                     how_held_out.c_str(), m.n_points) +
           formatted("AUC %.4f, FP@95 %.4f, NLL %.4f, ECE %.4f. Prior probability %.3f.\n", m.auc,
                     m.false_positive_rate, m.nll, m.calibration_error,
                     prior_probability(best.fit.params));
}

} // namespace gpom_tools

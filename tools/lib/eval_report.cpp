#include "tools/lib/eval_report.hpp"

#include "tools/lib/raster_csv.hpp"
#include "tools/lib/text_lines.hpp"

#include <utility>

namespace gpom_tools
{
namespace
{

/// Table I of the paper: a simulated street of the same recipe, but not one of ours.
struct PaperResult {
    const char *label;
    double auc;
    double false_positive_rate;
};

constexpr PaperResult kPaperResults[] = {{"GP (paper, its own street)", 0.9948, 0.026},
                                         {"grid (paper, its own street)", 0.8938, 0.1913}};

constexpr int kLabelColumns = 33;

void append_metrics(std::string &text, const Metrics &m)
{
    append_text(text, "  %7.4f %7.4f %7.4f %7.4f", m.auc, m.false_positive_rate, m.nll,
                m.calibration_error);
}

nlohmann::ordered_json json_of(const Metrics &metrics)
{
    nlohmann::ordered_json json;
    json["points"] = metrics.n_points;
    json["share_occupied"] = metrics.share_occupied;
    json["auc"] = metrics.auc;
    json["fp_at_tp95"] = metrics.false_positive_rate;
    json["nll"] = metrics.nll;
    json["ece"] = metrics.calibration_error;
    for (const RocPoint &point : metrics.roc) {
        json["roc"]["fp"].push_back(point.false_positive_rate);
        json["roc"]["tp"].push_back(point.true_positive_rate);
    }
    for (const ReliabilityBin &bin : metrics.reliability) {
        json["reliability"].push_back({{"low", bin.low},
                                       {"high", bin.high},
                                       {"points", bin.n_points},
                                       {"mean_probability", bin.mean_probability},
                                       {"share_occupied", bin.share_occupied}});
    }
    return json;
}

} // namespace

MethodResult judged(MethodResult method, const std::vector<TestPoint> &points,
                    const std::vector<bool> &near_beam)
{
    std::vector<Prediction> all, near;
    for (std::size_t i = 0; i < points.size(); ++i) {
        all.push_back({method.probabilities[i], points[i].occupied});
        if (!near_beam.empty() && near_beam[i]) {
            near.push_back(all.back());
        }
    }
    method.all = measure(std::move(all));
    if (!near_beam.empty()) {
        method.near = measure(std::move(near));
    }
    return method;
}

std::string report_table(const std::vector<MethodResult> &methods)
{
    const bool has_near = !methods.empty() && methods.front().near.has_value();
    std::string text;
    if (has_near) {
        append_text(text, "%-*s  %-31s  %s\n", kLabelColumns, "", "all points",
                    "near: within 5 m of a beam");
    }
    append_text(text, "%-*s", kLabelColumns, "method");
    for (int i = 0; i < (has_near ? 2 : 1); ++i) {
        append_text(text, "  %7s %7s %7s %7s", "AUC", "FP@95", "NLL", "ECE");
    }
    text += '\n';
    for (const MethodResult &method : methods) {
        append_text(text, "%-*s", kLabelColumns, method.label.c_str());
        append_metrics(text, method.all);
        if (method.near) {
            append_metrics(text, *method.near);
        }
        text += method.setting.empty() ? "\n" : "  " + method.setting + "\n";
    }
    for (const PaperResult &paper : kPaperResults) {
        append_text(text, "%-*s  %7.4f %7.4f       -       -\n", kLabelColumns, paper.label,
                    paper.auc, paper.false_positive_rate);
    }
    text +=
        "AUC: area under the ROC curve; FP@95: false-positive rate at true-positive rate 0.95;\n"
        "NLL: mean negative log likelihood; ECE: expected calibration error.\n";
    return text;
}

nlohmann::ordered_json report_json(const std::vector<MethodResult> &methods)
{
    nlohmann::ordered_json json;
    for (const MethodResult &method : methods) {
        nlohmann::ordered_json entry;
        entry["key"] = method.key;
        entry["label"] = method.label;
        if (!method.setting.empty()) {
            entry["setting"] = method.setting;
        }
        entry["all"] = json_of(method.all);
        if (method.near) {
            entry["near"] = json_of(*method.near);
        }
        json["methods"].push_back(entry);
    }
    for (const PaperResult &paper : kPaperResults) {
        json["paper_table_1"].push_back({{"label", paper.label},
                                         {"auc", paper.auc},
                                         {"fp_at_tp95", paper.false_positive_rate}});
    }
    return json;
}

std::string points_csv(const std::vector<TestPoint> &points, const std::vector<bool> &near_beam,
                       const std::vector<MethodResult> &methods)
{
    std::string text = "x,y,truth,near";
    for (const MethodResult &method : methods) {
        text += ',' + method.key;
    }
    text += '\n';
    for (std::size_t i = 0; i < points.size(); ++i) {
        append_text(text, "%.4f,%.4f,%d,%d", points[i].at.x_m, points[i].at.y_m,
                    points[i].occupied ? 1 : 0, near_beam.empty() || near_beam[i] ? 1 : 0);
        for (const MethodResult &method : methods) {
            text += ',';
            append_number(text, method.probabilities[i]); // all digits: they decide the ranking
        }
        text += '\n';
    }
    return text;
}

} // namespace gpom_tools

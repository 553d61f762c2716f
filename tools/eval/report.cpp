#include "tools/eval/report.hpp"

#include "ports/host/text_lines.hpp"
#include "tools/map/raster_csv.hpp"

#include <utility>

namespace gpom_tools
{
namespace
{

/// Table I of the paper. Its simulated street has the same recipe as ours, but is another street.
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

void append_band(std::string &text, const std::optional<Calibration> &band)
{
    if (band) {
        append_text(text, "  %7.4f %7.4f", band->nll, band->calibration_error);
    } else {
        append_text(text, "  %7s %7s", "-", "-");
    }
}

/// Append one line of the profile's table: one figure for each row, `-` for an offset without
/// places.
template <class Figure>
void append_profile(std::string &text, const Profile &profile, const char *format,
                    const Figure &figure)
{
    auto row = profile.rows.begin();
    for (const double offset_m : kProfileOffsets) {
        if (row != profile.rows.end() && row->offset_m == offset_m) {
            append_text(text, format, figure(*row++));
        } else {
            append_text(text, " %6s", "-");
        }
    }
    text += '\n';
}

void append_probability(std::string &text, double probability)
{
    text += ',';
    append_number(text, probability); // all digits, because they decide the ranking
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

nlohmann::ordered_json json_of(const Calibration &band)
{
    return {{"points", band.n_points},
            {"share_occupied", band.share_occupied},
            {"nll", band.nll},
            {"ece", band.calibration_error}};
}

nlohmann::ordered_json json_of(const Profile &profile)
{
    nlohmann::ordered_json json{{"crossing_m", nullptr}, {"rows", nlohmann::ordered_json::array()}};
    if (profile.crossing_m) {
        json["crossing_m"] = *profile.crossing_m;
    }
    for (const ProfileRow &row : profile.rows) {
        json["rows"].push_back({{"offset_m", row.offset_m},
                                {"places", row.n_places},
                                {"mean_probability", row.mean_probability},
                                {"share_free", row.share_free},
                                {"share_occupied", row.share_occupied}});
    }
    return json;
}

MethodResult judged(MethodResult method, const TestSet &test)
{
    std::vector<Prediction> all, near, band;
    for (std::size_t i = 0; i < test.points.size(); ++i) {
        const TestPoint &point = test.points[i];
        const bool is_near = test.near_beam.empty() || test.near_beam[i];
        all.push_back({method.probabilities[i], point.occupied});
        if (is_near && !test.near_beam.empty()) {
            near.push_back(all.back());
        }
        if (is_near && point.in_band) {
            band.push_back(all.back());
        }
    }
    method.all = measure(std::move(all));
    if (!test.near_beam.empty()) {
        method.near = measure(std::move(near));
    }
    if (!band.empty()) {
        method.band = measure_calibration(band);
    }
    const auto first = method.probabilities.begin() +
                       static_cast<std::vector<double>::difference_type>(test.points.size());
    method.profile = profile_of(test.profile, {first, method.probabilities.end()});
    return method;
}

std::string report_table(const std::vector<MethodResult> &methods)
{
    const bool has_near = !methods.empty() && methods.front().near.has_value();
    std::string text;
    append_text(text, "%-*s  %-31s", kLabelColumns, "", "all points");
    if (has_near) {
        append_text(text, "  %-31s", "near: within 5 m of a beam");
    }
    append_text(text, "  %s\n%-*s", "band", kLabelColumns, "method");
    for (int i = 0; i < (has_near ? 2 : 1); ++i) {
        append_text(text, "  %7s %7s %7s %7s", "AUC", "FP@95", "NLL", "ECE");
    }
    append_text(text, "  %7s %7s\n", "NLL", "ECE");
    for (const MethodResult &method : methods) {
        append_text(text, "%-*s", kLabelColumns, method.label.c_str());
        append_metrics(text, method.all);
        if (method.near) {
            append_metrics(text, *method.near);
        }
        append_band(text, method.band);
        text += method.setting.empty() ? "\n" : "  " + method.setting + "\n";
    }
    for (const PaperResult &paper : kPaperResults) {
        append_text(text, "%-*s  %7.4f %7.4f       -       -\n", kLabelColumns, paper.label,
                    paper.auc, paper.false_positive_rate);
    }
    append_text(text,
                "AUC: area under the ROC curve; FP@95: false-positive rate at true-positive rate "
                "0.95;\nNLL: mean negative log likelihood; ECE: expected calibration error;\n"
                "band: %s.\n",
                has_near ? "points near a beam and within 0.5 m of the true surface"
                         : "points within 0.5 m of the return of their beam");
    return text;
}

std::string profile_table(const std::vector<MethodResult> &methods, bool across_truth)
{
    std::string text;
    append_text(text, "\nBy the offset from %s [m], negative before it:\n",
                across_truth ? "the true surface" : "the return along held-out beams");
    append_text(text, "%-*s  %-10s", kLabelColumns, "method", "offset");
    for (const double offset_m : kProfileOffsets) {
        append_text(text, " %6.2f", offset_m);
    }
    text += '\n';
    for (const MethodResult &method : methods) {
        const Profile &profile = method.profile;
        append_text(text, "%-*s  %-10s", kLabelColumns, method.label.c_str(), "mean p");
        append_profile(text, profile, " %6.3f",
                       [](const ProfileRow &row) { return row.mean_probability; });
        std::string crossing;
        if (profile.crossing_m) {
            append_text(crossing, "  mean p is 0.5 at %.3f m", *profile.crossing_m);
        } else {
            crossing = "  mean p never rises to 0.5";
        }
        append_text(text, "%-*s  %-10s", kLabelColumns, crossing.c_str(), "free %");
        append_profile(text, profile, " %6.1f",
                       [](const ProfileRow &row) { return 100.0 * row.share_free; });
        append_text(text, "%-*s  %-10s", kLabelColumns, "", "occupied %");
        append_profile(text, profile, " %6.1f",
                       [](const ProfileRow &row) { return 100.0 * row.share_occupied; });
    }
    text += "free: p <= 0.3; occupied: p >= 0.7.\n";
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
        if (method.band) {
            entry["band"] = json_of(*method.band);
        }
        entry["profile"] = json_of(method.profile);
        json["methods"].push_back(entry);
    }
    for (const PaperResult &paper : kPaperResults) {
        json["paper_table_1"].push_back({{"label", paper.label},
                                         {"auc", paper.auc},
                                         {"fp_at_tp95", paper.false_positive_rate}});
    }
    return json;
}

std::string points_csv(const TestSet &test, const std::vector<MethodResult> &methods)
{
    std::string text = "x,y,truth,near,band";
    for (const MethodResult &method : methods) {
        text += ',' + method.key;
    }
    text += '\n';
    for (std::size_t i = 0; i < test.points.size(); ++i) {
        const TestPoint &point = test.points[i];
        append_text(text, "%.4f,%.4f,%d,%d,%d", point.at.x_m, point.at.y_m, point.occupied ? 1 : 0,
                    test.near_beam.empty() || test.near_beam[i] ? 1 : 0, point.in_band ? 1 : 0);
        for (const MethodResult &method : methods) {
            append_probability(text, method.probabilities[i]);
        }
        text += '\n';
    }
    return text;
}

std::string profile_csv(const TestSet &test, const std::vector<MethodResult> &methods)
{
    std::string text = "x,y,offset";
    for (const MethodResult &method : methods) {
        text += ',' + method.key;
    }
    text += '\n';
    for (std::size_t i = 0; i < test.profile.size(); ++i) {
        const ProfilePlace &place = test.profile[i];
        append_text(text, "%.4f,%.4f,%.2f", place.at.x_m, place.at.y_m,
                    kProfileOffsets[place.i_offset]);
        for (const MethodResult &method : methods) {
            append_probability(text, method.probabilities[test.points.size() + i]);
        }
        text += '\n';
    }
    return text;
}

} // namespace gpom_tools

#include "tools/eval/metrics.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace gpom_tools
{
namespace
{

/// All ROC points by falling threshold. Points of equal probability make one step, because no
/// threshold lies between them.
std::vector<RocPoint> full_roc(std::vector<Prediction> &predictions)
{
    std::sort(predictions.begin(), predictions.end(), [](const Prediction &a, const Prediction &b) {
        return a.probability > b.probability;
    });
    const std::size_t n = predictions.size();
    std::vector<RocPoint> counts{{0.0, 0.0}};
    RocPoint passed{0.0, 0.0};
    for (std::size_t i = 0; i < n; ++i) {
        (predictions[i].occupied ? passed.true_positive_rate : passed.false_positive_rate) += 1.0;
        if (i + 1 == n || predictions[i + 1].probability < predictions[i].probability) {
            counts.push_back(passed);
        }
    }
    for (RocPoint &point : counts) {
        point.false_positive_rate /= passed.false_positive_rate;
        point.true_positive_rate /= passed.true_positive_rate;
    }
    return counts;
}

/// Area by trapezoids. A tie counts half, so that the area is the rank statistic with averaged
/// ranks.
double area_under(const std::vector<RocPoint> &roc)
{
    double area = 0.0;
    for (std::size_t i = 1; i < roc.size(); ++i) {
        area += (roc[i].false_positive_rate - roc[i - 1].false_positive_rate) *
                (roc[i].true_positive_rate + roc[i - 1].true_positive_rate) / 2.0;
    }
    return area;
}

double false_positive_rate_at(const std::vector<RocPoint> &roc, double true_positive_rate)
{
    for (const RocPoint &point : roc) {
        if (point.true_positive_rate >= true_positive_rate - 1e-12) { // k / n may be rounded down
            return point.false_positive_rate;
        }
    }
    return 1.0;
}

/// At most kRocPointsMax points, evenly spaced along the curve by the sum of both rates.
std::vector<RocPoint> thinned(const std::vector<RocPoint> &roc)
{
    if (roc.size() <= kRocPointsMax) {
        return roc;
    }
    const double step = 2.0 / static_cast<double>(kRocPointsMax - 2);
    std::vector<RocPoint> kept{roc.front()};
    for (const RocPoint &point : roc) {
        const double way = point.false_positive_rate - kept.back().false_positive_rate +
                           (point.true_positive_rate - kept.back().true_positive_rate);
        if (way >= step) {
            kept.push_back(point);
        }
    }
    kept.push_back(roc.back());
    return kept;
}

std::vector<ReliabilityBin> reliability_of(const std::vector<Prediction> &predictions)
{
    constexpr double kBins = static_cast<double>(kReliabilityBins);
    std::vector<ReliabilityBin> bins;
    for (std::size_t i = 0; i < kReliabilityBins; ++i) {
        const double low = static_cast<double>(i);
        bins.push_back({low / kBins, (low + 1.0) / kBins, 0, 0.0, 0.0});
    }
    for (const Prediction &prediction : predictions) {
        const auto i = static_cast<std::size_t>(prediction.probability * kBins);
        ReliabilityBin &bin = bins[std::min(i, kReliabilityBins - 1)];
        ++bin.n_points;
        bin.mean_probability += prediction.probability;
        bin.share_occupied += prediction.occupied ? 1.0 : 0.0;
    }
    for (ReliabilityBin &bin : bins) {
        const double n = static_cast<double>(std::max<std::size_t>(bin.n_points, 1));
        bin.mean_probability /= n;
        bin.share_occupied /= n;
    }
    return bins;
}

double calibration_error_of(const std::vector<ReliabilityBin> &bins, std::size_t n_points)
{
    double sum = 0.0;
    for (const ReliabilityBin &bin : bins) {
        sum +=
            static_cast<double>(bin.n_points) * std::abs(bin.mean_probability - bin.share_occupied);
    }
    return sum / static_cast<double>(n_points);
}

double nll_of(const std::vector<Prediction> &predictions)
{
    double sum = 0.0;
    for (const Prediction &prediction : predictions) {
        const double p = std::clamp(prediction.probability, kNllClip, 1.0 - kNllClip);
        sum -= std::log(prediction.occupied ? p : 1.0 - p);
    }
    return sum / static_cast<double>(predictions.size());
}

std::size_t count_occupied(const std::vector<Prediction> &predictions)
{
    const auto n = std::count_if(predictions.begin(), predictions.end(),
                                 [](const Prediction &p) { return p.occupied; });
    return static_cast<std::size_t>(n);
}

} // namespace

Metrics measure(std::vector<Prediction> predictions)
{
    const std::size_t n = predictions.size();
    const std::size_t n_occupied = count_occupied(predictions);
    if (n_occupied == 0 || n_occupied == n) {
        throw std::runtime_error("of " + std::to_string(n) + " test points " +
                                 std::to_string(n_occupied) +
                                 " are occupied; rates need free and occupied ones");
    }
    const Calibration calibration = measure_calibration(predictions);
    const std::vector<RocPoint> roc = full_roc(predictions);
    Metrics metrics;
    metrics.n_points = n;
    metrics.share_occupied = calibration.share_occupied;
    metrics.auc = area_under(roc);
    metrics.false_positive_rate = false_positive_rate_at(roc, kTruePositiveRate);
    metrics.nll = calibration.nll;
    metrics.roc = thinned(roc);
    metrics.reliability = reliability_of(predictions);
    metrics.calibration_error = calibration.calibration_error;
    return metrics;
}

Calibration measure_calibration(const std::vector<Prediction> &predictions)
{
    for (const Prediction &prediction : predictions) {
        if (!(prediction.probability >= 0.0 && prediction.probability <= 1.0)) {
            throw std::runtime_error("a prediction is no probability");
        }
    }
    const std::size_t n = predictions.size();
    if (n == 0) {
        throw std::runtime_error("there are no test points to judge by");
    }
    return {n, static_cast<double>(count_occupied(predictions)) / static_cast<double>(n),
            nll_of(predictions), calibration_error_of(reliability_of(predictions), n)};
}

} // namespace gpom_tools

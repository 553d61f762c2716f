// Measures the quality of probabilities of occupancy: ranking (ROC) and calibration.
#ifndef GPOM_TOOLS_EVAL_METRICS_HPP
#define GPOM_TOOLS_EVAL_METRICS_HPP

#include <cstddef>
#include <vector>

namespace gpom_tools
{

/// Probabilities are clipped to [kNllClip, 1 - kNllClip] for the negative log likelihood.
constexpr double kNllClip = 0.001;
constexpr double kTruePositiveRate = 0.95; ///< The true-positive rate at which the paper's Table I
                                           ///< reads the ROC.
constexpr std::size_t kReliabilityBins = 10;
constexpr std::size_t kRocPointsMax = 500;

/// A predicted probability of occupancy, and the true occupancy.
struct Prediction {
    double probability;
    bool occupied;
};

/// Shares of the free points and of the occupied points whose probability reaches a threshold.
struct RocPoint {
    double false_positive_rate;
    double true_positive_rate;
};

/// Points with probabilities in [low, high); the last bin includes 1. The means of an empty bin are
/// 0.
struct ReliabilityBin {
    double low;
    double high;
    std::size_t n_points;
    double mean_probability;
    double share_occupied;
};

struct Metrics {
    std::size_t n_points;
    double share_occupied;
    double auc;                 ///< Area under the ROC: P(an occupied point has a higher score than
                                ///< a free one), ties count 1/2.
    double false_positive_rate; ///< At the largest threshold whose true-positive rate is at least
                                ///< kTruePositiveRate.
    double nll;                 ///< Mean negative log likelihood [nat].
    double calibration_error;   ///< Expected calibration error over kReliabilityBins bins.
    std::vector<RocPoint> roc;  ///< From (0, 0) to (1, 1), at most kRocPointsMax points.
    std::vector<ReliabilityBin> reliability;
};

/// The measures that need only points of one kind.
struct Calibration {
    std::size_t n_points;
    double share_occupied;
    double nll;
    double calibration_error;
};

/// Throws std::runtime_error without free points or without occupied points, because rates need
/// both.
Metrics measure(std::vector<Prediction> predictions);

/// Needs at least one point.
Calibration measure_calibration(const std::vector<Prediction> &predictions);

} // namespace gpom_tools

#endif

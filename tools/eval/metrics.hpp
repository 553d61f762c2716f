// How good probabilities of occupancy are: ranking (ROC) and calibration.
#ifndef GPOM_TOOLS_EVAL_METRICS_HPP
#define GPOM_TOOLS_EVAL_METRICS_HPP

#include <cstddef>
#include <vector>

namespace gpom_tools
{

/// Probabilities are clipped to [kNllClip, 1 - kNllClip] for the negative log likelihood.
constexpr double kNllClip = 0.001;
constexpr double kTruePositiveRate = 0.95; ///< At which the paper's Table I reads the ROC.
constexpr std::size_t kReliabilityBins = 10;
constexpr std::size_t kRocPointsMax = 500;

/// A predicted probability of occupancy and what is there.
struct Prediction {
    double probability;
    bool occupied;
};

/// Share of the free and of the occupied points whose probability reaches a threshold.
struct RocPoint {
    double false_positive_rate;
    double true_positive_rate;
};

/// Points with probabilities in [low, high), the last bin with 1 too; means are 0 if it is empty.
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
    double auc;                 ///< Area under the ROC: P(occupied scores over free), ties 1/2.
    double false_positive_rate; ///< At the largest threshold with rate kTruePositiveRate or more.
    double nll;                 ///< Mean negative log likelihood [nat].
    double calibration_error;   ///< Expected calibration error over kReliabilityBins bins.
    std::vector<RocPoint> roc;  ///< From (0, 0) to (1, 1), at most kRocPointsMax.
    std::vector<ReliabilityBin> reliability;
};

/// What needs no points of both kinds.
struct Calibration {
    std::size_t n_points;
    double share_occupied;
    double nll;
    double calibration_error;
};

/// Throws std::runtime_error if there are no free or no occupied points: rates need both.
Metrics measure(std::vector<Prediction> predictions);

/// Of one point or more.
Calibration measure_calibration(const std::vector<Prediction> &predictions);

} // namespace gpom_tools

#endif

#include "tools/eval/strong_grid.hpp"

#include "tools/eval/protocol.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace gpom_tools
{
namespace
{

constexpr double kBlurReach = 4.0; ///< The blur is cut at this many standard deviations.
constexpr double kHitWeight = 4.0;
constexpr double kHitPrior = 0.05; ///< Number of returns assumed in every cell before any beam. The
                                   ///< same number of passing beams is assumed.
constexpr double kShareBuilding = 0.8;
constexpr std::size_t kLearningPoints = 3000;
constexpr double kLearningClip = 1e-4;
constexpr double kWeightPrior = 1e-3; ///< Inverse prior variance of the logistic function's
                                      ///< weights.
constexpr int kNewtonStepsMax = 100;

double loss(const Logistic &model, const LogisticSample &sample, double clip)
{
    const double p = std::clamp(model.probability(sample.x), clip, 1.0 - clip);
    return -std::log(sample.occupied ? p : 1.0 - p);
}

double mean_loss(const Logistic &model, const std::vector<LogisticSample> &samples)
{
    double sum = 0.0;
    for (const LogisticSample &sample : samples) {
        sum += loss(model, sample, kLearningClip);
    }
    return sum / static_cast<double>(samples.size());
}

double penalised_loss(const Logistic &model, const std::vector<LogisticSample> &samples)
{
    double sum = 0.0;
    for (const LogisticSample &sample : samples) {
        sum += loss(model, sample, 1e-300);
    }
    const auto &w = model.weights;
    return sum + 0.5 * kWeightPrior * (w[0] * w[0] + w[1] * w[1]);
}

Eigen::Vector3d newton_step(const Logistic &model, const std::vector<LogisticSample> &samples)
{
    Eigen::Vector3d gradient(0.0, kWeightPrior * model.weights[0], kWeightPrior * model.weights[1]);
    Eigen::Matrix3d hessian = Eigen::Vector3d(0.0, kWeightPrior, kWeightPrior).asDiagonal();
    for (const LogisticSample &sample : samples) {
        const Eigen::Vector3d x(1.0, sample.x[0], sample.x[1]);
        const double p = model.probability(sample.x);
        gradient += (p - (sample.occupied ? 1.0 : 0.0)) * x;
        hessian += p * (1.0 - p) * x * x.transpose();
    }
    return -hessian.ldlt().solve(gradient);
}

Logistic moved(const Logistic &model, const Eigen::Vector3d &step)
{
    return {model.bias + step[0], {model.weights[0] + step[1], model.weights[1] + step[2]}};
}

struct CountPair {
    CellCounts hits, free;
};

/// Count the beams. All counted parts of the beams lie inside the raster.
CountPair counts_of(const std::vector<GridBeam> &beams, const gpom_raster_t &raster)
{
    CountPair counts{CellCounts::Zero(raster.ny, raster.nx),
                     CellCounts::Zero(raster.ny, raster.nx)};
    const auto add = [&](CellCounts &cells, double x_m, double y_m, double count) {
        const double u = std::floor((x_m - raster.x0_m) / raster.cell_m);
        const double v = std::floor((y_m - raster.y0_m) / raster.cell_m);
        if (u >= 0.0 && v >= 0.0 && u < raster.nx && v < raster.ny) {
            cells(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(u)) += count;
        }
    };
    for (const GridBeam &beam : beams) {
        const double c = std::cos(beam.bearing_rad), s = std::sin(beam.bearing_rad);
        const double n = std::max(1.0, std::floor(beam.range_m / (0.5 * raster.cell_m)));
        for (double i = 0.5; i < n; i += 1.0) {
            const double way_m = i / n * beam.range_m;
            add(counts.free, beam.x_m + way_m * c, beam.y_m + way_m * s, 0.5);
        }
        if (beam.hit) {
            add(counts.hits, beam.x_m + beam.range_m * c, beam.y_m + beam.range_m * s, 1.0);
        }
    }
    return counts;
}

/// Test points along the given beams, as in the protocol: every second one lies behind a return,
/// and every second free one in the band.
std::vector<TestPoint> learning_points(const std::vector<GridBeam> &beams)
{
    ProtocolRandom random(0);
    std::vector<TestPoint> points;
    for (std::size_t i = 0; i < kLearningPoints && !beams.empty(); ++i) {
        const GridBeam &beam = beams[random.below(beams.size())];
        const double share = random.uniform();
        const bool occupied = i % 2 == 0 && beam.hit;
        const double way_m = occupied ? beam.range_m + kBeyondReturn
                                      : free_distance(beam.range_m, i % 4 == 1, share);
        points.push_back({{beam.x_m + way_m * std::cos(beam.bearing_rad),
                           beam.y_m + way_m * std::sin(beam.bearing_rad)},
                          occupied});
    }
    return points;
}

struct BeamParts {
    std::vector<GridBeam> building, left_out;
};

BeamParts parted(const std::vector<GridBeam> &beams)
{
    ProtocolRandom random(5);
    BeamParts parts;
    for (const GridBeam &beam : beams) {
        (random.uniform() < kShareBuilding ? parts.building : parts.left_out).push_back(beam);
    }
    return parts;
}

} // namespace

CellCounts blurred(const CellCounts &counts, double sigma_cells)
{
    const auto radius = static_cast<Eigen::Index>(kBlurReach * sigma_cells + 0.5);
    if (radius == 0) {
        return counts;
    }
    Eigen::ArrayXd weights(radius + 1);
    for (Eigen::Index k = 0; k <= radius; ++k) {
        const double z = static_cast<double>(k) / sigma_cells;
        weights[k] = std::exp(-0.5 * z * z);
    }
    weights /= 2.0 * weights.sum() - weights[0];
    const Eigen::Index n_rows = counts.rows(), n_columns = counts.cols();
    CellCounts along = weights[0] * counts;
    for (Eigen::Index row = 0; row < n_rows; ++row) { // by rows, so that they stay in the cache
        for (Eigen::Index k = 1; k <= std::min(radius, n_columns - 1); ++k) {
            const Eigen::Index n = n_columns - k;
            along.row(row).tail(n) += weights[k] * counts.row(row).head(n);
            along.row(row).head(n) += weights[k] * counts.row(row).tail(n);
        }
    }
    CellCounts both = weights[0] * along;
    for (Eigen::Index row = 0; row < n_rows; ++row) {
        const Eigen::Index first = std::max<Eigen::Index>(row - radius, 0);
        const Eigen::Index last = std::min(row + radius, n_rows - 1);
        for (Eigen::Index other = first; other <= last; ++other) {
            if (other != row) {
                both.row(row) += weights[std::abs(row - other)] * along.row(other);
            }
        }
    }
    return both;
}

double Logistic::probability(const std::array<double, 2> &x) const
{
    return 1.0 / (1.0 + std::exp(-(bias + weights[0] * x[0] + weights[1] * x[1])));
}

Logistic fit_logistic(const std::vector<LogisticSample> &samples)
{
    const auto n_occupied = std::count_if(samples.begin(), samples.end(),
                                          [](const LogisticSample &s) { return s.occupied; });
    if (n_occupied == 0 || static_cast<std::size_t>(n_occupied) == samples.size()) {
        throw std::runtime_error("too few beams for the strong grid: those it leaves out to learn "
                                 "its scaling show one kind of point alone; give --rivals off");
    }
    Logistic model;
    double value = penalised_loss(model, samples);
    for (int i = 0; i < kNewtonStepsMax; ++i) {
        Eigen::Vector3d step = newton_step(model, samples);
        Logistic next = moved(model, step);
        while (!(penalised_loss(next, samples) <= value) && step.norm() > 1e-12) {
            step *= 0.5;
            next = moved(model, step);
        }
        if (!(step.norm() > 1e-9)) {
            break;
        }
        model = next;
        value = penalised_loss(model, samples);
    }
    return model;
}

StrongGrid::StrongGrid(const std::vector<GridBeam> &beams, const gpom_raster_t &raster,
                       const std::vector<double> &sigmas_m)
    : raster_(raster)
{
    const BeamParts parts = parted(beams);
    const std::vector<TestPoint> points = learning_points(parts.left_out);
    const CountPair building = counts_of(parts.building, raster);
    for (const double sigma_m : sigmas_m) {
        blur(building.hits, building.free, sigma_m);
        std::vector<LogisticSample> samples;
        for (const TestPoint &point : points) {
            samples.push_back({features(point.at), point.occupied});
        }
        const Logistic scaling = fit_logistic(samples);
        const double nll = mean_loss(scaling, samples);
        if (sigma_m_ == 0.0 || nll < left_out_nll_) {
            left_out_nll_ = nll;
            sigma_m_ = sigma_m;
            scaling_ = scaling;
        }
    }
    const CountPair all = counts_of(beams, raster);
    blur(all.hits, all.free, sigma_m_);
}

void StrongGrid::blur(const CellCounts &hits, const CellCounts &free, double sigma_m)
{
    hits_ = kHitWeight * blurred(hits, sigma_m / raster_.cell_m);
    free_ = blurred(free, sigma_m / raster_.cell_m);
}

/// Both features at a point: bilinear between the centres of cells, constant beyond the border.
std::array<double, 2> StrongGrid::features(gpom_point_t point) const
{
    const double u = std::clamp((point.x_m - raster_.x0_m) / raster_.cell_m - 0.5, 0.0,
                                static_cast<double>(raster_.nx - 1));
    const double v = std::clamp((point.y_m - raster_.y0_m) / raster_.cell_m - 0.5, 0.0,
                                static_cast<double>(raster_.ny - 1));
    const auto ix = static_cast<Eigen::Index>(u), iy = static_cast<Eigen::Index>(v);
    double share = 0.0, total = 0.0;
    for (Eigen::Index corner = 0; corner < 4; ++corner) {
        const Eigen::Index right = corner % 2, up = corner / 2;
        const double along = u - static_cast<double>(ix), across = v - static_cast<double>(iy);
        const double weight = (right ? along : 1.0 - along) * (up ? across : 1.0 - across);
        const Eigen::Index column = std::min(ix + right, hits_.cols() - 1);
        const Eigen::Index row = std::min(iy + up, hits_.rows() - 1);
        const double n = hits_(row, column) + free_(row, column);
        share += weight * (hits_(row, column) + kHitPrior) / (n + 2.0 * kHitPrior);
        total += weight * n;
    }
    const double logit = std::log(share / (1.0 - share));
    return {logit, logit * std::log1p(total)};
}

double StrongGrid::probability(gpom_point_t point) const
{
    return scaling_.probability(features(point));
}

} // namespace gpom_tools

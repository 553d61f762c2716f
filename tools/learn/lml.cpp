#include "tools/learn/lml.hpp"

#include "tools/eval/protocol.hpp"
#include "tools/map/parallel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace gpom_tools
{
namespace
{

constexpr int kAnnealingSteps = 300;
constexpr double kTemperatureFirst = 0.3; ///< In units of the loss per point.
constexpr double kTemperatureLast = 0.001;
constexpr double kAnnealingReach = 0.25; ///< Size of the first step as a share of the box.
constexpr int kAscentIterations = 60;
constexpr int kSigmoidIterations = 100;

struct FreePoint {
    double x_m, y_m;
};

template <class T> void shuffle(std::vector<T> &items, ProtocolRandom &random)
{
    for (std::size_t i = items.size(); i > 1; --i) {
        std::swap(items[i - 1], items[random.below(i)]);
    }
}

/// The data of eq. 6: one subset, or many neighbourhoods.
using Subsets = std::vector<Neighbourhood>;

double mean_negative_lml(const LearntParams &params, const Subsets &subsets, unsigned n_threads,
                         Gradient *gradient)
{
    std::vector<double> losses(chunk_count(subsets.size()), 0.0);
    std::vector<Gradient> gradients(losses.size(), Gradient::Zero());
    for_chunks(
        subsets.size(), n_threads, [&](std::size_t i_chunk, std::size_t first, std::size_t last) {
            ModelWork work;
            for (std::size_t i = first; i < last; ++i) {
                losses[i_chunk] += negative_lml(
                    params, subsets[i], work, gradient != nullptr ? &gradients[i_chunk] : nullptr);
            }
        });
    const double scale = 1.0 / static_cast<double>(subsets.size());
    if (gradient != nullptr) {
        *gradient =
            scale * std::accumulate(gradients.begin(), gradients.end(), Gradient(Gradient::Zero()));
    }
    return scale * std::accumulate(losses.begin(), losses.end(), 0.0);
}

/// Simulated annealing (Kirkpatrick et al., 1983) with geometric cooling. The step size follows the
/// square root of the temperature.
Minimum anneal(const std::function<double(const Eigen::VectorXd &)> &loss,
               const Eigen::VectorXd &start, const Box &box, std::uint64_t seed,
               const Advance &advance)
{
    ProtocolRandom random(seed);
    Eigen::VectorXd x = start.cwiseMax(box.low).cwiseMin(box.high);
    double value = loss(x);
    Minimum best{x, value, 1};
    const double cooling = std::log(kTemperatureLast / kTemperatureFirst);
    for (int i = 0; i < kAnnealingSteps; ++i) {
        const double t = kTemperatureFirst * std::exp(cooling * i / kAnnealingSteps);
        const double reach = kAnnealingReach * std::pow(t / kTemperatureFirst, 0.25);
        Eigen::VectorXd trial = x;
        for (Eigen::Index j = 0; j < x.size(); ++j) {
            trial(j) += reach * (box.high(j) - box.low(j)) * (2.0 * random.uniform() - 1.0);
        }
        trial = trial.cwiseMax(box.low).cwiseMin(box.high);
        const double trial_value = loss(trial);
        if (random.uniform() < std::exp((value - trial_value) / t)) {
            x = trial;
            value = trial_value;
        }
        if (trial_value < best.value) {
            best = {trial, trial_value, best.n_evaluations};
        }
        ++best.n_evaluations;
        advance(0.8 * i / kAnnealingSteps);
    }
    return best;
}

/// The coordinates of the covariance: all coordinates of a fit except those of the sigmoid.
class CovarianceSpace {
public:
    CovarianceSpace(const FitSpace &space, const LearntParams &base) : space_(space), base_(base)
    {
        const Eigen::VectorXd all = space_.coordinates(base_);
        n_ = all.size() - 2; // without ingredients, alpha and beta are the last coordinates
        rest_ = all.tail(2);
    }

    LearntParams params(const Eigen::VectorXd &x) const
    {
        Eigen::VectorXd all(n_ + 2);
        all << x, rest_;
        return space_.params(base_, all);
    }
    Eigen::VectorXd gradient(const LearntParams &params, const Gradient &by_params) const
    {
        return space_.gradient(params, by_params).head(n_);
    }
    Box box() const { return {space_.box().low.head(n_), space_.box().high.head(n_)}; }
    Eigen::VectorXd start() const { return space_.coordinates(base_).head(n_); }

private:
    const FitSpace &space_;
    LearntParams base_;
    Eigen::Index n_;
    Eigen::VectorXd rest_;
};

struct Labelled {
    LatentMoments moments;
    bool occupied;
};

/// Fit only alpha and beta, by the losses of left-out points.
Minimum fit_sigmoid(const FitSpace &space, const LearntParams &base,
                    const std::vector<Labelled> &points)
{
    const Eigen::VectorXd at_base = space.coordinates(base);
    const auto params_at = [&](const Eigen::VectorXd &x) {
        Eigen::VectorXd all = at_base;
        all.tail(2) = x;
        return space.params(base, all);
    };
    const Objective objective = [&](const Eigen::VectorXd &x, Eigen::VectorXd &gradient) {
        const LearntParams params = params_at(x);
        Gradient by_params = Gradient::Zero();
        double sum = 0.0;
        for (const Labelled &point : points) {
            const SigmoidLoss loss =
                sigmoid_loss(params.alpha, params.beta, point.moments, point.occupied);
            sum += loss.value;
            by_params(kByAlpha) += loss.by_alpha_log;
            by_params(kByBeta) += loss.by_argument;
        }
        const double scale = 1.0 / static_cast<double>(points.size());
        gradient = scale * space.gradient(params, by_params).tail(2);
        return scale * sum;
    };
    const Box box{space.box().low.tail(2), space.box().high.tail(2)};
    Minimum minimum = minimise(objective, at_base.tail(2), box, kSigmoidIterations);
    Eigen::VectorXd all = at_base;
    all.tail(2) = minimum.x;
    minimum.x = all;
    return minimum;
}

std::vector<Labelled> all_left_out(const LearntParams &params, const Subsets &subsets)
{
    std::vector<Labelled> points;
    ModelWork work;
    for (const Neighbourhood &subset : subsets) {
        const std::vector<LatentMoments> moments = left_out_moments(params, subset, work);
        for (std::size_t i = 0; i < moments.size(); ++i) {
            points.push_back({moments[i], subset.points[i].label > 0.0});
        }
    }
    return points;
}

Subsets subsets_of(const LearnData &data, const LearntParams &start, const FitOptions &options,
                   const LmlOptions &lml)
{
    Subsets subsets;
    if (lml.composite) {
        std::vector<LearnPlace> places = data.learning;
        ProtocolRandom random(lml.seed + 2);
        shuffle(places, random);
        places.resize(std::min(places.size(), lml.n_composite));
        return neighbourhoods_of(data.worlds, places, rule_of(start), options.n_threads);
    }
    for (const LearnWorld &world : data.worlds) {
        subsets.push_back(random_subset(world, start.gap_m, lml.n_points, lml.seed + 2));
    }
    return subsets;
}

} // namespace

Neighbourhood random_subset(const LearnWorld &world, double gap_m, std::size_t n_points,
                            std::uint64_t seed)
{
    std::vector<FreePoint> hits, free;
    for (const LearnBeam &beam : world) {
        if (beam.hit) {
            hits.push_back(
                {beam.x_m + beam.range_m * beam.dir_x, beam.y_m + beam.range_m * beam.dir_y});
        }
        const double free_m = beam.hit ? beam.range_m - gap_m : beam.range_m;
        for (double s_m = 0.0; s_m <= free_m; s_m += kLmlFreeSpacing) {
            free.push_back({beam.x_m + s_m * beam.dir_x, beam.y_m + s_m * beam.dir_y});
        }
    }
    ProtocolRandom random(seed);
    shuffle(hits, random);
    shuffle(free, random);
    hits.resize(std::min(hits.size(), n_points / 2));
    free.resize(std::min(free.size(), n_points - hits.size()));
    double x_m = 0.0, y_m = 0.0;
    for (const FreePoint &hit : hits) {
        x_m += hit.x_m / static_cast<double>(hits.size());
        y_m += hit.y_m / static_cast<double>(hits.size());
    }
    Neighbourhood subset{};
    subset.axis_ratio = 1.0;
    for (const auto *points : {&hits, &free}) {
        for (const FreePoint &point : *points) {
            subset.points.push_back({point.x_m - x_m, point.y_m - y_m, points == &hits ? 1.0 : -1.0,
                                     HitNoise::kSeen, 1.0});
        }
    }
    return subset;
}

double negative_lml(const LearntParams &params, const Neighbourhood &points, ModelWork &work,
                    Gradient *gradient)
{
    constexpr double kLogTwoPi = 1.8378770664093453;
    work.assemble(params, points, gradient != nullptr);
    work.solve();
    const auto n = static_cast<Eigen::Index>(work.size());
    const double scale = 1.0 / static_cast<double>(n);
    const Eigen::VectorXd &a = work.weights();
    const Eigen::MatrixXd &factor = work.factor().matrixLLT();
    const double half_log_det = factor.diagonal().array().log().sum();
    const double loss =
        0.5 * work.labels().dot(a) + half_log_det + 0.5 * static_cast<double>(n) * kLogTwoPi;
    if (gradient != nullptr) {
        // d(-log p) = 1/2 tr((A^-1 - a a^T) dA), a = A^-1 y.
        const Eigen::MatrixXd inverse =
            work.factor().solve(Eigen::MatrixXd::Identity(n, n)) - a * a.transpose();
        Adjoint adjoint = Adjoint::Zero(n + 1, n + 1);
        adjoint.topLeftCorner(n, n) = scale * inverse;
        adjoint.diagonal() *= 0.5;
        work.accumulate(adjoint, *gradient);
    }
    return scale * loss;
}

std::vector<LatentMoments> left_out_moments(const LearntParams &params, const Neighbourhood &points,
                                            ModelWork &work)
{
    work.assemble(params, points, false);
    work.solve();
    const auto n = static_cast<Eigen::Index>(work.size());
    const Eigen::MatrixXd inverse = work.factor().solve(Eigen::MatrixXd::Identity(n, n));
    std::vector<LatentMoments> moments;
    for (Eigen::Index i = 0; i < n; ++i) {
        const double variance = 1.0 / inverse(i, i);
        moments.push_back({work.labels()(i) - work.weights()(i) * variance,
                           std::max(variance - work.noises()(i), 0.0)});
    }
    return moments;
}

Fit fit_lml(gpom_kernel_t kernel, const LearnData &data, const FitOptions &options,
            const LmlOptions &lml, const Advance &advance)
{
    FitOptions covariance_alone = options;
    covariance_alone.ingredients = {};
    const FitSpace space(kernel, covariance_alone);
    LearntParams start;
    start.kernel = kernel;
    start.alpha = 3.0;
    start.ell_m = 4.0;
    start.s0 = 5.0;
    start.sn2 = start.sn2_free = 0.1;
    start.n_hits = options.n_hits;
    start.n_free = options.n_free;
    const Subsets subsets = subsets_of(data, start, options, lml);
    const CovarianceSpace covariance(space, start);
    const auto loss = [&](const Eigen::VectorXd &x) {
        return mean_negative_lml(covariance.params(x), subsets, options.n_threads, nullptr);
    };
    const Objective with_gradient = [&](const Eigen::VectorXd &x, Eigen::VectorXd &gradient) {
        const LearntParams params = covariance.params(x);
        Gradient by_params;
        const double value = mean_negative_lml(params, subsets, options.n_threads, &by_params);
        gradient = covariance.gradient(params, by_params);
        return value;
    };
    const Minimum annealed = anneal(loss, covariance.start(), covariance.box(), lml.seed, advance);
    Minimum ascended = minimise(with_gradient, annealed.x, covariance.box(), kAscentIterations);
    const Minimum plain =
        minimise(with_gradient, covariance.start(), covariance.box(), kAscentIterations);
    const FitAttempt ascents[] = {{"-LML/n, ascent", ascended.value, ascended.n_evaluations},
                                  {"-LML/n, no annealing", plain.value, plain.n_evaluations}};
    ascended = plain.value < ascended.value ? plain : ascended;
    const LearntParams found = covariance.params(ascended.x);
    const Minimum sigmoid = fit_sigmoid(space, found, all_left_out(found, subsets));
    Fit fit;
    fit.params = with_legal_noise(space.params(found, sigmoid.x));
    fit.loss = sigmoid.value;
    fit.attempts = {{"-LML/n, annealing", annealed.value, annealed.n_evaluations},
                    ascents[0],
                    ascents[1],
                    {"sigmoid, left out", sigmoid.value, sigmoid.n_evaluations}};
    advance(1.0);
    return fit;
}

} // namespace gpom_tools

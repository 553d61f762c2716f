#include "tools/eval/metrics.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace
{

using gpom_tools::Metrics;
using gpom_tools::Prediction;

/// Random predictions; with n_levels > 0 only that many probabilities, so that there are ties.
std::vector<Prediction> random_predictions(unsigned seed, std::size_t n, unsigned n_levels)
{
    std::mt19937 bits(seed);
    std::vector<Prediction> predictions;
    for (std::size_t i = 0; i < n; ++i) {
        const double truth = static_cast<double>(bits() % 1000) / 1000.0;
        const double noise = static_cast<double>(bits() % 100000) / 100000.0;
        double p = 0.5 * (truth + noise);
        p = n_levels > 0 ? std::floor(p * n_levels) / n_levels : p;
        predictions.push_back({p, truth > 0.6});
    }
    predictions[0].occupied = true;
    predictions[1].occupied = false;
    return predictions;
}

/// P(an occupied point scores over a free one), ties 1/2: the definition, pair by pair.
double pairwise_auc(const std::vector<Prediction> &predictions)
{
    double wins = 0.0, pairs = 0.0;
    for (const Prediction &a : predictions) {
        for (const Prediction &b : predictions) {
            if (a.occupied && !b.occupied) {
                pairs += 1.0;
                wins += a.probability > b.probability ? 1.0 : 0.0;
                wins += a.probability == b.probability ? 0.5 : 0.0;
            }
        }
    }
    return wins / pairs;
}

double rate_over(const std::vector<Prediction> &predictions, bool occupied, double threshold)
{
    double n = 0.0, over = 0.0;
    for (const Prediction &p : predictions) {
        n += p.occupied == occupied ? 1.0 : 0.0;
        over += p.occupied == occupied && p.probability >= threshold ? 1.0 : 0.0;
    }
    return over / n;
}

double swept_false_positive_rate(const std::vector<Prediction> &predictions)
{
    double best = -1.0;
    for (const Prediction &p : predictions) {
        if (rate_over(predictions, true, p.probability) >= 0.95) {
            best = std::max(best, p.probability);
        }
    }
    return rate_over(predictions, false, best);
}

} // namespace

// The rank statistic and its pairwise definition are the same number, with and without ties.
TEST_CASE("AUC is the share of ordered pairs, ties counting half")
{
    for (unsigned seed = 0; seed < 20; ++seed) {
        for (const unsigned n_levels : {0u, 2u, 5u, 50u}) {
            const auto predictions = random_predictions(seed, 20 + 17 * seed, n_levels);
            CHECK(gpom_tools::measure(predictions).auc ==
                  doctest::Approx(pairwise_auc(predictions)).epsilon(1e-12));
        }
    }
}

// The largest threshold that lets 95 % of the occupied points pass lets this share of free pass.
TEST_CASE("false-positive rate is that of a sweep over all thresholds")
{
    for (unsigned seed = 0; seed < 20; ++seed) {
        for (const unsigned n_levels : {0u, 2u, 5u, 50u}) {
            const auto predictions = random_predictions(seed, 20 + 17 * seed, n_levels);
            CHECK(gpom_tools::measure(predictions).false_positive_rate ==
                  doctest::Approx(swept_false_positive_rate(predictions)).epsilon(1e-12));
        }
    }
}

TEST_CASE("exactly 95 of 100 occupied points over a threshold are enough")
{
    std::vector<Prediction> predictions;
    for (int i = 0; i < 100; ++i) {
        predictions.push_back({i < 95 ? 0.9 : 0.1, true});
        predictions.push_back({i < 7 ? 0.95 : 0.2, false});
    }
    CHECK(gpom_tools::measure(predictions).false_positive_rate == doctest::Approx(0.07));
}

TEST_CASE("constant predictions rank like chance")
{
    for (const double p : {0.0, 0.3, 1.0}) {
        const Metrics m = gpom_tools::measure({{p, true}, {p, false}, {p, false}, {p, true}});
        CHECK(m.auc == 0.5);
        CHECK(m.false_positive_rate == 1.0);
        CHECK(m.calibration_error == doctest::Approx(std::abs(p - 0.5)));
    }
}

TEST_CASE("perfect and inverted predictions are the ends of every scale")
{
    const Metrics good = gpom_tools::measure({{1.0, true}, {0.0, false}});
    CHECK(good.auc == 1.0);
    CHECK(good.false_positive_rate == 0.0);
    CHECK(good.nll == doctest::Approx(-std::log(0.999)));
    CHECK(good.calibration_error == 0.0);
    const Metrics bad = gpom_tools::measure({{0.0, true}, {1.0, false}});
    CHECK(bad.auc == 0.0);
    CHECK(bad.false_positive_rate == 1.0);
    CHECK(bad.nll == doctest::Approx(-std::log(0.001)));
    CHECK(bad.calibration_error == 1.0);
}

// Two bins: 3 points at 0.2 of which one is occupied, 1 at 0.7 which is free.
TEST_CASE("calibration error weighs the bins by their points")
{
    const Metrics m = gpom_tools::measure({{0.2, true}, {0.2, false}, {0.2, false}, {0.7, false}});
    CHECK(m.calibration_error == doctest::Approx((3.0 * (1.0 / 3.0 - 0.2) + 0.7) / 4.0));
    CHECK(m.reliability[2].n_points == 3);
    CHECK(m.reliability[7].n_points == 1);
    CHECK(m.share_occupied == 0.25);
}

TEST_CASE("calibration alone is that of the whole measure, and of one kind of point, too")
{
    const auto predictions = random_predictions(4, 500, 0);
    const Metrics whole = gpom_tools::measure(predictions);
    const gpom_tools::Calibration alone = gpom_tools::measure_calibration(predictions);
    CHECK(alone.n_points == whole.n_points);
    CHECK(alone.share_occupied == whole.share_occupied);
    CHECK(alone.nll == doctest::Approx(whole.nll).epsilon(1e-12));
    CHECK(alone.calibration_error == doctest::Approx(whole.calibration_error).epsilon(1e-12));
    const auto free = gpom_tools::measure_calibration({{0.2, false}, {0.4, false}});
    CHECK(free.nll == doctest::Approx(-0.5 * (std::log(0.8) + std::log(0.6))));
    CHECK(free.calibration_error == doctest::Approx(0.3));
    CHECK_THROWS_AS(gpom_tools::measure_calibration({}), std::runtime_error);
    CHECK_THROWS_AS(gpom_tools::measure_calibration({{NAN, true}}), std::runtime_error);
}

// The stored curve must be short, rise from corner to corner, and keep the area.
TEST_CASE("the thinned ROC curve keeps its ends, its order and its area")
{
    const Metrics m = gpom_tools::measure(random_predictions(3, 20000, 0));
    CHECK(m.roc.size() <= gpom_tools::kRocPointsMax);
    CHECK(m.roc.front().false_positive_rate == 0.0);
    CHECK(m.roc.back().true_positive_rate == 1.0);
    double area = 0.0;
    for (std::size_t i = 1; i < m.roc.size(); ++i) {
        CHECK(m.roc[i].true_positive_rate >= m.roc[i - 1].true_positive_rate);
        const double width = m.roc[i].false_positive_rate - m.roc[i - 1].false_positive_rate;
        CHECK(width >= 0.0);
        area += width * (m.roc[i].true_positive_rate + m.roc[i - 1].true_positive_rate) / 2.0;
    }
    CHECK(area == doctest::Approx(m.auc).epsilon(1e-3));
}

TEST_CASE("one kind of point, none, or no probability cannot be judged")
{
    CHECK_THROWS_AS(gpom_tools::measure({}), std::runtime_error);
    CHECK_THROWS_AS(gpom_tools::measure({{0.5, true}}), std::runtime_error);
    CHECK_THROWS_AS(gpom_tools::measure({{0.5, false}, {0.4, false}}), std::runtime_error);
    CHECK_THROWS_AS(gpom_tools::measure({{NAN, true}, {0.4, false}}), std::runtime_error);
    CHECK_THROWS_AS(gpom_tools::measure({{1.1, true}, {0.4, false}}), std::runtime_error);
}

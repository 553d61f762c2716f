// The local Gaussian process against a dense solve in double.
#include "tests/common/reference.hpp"

#include "src/gp/classify.hpp"
#include "src/gp/local_gp.hpp"

using namespace reference;

namespace
{

/// One query's points, hits first, relative to the query; the query's place in the frame.
struct Case {
    std::vector<LabelledPoint> hits, free;
    Xy frame = {0.0, 0.0};
    bool merges = false; ///< Call merge_equal() before, as a query does.
};

/// Working arrays of W cases side by side; all have the same numbers of hits and free points.
template <int W> class LaneGp {
public:
    using F = Lanes<W>;

    explicit LaneGp(const std::vector<Case> &cases)
        : n_hits_(cases[0].hits.size()), n_(n_hits_ + cases[0].free.size()),
          n_padded_(gpom::kTile * gpom::tile_count(n_)), x_(n_padded_), y_(n_padded_),
          noise_(n_padded_), u_(n_padded_), v_(n_padded_), l_(gpom::panel_at(gpom::tile_count(n_))),
          features_(n_padded_)
    {
        for (int i = 0; i < W; ++i) {
            const Case &c = cases[static_cast<std::size_t>(i) % cases.size()];
            for (std::size_t j = 0; j < n_; ++j) {
                const LabelledPoint &p = j < n_hits_ ? c.hits[j] : c.free[j - n_hits_];
                gpom::lane::set(x_[j], i, static_cast<float>(p.at.x));
                gpom::lane::set(y_[j], i, static_cast<float>(p.at.y));
                gpom::lane::set(noise_[j], i, static_cast<float>(p.noise));
            }
            gpom::lane::set(frame_x_, i, static_cast<float>(c.frame.x));
            gpom::lane::set(frame_y_, i, static_cast<float>(c.frame.y));
        }
        if (cases[0].merges) {
            gpom::merge_equal(x_.data(), y_.data(), noise_.data(), n_hits_);
            gpom::merge_equal(x_.data() + n_hits_, y_.data() + n_hits_, noise_.data() + n_hits_,
                              n_ - n_hits_);
        }
    }

    gpom::Moments<F> predict(const gpom_params_t &p)
    {
        switch (p.kernel) {
        case GPOM_KERNEL_NN:
            return run<GPOM_KERNEL_NN>(p);
        case GPOM_KERNEL_MATERN12:
            return run<GPOM_KERNEL_MATERN12>(p);
        case GPOM_KERNEL_MATERN32:
            return run<GPOM_KERNEL_MATERN32>(p);
        case GPOM_KERNEL_SE:
            return run<GPOM_KERNEL_SE>(p);
        default:
            return run<GPOM_KERNEL_ASKEY>(p);
        }
    }

    const std::vector<F> &noise() const { return noise_; }

private:
    template <gpom_kernel_t K> gpom::Moments<F> run(const gpom_params_t &p)
    {
        const gpom::Neighbourhood<F> points = {x_.data(), y_.data(), noise_.data(),
                                               nullptr,   n_hits_,   n_ - n_hits_};
        gpom::GpWork<F> work = {features_.data(), u_.data(), v_.data(), {l_.data(), F{}}};
        return gpom::predict<K>(gpom::kernel_constants(p), points, work, frame_x_, frame_y_);
    }

    std::size_t n_hits_, n_, n_padded_;
    std::vector<F> x_, y_, noise_, u_, v_, l_;
    std::vector<gpom::Feature<F>> features_;
    F frame_x_ = {}, frame_y_ = {};
};

struct Result {
    float mean, variance, bad;
};

template <int W>
std::vector<Result> predict_all(const gpom_params_t &p, const std::vector<Case> &cases)
{
    LaneGp<W> gp(cases);
    const auto m = gp.predict(p);
    std::vector<Result> results;
    for (int i = 0; i < W; ++i) {
        results.push_back({gpom::lane::get(m.mean, i), gpom::lane::get(m.variance, i),
                           gpom::lane::get(m.bad, i)});
    }
    return results;
}

Result predict_one(const gpom_params_t &p, const Case &c) { return predict_all<1>(p, {c})[0]; }

/// The dense double solve of all points that are there.
Moments truth_of(const gpom_params_t &p, const Case &c)
{
    std::vector<LabelledPoint> points;
    for (const auto *part : {&c.hits, &c.free}) {
        for (LabelledPoint point : *part) {
            point.at = {point.at.x + c.frame.x, point.at.y + c.frame.y};
            if (point.noise < static_cast<double>(gpom::kAbsentNoise)) {
                points.push_back(point);
            }
        }
    }
    return predict(p, points, c.frame);
}

/// A coordinate that float32 holds exactly, also when the frame's is added.
double grid(double x) { return std::round(x * 64.0) / 64.0; }

Case random_case(Random &random, std::size_t n_hits, std::size_t n_free, Xy frame)
{
    Case c;
    c.frame = {grid(frame.x), grid(frame.y)};
    for (std::size_t i = 0; i < n_hits + n_free; ++i) {
        const bool is_hit = i < n_hits;
        const LabelledPoint p = {{grid(random.uniform(-4, 4)), grid(random.uniform(-4, 4))},
                                 is_hit ? 1.0 : -1.0,
                                 0.125 + 0.125 * random.below(8)};
        (is_hit ? c.hits : c.free).push_back(p);
    }
    return c;
}

/// 0.0001, the product's stated accuracy at noise variances of 0.1 and more.
void check_close(const Result &got, const Moments &truth)
{
    CHECK(got.bad == 0.0f);
    CHECK(std::abs(static_cast<double>(got.mean) - truth.mean) <= 1e-4);
    CHECK(std::abs(static_cast<double>(got.variance) - truth.variance) <= 1e-4);
}

template <class Fn> void for_all_kernels_and_frames(Fn f)
{
    GPOM_TELL_SEED();
    for (const gpom_kernel_t which : kKernels) {
        for (const gpom_frame_t frame : kFrames) {
            INFO("kernel ", std::string(kKernelNames[which]));
            CAPTURE(frame);
            f(params_of(which, frame), frame == GPOM_FRAME_MAP ? Xy{13.0, -21.0} : Xy{0.0, 0.0});
        }
    }
}

} // namespace

// Mean and variance are those of a dense solve in double, for every kernel, both frames and any
// number of points up to the most.
TEST_CASE("predict equals a dense solve in double")
{
    for_all_kernels_and_frames([](const gpom_params_t &p, Xy frame) {
        Random random(60);
        for (const std::size_t n : {1, 2, 3, 8, 16, 31, 32, 48, 64}) {
            CAPTURE(n);
            const Case c = random_case(random, n - n / 2, n / 2, frame);
            check_close(predict_one(p, c), truth_of(p, c));
        }
    });
}

// Each lane gives the bits that its case gives alone.
TEST_CASE("predict gives the same bits at every lane width")
{
    for_all_kernels_and_frames([](const gpom_params_t &p, Xy frame) {
        Random random(61);
        std::vector<Case> cases;
        for (int i = 0; i < 16; ++i) {
            cases.push_back(random_case(random, 8, 8, frame));
        }
        const std::vector<Result> wide = predict_all<16>(p, cases);
        const std::vector<Result> four = predict_all<4>(p, cases);
        const std::vector<Result> eight = predict_all<8>(p, cases);
        for (std::size_t i = 0; i < 16; ++i) {
            const Result alone = predict_one(p, cases[i]);
            CHECK(same_bits(wide[i].mean, alone.mean));
            CHECK(same_bits(wide[i].variance, alone.variance));
            CHECK((i >= 8 || same_bits(eight[i].mean, alone.mean)));
            CHECK((i >= 4 || same_bits(four[i].variance, alone.variance)));
        }
    });
}

// Points at one place with one label, whatever their noises, count exactly as if they were not
// merged.
TEST_CASE("merging equal points changes nothing but conditioning")
{
    for_all_kernels_and_frames([](const gpom_params_t &p, Xy frame) {
        Random random(62);
        Case c = random_case(random, 12, 12, frame);
        for (std::size_t i : {1, 2, 5, 9}) {
            c.hits[i].at = c.hits[0].at;
            c.free[i].at = c.free[0].at;
        }
        c.free[11].at = c.free[10].at;
        c.hits[11].at = c.free[10].at; // another label: not to be merged
        c.merges = true;
        check_close(predict_one(p, c), truth_of(p, c));
    });
}

// Merging adds precisions and leaves exactly one point of each place.
TEST_CASE("merged points are one point whose precision is the sum")
{
    Case c;
    for (const double noise : {0.5, 0.25, 1.0, 0.125}) {
        c.free.push_back({{1.0, 2.0}, -1.0, noise});
    }
    c.free[2].at = {1.0, 2.5};
    c.merges = true;
    const LaneGp<1> gp({c});
    CHECK(gp.noise()[0] == doctest::Approx(1.0 / (2.0 + 4.0 + 8.0)));
    CHECK(gp.noise()[1] == gpom::kAbsentNoise);
    CHECK(gp.noise()[2] == 1.0f);
    CHECK(gp.noise()[3] == gpom::kAbsentNoise);
}

// A point that is not there counts as if it had been left out, wherever it stands in the list.
TEST_CASE("absent points equal leaving them out")
{
    for_all_kernels_and_frames([](const gpom_params_t &p, Xy frame) {
        Random random(63);
        Case c = random_case(random, 9, 9, frame);
        for (std::size_t i : {0, 3, 8}) {
            c.hits[i].noise = static_cast<double>(gpom::kAbsentNoise);
            c.free[i].noise = static_cast<double>(gpom::kAbsentNoise);
            c.hits[i].at = {0.0, 0.0};
            c.free[i].at = {0.0, 0.0};
        }
        for (const bool merges : {false, true}) {
            c.merges = merges;
            check_close(predict_one(p, c), truth_of(p, c));
        }
    });
}

// With no point at all the answer is the prior.
TEST_CASE("nothing but absent points gives the prior")
{
    for_all_kernels_and_frames([](const gpom_params_t &p, Xy frame) {
        Random random(64);
        Case c = random_case(random, 4, 4, frame);
        for (std::size_t i = 0; i < 4; ++i) {
            c.hits[i].noise = c.free[i].noise = static_cast<double>(gpom::kAbsentNoise);
        }
        const Result got = predict_one(p, c);
        CHECK(std::abs(got.mean) <= 1e-12f);
        CHECK(static_cast<double>(got.variance) ==
              doctest::Approx(kernel(p, c.frame, c.frame)).epsilon(2e-6));
    });
}

// A query right on a point is nothing special.
TEST_CASE("a query exactly on a point")
{
    for_all_kernels_and_frames([](const gpom_params_t &p, Xy frame) {
        Random random(65);
        Case c = random_case(random, 8, 8, frame);
        c.hits[0].at = {0.0, 0.0};
        check_close(predict_one(p, c), truth_of(p, c));
        c.free[0].at = {0.0, 0.0}; // and now of both labels
        check_close(predict_one(p, c), truth_of(p, c));
    });
}

// A matrix that is not positive definite, by two equal rows without noise or by a noise that is no
// number, gives the prior and a mark in its own lane; the others keep their bits.
TEST_CASE("a matrix that is not positive definite gives the prior and is marked")
{
    GPOM_TELL_SEED();
    gpom_params_t p = params_of(GPOM_KERNEL_SE);
    p.sf2 = 1.0f;
    Random random(66);
    for (const double bad_noise : {-2.0, static_cast<double>(kNan), static_cast<double>(kInf)}) {
        CAPTURE(bad_noise);
        std::vector<Case> cases;
        for (int i = 0; i < 4; ++i) {
            cases.push_back(random_case(random, 4, 4, {0, 0}));
        }
        const std::vector<Result> clean = predict_all<4>(p, cases);
        cases[2].free[1].noise = bad_noise;
        const std::vector<Result> spoilt = predict_all<4>(p, cases);
        CHECK(spoilt[2].bad == 1.0f);
        CHECK(spoilt[2].mean == 0.0f);
        CHECK(spoilt[2].variance == p.sf2);
        for (const std::size_t i : {0, 1, 3}) {
            CHECK(spoilt[i].bad == 0.0f);
            CHECK(same_bits(spoilt[i].mean, clean[i].mean));
            CHECK(same_bits(spoilt[i].variance, clean[i].variance));
        }
    }
}

// Vectors written by an independent program from eqs. 2 and 3; coincident points are among them.
TEST_CASE("predict equals the golden vectors")
{
    const std::vector<Row> rows = read_golden("local_gp.csv");
    REQUIRE(rows.size() >= 30); // run from the repository's root
    for (const Row &row : rows) {
        const gpom_params_t p = params_of_row(row, 0);
        const auto n = static_cast<std::size_t>(number(row, 9));
        Case c;
        c.frame = {number(row, 5), number(row, 6)};
        for (std::size_t i = 0; i < n; ++i) {
            const std::size_t at = 10 + 4 * i;
            const LabelledPoint point = {
                {number(row, at) - c.frame.x, number(row, at + 1) - c.frame.y},
                number(row, at + 2),
                number(row, at + 3)};
            (point.label > 0.0 ? c.hits : c.free).push_back(point);
        }
        INFO("kernel ", row[0]);
        CAPTURE(n);
        check_close(predict_one(p, c), {number(row, 7), number(row, 8)});
    }
}

// Eq. 7 with its square root, over means, variances and slopes.
TEST_CASE("squash is eq. 7")
{
    GPOM_TELL_SEED();
    Random random(67);
    double worst = 0.0;
    for (int i = 0; i < 20000; ++i) {
        gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
        p.alpha = random.uniform_f(0.1, 20.0);
        p.beta = random.uniform_f(-5.0, 5.0);
        const float mean = random.uniform_f(-2.0, 2.0);
        const float variance = random.uniform_f(0.0, 1.5);
        const double exact = squash(p, {static_cast<double>(mean), static_cast<double>(variance)});
        worst = std::max(
            worst, std::abs(static_cast<double>(gpom::squash(p, mean, variance, p.beta)) - exact));
    }
    CHECK(worst <= 2e-6);
}

// However steep the slope that gpom_params_check() accepts, eq. 7 holds: neither alpha^2 nor alpha
// mu may overflow into a wrong side.
TEST_CASE("squash is eq. 7 for every slope that is accepted")
{
    for (float alpha = 1e-6f; alpha < 2e38f; alpha *= 10.0f) {
        gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
        p.alpha = alpha;
        if (gpom_params_check(&p, nullptr) != GPOM_OK) {
            continue;
        }
        double worst = 0.0;
        for (const float mean : {-1.25f, -0.5f, 0.0f, 0.5f, 1.25f}) {
            for (const float variance : {0.0f, 0.25f, 1.0f}) {
                const double exact =
                    squash(p, {static_cast<double>(mean), static_cast<double>(variance)});
                worst = std::max(
                    worst,
                    std::abs(static_cast<double>(gpom::squash(p, mean, variance, p.beta)) - exact));
            }
        }
        CAPTURE(alpha);
        CHECK(worst <= 2e-6);
    }
}

// Probabilities written by an independent program, down to both tails.
TEST_CASE("squash equals the golden values")
{
    const std::vector<Row> rows = read_golden("sigmoid.csv");
    REQUIRE(rows.size() > 50);
    for (const Row &row : rows) {
        gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
        p.alpha = std::stof(row.at(2));
        p.beta = std::stof(row.at(3));
        const float got = gpom::squash(p, std::stof(row.at(0)), std::stof(row.at(1)), p.beta);
        CHECK(std::abs(static_cast<double>(got) - number(row, 4)) <= 1e-6);
    }
}

// The prior probability is Phi(beta / sqrt(1 + alpha^2 k)), what a place far from all beams gets.
TEST_CASE("the prior probability is eq. 7 of the prior")
{
    for (const gpom_kernel_t which : kKernels) {
        const gpom_params_t p = params_of(which);
        const double exact = squash(p, {0.0, kernel(p, {0, 0}, {0, 0})});
        CHECK(static_cast<double>(gpom_params_prior_probability(&p)) ==
              doctest::Approx(exact).epsilon(1e-6));
    }
}

// Both thresholds belong to the class they bound.
TEST_CASE("class thresholds are inclusive")
{
    gpom_params_t p = params_of(GPOM_KERNEL_MATERN12);
    p.p_free = 0.25f;
    p.p_occupied = 0.75f;
    CHECK(gpom::class_of(p, 0.75f) == GPOM_OCCUPIED);
    CHECK(gpom::class_of(p, step_float(0.75f, -1)) == GPOM_UNSURE);
    CHECK(gpom::class_of(p, 0.25f) == GPOM_FREE);
    CHECK(gpom::class_of(p, step_float(0.25f, 1)) == GPOM_UNSURE);
    CHECK(gpom::class_of(p, 0.0f) == GPOM_FREE);
    CHECK(gpom::class_of(p, 1.0f) == GPOM_OCCUPIED);
    CHECK(gpom::class_of(p, kNan) == GPOM_UNSURE);
}

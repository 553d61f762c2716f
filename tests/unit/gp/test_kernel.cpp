// Covariance functions against their formulas in double.
#include "tests/common/reference.hpp"

#include "src/gp/nn_block.hpp"

using namespace reference;

namespace
{

/// The library's k(a, b) for any of its kernels.
float covariance_of(const gpom_params_t &p, Xy a, Xy b)
{
    const gpom::KernelConstants constants = gpom::kernel_constants(p);
    const auto value = [&](auto kind) {
        constexpr gpom_kernel_t K = decltype(kind)::value;
        const auto fa =
            gpom::feature<K>(constants, static_cast<float>(a.x), static_cast<float>(a.y));
        const auto fb =
            gpom::feature<K>(constants, static_cast<float>(b.x), static_cast<float>(b.y));
        return p.sf2 * gpom::unit_covariance<K>(gpom::separation<K>(fa, fb));
    };
    switch (p.kernel) {
    case GPOM_KERNEL_NN:
        return value(std::integral_constant<gpom_kernel_t, GPOM_KERNEL_NN>());
    case GPOM_KERNEL_MATERN12:
        return value(std::integral_constant<gpom_kernel_t, GPOM_KERNEL_MATERN12>());
    case GPOM_KERNEL_MATERN32:
        return value(std::integral_constant<gpom_kernel_t, GPOM_KERNEL_MATERN32>());
    case GPOM_KERNEL_SE:
        return value(std::integral_constant<gpom_kernel_t, GPOM_KERNEL_SE>());
    default:
        return value(std::integral_constant<gpom_kernel_t, GPOM_KERNEL_ASKEY>());
    }
}

Xy random_xy(Random &random, double reach_m)
{
    return {static_cast<double>(random.uniform_f(-reach_m, reach_m)),
            static_cast<double>(random.uniform_f(-reach_m, reach_m))};
}

/// A kernel with random but legal hyperparameters.
gpom_params_t random_params(Random &random, gpom_kernel_t which)
{
    gpom_params_t p = params_of(which);
    p.sf2 = random.uniform_f(0.1, 4.0);
    p.s0 = random.uniform_f(0.5, 80.0);
    p.s1 = random.uniform_f(0.05, 4.0);
    p.ell_m = random.uniform_f(0.5, 12.0);
    return p;
}

/// What float32 may cost. Eq. 4's argument c carries an error of about 8e-7 (near -1; near 1 it is
/// formed without cancellation), which the arcsine's slope 1 / sqrt(1 - c^2) enlarges; the others
/// see the rounding of coordinates of up to 200 length scales, 1.2e-5 each of four, times their
/// slope of 1 / ell, Askey's of 3 / ell.
double tolerance(const gpom_params_t &p, double k)
{
    const double sf2 = p.sf2;
    if (p.kernel != GPOM_KERNEL_NN) {
        return (p.kernel == GPOM_KERNEL_ASKEY ? 1.5e-4 : 5e-5) * sf2;
    }
    const double c = std::sin(k / sf2);
    return sf2 * (1e-6 + 8e-7 / std::sqrt(1.0 - c * c + 8e-7));
}

} // namespace

// Each covariance is its formula to float32 accuracy, near the query and at 100 m from it.
TEST_CASE("covariances equal their formulas in double")
{
    GPOM_TELL_SEED();
    Random random(20);
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        double worst = 0.0;
        for (int i = 0; i < 20000; ++i) {
            const gpom_params_t p = random_params(random, which);
            const double reach_m = i % 3 == 0 ? 100.0 : 8.0;
            const Xy a = random_xy(random, reach_m);
            const Xy b = i % 5 == 0 ? Xy{a.x + random.uniform(-1e-3, 1e-3), a.y}
                                    : random_xy(random, reach_m);
            const Xy b_float = {static_cast<double>(static_cast<float>(b.x)), b.y};
            const double k = static_cast<double>(covariance_of(p, a, b_float));
            const double exact = kernel(p, a, b_float);
            worst = std::max(worst, std::abs(k - exact) / tolerance(p, exact));
        }
        CHECK(worst <= 1.0);
    }
}

// k(x, x') and k(x', x) have the same bits.
TEST_CASE("covariances are symmetric")
{
    GPOM_TELL_SEED();
    Random random(21);
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        bool is_symmetric = true;
        for (int i = 0; i < 5000; ++i) {
            const gpom_params_t p = random_params(random, which);
            const Xy a = random_xy(random, 20.0);
            const Xy b = random_xy(random, 20.0);
            is_symmetric =
                is_symmetric && same_bits(covariance_of(p, a, b), covariance_of(p, b, a));
        }
        CHECK(is_symmetric);
    }
}

// The prior variance k(x, x): sf2 for the stationary ones everywhere, eq. 4's for the neural
// network.
TEST_CASE("k(x, x) is the prior variance")
{
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        gpom_params_t p = params_of(which);
        p.sf2 = 1.75f;
        for (const Xy x : {Xy{0, 0}, Xy{3, -4}, Xy{7900, 100}}) {
            const double exact = kernel(p, x, x);
            CHECK(std::abs(static_cast<double>(covariance_of(p, x, x)) - exact) <=
                  tolerance(p, exact));
            if (which != GPOM_KERNEL_NN) {
                CHECK(covariance_of(p, x, x) == p.sf2);
            }
        }
        CHECK(gpom_params_prior_variance(&p) == covariance_of(p, {0, 0}, {0, 0}));
    }
}

// The covariance matrix of any set of points is positive semidefinite, up to float32's rounding.
TEST_CASE("covariance matrices are positive semidefinite")
{
    GPOM_TELL_SEED();
    Random random(22);
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        double smallest = 1.0;
        for (int round = 0; round < 20; ++round) {
            const gpom_params_t p = random_params(random, which);
            std::vector<Xy> points;
            for (int i = 0; i < 32; ++i) {
                points.push_back(random_xy(random, round % 2 == 0 ? 2.0 : 15.0));
            }
            Eigen::MatrixXd K(32, 32);
            for (int i = 0; i < 32; ++i) {
                for (int j = 0; j < 32; ++j) {
                    K(i, j) =
                        static_cast<double>(covariance_of(p, points[static_cast<std::size_t>(i)],
                                                          points[static_cast<std::size_t>(j)]));
                }
            }
            const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(K, Eigen::EigenvaluesOnly);
            smallest = std::min(smallest, solver.eigenvalues()(0) / static_cast<double>(p.sf2));
        }
        CHECK(smallest >= -2e-5);
    }
}

// Far away a stationary covariance is exactly 0; the neural network's is small. None is a NaN,
// however short the legal length scale.
TEST_CASE("far covariances are 0, not NaN")
{
    for (const gpom_kernel_t which : kKernels) {
        for (const float ell_m : {8.0f, 1e-3f, 1e-6f}) {
            INFO("kernel ", std::string(kKernelNames[which]));
            CAPTURE(ell_m);
            gpom_params_t p = params_of(which);
            p.ell_m = ell_m;
            for (const double r_m : {2000.0, 16000.0}) {
                const float k = covariance_of(p, {0, 0}, {r_m, -r_m});
                if (which == GPOM_KERNEL_NN) {
                    CHECK(k >= 0.0f);
                    CHECK(k < 0.01f * p.sf2);
                } else {
                    CHECK(k == 0.0f);
                }
            }
        }
    }
}

// Askey's covariance has compact support: 0 from ell on, positive before.
TEST_CASE("Askey's covariance ends at its length")
{
    gpom_params_t p = params_of(GPOM_KERNEL_ASKEY);
    p.ell_m = 2.0f;
    CHECK(covariance_of(p, {0, 0}, {2.0, 0}) == 0.0f);
    CHECK(covariance_of(p, {0, 0}, {2.5, 0}) == 0.0f);
    CHECK(covariance_of(p, {0, 0}, {1.99, 0}) > 0.0f);
}

// Values written by an independent program from the equations.
TEST_CASE("covariances equal the golden ones")
{
    const std::vector<Row> rows = read_golden("kernel.csv");
    REQUIRE(rows.size() > 50); // run from the repository's root
    for (const Row &row : rows) {
        const gpom_params_t p = params_of_row(row, 1);
        const float k =
            covariance_of(p, {number(row, 6), number(row, 7)}, {number(row, 8), number(row, 9)});
        INFO("kernel ", row[1]);
        CHECK(std::abs(static_cast<double>(k) - number(row, 10)) <= tolerance(p, number(row, 10)));
    }
}

// covariance_on_axis is k between two places on the x axis, for each kernel.
TEST_CASE("covariance_on_axis is k on the x axis")
{
    for (const gpom_kernel_t which : kKernels) {
        const gpom_params_t p = params_of(which);
        for (const double x : {0.0, 0.25, 3.0}) {
            CHECK(gpom::covariance_on_axis(p, 0.5f, static_cast<float>(x)) ==
                  covariance_of(p, {0.5, 0}, {x, 0}));
        }
    }
}

// Four points at a time, as a microcontroller computes them, eq. 4 holds for each pair of a block
// row and the query, for acute and obtuse angles in one group of four.
TEST_CASE("a block row of neural-network covariances equals eq. 4 in double")
{
    GPOM_TELL_SEED();
    Random random(21);
    constexpr std::size_t kTiles = 3;
    constexpr std::size_t kPoints = kTiles * gpom::kTile;
    std::size_t n_obtuse = 0;
    for (int round = 0; round < 500; ++round) {
        const gpom_params_t p = random_params(random, GPOM_KERNEL_NN);
        const gpom::KernelConstants constants = gpom::kernel_constants(p);
        Xy at[kPoints + 1]; // the query is the last
        gpom::Feature<float> features[kPoints + 1];
        for (std::size_t i = 0; i <= kPoints; ++i) {
            at[i] = random_xy(random, 8.0);
            features[i] = gpom::feature<GPOM_KERNEL_NN>(constants, static_cast<float>(at[i].x),
                                                        static_cast<float>(at[i].y));
        }
        for (std::size_t i = 0; i < kTiles; ++i) {
            float panel[gpom::kTile * kPoints];
            float v[kPoints];
            gpom::nn_block_row(features, features[kPoints], i, v, panel);
            for (std::size_t r = 0; r < gpom::kTile; ++r) {
                const std::size_t own = gpom::kTile * i + r;
                for (std::size_t other = 0; other <= own; ++other) {
                    const double k = kernel(p, at[own], at[other]);
                    n_obtuse += k < 0.0 ? 1 : 0;
                    const float got = p.sf2 * panel[gpom::kTile * other + r];
                    CHECK(std::fabs(static_cast<double>(got) - k) <= tolerance(p, k));
                }
                const double k = kernel(p, at[own], at[kPoints]);
                const float got = p.sf2 * v[own];
                CHECK(std::fabs(static_cast<double>(got) - k) <= tolerance(p, k));
            }
        }
    }
    CHECK(n_obtuse > 100); // both ways were taken
}

// The lane Cholesky factor against Eigen's in double.
#include "tests/common/reference.hpp"

#include "src/gp/chol.hpp"

using namespace reference;

namespace
{

constexpr std::size_t kNMax = 64;

/// A factor of n rows, and of the identity where its last tile has more, W matrices at once.
template <int W> struct LaneFactor {
    using F = Lanes<W>;
    std::size_t n;
    std::vector<F> l;
    gpom::Factor<F> factor;

    explicit LaneFactor(std::size_t n_rows)
        : n(n_rows), l(gpom::panel_at(gpom::tile_count(n_rows))), factor{l.data(), F{}}
    {
        for (std::size_t i = n; i < gpom::kTile * gpom::tile_count(n); ++i) {
            at(i, i) = gpom::lane::splat<F>(1.0f);
        }
    }

    F &at(std::size_t row, std::size_t column)
    {
        return l[gpom::panel_at(row / gpom::kTile) + gpom::kTile * column + row % gpom::kTile];
    }

    void load(int lane, const Eigen::MatrixXf &A)
    {
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                gpom::lane::set(at(i, j), lane,
                                A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
            }
        }
    }

    void run()
    {
        for (std::size_t i = 0; i < gpom::tile_count(n); ++i) {
            gpom::factor_block_row(factor, i);
        }
    }

    /// All numbers of one lane that a good factor defines; of each row the diagonal comes last.
    std::vector<float> lane_bits(int lane)
    {
        std::vector<float> bits;
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                bits.push_back(gpom::lane::get(at(i, j), lane));
            }
        }
        return bits;
    }
};

/// A random covariance-like matrix: positive definite, eigenvalues from 0.1 up.
Eigen::MatrixXf random_matrix(Random &random, Eigen::Index n)
{
    Eigen::MatrixXd B(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
        for (Eigen::Index j = 0; j < n; ++j) {
            B(i, j) = random.uniform(-1.0, 1.0);
        }
    }
    const Eigen::MatrixXd A =
        B * B.transpose() / static_cast<double>(n) + 0.1 * Eigen::MatrixXd::Identity(n, n);
    return A.cast<float>();
}

template <int W> void check_against_eigen(Eigen::Index n)
{
    Random random(30 + static_cast<std::uint64_t>(n));
    LaneFactor<W> lanes(static_cast<std::size_t>(n));
    std::vector<Eigen::MatrixXf> matrices;
    for (int i = 0; i < W; ++i) {
        matrices.push_back(random_matrix(random, n));
        lanes.load(i, matrices.back());
    }
    lanes.run();
    for (int i = 0; i < W; ++i) {
        const Eigen::MatrixXd A = matrices[static_cast<std::size_t>(i)].cast<double>();
        const Eigen::MatrixXd L = A.llt().matrixL();
        const std::vector<float> got = lanes.lane_bits(i);
        double worst = 0.0;
        std::size_t at = 0;
        for (Eigen::Index r = 0; r < n; ++r) {
            for (Eigen::Index c = 0; c < r; ++c) {
                worst = std::max(worst, std::abs(static_cast<double>(got[at++]) - L(r, c)));
            }
            worst = std::max(worst, std::abs(static_cast<double>(got[at++]) * L(r, r) - 1.0));
        }
        CHECK(worst <= 2e-5);
        CHECK(gpom::lane::get(lanes.factor.bad, i) == 0.0f);
    }
}

template <int W> void check_forward(std::size_t n)
{
    using F = Lanes<W>;
    Random random(40);
    LaneFactor<W> lanes(n);
    const Eigen::MatrixXf A = random_matrix(random, static_cast<Eigen::Index>(n));
    Eigen::MatrixXd b(n, 2);
    std::vector<F> z[2];
    z[0].resize(gpom::kTile * gpom::tile_count(n));
    z[1] = z[0];
    for (int i = 0; i < W; ++i) {
        lanes.load(i, A);
    }
    lanes.run();
    for (std::size_t i = 0; i < n; ++i) {
        for (Eigen::Index side = 0; side < 2; ++side) {
            const float b_i = random.uniform_f(-1.0, 1.0);
            b(static_cast<Eigen::Index>(i), side) = b_i;
            z[side][i] = gpom::lane::splat<F>(b_i);
        }
    }
    for (std::size_t i = 0; i < gpom::tile_count(n); ++i) {
        gpom::forward_block(lanes.factor, i, z[0].data(), z[1].data());
    }
    const Eigen::MatrixXd truth = A.cast<double>().llt().matrixL().solve(b);
    for (std::size_t i = 0; i < n; ++i) {
        for (Eigen::Index side = 0; side < 2; ++side) {
            CHECK(static_cast<double>(gpom::lane::get(z[side][i], W - 1)) ==
                  doctest::Approx(truth(static_cast<Eigen::Index>(i), side)).epsilon(1e-4));
        }
    }
}

/// One lane's matrix gets `bad` on its diagonal, or a value that makes the pivot negative.
template <int W> void check_bad_pivot(float bad, Eigen::Index row, int bad_lane)
{
    constexpr Eigen::Index kN = 5;
    Random random(50);
    LaneFactor<W> clean(kN);
    LaneFactor<W> spoilt(kN);
    for (int i = 0; i < W; ++i) {
        Eigen::MatrixXf A = random_matrix(random, kN);
        clean.load(i, A);
        A(row, row) = i == bad_lane ? bad : A(row, row);
        spoilt.load(i, A);
    }
    clean.run();
    spoilt.run();
    for (int i = 0; i < W; ++i) {
        const bool is_bad = i == bad_lane;
        CHECK(gpom::lane::get(spoilt.factor.bad, i) == (is_bad ? 1.0f : 0.0f));
        const std::vector<float> bits = spoilt.lane_bits(i);
        if (is_bad) {
            const auto n_above = static_cast<std::ptrdiff_t>(row * (row + 1) / 2);
            const std::vector<float> clean_bits = clean.lane_bits(i);
            CHECK(std::equal(bits.begin(), bits.begin() + n_above, clean_bits.begin()));
        } else {
            CHECK(same_bits(bits, clean.lane_bits(i)));
        }
    }
}

} // namespace

// The factor of any size up to the most points is Eigen's, in each lane its own.
TEST_CASE("factor_block_row gives Eigen's factor")
{
    GPOM_TELL_SEED();
    for (const Eigen::Index n : {1, 2, 3, 7, 16, 33, 64}) {
        CAPTURE(n);
        check_against_eigen<1>(n);
        check_against_eigen<4>(n);
        check_against_eigen<8>(n);
        check_against_eigen<16>(n);
    }
}

// Forward substitution solves L z = b.
TEST_CASE("forward solves with the factor")
{
    GPOM_TELL_SEED();
    for (const std::size_t n : {std::size_t{1}, std::size_t{2}, std::size_t{16}, kNMax}) {
        check_forward<1>(n);
        check_forward<4>(n);
        check_forward<16>(n);
    }
}

// Every way in which a pivot can be unusable is noted in its own lane; the rows before it survive,
// and the other lanes keep every bit.
TEST_CASE("a bad pivot is noted in its lane and touches no other")
{
    GPOM_TELL_SEED();
    for (const float bad : {0.0f, -0.0f, -1.0f, -1e30f, kNan, kInf, -kInf}) {
        for (const Eigen::Index row : {0, 1, 4}) {
            CAPTURE(bad);
            CAPTURE(row);
            check_bad_pivot<1>(bad, row, 0);
            for (int lane = 0; lane < 4; ++lane) {
                check_bad_pivot<4>(bad, row, lane);
            }
            check_bad_pivot<8>(bad, row, 5);
            check_bad_pivot<16>(bad, row, 15);
        }
    }
}

// A matrix that stops being positive definite by its off-diagonal is caught as well: the second of
// two equal rows leaves a pivot of exactly 0.
TEST_CASE("two equal rows without noise are a bad pivot")
{
    LaneFactor<4> lanes(2);
    Eigen::MatrixXf A(2, 2);
    A << 4.0f, 4.0f, 4.0f, 4.0f;
    for (int i = 0; i < 4; ++i) {
        A(1, 1) = i == 2 ? 4.0f : 5.0f;
        lanes.load(i, A);
    }
    lanes.run();
    for (int i = 0; i < 4; ++i) {
        CHECK(gpom::lane::get(lanes.factor.bad, i) == (i == 2 ? 1.0f : 0.0f));
    }
}

// Block rows are dense: each starts behind the 4 x 4, 4 x 8, 4 x 12 ... elements before it.
TEST_CASE("panel_at counts the elements of the block rows above")
{
    std::size_t n = 0;
    for (std::size_t i = 0; i <= gpom::tile_count(kNMax); ++i) {
        CHECK(gpom::panel_at(i) == n);
        n += gpom::kTile * gpom::kTile * (i + 1);
    }
}

// From scans and poses to beams: what is kept, what is counted, what is refused.
#include "tests/common/reference.hpp"

using namespace reference;

namespace
{

gpom_config_t map_config(std::uint32_t beam_max = 256)
{
    return config_of(params_of(GPOM_KERNEL_MATERN12), beam_max);
}

/// A scan of one range at bearing 0.
TestScan single(float range_m)
{
    TestScan s;
    s.ranges_m = {range_m};
    return s;
}

bool same_stats(const gpom_stats_t &a, const gpom_stats_t &b)
{
    return std::memcmp(&a, &b, sizeof a) == 0;
}

/// Insert and expect `status`, no new beam, and no counter changed but `counter`, by one.
void check_refused(const TestScan &s, gpom_status_t status,
                   std::uint64_t gpom_stats_t::*counter = nullptr)
{
    TestMap map(map_config());
    REQUIRE(single(3.0f).insert_into(map.get()) == GPOM_OK);
    gpom_stats_t expected = map.stats();
    if (counter != nullptr) {
        ++(expected.*counter);
    }
    CHECK(s.insert_into(map.get()) == status);
    CHECK(gpom_map_beam_count(map.get()) == 1);
    CHECK(same_stats(map.stats(), expected));
}

/// The one beam that a scan of one range makes.
gpom_beam_t beam_of_single(const TestScan &s, const gpom_config_t &config = map_config())
{
    TestMap map(config);
    REQUIRE(s.insert_into(map.get()) == GPOM_OK);
    REQUIRE(gpom_map_beam_count(map.get()) == 1);
    return map.beams()[0];
}

/// Pose and mount composed in double: the sensor's place and the direction of a bearing.
Beam expected_beam(const TestScan &s, std::size_t i)
{
    const double c = std::cos(s.pose.yaw_rad), n = std::sin(s.pose.yaw_rad);
    const double bearing = s.angle_min_rad + static_cast<double>(i) * s.angle_step_rad;
    const double yaw =
        s.pose.yaw_rad + s.sensor.yaw_rad + (s.sensor.upside_down != 0 ? -bearing : bearing);
    const double range = s.ranges_m[i], range_max = s.sensor.range_max_m;
    return {{s.pose.x_m + c * s.sensor.x_m - n * s.sensor.y_m,
             s.pose.y_m + n * s.sensor.x_m + c * s.sensor.y_m},
            {std::cos(yaw), std::sin(yaw)},
            std::min(range, range_max),
            range < range_max,
            0.0,
            0.0,
            0};
}

/// Noise by the formula of scan.h, for the standard deviation sd_m.
double raised_noise(const gpom_params_t &p, double sn2, double sd_m)
{
    const Xy at = {0, 0}, moved = {sd_m, 0};
    const double prior = kernel(p, at, at);
    const double rho2 = std::pow(kernel(p, at, moved), 2) / (prior * kernel(p, moved, moved));
    return (sn2 + (1.0 - rho2) * prior) / rho2;
}

} // namespace

// A reading at or beyond the usable maximum is free up to there, without a hit.
TEST_CASE("a beam without return is free up to the usable maximum")
{
    for (const float range_m : {12.0f, 12.5f, kInf}) {
        TestScan s = single(range_m);
        s.sensor.range_max_m = 12.0f;
        const gpom_beam_t beam = beam_of_single(s);
        CHECK(beam.is_hit == 0);
        CHECK(beam.range_m == 12.0f);
    }
}

// Each kept beam can be read back: raw range, direction, place, time, id in order of insertion.
TEST_CASE("beams read back as they were inserted, for any mount")
{
    GPOM_TELL_SEED();
    Random random(100);
    TestMap map(map_config(2000));
    std::vector<Beam> expected;
    std::vector<std::int64_t> stamps;
    for (int i = 0; i < 30; ++i) {
        TestScan s = yard_scan(random, i, {0, 0});
        s.sensor.x_m = random.uniform(-2, 2);
        s.sensor.y_m = random.uniform(-2, 2);
        s.sensor.yaw_rad = random.uniform(-4, 4);
        s.sensor.upside_down = i % 2 == 0 ? 1 : 0;
        s.angle_step_rad = i % 3 == 0 ? -0.05 : 0.05;
        s.stamp_us = INT64_C(1700000000000000) + 12345 * i;
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
        for (std::size_t j = 0; j < s.ranges_m.size(); ++j) {
            expected.push_back(expected_beam(s, j));
            stamps.push_back(s.stamp_us);
        }
    }
    const std::vector<gpom_beam_t> beams = map.beams();
    REQUIRE(beams.size() == expected.size());
    double worst_m = 0.0, worst_dir = 0.0;
    bool all_same = true;
    for (std::size_t i = 0; i < beams.size(); ++i) {
        const Beam got = beam_of(beams[i]);
        worst_m = std::max(worst_m, std::hypot(got.origin.x - expected[i].origin.x,
                                               got.origin.y - expected[i].origin.y));
        worst_dir = std::max(
            worst_dir, std::hypot(got.dir.x - expected[i].dir.x, got.dir.y - expected[i].dir.y));
        all_same = all_same && got.range == expected[i].range && got.is_hit == expected[i].is_hit &&
                   beams[i].returned == beams[i].is_hit && beams[i].is_free == 1 &&
                   beams[i].provisional == 0 && beams[i].n_agreed == 0 && beams[i].id == i &&
                   beams[i].stamp_us <= stamps[i] && beams[i].stamp_us > stamps[i] - 1000;
    }
    CHECK(all_same);
    CHECK(worst_m <= 1e-5); // 100 m in float32
    CHECK(worst_dir <= 2e-7);
}

// Stamps may be anything: beams tell theirs to a millisecond, held within 49 days from the first.
TEST_CASE("beams keep stamps of any size within 49 days of the first")
{
    constexpr std::int64_t kLow = INT64_MIN, kHigh = INT64_MAX, kMost = INT64_C(4294967295000);
    const std::int64_t table[][3] = {{0, 1999, 1000},
                                     {0, -5, 0},
                                     {kLow, kHigh, kLow + kMost},
                                     {kHigh, kLow, kHigh},
                                     {kHigh - 2500, kHigh, kHigh - 500},
                                     {0, kMost + 9999, kMost}};
    for (const auto &row : table) {
        TestMap map(map_config());
        TestScan s = single(3.0f);
        s.stamp_us = row[0];
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
        s.stamp_us = row[1];
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
        CHECK(map.beams()[0].stamp_us == row[0]);
        CHECK(map.beams()[1].stamp_us == row[2]);
    }
}

// Masked bearings are ignored and counted, both ends included, also across pi and for whole turns
// more.
TEST_CASE("masks remove their bearings, also across pi")
{
    const gpom_mask_t masks[] = {{3.0f, -3.0f}, {0.5f, 1.0f}, {-1.25f, -1.25f}};
    const double two_pi = 2.0 * kPi;
    const struct {
        double bearing_rad;
        bool is_masked;
    } table[] = {{0.0, false},          {0.5, true},           {0.75, true},
                 {1.0, true},           {1.001, false},        {0.499, false},
                 {3.0, true},           {kPi, true},           {-kPi, true},
                 {-3.0, true},          {-2.999, false},       {2.999, false},
                 {-1.25, true},         {-1.24, false},        {-1.26, false},
                 {0.75 + two_pi, true}, {0.75 - two_pi, true}, {0.25 + two_pi, false},
                 {3.1 - two_pi, true}};
    for (const auto &row : table) {
        for (const bool upside_down : {false, true}) { // bearings are the scan's own either way
            CAPTURE(row.bearing_rad);
            TestMap map(map_config());
            TestScan s = single(5.0f);
            s.angle_min_rad = row.bearing_rad;
            s.sensor.upside_down = upside_down ? 1 : 0;
            s.sensor.yaw_rad = 2.0;
            s.pose.yaw_rad = -1.0;
            s.sensor.masks = masks;
            s.sensor.n_masks = 3;
            CHECK(s.insert_into(map.get()) == GPOM_OK);
            CHECK(map.stats().beams_masked == (row.is_masked ? 1 : 0));
            CHECK(gpom_map_beam_count(map.get()) == (row.is_masked ? 0 : 1));
        }
    }
}

// A mask whose ends lie a full turn apart removes every bearing, although float32 rounds pi up.
TEST_CASE("a mask of a full turn removes everything")
{
    const float pi = static_cast<float>(kPi);
    const gpom_mask_t mask = {-pi, pi};
    for (const double bearing_rad : {-3.0, -1.0, 0.0, 0.5, 3.0}) {
        TestScan s = single(5.0f);
        s.angle_min_rad = bearing_rad;
        s.sensor.masks = &mask;
        s.sensor.n_masks = 1;
        TestMap map(map_config());
        CHECK(s.insert_into(map.get()) == GPOM_OK);
        CHECK(map.stats().beams_masked == 1);
    }
}

// A return nearer than the gap keeps its hit and leaves a free segment of no length, at the sensor.
TEST_CASE("a hit within the gap leaves a free point at the sensor")
{
    for (const float range_m : {0.0625f, 0.25f, 0.5f}) {
        gpom_config_t config = map_config();
        config.params.gap_m = 0.5f;
        TestMap map(config);
        TestScan s = single(range_m);
        s.pose.x_m = 2.0;
        REQUIRE(s.insert_into(map.get()) == GPOM_OK);
        const Xy q = {2.5, 1.0};
        const Moments truth = predict(
            config.params,
            {{{2.0 + static_cast<double>(range_m), 0}, 1.0, static_cast<double>(config.params.sn2)},
             {{2.0, 0}, -1.0, static_cast<double>(config.params.sn2_free)}},
            q);
        const gpom_answer_t answer = query_points(map.get(), {{q.x, q.y}}).all[0];
        CHECK(static_cast<double>(answer.mean) == doctest::Approx(truth.mean).epsilon(1e-4));
        CHECK(static_cast<double>(answer.variance) ==
              doctest::Approx(truth.variance).epsilon(1e-4));
    }
}

// A pose that is not finite, or turned out of range, is refused and counted.
TEST_CASE("a pose that is not finite is refused")
{
    const double bads[] = {static_cast<double>(kNan), static_cast<double>(kInf),
                           -static_cast<double>(kInf)};
    for (const double bad : bads) {
        for (double gpom_pose_t::*at :
             {&gpom_pose_t::x_m, &gpom_pose_t::y_m, &gpom_pose_t::yaw_rad}) {
            TestScan s = single(3.0f);
            s.pose.*at = bad;
            check_refused(s, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
        }
    }
    TestScan s = single(3.0f);
    s.pose.yaw_rad = 1.0001e6;
    check_refused(s, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
}

// Each way a covariance can be invalid is refused and counted.
TEST_CASE("an invalid pose covariance is refused")
{
    const float table[][9] = {
        {-1e-6f, 0, 0, 0, 1, 0, 0, 0, 1},        {1, 0, 0, 0, 1, 0, 0, 0, -1},
        {kNan, 0, 0, 0, 1, 0, 0, 0, 1},          {1, 0, 0, 0, kInf, 0, 0, 0, 1},
        {1, kNan, 0, kNan, 1, 0, 0, 0, 1},       {1, 1.01f, 0, 1.01f, 1, 0, 0, 0, 1},
        {1, 0, 0, 0, 1, -0.6f, 0, -0.6f, 0.25f}, {0, 0.1f, 0, 0.1f, 1, 0, 0, 0, 1},
        {1, 0.2f, 0, 0.3f, 1, 0, 0, 0, 1},       {1, 0, 0.2f, 0, 1, 0, -0.2f, 0, 1},
        {1, 0, 0, 0, 1, 0, 0, kNan, 1}};
    for (const auto &cov : table) {
        TestScan s = single(3.0f);
        s.pose.cov = cov;
        check_refused(s, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
    }
}

// Correlations that are pairwise legal but together impossible have a negative variance somewhere:
// the matrix is not positive semidefinite and is refused.
TEST_CASE("a covariance that is not positive semidefinite is refused")
{
    const float cov[9] = {1.0f, -0.9f, -0.9f, -0.9f, 1.0f, -0.9f, -0.9f, -0.9f, 1.0f};
    TestScan s = single(3.0f);
    s.pose.cov = cov;
    check_refused(s, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
}

// Valid covariances are taken: zero, singular, fully correlated.
TEST_CASE("valid covariances are accepted")
{
    const float table[][9] = {
        {0, 0, 0, 0, 0, 0, 0, 0, 0},
        {1, 0, 0, 0, 0, 0, 0, 0, 0},
        {0.25f, 0.5f, 0, 0.5f, 1, 0, 0, 0, 0},
        {0.04f, 0.01f, 0.001f, 0.01f, 0.09f, -0.002f, 0.001f, -0.002f, 0.01f}};
    for (const auto &cov : table) {
        TestScan s = single(3.0f);
        s.pose.cov = cov;
        CHECK(beam_of_single(s).range_m == 3.0f);
    }
}

// Noise only grows: with pose variance, with range variance, and under yaw variance with the range.
TEST_CASE("noise grows with every uncertainty")
{
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        const gpom_config_t config = config_of(params_of(which));
        float by_pose = config.params.sn2, by_range_var = by_pose, by_yaw = by_pose,
              by_range = by_pose;
        for (const float var : {0.01f, 0.04f, 0.25f, 1.0f, 1e4f, 1e12f}) {
            const float pose_cov[9] = {var, 0, 0, 0, var, 0, 0, 0, 0};
            const float yaw_cov[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0.01f * var};
            TestScan s = single(5.0f);
            s.pose.cov = pose_cov;
            const float pose_noise = beam_of_single(s, config).hit_noise;
            s.pose.cov = yaw_cov;
            const float yaw_noise = beam_of_single(s, config).hit_noise;
            s.pose.cov = nullptr;
            s.sensor.range_var_m2 = var;
            const float range_noise = beam_of_single(s, config).hit_noise;
            const bool may_saturate = var > 1.0f;
            CHECK((pose_noise > by_pose || (may_saturate && pose_noise == by_pose)));
            CHECK((range_noise > by_range_var || (may_saturate && range_noise == by_range_var)));
            CHECK((yaw_noise > by_yaw || (may_saturate && yaw_noise == by_yaw)));
            by_pose = pose_noise;
            by_range_var = range_noise;
            by_yaw = yaw_noise;
        }
        const float yaw_cov[9] = {0, 0, 0, 0, 0, 0, 0, 0, 0.001f};
        for (const float range_m : {1.0f, 3.0f, 9.0f, 27.0f}) {
            TestScan s = single(range_m);
            s.pose.cov = yaw_cov;
            const float noise = beam_of_single(s, config).hit_noise;
            CHECK(noise > by_range);
            by_range = noise;
        }
    }
}

// The noise is the header's formula, with the variance propagated to the hit to first order.
TEST_CASE("noise is (sn2 + (1 - rho^2) k) / rho^2")
{
    GPOM_TELL_SEED();
    Random random(101);
    for (const gpom_kernel_t which : kKernels) {
        INFO("kernel ", std::string(kKernelNames[which]));
        const gpom_config_t config = config_of(params_of(which));
        for (int i = 0; i < 30; ++i) {
            Eigen::Matrix3d B;
            for (int j = 0; j < 9; ++j) {
                B(j) = random.uniform(-0.2, 0.2) * (j % 3 == 2 ? 0.2 : 1.0);
            }
            const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> cov =
                (B.transpose() * B).cast<float>();
            TestScan s = single(random.uniform_f(0.5, 10.0));
            s.angle_min_rad = random.uniform(-3, 3);
            s.pose.yaw_rad = random.uniform(-3, 3);
            s.sensor.x_m = random.uniform(-2, 2);
            s.sensor.range_var_m2 = random.uniform_f(0.0, 0.02);
            s.pose.cov = cov.data();
            const Beam e = expected_beam(s, 0);
            const double lx = e.origin.x + e.range * e.dir.x, ly = e.origin.y + e.range * e.dir.y;
            Eigen::Matrix<double, 2, 3> J;
            J << 1, 0, -ly, 0, 1, lx; // d hit / d (x, y, yaw), the robot standing at the origin
            const double var = static_cast<double>(s.sensor.range_var_m2) +
                               0.5 * (J * cov.cast<double>() * J.transpose()).trace();
            const gpom_beam_t beam = beam_of_single(s, config);
            const gpom_params_t &p = config.params;
            CHECK(static_cast<double>(beam.hit_noise) ==
                  doctest::Approx(raised_noise(p, static_cast<double>(p.sn2), std::sqrt(var)))
                      .epsilon(2e-3));
            CHECK(static_cast<double>(beam.free_noise) ==
                  doctest::Approx(raised_noise(p, static_cast<double>(p.sn2_free), std::sqrt(var)))
                      .epsilon(2e-3));
        }
    }
}

// Noises written by an independent program, over kernels and standard deviations.
TEST_CASE("noise equals the golden values")
{
    const std::vector<Row> rows = read_golden("excess_noise.csv");
    REQUIRE(rows.size() >= 20); // run from the repository's root
    for (const Row &row : rows) {
        gpom_config_t config = map_config();
        config.params = params_of_row(row, 0);
        config.params.alpha = 1.0f;
        config.params.beta = 0.0f;
        config.params.sn2 = config.params.sn2_free = std::stof(row.at(6));
        TestScan s = single(3.0f);
        s.sensor.range_var_m2 = std::stof(row.at(5)) * std::stof(row.at(5));
        INFO(row[0], " at ", row[5]);
        CHECK(static_cast<double>(beam_of_single(s, config).hit_noise) ==
              doctest::Approx(number(row, 7)).epsilon(1e-3));
    }
}

// A covariance of zeros is a pose that is known exactly.
TEST_CASE("zero covariance equals none")
{
    const float zeros[9] = {};
    TestScan s = single(4.0f);
    s.pose.yaw_rad = 0.7;
    const gpom_beam_t known = beam_of_single(s);
    s.pose.cov = zeros;
    const gpom_beam_t zero = beam_of_single(s);
    CHECK(std::memcmp(&known, &zero, sizeof known) == 0);
    CHECK(known.hit_noise == map_config().params.sn2);
    CHECK(known.free_noise == map_config().params.sn2_free);
}

// However large the uncertainty, even where its propagation overflows, the noise is large and
// finite: it must never come out as "known exactly".
TEST_CASE("a hopeless pose has a large, finite noise")
{
    const float big = 1e12f;
    const float table[][9] = {{big, 0, 0, 0, big, 0, 0, 0, big},
                              {big, big, big, big, big, big, big, big, big},
                              {big, -big, big, -big, big, -big, big, -big, big},
                              {0, 0, 0, 0, 0, 0, 0, 0, big}};
    for (const auto &cov : table) {
        for (const double yaw_rad : {0.0, 1.0, 2.5}) {
            TestScan s = single(20.0f);
            s.pose.yaw_rad = yaw_rad;
            s.pose.cov = cov;
            const gpom_beam_t beam = beam_of_single(s);
            CHECK(beam.hit_noise >= 1e6f);
            CHECK(beam.hit_noise <= 1e30f);
        }
    }
}

// Beams keep their millimetres when the map lies far from its frame's zero, as in UTM coordinates.
TEST_CASE("far poses lose nothing beside a far origin")
{
    for (const Xy far : {Xy{400e3, 5800e3}, Xy{-5800e3, 400e3}}) {
        gpom_config_t config = map_config();
        config.origin_x_m = far.x;
        config.origin_y_m = far.y;
        TestScan s = single(7.0f);
        s.pose = {far.x + 123.456, far.y - 78.9, 0.4, nullptr};
        s.sensor.x_m = 1.5;
        const Beam expected = expected_beam(s, 0);
        const gpom_beam_t beam = beam_of_single(s, config);
        CHECK(std::abs(beam.x_m - expected.origin.x) <= 1e-5);
        CHECK(std::abs(beam.y_m - expected.origin.y) <= 1e-5);
    }
}

// A sensor beyond reach is refused and counted, so is a pose where no map can be; just within it is
// taken.
TEST_CASE("a sensor beyond 8 km is refused")
{
    for (const Xy at : {Xy{8000.5, 0}, Xy{-5700, 5700}, Xy{0, 1e8}, Xy{1e8, -1e8}}) {
        TestScan s = single(3.0f);
        s.pose.x_m = at.x;
        s.pose.y_m = at.y;
        check_refused(s, GPOM_ERR_REACH, &gpom_stats_t::scans_out_of_reach);
    }
    for (const Xy at : {Xy{1.0001e8, 0}, Xy{0, -1.0001e8}, Xy{1e21, 0}, Xy{1e300, -1e300}}) {
        TestScan s = single(3.0f);
        s.pose.x_m = at.x;
        s.pose.y_m = at.y;
        check_refused(s, GPOM_ERR_ARG, &gpom_stats_t::scans_bad_pose);
    }
    TestScan s = single(3.0f);
    s.pose.x_m = 7999.5;
    CHECK(beam_of_single(s).x_m == doctest::Approx(7999.5));
}

// In a full map each new beam is in at the cost of one that went, or stayed out; either is counted.
TEST_CASE("beams that do not fit are counted")
{
    TestMap map(map_config(10));
    TestScan s;
    s.ranges_m = {1, 2, kNan, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0, 12};
    for (std::uint64_t i = 1; i <= 3; ++i) {
        CHECK(s.insert_into(map.get()) == GPOM_OK);
        const gpom_stats_t n = map.stats();
        CHECK(gpom_map_beam_count(map.get()) == 10);
        CHECK(n.beams_hit + n.beams_redundant == 12 * i);
        CHECK(n.beams_hit - gpom_stats_evicted(&n) == 10);
        CHECK(n.beams_nan == i);
        CHECK(n.beams_not_positive == i);
        CHECK(n.scans_inserted == i);
    }
    const gpom_stats_t full = map.stats();
    CHECK(gpom_stats_evicted(&full) > 0);
    CHECK(single(kNan).insert_into(map.get()) == GPOM_OK); // nothing that needed room
    CHECK(map.n_evicted() == gpom_stats_evicted(&full));
}

// Arguments out of range are refused before anything is counted or kept.
TEST_CASE("a broken scan or sensor leaves the map unchanged")
{
    const double nan = static_cast<double>(kNan);
    std::vector<TestScan> broken(18, single(3.0f));
    broken[0].angle_min_rad = nan;
    broken[1].angle_step_rad = nan;
    broken[2].angle_min_rad = static_cast<double>(kInf);
    broken[3].angle_step_rad = -static_cast<double>(kInf);
    broken[4].sensor.x_m = nan;
    broken[5].sensor.y_m = static_cast<double>(kInf);
    broken[6].sensor.yaw_rad = nan;
    broken[7].sensor.range_min_m = -0.1f;
    broken[8].sensor.range_min_m = kNan;
    broken[9].sensor.range_max_m = kNan;
    broken[10].sensor.range_max_m = kInf;
    broken[11].sensor.range_max_m = 0.0f;
    broken[12].sensor.range_min_m = broken[12].sensor.range_max_m;
    broken[13].sensor.range_var_m2 = -1.0f;
    broken[14].sensor.range_var_m2 = kNan;
    broken[15].sensor.range_var_m2 = kInf;
    broken[16].sensor.n_masks = 1; // but no masks
    broken[17].ranges_m.assign(GPOM_RANGES_MAX + 1, 1.0f);
    for (std::size_t i = 0; i < broken.size(); ++i) {
        CAPTURE(i);
        check_refused(broken[i], GPOM_ERR_ARG);
    }
}

// Null pointers are refused; a scan without ranges needs none.
TEST_CASE("null arguments are refused")
{
    TestMap map(map_config());
    const TestScan s = single(3.0f);
    gpom_scan_t scan = s.scan();
    CHECK(gpom_scan_insert(nullptr, &scan, &s.sensor, &s.pose) == GPOM_ERR_ARG);
    CHECK(gpom_scan_insert(map.get(), nullptr, &s.sensor, &s.pose) == GPOM_ERR_ARG);
    CHECK(gpom_scan_insert(map.get(), &scan, nullptr, &s.pose) == GPOM_ERR_ARG);
    CHECK(gpom_scan_insert(map.get(), &scan, &s.sensor, nullptr) == GPOM_ERR_ARG);
    scan.ranges_m = nullptr;
    CHECK(gpom_scan_insert(map.get(), &scan, &s.sensor, &s.pose) == GPOM_ERR_ARG);
    CHECK(map.stats().scans_inserted == 0);
    scan.n_ranges = 0;
    CHECK(gpom_scan_insert(map.get(), &scan, &s.sensor, &s.pose) == GPOM_OK);
    CHECK(map.stats().scans_inserted == 1);
    gpom_sensor_init(nullptr);
}

// Times of recorded scans: those that are sound stay, and what is done to others is told.
#include "ports/host/scan_times.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace gpom_tools;

namespace
{

std::vector<Scan> scans_at(const std::vector<double> &times_s)
{
    std::vector<Scan> scans(times_s.size());
    for (std::size_t i = 0; i < scans.size(); ++i) {
        scans[i].t_s = times_s[i];
    }
    return scans;
}

/// Ten a second, from a time since 1970 on.
std::vector<double> clock_times(std::size_t n)
{
    std::vector<double> times_s;
    for (std::size_t i = 0; i < n; ++i) {
        times_s.push_back(1.6e9 + 0.1 * static_cast<double>(i));
    }
    return times_s;
}

bool is_close(double a, double b) { return std::abs(a - b) < 1e-6; }

} // namespace

TEST_CASE("a clock that is set back once leaves the times before it and all intervals")
{
    for (const double back_s : {0.25, 5.0, 3600.0, 1.6e9}) {
        for (const std::size_t i_back : {1u, 50u, 99u}) {
            CAPTURE(back_s);
            CAPTURE(i_back);
            std::vector<double> times_s = clock_times(100);
            for (std::size_t i = i_back; i < 100; ++i) {
                times_s[i] -= back_s;
            }
            std::vector<Scan> scans = scans_at(times_s);
            const std::vector<std::string> told = mend_times(scans);
            for (std::size_t i = 0; i < 100; ++i) {
                CHECK(is_close(scans[i].t_s, clock_times(100)[i]));
            }
            REQUIRE(told.size() == 1);
            CHECK(told[0].find("the clock goes back 1 time, at scan " + std::to_string(i_back + 1) +
                               " by ") == 0);
        }
    }
}

TEST_CASE("what is told of a clock says where, by how much and what was done")
{
    std::vector<Scan> scans = scans_at({0.0, 0.1, 0.2, 0.3, 0.05, 0.15, 0.25, 0.35});
    CHECK(mend_times(scans) ==
          std::vector<std::string>{
              "the clock goes back 1 time, at scan 5 by 0.25 s: the times from there on are moved "
              "so that they go on"});
}

TEST_CASE("a time that is wrong alone leaves all others, to the bit")
{
    for (const double wrong_s : {-1e9, -1.0, -0.45, 0.45, 1.0, 3600.0, 1e9}) {
        CAPTURE(wrong_s);
        std::vector<double> times_s = clock_times(100);
        times_s[50] += wrong_s;
        std::vector<Scan> scans = scans_at(times_s);
        const std::vector<std::string> told = mend_times(scans);
        for (std::size_t i = 0; i < 100; ++i) {
            CAPTURE(i);
            CHECK((i == 50 || scans[i].t_s == times_s[i]));
        }
        CHECK(is_close(scans[50].t_s, clock_times(100)[50]));
        CHECK(told == std::vector<std::string>{
                          "1 time out of order: set between the times before and after"});
    }
}

// As of a logger that stamps scans when it gets to them. Where several late stamps meet, no rule
// can tell them from a clock that is set back; that is rare.
TEST_CASE("late stamps are set in order, and hardly ever taken for a clock that is set back")
{
    std::mt19937_64 bits(1);
    std::uniform_real_distribution<double> chance;
    const std::vector<double> true_s = clock_times(20000);
    std::vector<double> times_s = true_s;
    for (double &time_s : times_s) {
        time_s += chance(bits) < 0.02 ? chance(bits) : 0.0;
    }
    std::vector<Scan> scans = scans_at(times_s);
    REQUIRE(!mend_times(scans).empty());
    for (std::size_t i = 0; i < scans.size(); ++i) {
        CHECK(std::abs(scans[i].t_s - true_s[i]) < 3.0);
        CHECK((i == 0 || scans[i].t_s >= scans[i - 1].t_s));
    }
}

TEST_CASE("whatever times there are, they never go back afterwards, and sound ones are not touched")
{
    std::mt19937_64 bits(2);
    std::uniform_real_distribution<double> number(-1e6, 1e6);
    for (int n_repeat = 0; n_repeat < 200; ++n_repeat) {
        std::vector<double> times_s(1 + bits() % 30);
        std::generate(times_s.begin(), times_s.end(), [&] { return number(bits); });
        std::vector<Scan> scans = scans_at(times_s);
        const bool is_told = !mend_times(scans).empty();
        CHECK(is_told == !std::is_sorted(times_s.begin(), times_s.end()));
        CHECK(std::is_sorted(scans.begin(), scans.end(),
                             [](const Scan &a, const Scan &b) { return a.t_s < b.t_s; }));
        std::sort(times_s.begin(), times_s.end());
        scans = scans_at(times_s);
        CHECK(mend_times(scans).empty());
        for (std::size_t i = 0; i < scans.size(); ++i) {
            CHECK(scans[i].t_s == times_s[i]);
        }
    }
}

TEST_CASE("too few times for a clock are told, with what scans have instead")
{
    std::vector<Scan> scans = scans_at({7.0, 7.0, 7.0, 8.0, 8.0});
    CHECK(mend_times(scans) ==
          std::vector<std::string>{
              "only 2 times in 5 scans: the time of each scan is its number, in seconds"});
    CHECK(scans[4].t_s == 4.0);
}

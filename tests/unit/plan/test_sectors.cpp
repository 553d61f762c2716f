// Sectors against all cells of a copy, one by one, in double precision.
#include "gpom/sectors.h"
#include "tests/common/lowres_fixture.hpp"

#include <complex>

using namespace reference;

namespace
{

using Complex = std::complex<double>;

constexpr double kCell_m = 0.25;
/// More than a bearing may be wrong [rad], and than a length may be wrong [m].
constexpr double kAngle_rad = 5e-6;
constexpr double kLength_m = 2e-5;

constexpr std::uint32_t kFree = GPOM_FREE << 24 | 20u << 16 | 3000;
constexpr std::uint32_t kOccupied = GPOM_OCCUPIED << 24 | 30u << 16 | 60000;
constexpr std::uint32_t kUnknown = GPOM_UNKNOWN << 24 | 255u << 16 | 33000;

/// A map whose cells the test sets. Its window has moved, so that cells lie anywhere in memory.
struct Scene {
    TestMap map{rolling_config(61, 53, kCell_m)};
    gpom_lookout_t lookout = {0.0, 0.0, 0.7, 4.8f, 0.4f};
    gpom::Layer &layer = map.get()->lowres.layers[GPOM_LAYER_COARSE];

    explicit Scene(gpom::Point robot = {20.1f, -31.4f})
    {
        gpom::lowres_follow(map.get()->lowres, robot, 0);
        lookout.x_m = static_cast<double>(robot.x_m);
        lookout.y_m = static_cast<double>(robot.y_m);
        fill(kFree);
    }
    void fill(std::uint32_t value)
    {
        for (std::uint32_t i = 0; i < layer.cell_max; ++i) {
            layer.cells[i].value = value;
        }
    }
    /// Set the cell so far away in a direction from forward.
    void set(double distance_m, double bearing_rad, std::uint32_t value)
    {
        const Complex p = std::polar(distance_m, bearing_rad + lookout.yaw_rad);
        const auto ix = static_cast<std::int32_t>(std::floor((lookout.x_m + p.real()) / kCell_m));
        const auto iy = static_cast<std::int32_t>(std::floor((lookout.y_m + p.imag()) / kCell_m));
        layer.cells[gpom::slot_of(layer.window, ix, iy)].value = value;
    }
    std::vector<gpom_sector_t> look(std::size_t n, gpom_status_t expected = GPOM_OK)
    {
        std::vector<gpom_sector_t> sectors(n);
        CHECK(gpom_sectors(map.get(), &lookout, sectors.data(), n, nullptr) == expected);
        return sectors;
    }
};

/// A cell, and its corners as seen from the pose, with x forward.
struct Seen {
    gpom_cell_t cell;
    Complex low, high, turn; ///< Relative to the pose, in the map frame; the turn to forward.
    double distance_m, centre_m;

    Complex centre() const { return 0.5 * (low + high) * turn; }
    /// Signed angles from the bearing to the rightmost and leftmost corner.
    std::pair<double, double> beside(double bearing_rad) const
    {
        const double middle = std::arg(centre() * std::polar(1.0, -bearing_rad));
        std::pair<double, double> span = {middle, middle};
        for (const Complex corner :
             {low, high, Complex(low.real(), high.imag()), Complex(high.real(), low.imag())}) {
            const double aside = std::arg(corner * turn / centre());
            span.first = std::min(span.first, middle + aside);
            span.second = std::max(span.second, middle + aside);
        }
        return span;
    }
    /// True if the cell, or one that is larger by `more_rad` on both sides, overlaps the sector.
    bool overlaps(double bearing_rad, double half_rad, double more_rad) const
    {
        const auto [right, left] = beside(bearing_rad);
        const bool is_direct = right <= half_rad + more_rad && left >= -half_rad - more_rad;
        const bool is_behind = left >= 2 * M_PI - half_rad - more_rad || // seen the other way round
                               right <= -2 * M_PI + half_rad + more_rad;
        return distance_m <= 0.0 || is_direct || is_behind;
    }
    /// Where a ray enters the cell, enlarged by `more_m`. Infinity: nowhere.
    double entry_m(double bearing_rad, double more_m) const
    {
        const Complex d = std::polar(1.0, bearing_rad) / turn;
        const auto slab = [more_m](double slope, double a, double b) {
            const double p = (a - more_m) / slope, q = (b + more_m) / slope;
            return std::make_pair(std::min(p, q), std::max(p, q));
        };
        const auto [x0, x1] = slab(d.real(), low.real(), high.real());
        const auto [y0, y1] = slab(d.imag(), low.imag(), high.imag());
        const double first = std::max({x0, y0, 0.0});
        return first <= std::min(x1, y1) ? first : INFINITY;
    }
};

/// All cells of the raster, and a frame of unknown cells about it.
std::vector<Seen> all_seen(Scene &scene)
{
    const Raster raster = raster_of(scene.map.get());
    const gpom_raster_t &r = raster.info.raster;
    const gpom_lookout_t &from = scene.lookout;
    std::vector<Seen> all;
    for (std::int64_t iy = -1; iy <= r.ny; ++iy) {
        for (std::int64_t ix = -1; ix <= r.nx; ++ix) {
            const bool is_inside = ix >= 0 && iy >= 0 && ix < r.nx && iy < r.ny;
            Seen seen = {};
            seen.cell = is_inside ? raster.at(std::uint32_t(ix), std::uint32_t(iy))
                                  : gpom_cell_t{0, 255, GPOM_UNKNOWN, 0};
            seen.low = {r.x0_m + double(ix) * r.cell_m - from.x_m,
                        r.y0_m + double(iy) * r.cell_m - from.y_m};
            seen.high = seen.low + Complex(r.cell_m, r.cell_m);
            seen.turn = std::polar(1.0, -from.yaw_rad);
            const Complex nearest = {std::clamp(0.0, seen.low.real(), seen.high.real()),
                                     std::clamp(0.0, seen.low.imag(), seen.high.imag())};
            seen.distance_m = std::abs(nearest);
            seen.centre_m = std::abs(seen.centre());
            const double radius_m = static_cast<double>(from.radius_m);
            if (seen.centre_m > radius_m && seen.distance_m < static_cast<double>(from.range_m)) {
                all.push_back(seen);
            }
        }
    }
    return all;
}

/// One sector by brute force: bounds of the two lengths.
struct Bounds {
    double distance_low_m, distance_high_m, free_low_m, free_high_m;
};

Bounds bounds_of(const std::vector<Seen> &all, double bearing_rad, double half_rad, double range_m)
{
    Bounds b = {range_m, range_m, range_m, range_m};
    for (const Seen &seen : all) {
        if (seen.cell.cls == GPOM_FREE) {
            continue;
        }
        const auto bound = [](double &least, bool is_met, double length_m) {
            least = is_met ? std::min(least, length_m) : least;
        };
        bound(b.distance_low_m, seen.overlaps(bearing_rad, half_rad, kAngle_rad), seen.distance_m);
        bound(b.distance_high_m, seen.overlaps(bearing_rad, half_rad, -kAngle_rad),
              seen.distance_m);
        bound(b.free_low_m, true, seen.entry_m(bearing_rad, 10 * kLength_m));
        bound(b.free_high_m, true, seen.entry_m(bearing_rad, -10 * kLength_m));
    }
    return b;
}

bool is_of(const gpom_sector_t &sector, const gpom_cell_t &cell)
{
    return sector.probability == cell.probability && sector.variance == cell.variance &&
           sector.cls == cell.cls;
}

/// True if some cell at the sector's distance is what the sector says. Of a sector without end: if
/// the sector has the greatest probability of the free cells in it.
bool tells_its_cell(const std::vector<Seen> &all, const gpom_sector_t &sector, double bearing_rad,
                    double half_rad)
{
    int greatest = 0;
    bool is_found = false;
    for (const Seen &seen : all) {
        const double aside = std::fabs(std::arg(seen.centre() * std::polar(1.0, -bearing_rad)));
        if (sector.cls == GPOM_FREE && seen.cell.cls == GPOM_FREE &&
            aside < half_rad - kAngle_rad) {
            greatest = std::max<int>(greatest, seen.cell.probability);
        }
        is_found =
            is_found || (sector.cls != GPOM_FREE && is_of(sector, seen.cell) &&
                         std::fabs(seen.distance_m - double(sector.distance_m)) < kLength_m &&
                         seen.overlaps(bearing_rad, half_rad, kAngle_rad));
    }
    return sector.cls == GPOM_FREE ? sector.probability >= greatest : is_found;
}

void check_against_all(Scene &scene, std::size_t n)
{
    const std::vector<gpom_sector_t> sectors = scene.look(n);
    const std::vector<Seen> all = all_seen(scene);
    const double half_rad = M_PI / double(n);
    const double range_m = static_cast<double>(scene.lookout.range_m);
    for (std::size_t i = 0; i < n; ++i) {
        CAPTURE(i);
        const double bearing_rad = 2.0 * half_rad * double(i);
        const Bounds b = bounds_of(all, bearing_rad, half_rad, range_m);
        const auto distance_m = double(sectors[i].distance_m), free_m = double(sectors[i].free_m);
        CHECK(distance_m >= b.distance_low_m - kLength_m);
        CHECK(distance_m <= b.distance_high_m * (1.0 + 1e-6)); // rounded down, never up
        CHECK(free_m >= std::max(b.free_low_m, b.distance_low_m) - kLength_m);
        CHECK(free_m <= b.free_high_m + kLength_m);
        CHECK(free_m >= distance_m);
        CHECK(tells_its_cell(all, sectors[i], bearing_rad, half_rad));
        CHECK((sectors[i].cls == GPOM_FREE) == (sectors[i].distance_m == scene.lookout.range_m));
    }
}

} // namespace

// At any place, direction, range and radius, in any number of sectors, over cells of any class.
TEST_CASE("each sector's lengths and cell are those of a search of all cells")
{
    GPOM_TELL_SEED();
    Random random(730);
    for (int round = 0; round < 60; ++round) {
        Scene scene({random.uniform_f(-90, 90), random.uniform_f(-90, 90)});
        const std::uint32_t n_kinds = 20u << random.below(8); // of many cells one is not free
        for (std::uint32_t i = 0; i < scene.layer.cell_max; ++i) {
            const std::uint32_t cls = random.below(n_kinds) == 0 ? 1 + random.below(3) : 0;
            scene.layer.cells[i].value = cls << 24 | random.below(256) << 16 | random.below(65536);
        }
        scene.lookout.x_m += random.uniform(-3.0, 3.0);
        scene.lookout.y_m += random.uniform(-3.0, 3.0);
        scene.lookout.yaw_rad = random.uniform(-20.0, 20.0);
        scene.lookout.range_m = random.uniform_f(0.1, 12.0);
        scene.lookout.radius_m = random.below(3) == 0 ? 0.0f : random.uniform_f(0.0, 1.0);
        check_against_all(scene, 1 + random.below(80));
    }
}

TEST_CASE("sector 0 is about forward, and they run counter-clockwise")
{
    for (const std::size_t n : {15u, 28u, 72u}) {
        for (std::size_t i = 0; i < n; i += 4) {
            Scene scene;
            scene.set(4.0, 2.0 * M_PI * double(i) / double(n), kOccupied);
            const std::vector<gpom_sector_t> sectors = scene.look(n);
            CHECK(sectors[i].cls == GPOM_OCCUPIED);
            CHECK(sectors[i].probability == 60000);
            CHECK(sectors[i].variance == 30);
            CHECK(sectors[i].free_m == doctest::Approx(4.0).epsilon(0.08));
            const gpom_sector_t &opposite = sectors[(i + n / 2) % n];
            CHECK(opposite.cls == GPOM_FREE);
            CHECK(opposite.distance_m == scene.lookout.range_m);
            CHECK(opposite.probability == 3000);
        }
    }
}

TEST_CASE("a sector is unknown where nothing is known, and ends where something is")
{
    Scene scene;
    scene.fill(kUnknown);
    for (const gpom_sector_t &sector : scene.look(15)) {
        CHECK(sector.cls == GPOM_UNKNOWN);
        CHECK(sector.flags == GPOM_SECTOR_UNKNOWN);
    }
    Scene wall;
    wall.set(3.0, 0.0, kUnknown);
    const gpom_sector_t ahead = wall.look(15)[0];
    CHECK(ahead.cls == GPOM_UNKNOWN);
    CHECK(ahead.flags == 0);
    CHECK(ahead.distance_m == doctest::Approx(2.85).epsilon(0.06));
}

TEST_CASE("from outside of the raster all is unknown")
{
    Scene scene;
    for (const double x_m : {scene.lookout.x_m - 19.0, scene.lookout.x_m + 19.0, 1e12}) {
        scene.lookout.x_m = x_m;
        for (const gpom_sector_t &sector : scene.look(15, GPOM_ERR_REACH)) {
            CHECK(sector.distance_m == 0.0f);
            CHECK(sector.free_m == 0.0f);
            CHECK(sector.flags == GPOM_SECTOR_UNKNOWN);
        }
    }
}

TEST_CASE("arguments that make no sense leave the sectors as they were")
{
    Scene scene;
    gpom_sector_t sector = {};
    sector.probability = 77;
    const gpom_map_t *const map = scene.map.get();
    const auto status_of = [&](auto change) {
        gpom_lookout_t lookout = scene.lookout;
        change(lookout);
        return gpom_sectors(map, &lookout, &sector, 1, nullptr);
    };
    const double nan = std::nan("");
    CHECK(status_of([&](gpom_lookout_t &l) { l.x_m = nan; }) == GPOM_ERR_ARG);
    CHECK(status_of([&](gpom_lookout_t &l) { l.y_m = INFINITY; }) == GPOM_ERR_ARG);
    CHECK(status_of([&](gpom_lookout_t &l) { l.yaw_rad = nan; }) == GPOM_ERR_ARG);
    CHECK(status_of([&](gpom_lookout_t &l) { l.yaw_rad = 1.1e6; }) == GPOM_ERR_ARG);
    CHECK(status_of([&](gpom_lookout_t &l) { l.range_m = 0.0f; }) == GPOM_ERR_ARG);
    CHECK(status_of([&](gpom_lookout_t &l) { l.range_m = INFINITY; }) == GPOM_ERR_ARG);
    CHECK(status_of([&](gpom_lookout_t &l) { l.radius_m = -0.1f; }) == GPOM_ERR_ARG);
    CHECK(gpom_sectors(nullptr, &scene.lookout, &sector, 1, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_sectors(map, nullptr, &sector, 1, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_sectors(map, &scene.lookout, nullptr, 1, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_sectors(map, &scene.lookout, &sector, 0, nullptr) == GPOM_ERR_ARG);
    CHECK(gpom_sectors(map, &scene.lookout, &sector, GPOM_SECTORS_MAX + 1, nullptr) ==
          GPOM_ERR_ARG);
    TestMap bare(config_of(params_of(GPOM_KERNEL_MATERN12)));
    CHECK(gpom_sectors(bare.get(), &scene.lookout, &sector, 1, nullptr) == GPOM_ERR_ARG);
    CHECK(sector.probability == 77);
}

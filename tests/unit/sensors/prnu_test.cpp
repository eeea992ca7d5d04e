// SPDX-License-Identifier: Apache-2.0
// Photo-response non-uniformity: measured from digital numbers as EMVA 1288 does, and the look of its parts.
#include "core/error.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/response_pattern.hpp"
#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace prnu_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double aperture_m = 0.02;
const SpectralBand band{500e-9, 600e-9};
constexpr std::size_t rows = 240, columns = 320;

SensorDescription sensor() {
    SensorDescription d;
    d.readout.width = columns;
    d.readout.height = rows;
    d.detector.adc_bits = 14;
    d.detector.gain_dn_per_e = 0.3;
    d.detector.offset_fpn_e = 20; // what the dark images take out
    d.detector.column_fpn_e = 10;
    return d;
}

/// Means over all pixels, columns and rows of an image, and the variances of EMVA 1288 release 4, section 8:
/// spatial, and its split into pixels, columns and rows. Written from the standard, in plain double.
struct Spatial {
    double mean = 0, total = 0, pixel = 0, column = 0, row = 0;
};
Spatial spatial(const std::vector<double>& y) {
    const double m = rows, n = columns;
    Spatial s;
    for (const double v : y)
        s.mean += v / (m * n);
    const auto sum_of_squares = [&](const std::vector<double>& values) {
        double sum = 0;
        for (const double v : values)
            sum += (v - s.mean) * (v - s.mean);
        return sum;
    };
    std::vector<double> column_average(columns), row_average(rows);
    for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t c = 0; c < columns; ++c) {
            column_average[c] += y[r * columns + c] / m;
            row_average[r] += y[r * columns + c] / n;
        }
    s.total = sum_of_squares(y) / (m * n);
    const double cav = sum_of_squares(column_average) / n, rav = sum_of_squares(row_average) / m;
    s.pixel = m * n / (m * n - m - n) * (s.total - cav - rav);
    s.column = cav - s.pixel / m;
    s.row = rav - s.pixel / n;
    return s;
}

/// Mean of `count` images under uniform light; `variance` gets the temporal variance of the mean.
std::vector<double> stack(const Detector& detector, const ReadoutPlan& plan, double electrons, int count,
                          std::uint64_t first_frame, double& variance) {
    const auto light = static_cast<float>(electrons / to_seconds(plan.rows[0].exposure_ns()) /
                                          detector.electrons_per_s_per_w_m2()[0]);
    const std::vector<float> values(rows * columns, light);
    std::vector<double> sum(rows * columns), squares(rows * columns);
    std::vector<std::uint16_t> dn(rows * columns);
    for (int i = 0; i < count; ++i) {
        detector.expose(plan, {0, plan.height, plan.width, values},
                        first_frame + static_cast<std::uint64_t>(i), 0, dn);
        for (std::size_t p = 0; p < dn.size(); ++p) {
            sum[p] += dn[p];
            squares[p] += double{1} * dn[p] * dn[p];
        }
    }
    variance = 0;
    for (std::size_t p = 0; p < dn.size(); ++p) {
        variance += (squares[p] - sum[p] * sum[p] / count) / (count - 1) / static_cast<double>(dn.size());
        sum[p] /= count;
    }
    variance /= count;
    return sum;
}

struct Measured {
    double total, pixel, column;
};
Measured measure_prnu(const SensorDescription& d) {
    const Detector detector(d, {&band, 1}, aperture_m, 3);
    ReadoutPlan plan;
    const WindowRequest window{{0, 0, columns, rows}, 10'000'000};
    REQUIRE(plan_readout(d.readout, {&window, 1}, Time{}, plan) == "");
    constexpr int images = 40;
    double noise_bright = 0, noise_dark = 0;
    const Spatial bright =
        spatial(stack(detector, plan, d.detector.full_well_e / 2, images, 1, noise_bright));
    const Spatial dark = spatial(stack(detector, plan, 0, images, 1000, noise_dark));
    const double signal = bright.mean - dark.mean, noise = noise_bright - noise_dark;
    const auto relative = [&](double variance) { return std::sqrt(std::max(variance, 0.0)) / signal; };
    // The noise that is left in the mean image is white: a share 1 / rows of it is in the column averages.
    return {relative(bright.total - dark.total - noise), relative(bright.pixel - dark.pixel - noise),
            relative(bright.column - dark.column)};
}

/// Least squares fit of c0 + c1 x + c2 y + c3 (x^2 + y^2), x and y from the centre in half widths.
struct Fit {
    std::array<double, 4> c{};
    double residual_rms = 0;
};
std::array<double, 4> basis(std::size_t column, std::size_t row) {
    const double x = (static_cast<double>(column) + 0.5 - columns / 2.0) / (columns / 2.0);
    const double y = (static_cast<double>(row) + 0.5 - rows / 2.0) / (columns / 2.0);
    return {1, x, y, x * x + y * y};
}
Fit fit(const std::vector<float>& map) {
    std::array<std::array<double, 5>, 4> a{};
    for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t c = 0; c < columns; ++c) {
            const auto b = basis(c, r);
            for (std::size_t i = 0; i < 4; ++i) {
                for (std::size_t j = 0; j < 4; ++j)
                    a[i][j] += b[i] * b[j];
                a[i][4] += b[i] * double{map[r * columns + c]};
            }
        }
    for (std::size_t i = 0; i < 4; ++i) // Gauss-Jordan elimination; the matrix is positive definite
        for (std::size_t k = 0; k < 4; ++k) {
            if (k == i) continue;
            const double factor = a[k][i] / a[i][i];
            for (std::size_t j = 0; j < 5; ++j)
                a[k][j] -= factor * a[i][j];
        }
    Fit f;
    for (std::size_t i = 0; i < 4; ++i)
        f.c[i] = a[i][4] / a[i][i];
    double squares = 0;
    for (std::size_t r = 0; r < rows; ++r)
        for (std::size_t c = 0; c < columns; ++c) {
            double model = 0;
            for (std::size_t i = 0; i < 4; ++i)
                model += f.c[i] * basis(c, r)[i];
            const double left = double{map[r * columns + c]} - model;
            squares += left * left;
        }
    f.residual_rms = std::sqrt(squares / (rows * columns));
    return f;
}

double rms(const std::vector<float>& map) {
    return std::sqrt(spatial({map.begin(), map.end()}).total);
}

/// Response with only the global part, and only the weights given to it.
SensorDescription global_only(double bowl, double gradient, double column, double stitching) {
    SensorDescription d = sensor();
    d.detector.prnu_global = 0.02;
    d.detector.prnu_bowl_weight = bowl;
    d.detector.prnu_gradient_weight = gradient;
    d.detector.prnu_column_weight = column;
    d.detector.prnu_stitching_weight = stitching;
    return d;
}

} // namespace

TEST_CASE("an EMVA 1288 evaluation of flat fields gives back the configured PRNU", "[sensors]") {
    struct Case {
        double local, global, edge, corner;
    };
    for (const auto& [local, global, edge, corner] :
         {Case{0.01, 0, 0, 0}, Case{0.008, 0, 0.09, 0.005}, Case{0.008, 0.018, 0.09, 0.005},
          Case{0.02, 0.005, 0.15, 0.03}, Case{0.005, 0.03, 0.02, 0.05}, Case{0, 0.018, 0.09, 0.005}}) {
        CAPTURE(local, global, edge, corner);
        SensorDescription d = sensor();
        d.detector.prnu_local = local;
        d.detector.prnu_global = global;
        d.detector.crosstalk_edge = edge;
        d.detector.crosstalk_corner = corner;
        const Measured measured = measure_prnu(d);
        CHECK_THAT(measured.total, WithinRel(std::hypot(local, global), 0.03));
        // Bowl, gradient and columns are sums of a row's and a column's share: the pixel part has none of
        // them.
        CHECK_THAT(measured.pixel, WithinAbs(local, 0.03 * local + 2e-4));
    }
}

TEST_CASE("columns of different gain show in the column part of the PRNU", "[sensors]") {
    SensorDescription d = global_only(0, 0, 1, 0);
    d.detector.prnu_local = 0.01;
    d.detector.crosstalk_edge = 0.09;
    const Measured measured = measure_prnu(d);
    CHECK_THAT(measured.column, WithinRel(0.02, 0.03));
    CHECK_THAT(measured.pixel, WithinRel(0.01, 0.03));
}

TEST_CASE("the response is that of a flat field: dividing by it leaves an even image", "[sensors]") {
    SensorDescription d = sensor();
    d.detector.prnu_local = 0.05;
    d.detector.prnu_global = 0.05;
    d.detector.crosstalk_edge = 0.09;
    d.detector.crosstalk_corner = 0.01;
    d.detector.dark_current_e_per_s = 0;
    const Detector detector(d, {&band, 1}, aperture_m, 3);
    ReadoutPlan plan;
    const WindowRequest window{{0, 0, columns, rows}, 10'000'000};
    REQUIRE(plan_readout(d.readout, {&window, 1}, Time{}, plan) == "");
    std::vector<float> light(rows * columns, 1e-9F), mean(rows * columns);
    std::vector<std::uint16_t> dn(rows * columns);
    detector.expose(plan, {0, plan.height, plan.width, light}, 1, 0, dn, {mean, {}});
    const std::vector<float>& response = detector.fixed_pattern().response;
    const double expected = double{mean[0]} / double{response[0]};
    for (std::size_t i = 0; i < mean.size(); ++i)
        REQUIRE_THAT(double{mean[i]} / double{response[i]}, WithinRel(expected, 1e-6));
}

TEST_CASE("the bowl falls with the square of the distance from about the centre", "[sensors]") {
    for (const std::uint64_t serial : {1U, 2U, 3U}) {
        SensorDescription d = global_only(1, 0, 0, 0);
        d.serial = serial;
        const std::vector<float> map = response_pattern(d);
        CHECK_THAT(rms(map), WithinRel(0.02, 1e-3));
        const Fit f = fit(map);
        CHECK(f.residual_rms < 1e-6);
        CHECK(f.c[3] < 0);
        CHECK(std::abs(-f.c[1] / (2 * f.c[3])) <= 0.1); // vertex: 5 % of the width
        CHECK(std::abs(-f.c[2] / (2 * f.c[3])) <= 0.1 * rows / columns);
    }
}

TEST_CASE("the gradient is a plane whose direction comes with the serial", "[sensors]") {
    std::vector<double> angles;
    for (const std::uint64_t serial : {1U, 2U, 3U}) {
        SensorDescription d = global_only(0, 1, 0, 0);
        d.serial = serial;
        const std::vector<float> map = response_pattern(d);
        CHECK_THAT(rms(map), WithinRel(0.02, 1e-3));
        const Fit f = fit(map);
        CHECK(f.residual_rms < 1e-6);
        CHECK(std::abs(f.c[3]) < 1e-6);
        angles.push_back(std::atan2(f.c[2], f.c[1]));
    }
    CHECK(std::abs(angles[0] - angles[1]) > 0.01);
    CHECK(std::abs(angles[1] - angles[2]) > 0.01);
}

TEST_CASE("the column structure is the same in every row and white from column to column", "[sensors]") {
    const std::vector<float> map = response_pattern(global_only(0, 0, 1, 0));
    CHECK_THAT(rms(map), WithinRel(0.02, 1e-3));
    double product = 0;
    for (std::size_t c = 0; c < columns; ++c) {
        for (std::size_t r = 1; r < rows; ++r)
            REQUIRE(map[r * columns + c] == map[c]);
        if (c > 0) product += (double{map[c]} - 1) * (double{map[c - 1]} - 1);
    }
    CHECK(std::abs(product / columns) < 4 * 0.02 * 0.02 / std::sqrt(double{columns}));
}

TEST_CASE("stitched fields differ by a step at each seam and are even inside", "[sensors]") {
    SensorDescription d = global_only(0, 0, 0, 1);
    d.detector.stitch_columns = 4;
    d.detector.stitch_rows = 3;
    const std::vector<float> map = response_pattern(d);
    CHECK_THAT(rms(map), WithinRel(0.02, 1e-3));
    std::size_t seams_across = 0, seams_down = 0;
    for (std::size_t c = 1; c < columns; ++c) {
        const bool step = map[c] != map[c - 1];
        CHECK(step == (c % (columns / 4) == 0));
        seams_across += step ? 1 : 0;
    }
    for (std::size_t r = 1; r < rows; ++r)
        seams_down += map[r * columns] != map[(r - 1) * columns] ? 1 : 0;
    CHECK(seams_across == 3);
    CHECK(seams_down == 2);
    // One field, as of a chip that is not stitched: no global part is left.
    d.detector.stitch_columns = d.detector.stitch_rows = 1;
    CHECK_THROWS_WITH(Detector(d, {&band, 1}, aperture_m, 1),
                      ContainsSubstring("prnu_global needs a weight"));
}

TEST_CASE("the parts are mixed by their weights", "[sensors]") {
    SensorDescription d = global_only(1, 0.5, 0.15, 0);
    const DetectorSettings defaults;
    CHECK(defaults.prnu_bowl_weight == d.detector.prnu_bowl_weight);
    CHECK(defaults.prnu_gradient_weight == d.detector.prnu_gradient_weight);
    CHECK(defaults.prnu_column_weight == d.detector.prnu_column_weight);
    double columns_left = 0;
    for (std::uint64_t serial = 1; serial <= 8; ++serial) {
        d.serial = serial;
        const std::vector<float> map = response_pattern(d);
        CHECK_THAT(rms(map), WithinRel(0.02, 1e-3));
        const Fit f = fit(map);
        CHECK(f.c[3] < 0); // the corners are darker than the centre
        columns_left += f.residual_rms / 8;
    }
    // The column part is what neither bowl nor gradient explains; the two are not quite independent.
    CHECK_THAT(columns_left, WithinRel(0.02 * 0.15 / std::sqrt(1 + 0.5 * 0.5 + 0.15 * 0.15), 0.1));
}

} // namespace prnu_test

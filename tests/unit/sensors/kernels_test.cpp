// SPDX-License-Identifier: Apache-2.0
#include "core/philox.hpp"
#include "sensors/kernels.hpp"
#include "tests/support/catch.hpp"

#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

namespace kernels_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

struct Draws {
    std::vector<float> counts, z0, z1;
};

Draws draw(const std::vector<float>& mean, const kernels::Stream& stream) {
    const std::size_t n = mean.size(), room = n + kernels::padding;
    Draws out{std::vector<float>(room), std::vector<float>(room), std::vector<float>(room)};
    std::vector<float> padded(mean), scratch(4 * room);
    padded.resize(room);
    kernels::poisson_row(padded.data(), n, stream, out.counts.data(), out.z0.data(), out.z1.data(),
                         scratch.data());
    for (auto* v : {&out.counts, &out.z0, &out.z1})
        v->resize(n);
    return out;
}

// Pearson's statistic against the exact probabilities, bins merged until each expects at least 10 draws,
// turned into a standard normal after Wilson and Hilferty. |z| < 4 fails a correct sampler once in 16,000
// seeds, and the seed is fixed.
double chi_squared_z(const std::vector<double>& histogram, double mean, double draws) {
    double chi_squared = 0, observed = 0, expected = 0, used = 0;
    int bins = 0;
    const auto close = [&] {
        chi_squared += (observed - expected) * (observed - expected) / expected;
        ++bins;
        observed = expected = 0;
    };
    for (std::size_t k = 0; k < histogram.size(); ++k) {
        const double p = std::exp(static_cast<double>(k) * std::log(mean) - mean -
                                  std::lgamma(static_cast<double>(k) + 1));
        observed += histogram[k];
        expected += draws * p;
        used += draws * p;
        if (expected >= 10 && draws - used >= 10) close();
    }
    expected += std::max(0.0, draws - used);
    close();
    const double h = 2.0 / (9 * (bins - 1));
    return (std::cbrt(chi_squared / (bins - 1)) - (1 - h)) / std::sqrt(h);
}

} // namespace

namespace {

std::vector<float> merge(const std::vector<float>& mean, float variance, const kernels::Stream& stream) {
    const std::size_t n = mean.size(), room = n + 2 * kernels::padding;
    std::vector<float> padded(mean), out(room), z(room);
    padded.resize(room);
    kernels::merged_row(padded.data(), variance, n, stream, out.data() + kernels::padding,
                        z.data() + kernels::padding);
    return {out.begin() + kernels::padding, out.begin() + kernels::padding + static_cast<std::ptrdiff_t>(n)};
}

/// Distribution function of Poisson(mean) plus a Gaussian: the exact sum.
double exact_cumulated(double x, double mean, double sigma) {
    double sum = 0;
    for (int k = 0; k < mean + 12 * std::sqrt(mean) + 20; ++k)
        sum += std::exp(k * std::log(mean) - mean - std::lgamma(k + 1.0)) * 0.5 *
               std::erfc((k - x) / (sigma * std::sqrt(2.0)));
    return sum;
}

} // namespace

TEST_CASE("one draw for shot and Gaussian noise follows the law of their sum") {
    const auto [mean, sigma] =
        GENERATE(std::pair{0.5, 20.0}, std::pair{12.0, 20.0}, std::pair{12.0, 55.0}, std::pair{100.0, 20.0},
                 std::pair{3000.0, 20.0}, std::pair{3000.0, 55.0});
    // In closed form: where the transformed normal puts its quantiles.
    const double total = mean + sigma * sigma, a = mean / 6 / total;
    double worst = 0;
    for (double z = -5; z <= 5; z += 0.05) {
        const double x = mean + std::sqrt(total - 2 * a * a) * z + a * (z * z - 1);
        worst =
            std::max(worst, std::abs(exact_cumulated(x, mean, sigma) - 0.5 * std::erfc(-z / std::sqrt(2.0))));
    }
    INFO("mean " << mean << ", sigma " << sigma << ": " << worst);
    CHECK(worst < (sigma > 50 ? 1e-6 : 2e-5));

    // As drawn: mean, variance and third moment of four million numbers.
    constexpr std::size_t row = 100'000;
    constexpr int rows = 40;
    double sum = 0, squares = 0, cubes = 0;
    for (int r = 0; r < rows; ++r)
        for (const float e :
             merge(std::vector<float>(row, static_cast<float>(mean)), static_cast<float>(sigma * sigma),
                   {static_cast<std::uint32_t>(r * row), 3, 9, 0, {5, 6}})) {
            const double d = static_cast<double>(e) - mean;
            sum += d, squares += d * d, cubes += d * d * d;
        }
    const double n = double{row} * rows, s = std::sqrt(total);
    CHECK(std::abs(sum / n) < 4 * s / std::sqrt(n));
    CHECK(std::abs(squares / n / total - 1) < 4 * std::sqrt(2 / n));
    CHECK(std::abs(cubes / n - mean) < 4 * std::sqrt(15 / n) * s * s * s);
}

TEST_CASE("one draw for all noise belongs to the pixel, not to where a row begins") {
    std::vector<float> mean(500);
    for (std::size_t i = 0; i < mean.size(); ++i)
        mean[i] = static_cast<float>(i);
    const std::vector<float> whole = merge(mean, 900, {1000, 1, 2, 3, {4, 5}});
    for (const std::uint32_t first : {1U, 2U, 3U, 4U, 77U, 498U}) {
        const std::vector<float> part =
            merge({mean.begin() + first, mean.end()}, 900, {1000 + first, 1, 2, 3, {4, 5}});
        CHECK(std::equal(part.begin(), part.end(), whole.begin() + first));
    }
}

TEST_CASE("ten million draws follow the Poisson law") {
    const double mean = GENERATE(0.05, 1.0, 8.0, 12.0, 62.7, 65.0, 100.0, 20000.0);
    constexpr std::size_t row = 100'000;
    constexpr std::uint32_t rows = 100;
    std::vector<double> histogram(static_cast<std::size_t>(mean + 12 * std::sqrt(mean) + 20));
    const std::vector<float> means(row, static_cast<float>(mean));
    double outside = 0;
    for (std::uint32_t r = 0; r < rows; ++r)
        for (const float k : draw(means, {static_cast<std::uint32_t>(r * row), 7, 0, 0, {1, 2}}).counts) {
            if (k >= 0 && k < static_cast<float>(histogram.size()))
                histogram[static_cast<std::size_t>(k)] += 1;
            else
                ++outside;
        }
    const double z =
        chi_squared_z(histogram, static_cast<double>(static_cast<float>(mean)), double{row} * rows);
    INFO("mean " << mean << ": z " << z);
    CHECK(outside == 0);
    CHECK(std::fabs(z) < 4);
}

TEST_CASE("normals have the moments of a standard normal and no correlation") {
    constexpr std::size_t n = 4'000'000;
    const Draws d = draw(std::vector<float>(n, 3.0F), {0, 1, 2, 3, {4, 5}});
    double m[5] = {}, cross = 0, against_counts = 0;
    for (std::size_t i = 0; i < n; ++i) {
        double power = 1;
        for (double& sum : m) {
            sum += power;
            power *= d.z0[i];
        }
        cross += double{d.z0[i]} * d.z1[i];
        against_counts += double{d.z0[i]} * (d.counts[i] - 3);
    }
    const double root = std::sqrt(static_cast<double>(n));
    CHECK_THAT(m[1] / n, WithinAbs(0, 4 / root));
    CHECK_THAT(m[2] / n, WithinAbs(1, 4 * std::sqrt(2.0) / root));
    CHECK_THAT(m[3] / n, WithinAbs(0, 4 * std::sqrt(15.0) / root));
    CHECK_THAT(m[4] / n, WithinAbs(3, 4 * std::sqrt(96.0) / root));
    CHECK_THAT(cross / n, WithinAbs(0, 4 / root));
    CHECK_THAT(against_counts / n, WithinAbs(0, 4 * std::sqrt(3.0) / root));
}

TEST_CASE("the vector Philox is the Philox of core, the vector functions are those of libm") {
    // A normal is built from the third and fourth words: rebuild it in double precision.
    const kernels::Stream stream{1'000'000'007, 11, 22, 33, {44, 55}};
    const Draws d = draw(std::vector<float>(1000, 1.0F), stream);
    for (std::uint32_t i = 0; i < 1000; ++i) {
        const auto w = philox4x32({stream.first_pixel + i, 11, 22, 33U << 16}, {44, 55});
        const auto u = [](std::uint32_t word) { return (static_cast<double>(word >> 9) + 0.5) * 0x1p-23; };
        const double radius = std::sqrt(-2 * std::log(u(w[2])));
        REQUIRE_THAT(d.z0[i], WithinAbs(radius * std::cos(2 * M_PI * u(w[3])), 2e-6));
        REQUIRE_THAT(d.z1[i], WithinAbs(radius * std::sin(2 * M_PI * u(w[3])), 2e-6));
    }
    std::vector<float> x(2000 + kernels::padding), e(2000 + kernels::padding);
    for (std::size_t i = 0; i < 2000; ++i)
        x[i] = -79.0F + 0.079F * static_cast<float>(i);
    kernels::exp_row(x.data(), 2000, e.data());
    for (std::size_t i = 0; i < 2000; ++i)
        REQUIRE_THAT(double{e[i]}, WithinRel(std::exp(double{x[i]}), 3e-7));
}

TEST_CASE("crosstalk spreads a point over its neighbours and loses nothing") {
    std::vector<float> rows[3];
    for (auto& row : rows)
        row.assign(20 + kernels::padding, 0.0F);
    rows[0][10] = 1000;
    std::vector<float> out(18 + kernels::padding);
    const auto filtered = [&](int above, int here, int below) {
        kernels::crosstalk_row(rows[above].data() + 1, rows[here].data() + 1, rows[below].data() + 1, 0.09F,
                               0.005F, 18, out.data());
        return std::vector<float>(out.begin() + 8, out.begin() + 11);
    };
    const auto centre = filtered(1, 0, 2), side = filtered(0, 1, 2);
    CHECK_THAT(centre[1], WithinAbs(620, 1e-3));
    CHECK_THAT(centre[0], WithinAbs(90, 1e-3));
    CHECK_THAT(centre[2], WithinAbs(90, 1e-3));
    CHECK_THAT(side[1], WithinAbs(90, 1e-3));
    CHECK_THAT(side[0], WithinAbs(5, 1e-3));
    CHECK(filtered(1, 2, 0) == side);
}

TEST_CASE("every instruction set gives the same bytes") {
    // Means on both sides of the samplers' border, zero, huge, with a row length that is no multiple of
    // anything.
    std::vector<float> mean;
    for (int i = 0; i < 20'011; ++i)
        mean.push_back(i % 97 == 0 ? 0.0F : std::exp(static_cast<float>(i % 211) * 0.08F - 3));
    const kernels::Stream stream{12345, 6, 7, 8, {9, 10}};
    const auto everything = [&] {
        Draws d = draw(mean, stream);
        const std::size_t n = mean.size(), room = n + kernels::padding;
        for (auto* v : {&d.counts, &d.z0, &d.z1})
            v->resize(room);
        std::vector<float> light(room), mixed(room), total(room), dark(mean);
        dark.resize(room);
        kernels::light_row(d.counts.data(), dark.data(), 0.3F, false, n, light.data());
        kernels::light_row(d.counts.data(), nullptr, 0.7F, true, n, light.data());
        kernels::crosstalk_row(light.data() + 1, d.counts.data() + 1, dark.data() + 1, 0.09F, 0.005F, n - 2,
                               mixed.data());
        kernels::mean_row(mixed.data(), nullptr, 0.1F, dark.data(), 0.01F, n - 2, total.data());
        kernels::accumulate_row(d.counts.data(), 0.25F, n, total.data());
        kernels::Chain chain;
        chain.full_well_e = 100'000;
        chain.inverse_full_well = 1e-5F;
        chain.nonlinearity = {0, 0, 0.06F, 0.03F};
        chain.offset_scale = 1;
        chain.sigma0_e = 25;
        chain.sigma1_e = 40;
        chain.row_e = 3;
        chain.gain_dn_per_e = 0.04F;
        chain.black_dn = 100;
        chain.top_dn = 4095;
        std::vector<std::uint16_t> adc(4096 * 8 + 2), dn(room), through_adc(room);
        for (std::size_t i = 0; i < adc.size(); ++i)
            adc[i] = static_cast<std::uint16_t>(std::min<std::size_t>(4095, (i * 3 + 5) / 24));
        kernels::collect_row(chain, n, total.data());
        kernels::convert_row(chain, total.data(), dark.data(), d.z0.data(), d.z1.data(), n, dn.data());
        chain.adc = adc.data();
        chain.adc_steps = 8;
        kernels::convert_row(chain, total.data(), nullptr, d.z0.data(), d.z1.data(), n, through_adc.data());
        std::vector<float> e(room), x(room);
        for (std::size_t i = 0; i < n; ++i)
            x[i] = d.z0[i] * 10;
        kernels::exp_row(x.data(), n, e.data());
        kernels::normal_row(n, stream, x.data(), d.z1.data());
        const std::vector<float> merged = merge(mean, 3000, stream);
        std::vector<unsigned char> bytes;
        const auto add = [&](const auto& v) {
            const auto* p = reinterpret_cast<const unsigned char*>(v.data());
            bytes.insert(bytes.end(), p, p + n * sizeof(v[0]));
        };
        add(d.counts), add(d.z0), add(x), add(light), add(total), add(e), add(dn), add(through_adc),
            add(merged);
        return bytes;
    };
    const auto reference = everything();
    int targets = 0;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(target);
        INFO(hwy::TargetName(target));
        CHECK(everything() == reference);
        ++targets;
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    INFO("targets compared: " << targets);
    CHECK(targets >= 2);
}

} // namespace kernels_test

// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/laboratory.hpp"

#include "core/error.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/photometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;

constexpr double planck_times_light_j_m = 6.62607015e-34 * 299'792'458.0;
constexpr double aperture_m = 0.02;

} // namespace

Laboratory::Laboratory(SensorDescription sensor, double wavelength_m)
    : sensor_(std::move(sensor)),
      wavelength_m_(wavelength_m),
      band_{wavelength_m - 0.5e-9, wavelength_m + 0.5e-9},
      detector_(prepared(sensor_), {&band_, 1}, aperture_m, 1288) {
    const ReadoutSettings& r = sensor_.readout;
    region_.width = std::min(1024, r.width);
    region_.height = std::min(1024, r.height);
    region_.x = (r.width - region_.width) / 2 / r.window_step * r.window_step;
    region_.y = (r.height - region_.height) / 2 / r.window_step * r.window_step;
}

double Laboratory::saturation_e() const {
    const DetectorSettings& d = sensor_.detector;
    const double top = (std::exp2(d.adc_bits) - 1 - d.offset_dn) / d.gain_dn_per_e;
    const auto bent = [&](double n) {
        const double x = n / d.full_well_e;
        double bend = 0;
        for (std::size_t i = 4; i-- > 0;)
            bend = (bend + d.nonlinearity[i]) * x;
        return n * (1 - bend);
    };
    double low = 0, high = d.full_well_e;
    if (bent(high) <= top) return high;
    for (int i = 0; i < 100; ++i)
        (bent((low + high) / 2) < top ? low : high) = (low + high) / 2;
    return low;
}

double Laboratory::true_quantum_efficiency() const {
    return sensors::quantum_efficiency(sensor_.detector.quantum_efficiency, wavelength_m_) *
           sensor_.detector.fill_factor;
}

void Laboratory::set_exposure(double seconds) {
    const sensors::WindowRequest window{region_, std::max<std::int64_t>(1, std::llround(seconds * 1e9))};
    if (const std::string why = plan_readout(sensor_.readout, {&window, 1}, Time{}, plan_); !why.empty())
        throw ConfigError(fmt::format("{}: {}", sensor_.name, why));
}

double Laboratory::exposure_s() const {
    return to_seconds(plan_.rows[0].exposure_ns());
}

Laboratory::Image Laboratory::shoot(double photons, double gain_db, std::vector<float>* mean_e) {
    const auto pixels = static_cast<std::size_t>(region_.area());
    const double energy_j = photons * planck_times_light_j_m / wavelength_m_;
    const double pupil_m2 = std::numbers::pi / 4 * aperture_m * aperture_m;
    const double irradiance = energy_j / exposure_s() / pupil_m2 / sensor_.detector.transmission;
    const std::vector<float> light(pixels, static_cast<float>(irradiance));
    Image dn(pixels);
    sensors::ExposureTruth truth;
    if (mean_e != nullptr) {
        mean_e->resize(pixels);
        truth.mean_e = *mean_e;
    }
    detector_.forget();
    detector_.expose(plan_, {0, plan_.height, plan_.width, light, 0, 0}, ++frame_, gain_db, dn, truth);
    return dn;
}

emva::PairStatistics Laboratory::pair(double photons, double gain_db) {
    const Image a = shoot(photons, gain_db);
    return emva::pair_statistics(a, shoot(photons, gain_db));
}

std::vector<double> Laboratory::true_offsets() const {
    std::vector<double> offsets;
    const sensors::FixedPattern& pattern = detector_.fixed_pattern();
    for (std::int32_t y = region_.y; y < region_.y + region_.height; ++y) {
        const float* row = pattern.row_of(pattern.offset_e, y, region_.x);
        for (std::int32_t x = 0; x < region_.width; ++x)
            offsets.push_back(row == nullptr ? 0.0 : static_cast<double>(row[x]));
    }
    return offsets;
}

const SensorDescription& Laboratory::prepared(SensorDescription& sensor) {
    // Without particles and RTS noise, and without defective pixels, which a laboratory masks.
    DetectorSettings& d = sensor.detector;
    d.hit_flux_per_cm2_s = 0;
    d.rts_fraction = 0;
    d.dead_fraction = d.stuck_fraction = 0;
    d.dead_rows = d.dead_columns = 0;
    d.test_pattern = TestPattern::off;
    return sensor;
}

} // namespace obscura::tools

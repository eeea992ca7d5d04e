// Light to digital numbers, pixel by pixel: photons -> electrons -> shot noise -> full well -> read noise ->
// gain, offset -> ADC. EMVA 1288 release 4, linear model, section 2.
#include "core/error.hpp"
#include "core/philox.hpp"
#include "sensors/photometry.hpp"
#include "sensors/poisson.hpp"
#include "sensors/sensor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace obscura::sensors {
namespace {

// Which random number of a pixel is meant: third word of the Philox counter, low half; the window is the high
// half, so that a pixel read by two windows has two independent reads.
enum Effect : std::uint32_t { shot_noise = 0, read_noise = 1 };

// Keeps the detector's streams apart from those of other users of the same seed.
constexpr std::uint64_t detector_stream = 0x6465746563746f72; // "detector"

void require(bool holds, const SensorDescription& d, std::string_view key, double value,
             std::string_view allowed) {
    if (!holds)
        throw ConfigError(fmt::format("sensor {}: {}: {} is not allowed, {}", d.name, key, value, allowed));
}

bool within(double value, double low, double high) {
    return value >= low && value <= high; // false for NaN
}

void check(const SensorDescription& d) {
    const DetectorSettings& s = d.detector;
    require(within(s.transmission, 0, 1), d, "transmission", s.transmission, "0 to 1");
    require(within(s.full_well_e, 1, 1e7), d, "full_well_e", s.full_well_e, "1 to 1e7");
    require(within(s.dark_current_e_per_s, 0, 1e9), d, "dark_current_e_per_s", s.dark_current_e_per_s,
            "0 to 1e9");
    require(within(s.read_noise_e, 0, 1e5), d, "read_noise_e", s.read_noise_e, "0 to 1e5");
    require(within(s.gain_dn_per_e, 1e-6, 1e6), d, "gain_dn_per_e", s.gain_dn_per_e, "1e-6 to 1e6");
    require(within(s.offset_dn, 0, 65535), d, "offset_dn", s.offset_dn, "0 to 65535");
    require(within(s.adc_bits, 8, 16), d, "adc_bits", s.adc_bits, "8 to 16");
    require(!s.quantum_efficiency.empty(), d, "quantum_efficiency", 0, "at least one point");
    for (std::size_t i = 0; i < s.quantum_efficiency.size(); ++i) {
        const SpectralPoint& p = s.quantum_efficiency[i];
        require(within(p.value, 0, 1), d, "quantum_efficiency", p.value, "0 to 1");
        require(p.wavelength_m > 0 && (i == 0 || p.wavelength_m > s.quantum_efficiency[i - 1].wavelength_m),
                d, "quantum_efficiency wavelength", p.wavelength_m, "above 0 and rising");
    }
}

} // namespace

struct Detector::Impl {
    DetectorSettings settings;
    std::int32_t sensor_width;
    std::vector<double> electrons_per_s; // per W/m2 at the entrance pupil, one per band
    std::array<std::uint32_t, 2> key;
};

Detector::Detector(const SensorDescription& description, std::span<const scene::SpectralBand> bands,
                   double aperture_m, std::uint64_t seed) {
    check(description);
    require(within(aperture_m, 0, 1e3), description, "aperture", aperture_m, "0 to 1000 m");
    impl_ = std::make_unique<Impl>();
    impl_->settings = description.detector;
    impl_->sensor_width = description.readout.width;
    impl_->key = philox_key(seed ^ detector_stream);
    const double pupil_m2 = std::numbers::pi / 4 * aperture_m * aperture_m;
    for (const scene::SpectralBand& band : bands)
        impl_->electrons_per_s.push_back(pupil_m2 * description.detector.transmission *
                                         electrons_per_joule(description.detector.quantum_efficiency, band));
}

Detector::~Detector() = default;
Detector::Detector(Detector&&) noexcept = default;
Detector& Detector::operator=(Detector&&) noexcept = default;

void Detector::expose(const ReadoutPlan& plan, const IrradianceBand& light, std::uint64_t frame_id,
                      double gain_db, std::span<std::uint16_t> dn) const noexcept {
    const DetectorSettings& s = impl_->settings;
    const auto width = static_cast<std::size_t>(light.width);
    const std::size_t plane = static_cast<std::size_t>(light.rows) * width;
    assert(light.width == plan.width && light.first_row >= 0 && light.first_row + light.rows <= plan.height);
    assert(light.values.size() >= plane * impl_->electrons_per_s.size() && dn.size() >= plane);

    const double gain = s.gain_dn_per_e * std::pow(10.0, gain_db / 20);
    const double top = std::exp2(s.adc_bits) - 1;
    for (std::int32_t r = 0; r < light.rows; ++r) {
        const auto row = static_cast<std::size_t>(light.first_row + r);
        std::size_t w = 0;
        while (w + 1 < plan.windows.size() && plan.windows[w + 1].image_y <= light.first_row + r)
            ++w;
        const Region& window = plan.windows[w].sensor;
        const double exposure_s = to_seconds(plan.rows[row].exposure_ns());
        const std::size_t begin = static_cast<std::size_t>(r) * width;
        for (std::size_t x = 0; x < width; ++x) {
            if (x >= static_cast<std::size_t>(window.width)) {
                dn[begin + x] = 0;
                continue;
            }
            double rate = s.dark_current_e_per_s;
            for (std::size_t b = 0; b < impl_->electrons_per_s.size(); ++b)
                rate += impl_->electrons_per_s[b] * static_cast<double>(light.values[b * plane + begin + x]);

            const std::uint32_t pixel = static_cast<std::uint32_t>(plan.sensor_row[row]) *
                                            static_cast<std::uint32_t>(impl_->sensor_width) +
                                        static_cast<std::uint32_t>(window.x) + static_cast<std::uint32_t>(x);
            const auto counter = [&](Effect effect) {
                return std::array<std::uint32_t, 4>{pixel, static_cast<std::uint32_t>(frame_id),
                                                    effect | static_cast<std::uint32_t>(w << 16), 0};
            };
            const double charge =
                std::min(draw_poisson(std::min(rate * exposure_s, 1e9), counter(shot_noise), impl_->key),
                         s.full_well_e);
            const auto words = philox4x32(counter(read_noise), impl_->key);
            // Box-Muller.
            const double normal = std::sqrt(-2 * std::log(uniform_double(words[0]))) *
                                  std::cos(2 * std::numbers::pi * uniform_double(words[1]));
            const double signal = s.offset_dn + gain * (charge + s.read_noise_e * normal);
            dn[begin + x] = static_cast<std::uint16_t>(std::clamp(std::nearbyint(signal), 0.0, top));
        }
    }
}

} // namespace obscura::sensors

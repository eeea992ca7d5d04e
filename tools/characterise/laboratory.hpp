// SPDX-License-Identifier: Apache-2.0
// Simulated laboratory for EMVA 1288: a sensor under uniform light or in the dark.
#pragma once

#include "sensors/emva1288.hpp"
#include "sensors/sensor.hpp"

#include <cstdint>
#include <vector>

namespace obscura::tools {

/// Simulated laboratory set-up: the sensor, or a window of at most 1024 x 1024 pixels in its centre, under
/// uniform light or in the dark. The mean response of the whole array is 1, that of a window is not.
class Laboratory {
public:
    using Image = std::vector<std::uint16_t>;

    Laboratory(SensorDescription sensor, double wavelength_m);

    /// Saturation capacity in electrons: full well, or the charge that reaches the ADC's maximum if less.
    [[nodiscard]] double saturation_e() const;
    [[nodiscard]] double true_quantum_efficiency() const;

    /// Throws ConfigError if the sensor cannot expose that long.
    void set_exposure(double seconds);
    [[nodiscard]] double exposure_s() const;

    /// Exposes one image. `photons` is the mean number per pixel and exposure; `mean_e`, if not null, takes
    /// the expected electrons of each pixel before noise.
    Image shoot(double photons, double gain_db = 0, std::vector<float>* mean_e = nullptr);
    sensors::emva1288::PairStatistics pair(double photons, double gain_db = 0);

    /// True offset of each pixel of the window, in electrons: the fixed pattern that the model applies.
    [[nodiscard]] std::vector<double> true_offsets() const;
    [[nodiscard]] const SensorDescription& sensor() const { return sensor_; }
    [[nodiscard]] const Region& region() const { return region_; }

private:
    static const SensorDescription& prepared(SensorDescription& sensor);

    SensorDescription sensor_;
    double wavelength_m_;
    SpectralBand band_;
    sensors::Detector detector_;
    Region region_;
    sensors::ReadoutPlan plan_;
    std::uint64_t frame_ = 0;
};

} // namespace obscura::tools

// SPDX-License-Identifier: Apache-2.0
// Detector state computed once from its description: patterns, particle flux, ADC curve, buffers.
#pragma once

#include "sensors/adc.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/particle_hits.hpp"
#include "sensors/sample_effects.hpp"
#include "sensors/scratch.hpp"
#include "sensors/sensor.hpp"
#include "sensors/sensor_model.hpp"

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace obscura::sensors {

struct DetectorState {
    DetectorState(const SensorDescription& description, std::span<const SpectralBand> bands,
                  double aperture_m, std::uint64_t the_seed);
    /// See Detector::set_aperture().
    void set_aperture(double aperture_m) noexcept;

    DetectorSettings settings;
    std::int32_t sensor_width, sensor_height;
    bool global_shutter;
    std::uint64_t seed;
    std::uint64_t noise_key; ///< of the temporal noise: run_key()
    FixedPattern pattern;
    SampleEffects sample_effects;
    ParticleFlux particles;
    AdcCurve adc;
    ScratchPool scratch;
    std::vector<double> band_electrons_per_joule; ///< one per spectral band
    std::vector<double> electrons_per_s;          ///< per W/m2 at the entrance pupil, one per spectral band
    std::int64_t reset_sample_ns; ///< double sampling: from the signal sample to the reset sample
    double dark_ratio;            ///< dark current relative to that at the reference temperature
    double reset_e;               ///< rms kTC noise
    std::optional<SensorModel> model;
    std::atomic<std::uint64_t> values_replaced{0}; ///< see Detector::values_replaced()
    std::vector<float> memory; ///< charge of the previous frame over the array; empty without lag
};

} // namespace obscura::sensors

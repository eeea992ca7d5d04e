// What a detector is made of, computed once from its description.
#pragma once

#include "sensors/adc.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/particle_hits.hpp"
#include "sensors/scratch.hpp"
#include "sensors/sensor.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::sensors {

struct DetectorState {
    DetectorState(const SensorDescription& description, std::span<const SpectralBand> bands,
                  double aperture_m, std::uint64_t noise_seed);

    DetectorSettings settings;
    std::int32_t sensor_width, sensor_height;
    bool global_shutter;
    std::uint64_t seed;
    FixedPattern pattern;
    ParticleRain rain;
    AdcCurve adc;
    ScratchPool scratch;
    std::vector<double> electrons_per_s; ///< per W/m2 at the entrance pupil, one per band
    std::int64_t reset_sample_ns;        ///< double sampling: from the sample to that of the reset level
    double dark_ratio;                   ///< to the dark current at the reference temperature
    double reset_e;                      ///< kTC noise
    std::vector<float> memory;           ///< charge of the frame before, over the array; empty without lag
};

} // namespace obscura::sensors

// SPDX-License-Identifier: Apache-2.0
// Directions of light and camera for pictures, tables and times of a scattering law.
#pragma once

#include "renderer/materials/material.hpp"

#include <vector>

namespace obscura::tools {

/// Directions of light and camera by the cosines that a law takes.
struct LawCosines {
    double in = 1, out = 1, phase = 1;
};

/// Directions of light and camera by their angles to the normal and between their planes, degrees.
struct LawAngles {
    double incidence_deg = 0, emission_deg = 0, azimuth_deg = 0;
    [[nodiscard]] LawCosines cosines() const;
    [[nodiscard]] double phase_deg() const;
};

/// `directions` in packets; the last one is filled up with the last direction.
[[nodiscard]] std::vector<renderer::ScatterPacket> packets_of(const std::vector<LawCosines>& directions);

/// BRDF times the cosine of incidence, 1/sr, at each of `directions`.
[[nodiscard]] std::vector<double> law_values(const renderer::Material& law,
                                             const std::vector<LawCosines>& directions);

} // namespace obscura::tools

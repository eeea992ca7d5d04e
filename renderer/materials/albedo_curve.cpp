// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/albedo_curve.hpp"

#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/hapke.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Reflectance lit at 45 degrees and seen at 45 degrees on the other side.
double oblique_reflectance(HapkeParameters parameters, double single_scattering_albedo) {
    parameters.single_scattering_albedo = std::min(single_scattering_albedo, 1.0);
    ScatterPacket s;
    for (int i = 0; i < packet_size; ++i) {
        s.cos_in[i] = s.cos_out[i] = std::sqrt(0.5);
        s.cos_phase[i] = 0;
    }
    Doubles r;
    Hapke(parameters).reflectance(s, r);
    return r[0];
}

} // namespace

std::vector<SpectralPoint> follow_albedo_curve(scene::Body& body, const std::vector<SpectralPoint>& factors,
                                               std::span<const SpectralBand> bands) {
    auto& parameters = body.material.get<HapkeParameters>();
    const double own_w = parameters.single_scattering_albedo;
    const auto& images = body.textures.parameters;
    const bool from_image = std::any_of(images.begin(), images.end(), [](const auto& image) {
        return image.name == "single_scattering_albedo";
    });
    if (!from_image && !bands.empty()) {
        double sum = 0;
        for (const SpectralBand& band : bands)
            sum += sunlit_mean(factors, band);
        parameters.single_scattering_albedo = std::min(own_w * sum / static_cast<double>(bands.size()), 1.0);
    }
    const double of_material = oblique_reflectance(parameters, parameters.single_scattering_albedo);
    std::vector<SpectralPoint> curve = factors;
    for (SpectralPoint& point : curve)
        point.value = of_material > 0 ? oblique_reflectance(parameters, own_w * point.value) / of_material
                                      : point.value;
    return curve;
}

} // namespace obscura::renderer

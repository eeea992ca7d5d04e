// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/preset_range.hpp"

#include "core/units.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/registry.hpp"

#include <fmt/format.h>

#include <cmath>

namespace obscura::renderer {
namespace {

/// Mean wavelength of the sunlight that a band passes.
double mean_wavelength_nm(const SpectralBand& band) {
    return sunlit_mean({{band.from_m, band.from_m * 1e9}, {band.to_m, band.to_m * 1e9}}, band);
}

} // namespace

std::vector<std::string> presets_out_of_range(const scene::Scene& scene, const View& view) {
    std::vector<std::string> lines;
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const scene::Body& body = scene.bodies[i];
        const MaterialKind* const kind = find_kind(material_kinds(), body.preset);
        if (kind == nullptr) continue;
        const PresetRange& range = kind->range;
        const auto add = [&](const std::string& instead) {
            lines.push_back(fmt::format("\"{}\" has material = \"{}\", which is known {} ({}), {}", body.name,
                                        kind->name, text_of(range), range.source, instead));
        };
        for (std::size_t b = 0; b < scene.bands.size(); ++b) {
            const double nm = mean_wavelength_nm(scene.bands[b]);
            if (nm >= range.from_nm && nm <= range.to_nm) continue;
            add(fmt::format("and the mean wavelength of band {} is {:.0f} nm: give parameters measured there",
                            b + 1, nm));
            break;
        }
        if (i >= view.bodies.size() || !view.bodies[i].in_field || !view.bodies[i].phase_rad) continue;
        const double phase_deg = *view.bodies[i].phase_rad / degree;
        if (!(phase_deg < range.from_deg || phase_deg > range.to_deg)) continue;
        add(fmt::format("and is seen at a phase angle of {:.4g} deg: its brightness there is the law's",
                        phase_deg));
    }
    return lines;
}

} // namespace obscura::renderer

// SPDX-License-Identifier: Apache-2.0
// Registry of all materials: scattering laws and presets, their parameters, and how they are made.
#pragma once

#include "core/spectral_band.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// Conditions for which the figures of a preset were measured; a limit that its source leaves open is
/// infinite.
struct PresetRange {
    double from_nm = 0, to_nm = 0;
    double from_deg = 0; ///< phase angle, degrees
    double to_deg = std::numeric_limits<double>::infinity();
    std::string_view source{}; ///< short, for messages
};
/// "from 450 to 1050 nm, at phase angles of 2 to 120 deg".
[[nodiscard]] std::string text_of(const PresetRange& range);

/// One scattering law, or a preset: a law with the parameters of a real surface as its defaults.
struct MaterialKind : scene::Kind<scene::MaterialFamily> {
    std::unique_ptr<Material> (*make)(const scene::Material& description);
    bool preset = false;
    /// Reflectance over wavelength relative to that of the parameters, for bodies of scene files that do not
    /// give a colour; empty: grey.
    std::vector<SpectralPoint> colour_curve{};
    /// The same of the single-scattering albedo of Hapke's law, instead of colour_curve.
    std::vector<SpectralPoint> albedo_curve{};
    PresetRange range{}; ///< of a preset
};

/// All kinds in the order in which messages and the reference list them. The first is the default material of
/// a body whose shape has none of its own.
[[nodiscard]] const std::vector<MaterialKind>& material_kinds();

/// Checks the description and makes its law. Throws ConfigError that names `place`.
[[nodiscard]] std::unique_ptr<Material> make_material(const scene::Material& description,
                                                      const std::string& place);

/// Radiance factor I/F of a plane surface lit and seen along its normal, which is pi times the reflectance.
/// Surges at opposition count.
[[nodiscard]] double normal_albedo(const scene::Material& description);

/// A parameter of a law that may vary over the surface.
struct VaryingParameter {
    std::string_view name; ///< in scene files, without the unit
    double value;          ///< in the description passed, SI units
};

/// Parameters of `material` that may be textured, in the order in which its law declares them, which is that
/// of ParameterPacket. Empty for a law with no parameter beside its albedo, on which every albedo texture is
/// a factor.
[[nodiscard]] std::vector<VaryingParameter> varying_parameters(const scene::Material& material);

/// Sets the parameter at `index` of varying_parameters(). If it has several coefficients, such as the weight
/// of the lunar-Lambert law, the first is set and the others become 0.
void set_varying_parameter(scene::Material& material, std::size_t index, double value);

} // namespace obscura::renderer

// Which parameters of a scattering law may differ from place to place.
#pragma once

#include "renderer/scene/scene.hpp"

#include <string_view>
#include <vector>

namespace obscura::renderer {

/// A parameter by its name in scene files, without the unit.
struct Parameter {
    std::string_view name;
    double value; ///< of the description it was asked of
};

/// Those of a law, in the order of ParameterPacket; none where the law has none beside its albedo, which
/// textures multiply anyway.
[[nodiscard]] std::vector<Parameter> parameters_of(const scene::Material& material);

/// Sets the parameter that stands at `index` of that list. The weight of the lunar-Lambert law then no longer
/// depends on the phase angle.
void set_parameter(scene::Material& material, std::size_t index, double value);

} // namespace obscura::renderer

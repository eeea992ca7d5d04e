// What geometry lies behind each pixel: the truth maps that go beside a frame.
#pragma once

#include "renderer/camera/projection.hpp"
#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Fills the layers of renderer.hpp's LayerId for the pixels [x, x + width) of row `y`: layer k at
/// out + k * plane. Textures are filtered over rays `ray_width_rad` wide. `candidates` is scratch space. One
/// ray through the centre of each pixel, no point spread.
void trace_layers(const Projection& projection, const RowState& row, std::int32_t x, std::int32_t y,
                  std::int32_t width, double ray_width_rad, std::vector<std::int32_t>& candidates, float* out,
                  std::size_t plane);

} // namespace obscura::renderer

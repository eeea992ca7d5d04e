// SPDX-License-Identifier: Apache-2.0
// Row pass: one row of the image from its samples, points, stars, wings and stray light.
#pragma once

#include "renderer/passes/built_scene.hpp"
#include "renderer/passes/pass_request.hpp"
#include "renderer/passes/row_block.hpp"
#include "renderer/passes/scratch.hpp"

#include <cstdint>
#include <span>

namespace obscura::renderer {

/// Renders row `r` of the request, once the passes before have filled `rows`, into its place of `irradiance`
/// and of RenderRequest::samples and variance. Reentrant: one Scratch for each thread; real-time safe once
/// that has had a row of this width and as many instants.
RenderedRow render_row(const BuiltScene& built, const PassRequest& request, const RowBlock& rows,
                       std::int32_t r, std::span<float> irradiance, Scratch& s);

} // namespace obscura::renderer

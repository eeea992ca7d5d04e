// SPDX-License-Identifier: Apache-2.0
// Smoothing groups of 3D Studio files.
#pragma once

#include <string_view>

namespace obscura::renderer {

/// Whether the bytes of a 3DS file have a list of smoothing groups (chunk 0x4150), which stands for normals
/// in this format. Reads the chunks 4D4D, 3D3D, 4000, 4100, 4120 of the format's description by J. van
/// Velsen and others (1997).
[[nodiscard]] bool has_smoothing_groups(std::string_view bytes);

} // namespace obscura::renderer

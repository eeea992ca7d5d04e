// SPDX-License-Identifier: Apache-2.0
// The 200 000-facet body that speed is measured on, here and beside other renderers.
#pragma once

#include <filesystem>

namespace obscura::bench {

/// Writes a lumpy body of about 500 x 450 x 400 m in half axes as a binary PLY file, metres: a cube of 129 x
/// 129 cells a side blown up to a sphere, 199 692 facets, with relief down to the facets. The same bytes each
/// time. Throws std::runtime_error when the file cannot be written.
void write_asteroid_200k(const std::filesystem::path& file);

} // namespace obscura::bench

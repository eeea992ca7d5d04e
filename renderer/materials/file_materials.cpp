// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/file_materials.hpp"

namespace obscura::renderer {

scene::ParameterList declare(FileMaterialsParameters& /*p*/) {
    return {};
}

} // namespace obscura::renderer

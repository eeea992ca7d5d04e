// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/handlers.hpp"

namespace obscura::serve::compatible {

const Handlers& handlers() {
    static const Handlers all = [] {
        Handlers made;
        for (const auto add :
             {add_connection_calls, add_camera_calls, add_psf_calls, add_lens_calls, add_model_calls,
              add_object_calls, add_light_calls, add_rendering_calls, add_output_calls, add_unused_calls,
              add_file_calls, add_texture_calls, add_dem_calls, add_mesh_calls, add_save_calls,
              add_state_calls, add_task_calls})
            add(made);
        return made;
    }();
    return all;
}

} // namespace obscura::serve::compatible

// SPDX-License-Identifier: Apache-2.0
#include "tools/verbs/batch.hpp"
#include "tools/verbs/model.hpp"
#include "tools/verbs/texture.hpp"
#include "tools/verbs/verb.hpp"

#include <array>

namespace obscura::tools {

std::span<const VerbEntry> verbs() {
    static constexpr std::array table{
        VerbEntry{"render", make_render},
        VerbEntry{"capture", make_capture},
        VerbEntry{"batch plan", make_batch_plan},
        VerbEntry{"batch run", make_batch_run},
        VerbEntry{"batch status", make_batch_status},
        VerbEntry{"batch verify", make_batch_verify},
        VerbEntry{"batch submit", make_batch_submit},
        VerbEntry{"grab", make_grab},
        VerbEntry{"check", make_check},
        VerbEntry{"keys", make_keys},
        VerbEntry{"pose", make_pose},
        VerbEntry{"new", make_new},
        VerbEntry{"examples", make_examples},
        VerbEntry{"compare", make_compare},
        VerbEntry{"import flight-image", make_import_flight_image},
        VerbEntry{"import map", make_import_map},
        VerbEntry{"import stars", make_import_stars},
        VerbEntry{"import ephemeris", make_import_ephemeris},
        VerbEntry{"ephemeris", make_ephemeris},
        VerbEntry{"texture info", make_texture_info},
        VerbEntry{"texture sample", make_texture_sample},
        VerbEntry{"texture check", make_texture_check},
        VerbEntry{"texture export", make_texture_export},
        VerbEntry{"texture bake", make_texture_bake},
        VerbEntry{"texture mount", make_texture_mount},
        VerbEntry{"model new", make_model_new},
        VerbEntry{"model list", make_model_list},
        VerbEntry{"model show", make_model_show},
        VerbEntry{"model check", make_model_check},
        VerbEntry{"model eval", make_model_eval},
        VerbEntry{"model plot", make_model_plot},
        VerbEntry{"model bench", make_model_bench},
        VerbEntry{"bench", make_bench},
        VerbEntry{"stimulator", make_stimulator},
        VerbEntry{"sensor", make_sensor},
        VerbEntry{"characterise", make_characterise},
        VerbEntry{"time", make_time},
        VerbEntry{"timing", make_timing},
        VerbEntry{"status", make_status},
        VerbEntry{"events", make_events},
        VerbEntry{"metrics", make_metrics},
        VerbEntry{"get", make_get},
        VerbEntry{"set", make_set},
        VerbEntry{"features", make_features},
        VerbEntry{"start", make_start},
        VerbEntry{"stop", make_stop},
        VerbEntry{"trigger", make_trigger},
        VerbEntry{"frame", make_frame},
        VerbEntry{"probe", make_probe},
        VerbEntry{"scene list", make_scene_list},
        VerbEntry{"scene show", make_scene_show},
        VerbEntry{"fault list", make_fault_list},
        VerbEntry{"fault add", make_fault_add},
        VerbEntry{"fault clear", make_fault_clear},
        VerbEntry{"support-bundle", make_support_bundle},
        VerbEntry{"web", make_web},
        VerbEntry{"release", make_release},
        VerbEntry{"truth", make_truth},
        VerbEntry{"sky", make_sky},
        VerbEntry{"irradiance", make_irradiance},
        VerbEntry{"serve", make_serve},
    };
    return table;
}

} // namespace obscura::tools

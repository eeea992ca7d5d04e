// SPDX-License-Identifier: Apache-2.0
// Commands of rendering: modes, samples, and the picture itself.
#include "serve/compatible/handlers.hpp"

#include <algorithm>

namespace obscura::serve::compatible {

void add_rendering_calls(Handlers& handlers) {
    handlers["render"] = [](Request& r) { r.client_state.render(r.work); };
    handlers["enableIrradianceMode"] = [](Request& r) {
        r.client_state.rendering.irradiance = r.arguments.flag("enable");
    };
    handlers["getIrradianceMode"] = [](Request& r) {
        r.reply.set("enable", r.client_state.rendering.irradiance);
    };
    handlers["enablePathTracing"] = [](Request& r) {
        r.client_state.rendering.path_tracing = r.arguments.flag("enable");
    };
    handlers["setMaxSecondaryRays"] = [](Request& r) {
        r.client_state.rendering.secondary_rays =
            static_cast<std::uint32_t>(r.arguments.integer("max_secondary_rays", 0, 1000));
    };
    handlers["getMaxSecondaryRays"] = [](Request& r) {
        r.reply.set("max_secondary_rays", static_cast<std::int32_t>(r.client_state.rendering.secondary_rays));
    };
    handlers["setNbSamplesPerPixel"] = [](Request& r) {
        r.client_state.rendering.samples =
            static_cast<std::uint32_t>(r.arguments.integer("nb_samples", 1, r.client_state.limits().samples));
    };
    handlers["getNbSamplesPerPixel"] = [](Request& r) {
        r.reply.set("nb_samples", static_cast<std::int32_t>(r.client_state.rendering.samples));
    };
    handlers["enableScanningDeviceMode"] = [](Request& r) {
        r.client_state.rendering.scanning_device = r.arguments.flag("enable");
    };
    handlers["getScanningDeviceMode"] = [](Request& r) {
        r.reply.set("enable", r.client_state.rendering.scanning_device);
    };
    handlers["enableLOSmapping"] = [](Request& r) {
        r.client_state.rendering.los_mapping = r.arguments.flag("b_enable");
    };
    handlers["getLOSmapping"] = [](Request& r) {
        r.reply.set("b_enable", r.client_state.rendering.los_mapping);
    };
    handlers["enableTimeMapping"] = [](Request& r) {
        r.client_state.rendering.time_mapping = r.arguments.flag("b_enable");
    };
    handlers["getTimeMapping"] = [](Request& r) {
        r.reply.set("b_enable", r.client_state.rendering.time_mapping);
    };
    handlers["enableRaytracing"] = [](Request& r) {
        if (!r.arguments.flag("enable"))
            r.reply.inform("enableRaytracing: there is no other mode, the picture is the same");
    };
    handlers["enablePhotonAccumulation"] = [](Request& r) {
        if (r.arguments.flag("enable"))
            throw r.arguments.refused("enable", "photon accumulation is not supported", "false");
    };
}

} // namespace obscura::serve::compatible

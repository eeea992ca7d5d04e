// SPDX-License-Identifier: Apache-2.0
// Commands without effect on the picture: of another rendering mode, or gone from the published program. What
// they set is remembered.
#include "serve/compatible/handlers.hpp"

#include <string>

namespace obscura::serve::compatible {
namespace {

/// Where the value of a setting is remembered; of each object its own.
std::string place_of(const Request& r, std::string_view setting) {
    std::string place(setting);
    if (r.arguments.has("object_name")) place += '\n' + r.arguments.text("object_name");
    if (r.arguments.has("name")) place += '\n' + r.arguments.text("name");
    if (r.arguments.has("element_name")) place += '\n' + r.arguments.text("element_name");
    if (r.arguments.has("property")) place += '\n' + r.arguments.text("property");
    return place;
}

/// A command that remembers its argument `argument` for that of the same setting that asks for it.
Handler remembers(std::string_view setting, std::string_view argument) {
    return [setting, argument](Request& r) {
        r.client_state.remembered.set(place_of(r, setting), r.arguments.value(argument));
    };
}

/// A command that asks for it; `otherwise`: what nothing has set.
Handler tells(std::string_view setting, std::string_view result, Value otherwise) {
    return [setting, result, otherwise](Request& r) {
        const Value* const found = r.client_state.remembered.find(place_of(r, setting));
        r.reply.set(result, found != nullptr ? *found : otherwise);
    };
}

/// Objects that the command names must exist.
Handler of_object(Handler handler, std::string_view argument) {
    return [handler = std::move(handler), argument](Request& r) {
        (void)r.client_state.object(r.arguments.text(argument), r.command.name);
        handler(r);
    };
}

} // namespace

void add_unused_calls(Handlers& handlers) {
    for (const char* name :
         {"enableAutoUpdate", "enableRaySharing", "enableRegularPixelSampling", "enableRegularPSFSampling",
          "enableSkipPixelSampling", "enableSpecularOptimization", "enableGlobalDynamicShadowMap"})
        handlers[name] = remembers(name, "enable");
    for (const char* name :
         {"updateDisplay", "enableDoublePrecisionMode", "enableFastPSFMode", "enableMultilateralFiltering"})
        handlers[name] = [](Request&) {};
    handlers["getDoublePrecisionMode"] = tells("double precision", "enable", true);

    struct Setting {
        const char *set, *argument, *get, *result;
        Value otherwise;
    };
    for (const auto& [set, argument, get, result, otherwise] : {
             Setting{"enablePreviewMode", "enable", "getPreviewMode", "enable", false},
             Setting{"setMaxSamplesPerPixel", "max_samples", "getMaxSamplesPerPixel", "max_samples", 64},
             Setting{"setMaxShadowRays", "max_shadow_rays", "getMaxShadowRays", "max_shadow_rays", 4},
             Setting{"setCubeMapSize", "cube_map_size", "getCubeMapSize", "cube_map_size", 512},
             Setting{"setShadowMapSize", "shadow_map_size", "getShadowMapSize", "shadow_map_size", 512},
             Setting{"setPhotonMapSamplingStep", "step", "getPhotonMapSamplingStep", "step", 0.1},
             Setting{"setSelfVisibilitySamplingStep", "step", "getSelfVisibilitySamplingStep", "step", 0.1},
         }) {
        handlers[set] = remembers(set, argument);
        handlers[get] = tells(set, result, otherwise);
    }
    for (const auto& [name, argument] : {std::pair{"setCubeMapZNear", "znear"}, std::pair{"setFSAA", "fsaa"},
                                         std::pair{"setNearPlane", "z"}, std::pair{"setPSFSigma", "sigma"}})
        handlers[name] = remembers(name, argument);
    handlers["setObjectDynamicCubeMap"] = of_object(remembers("cube map", "enable"), "object_name");
    handlers["getObjectDynamicCubeMap"] = of_object(tells("cube map", "enable", false), "object_name");
    handlers["setObjectDynamicShadowMap"] = of_object(remembers("shadow map", "enable"), "object_name");
    handlers["getObjectDynamicShadowMap"] = of_object(tells("shadow map", "enable", false), "object_name");
    handlers["setObjectSamples"] = of_object(remembers("samples", "nb_samples"), "object_name");
    handlers["getObjectSamples"] = of_object(tells("samples", "nb_samples", 0.0), "object_name");
    handlers["setObjectProperty"] = of_object(remembers("property", "value"), "name");
    handlers["getObjectProperty"] = of_object(tells("property", "value", 0.0), "name");
    handlers["setObjectElementProperty"] = of_object(remembers("element property", "value"), "name");
    handlers["getObjectElementProperty"] = of_object(tells("element property", "value", 0.0), "name");
    handlers["setGlobalVariables"] = [](Request& r) {
        const auto* const given = r.arguments.value("names_and_values").as<service::compatible::Fields>();
        if (given == nullptr)
            throw r.arguments.refused("names_and_values", "is no map", "a map of names and values");
        // Those that were set before stay.
        service::compatible::Fields all = *given;
        if (const auto* const before = r.client_state.remembered.find("global variables"))
            for (const auto& [name, value] : *before->as<service::compatible::Fields>())
                if (std::none_of(given->begin(), given->end(),
                                 [&own = name](const auto& g) { return g.name == own; }))
                    all.push_back({name, value});
        for (const auto& [name, value] : *given) {
            std::vector<double> numbers(1);
            if (!to_number(value, numbers[0]) && !to_numbers(value, numbers))
                throw r.arguments.refused("names_and_values", name, "a number, or one for each component");
        }
        r.client_state.remembered.set("global variables", all);
    };
    handlers["getGlobalVariables"] =
        tells("global variables", "names_and_values", service::compatible::Fields{});
}

} // namespace obscura::serve::compatible

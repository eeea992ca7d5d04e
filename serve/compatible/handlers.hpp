// SPDX-License-Identifier: Apache-2.0
// Handlers of the published client's commands, by name.
#pragma once

#include "serve/compatible/client_state.hpp"
#include "service/compatible/session.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace obscura::serve::compatible {

using service::Failure;
using service::FailureCode;
using service::compatible::Arguments;
using service::compatible::Bytes;
using service::compatible::List;
using service::compatible::Reply;
using service::compatible::Value;

/// What a handler works on.
struct Request {
    const service::compatible::Command& command;
    ClientState& client_state;
    const Arguments& arguments;
    Reply& reply;
    service::Work& work;
};
using Handler = std::function<void(Request&)>;
using Handlers = std::map<std::string_view, Handler>;

/// All that there are; commands without one are answered as not supported.
[[nodiscard]] const Handlers& handlers();

/// The file of a texture. Throws Failure.
[[nodiscard]] std::string texture_file(Request& request, const std::string& name);
/// The value of a key of a scene file that names a texture: its file, or the table of its model. Throws
/// Failure.
[[nodiscard]] nlohmann::json texture_key(Request& request, const std::string& name);
/// The table of the texture in SuMoL of a file, with the argument `parameters`. Throws Failure.
[[nodiscard]] nlohmann::json texture_of_file(Request& request, const std::filesystem::path& file);
/// Throws Failure unless the argument `element_name` means all of the object.
void require_whole(Request& request, const Object& object);
/// The model that an argument names. Throws Failure.
[[nodiscard]] const Model& model_of(Request& request, const std::map<std::string, Model>& all,
                                    std::string_view argument);

// One group each.
void add_connection_calls(Handlers& handlers);
void add_camera_calls(Handlers& handlers);
void add_psf_calls(Handlers& handlers);
void add_lens_calls(Handlers& handlers);
void add_model_calls(Handlers& handlers);
void add_object_calls(Handlers& handlers);
void add_light_calls(Handlers& handlers);
void add_rendering_calls(Handlers& handlers);
void add_output_calls(Handlers& handlers);
void add_unused_calls(Handlers& handlers);
void add_file_calls(Handlers& handlers);
void add_texture_calls(Handlers& handlers);
void add_dem_calls(Handlers& handlers);
void add_mesh_calls(Handlers& handlers);
void add_save_calls(Handlers& handlers);
void add_state_calls(Handlers& handlers);
void add_task_calls(Handlers& handlers);

} // namespace obscura::serve::compatible

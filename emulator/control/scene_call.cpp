// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/scene_call.hpp"

#include "config/shipped_files.hpp"
#include "core/path_below.hpp"

#include <fmt/format.h>

#include <string>
#include <system_error>

namespace obscura::emulator {
namespace {

using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Work;

struct Arguments {
    std::string file;

    Fields fields() {
        return {{config::key("file", &file)
                     .required()
                     .help("Name of a shipped scene, or of a scene file below control.scenes")}};
    }
};

/// The scene file of that name. Throws Failure.
std::filesystem::path file_of(const std::string& name, const std::filesystem::path& folder) {
    if (auto shipped = config::find_shipped(config::shipped_scenes, name)) return *shipped;
    const auto refuse = [&name](const std::string& why) {
        return bad_argument("file",
                            fmt::format("scene.show: file: \"{}\": {}", config::printable(name, 200), why));
    };
    if (name.find('\0') != std::string::npos) throw refuse("no such file");
    if (!is_below(folder / name, folder))
        throw refuse("only files below control.scenes, and shipped scenes, can be loaded");
    std::error_code error;
    const std::filesystem::path file = std::filesystem::weakly_canonical(folder / name, error);
    if (error || !std::filesystem::is_regular_file(file, error))
        throw refuse(config::explain_missing({config::shipped_scenes}, name));
    return file;
}

} // namespace

service::Call scene_call(SceneRequests& requests, const std::filesystem::path& folder) {
    service::Call call = service::call<Arguments>(
        "scene.show", service::Permission::scene,
        "Shows another scene. It is built while frames of the present one continue, and shown from a frame "
        "on; if it cannot be, nothing changes and the answer says why. A reload of the configuration returns "
        "to the scene that stands there.",
        [&requests, folder](const Arguments& arguments, Work& work) {
            const std::string why = requests.ask(file_of(arguments.file, folder), work.cancelled());
            if (!why.empty()) throw Failure(FailureCode::bad_scene, why);
            return Answer{{{"shown", requests.shown()}}};
        });
    call.results = {{"shown", "integer", "", "Scenes that have been shown by this call since the start"}};
    return call;
}

} // namespace obscura::emulator

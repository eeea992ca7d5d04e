// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/daemon_calls.hpp"

#include "core/realtime/log.hpp"

#include <utility>

namespace obscura::emulator {
namespace {

using service::Answer;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Permission;
using service::Work;

struct Level {
    LogLevel level = log_level();

    Fields fields() {
        return {{config::key("level", &level)
                     .required()
                     .help("Least severe lines that are written, until the next reload")}};
    }
};

} // namespace

service::Calls daemon_calls(const CameraCalls::Cameras& cameras, SceneRequests& requests,
                            ReleaseControl release) {
    service::Call reload = service::call<service::NoArguments>(
        "reload", Permission::admin,
        "Reads the configuration again, as SIGHUP does: all of its changes are taken on from the next frame "
        "on, or none, and the answer says why. A scene is built while frames of the present one continue.",
        [&requests](const service::NoArguments&, Work& work) {
            if (const std::string why = requests.ask(SceneRequests::configured, work.cancelled());
                !why.empty())
                throw Failure(FailureCode::not_now, why);
            return Answer{};
        });
    service::Call level = service::call<Level>(
        "log_level", Permission::operate, "Changes how much the daemon logs.",
        [](const Level& wanted, Work& /*work*/) {
            const LogLevel before = log_level();
            set_log_level(wanted.level);
            if (before != wanted.level)
                log_notice("calls: log level {}, it was {}", name_of(wanted.level), name_of(before));
            return Answer{{{"level", name_of(wanted.level)}, {"before", name_of(before)}}};
        });
    level.results = {{"level", "string", "", "Level from now on"},
                     {"before", "string", "", "Level until now"}};
    service::Call take = service::call<CameraNumber>(
        "release", Permission::admin,
        "Takes control of a camera away from the GigE Vision client that has it: its acquisition ends, and "
        "the next client may take control.",
        [&cameras, release = std::move(release)](const CameraNumber& which, Work& /*work*/) {
            (void)checked_camera(cameras, which.camera);
            const std::string controller = release(which.camera);
            if (!controller.empty())
                log_notice("calls: camera {}: {} loses control", which.camera, controller);
            return Answer{{{"controller", controller}}};
        });
    take.results = {{"controller", "string", "", "Address of the client that had control; empty: none"}};
    return {std::move(reload), std::move(level), std::move(take)};
}

} // namespace obscura::emulator

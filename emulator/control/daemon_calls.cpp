// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/daemon_calls.hpp"

#include "core/realtime/log.hpp"
#include "emulator/unit/release_self_test.hpp"

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

struct SelfTestTime {
    double seconds = 0.3;

    Fields fields() {
        return {{config::key("seconds", &seconds)
                     .unit("s")
                     .range(0.1, 5)
                     .help("Time for each of two rates, 10 and 100 Hz")}};
    }
};

service::Call self_test_call() {
    service::Call call = service::call<SelfTestTime>(
        "self_test", Permission::operate,
        "Measures how late an ordinary thread of this machine releases rows, as `obscura timing --self-test` does; "
        "cameras go on undisturbed.",
        [](const SelfTestTime& time, Work& /*work*/) {
            const ReleaseSelfTest test = release_self_test(time.seconds, false);
            nlohmann::json rows = nlohmann::json::array();
            for (const ReleaseLateness& row : test.rows)
                rows.push_back({{"name", row.name},
                                {"rate_hz", row.rate_hz},
                                {"rows", row.rows},
                                {"p50_us", row.p50_us},
                                {"p99_us", row.p99_us},
                                {"max_us", row.max_us}});
            return Answer{{{"scheduling", test.scheduling},
                           {"p99_us", test.p99_us},
                           {"rows", std::move(rows)},
                           {"text", text_of(test)}}};
        });
    call.results = {
        {"scheduling", "string", "", "Scheduling of the thread, and why it is no better one"},
        {"p99_us", "number", "us", "99 of 100 rows are released so late at most"},
        {"rows", "array of maps", "", "For each rate: name, rate_hz, rows, p50_us, p99_us, max_us"},
        {"text", "string", "", "The same as a table"}};
    return call;
}

} // namespace

service::Calls daemon_calls(const CameraCalls::Cameras& cameras, SceneRequests& requests,
                            ReleaseControl release) {
    service::Call reload = service::call<service::NoArguments>(
        "reload", Permission::admin,
        "Reads the configuration again, as SIGHUP does: all of its changes are taken on from the next frame on, or none, and the answer says why. "
        "A scene is built while frames of the present one continue.",
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
        "Takes control of a camera away from the GigE Vision client that has it: its acquisition ends, and the next client may take control.",
        [&cameras, release = std::move(release)](const CameraNumber& which, Work& /*work*/) {
            (void)checked_camera(cameras, which.camera);
            const std::string controller = release(which.camera);
            if (!controller.empty())
                log_notice("calls: camera {}: {} loses control", which.camera, controller);
            return Answer{{{"controller", controller}}};
        });
    take.results = {{"controller", "string", "", "Address of the client that had control; empty: none"}};
    return {std::move(reload), std::move(level), std::move(take), self_test_call()};
}

} // namespace obscura::emulator

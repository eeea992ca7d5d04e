// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/starting_host.hpp"

#include "core/clock.hpp"
#include "emulator/control/control_host.hpp"
#include "emulator/monitor/monitor.hpp"

#include <filesystem>
#include <mutex>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Work;

class StartingSession final : public service::Session {
public:
    StartingSession(const StartingHost& host, std::unique_ptr<service::Session> of_calls)
        : host_(host), of_calls_(std::move(of_calls)) {}

    [[nodiscard]] service::Calls calls() override {
        service::Calls calls = of_calls_->calls();
        for (service::Call& call : calls)
            call.bind = [this, name = std::string(call.name), bind = call.bind] {
                if (ControlHost* const running = host_.running()) return call_of(*running, name).bind();
                service::BoundCall bound = bind();
                // These ask no camera.
                if (name != "events" && name != "log_level")
                    bound.run = [this, state = name == "state"](Work& /*work*/) { return answer_of(state); };
                return bound;
            };
        return calls;
    }

private:
    /// The row of a session of the running daemon, which this one becomes.
    [[nodiscard]] const service::Call& call_of(ControlHost& running, const std::string& name) {
        std::call_once(opened_, [&] {
            running_ = running.open();
            running_calls_ = running_->calls();
        });
        return service::find_call(running_calls_, name);
    }
    [[nodiscard]] Answer answer_of(bool state) const {
        if (state) return {host_.state()};
        throw service::Failure(service::FailureCode::not_now, host_.progress().report().text());
    }

    const StartingHost& host_;
    std::unique_ptr<service::Session> of_calls_;
    std::once_flag opened_;
    std::unique_ptr<service::Session> running_;
    service::Calls running_calls_;
};

} // namespace

StartingHost::StartingHost(std::string version, const StartProgress& progress, json head)
    : version_(std::move(version)),
      progress_(progress),
      head_(std::move(head)),
      begun_(MonotonicClock().now()),
      no_cameras_(std::make_unique<ControlHost>(version_, CameraCalls::Cameras{}, std::filesystem::path{},
                                                ModelsSection{}, CoreSet{}, ControlHost::Sources{})) {}

StartingHost::~StartingHost() = default;

std::unique_ptr<service::Session> StartingHost::open() {
    if (ControlHost* const running = running_.load()) return running->open();
    return std::make_unique<StartingSession>(*this, no_cameras_->open());
}

json StartingHost::state() const {
    const StartProgress::Report report = progress_.report();
    json starting{{"text", report.text()}, {"step", report.step}};
    if (report.share) starting["share"] = *report.share;
    if (report.left_s) starting["left_s"] = *report.left_s;
    json state{{"daemon", head_}, {"heartbeats", json::array()}, {"cameras", json::array()}};
    state["daemon"]["up_s"] = to_seconds(MonotonicClock().now() - begun_);
    state["daemon"]["starting"] = std::move(starting);
    Monitor::add_process(state);
    return state;
}

} // namespace obscura::emulator

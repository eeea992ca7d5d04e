// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/control_host.hpp"

#include "emulator/control/configuration_call.hpp"
#include "emulator/control/device_calls.hpp"
#include "emulator/control/fault_calls.hpp"
#include "emulator/control/frame_call.hpp"
#include "emulator/control/scene_call.hpp"
#include "emulator/control/scene_tree.hpp"
#include "emulator/control/timing_call.hpp"
#include "emulator/control/truth_call.hpp"
#include "emulator/monitor/monitor.hpp"
#include "emulator/unit/reload.hpp"

#include <exception>
#include <string_view>
#include <utility>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::Fields;
using service::NoArguments;
using service::Permission;
using service::Work;

struct Events : EventRange {
    Fields fields() { return {keys()}; }
};

class ControlSession final : public service::Session {
public:
    ControlSession(ControlHost& host, const CameraCalls::Cameras& cameras,
                   const std::filesystem::path& scenes)
        : host_(host), cameras_(cameras), scenes_(scenes), camera_(cameras) {}

    [[nodiscard]] service::Calls calls() override {
        service::Calls calls{
            service::call<NoArguments>(
                "state", Permission::view,
                "Tells what the daemon and its cameras do: counters, latencies and the last minute.",
                [this](const NoArguments&, Work& /*work*/) { return Answer{*host_.state()}; }),
            service::call<Events>(
                "events", Permission::view,
                "Lists the latest lines of the daemon's log, oldest first, no more than 64 KiB of them: ask again with the last id.",
                [](const Events& a, Work& /*work*/) {
                    return Answer{service::head_of(Monitor::events(a.after, a.most))};
                }),
        };
        calls[0].results = state_results();
        calls[0].results.push_back(
            {"scenes", "map", "", "Scenes of scene.show that were shown, and refused, since the start"});
        calls[1].results = events_results();
        for (service::Call& call : camera_.calls())
            calls.push_back(std::move(call));
        calls.push_back(frame_call(cameras_));
        calls.push_back(stream_call(cameras_));
        calls.push_back(timing_call(cameras_));
        calls.push_back(timing_rows_call(cameras_));
        for (service::Call& call : device_calls(cameras_))
            calls.push_back(std::move(call));
        WatchedCameras watched;
        for (const auto& camera : cameras_)
            watched.push_back(camera->watch);
        for (service::Call& call :
             ring_calls(watched, [this](std::size_t camera) { return host_.ring_files(camera); }))
            calls.push_back(std::move(call));
        calls.push_back(truth_call(cameras_));
        const auto source = [this](std::size_t camera, const FrameInfo& frame) {
            return host_.probe_source(camera, frame);
        };
        calls.push_back(probe_call(cameras_, host_.probes(), source));
        calls.push_back(irradiance_call(cameras_, host_.probes(), source));
        for (service::Call& call :
             configuration_calls(host_.scene_requests(), [this] { return host_.configuration(); }))
            calls.push_back(std::move(call));
        for (service::Call& call : daemon_calls(cameras_, host_.scene_requests(),
                                                [this](std::size_t camera) { return host_.release(camera); }))
            calls.push_back(std::move(call));
        calls.push_back(scene_tree_call([this](std::size_t camera) {
            (void)checked_camera(cameras_, static_cast<std::uint32_t>(camera));
            return host_.scene_tree(camera);
        }));
        for (service::Call& call : fault_calls(cameras_))
            calls.push_back(std::move(call));
        for (service::Call& call : scene_calls(
                 host_.scene_requests(), scenes_, [this] { return host_.shown_scene(); },
                 [this](const std::vector<std::filesystem::path>& files) {
                     return host_.scenes_refused(files);
                 }))
            calls.push_back(std::move(call));
        for (service::Call& call :
             host_.models().calls(host_.scene_requests(), {[this] { return host_.shown_scene(); },
                                                           [this] { return host_.sensor_models(); }}))
            calls.push_back(std::move(call));
        return calls;
    }

private:
    ControlHost& host_;
    const CameraCalls::Cameras& cameras_;
    const std::filesystem::path& scenes_;
    CameraCalls camera_;
};

} // namespace

ControlHost::ControlHost(std::string version, CameraCalls::Cameras cameras, std::filesystem::path scenes,
                         const ModelsSection& models, const CoreSet& cores, Sources sources)
    : version_(std::move(version)),
      cameras_(std::move(cameras)),
      scenes_(std::move(scenes)),
      probes_(cores),
      models_(models, cores),
      sources_(std::move(sources)) {
    asked_.open();
}

void ControlHost::tick() {
    configuration_.reset();
    asked_.serve();
}

void ControlHost::ask(const std::function<void()>& work) {
    if (!asked_.run(work)) throw service::Failure(service::FailureCode::not_now, "the daemon is stopping");
}

std::shared_ptr<const json> ControlHost::state() {
    std::shared_ptr<const nlohmann::ordered_json> snapshot;
    ask([&] { snapshot = sources_.state(); });
    // However many ask in one tick, the answer is made once.
    const std::lock_guard lock(state_mutex_);
    if (snapshot != snapshot_) {
        json head = service::head_of(*snapshot);
        Monitor::add_process(head);
        head["scenes"] = {{"shown", scene_requests_.shown()}, {"refused", scene_requests_.refused()}};
        state_ = std::make_shared<const json>(std::move(head));
        snapshot_ = std::move(snapshot);
    }
    return state_;
}

std::shared_ptr<const json> ControlHost::configuration() {
    std::shared_ptr<const json> configuration;
    ask([this, &configuration] {
        if (!configuration_) configuration_ = std::make_shared<json>(sources_.configuration());
        configuration = configuration_;
    });
    return configuration;
}

std::filesystem::path ControlHost::shown_scene() {
    std::filesystem::path file;
    ask([this, &file] { file = sources_.scene(); });
    return file;
}

std::vector<std::filesystem::path> ControlHost::sensor_models() {
    std::vector<std::filesystem::path> files;
    ask([this, &files] {
        const DaemonConfig config = sources_.config();
        const auto add = [&files](const models::ModelValues& values) {
            if (values.loaded != nullptr) files.emplace_back(values.loaded->model->name());
        };
        for (const DaemonConfig* camera : config.cameras()) {
            add(camera->sensor.model);
            if (camera->sensor.readout.timing_values) add(*camera->sensor.readout.timing_values);
        }
    });
    return files;
}

std::vector<std::string> ControlHost::scenes_refused(const std::vector<std::filesystem::path>& files) {
    DaemonConfig config;
    ask([this, &config] { config = sources_.config(); });
    const auto why_not = [&config](const std::filesystem::path& file) -> std::string {
        try {
            const DaemonConfig next = with_scene(config, file);
            const auto before = config.cameras(), after = next.cameras();
            for (std::size_t i = 0; i < before.size(); ++i)
                if (std::string why = scene_refusal(before[i]->scene, *after[i]); !why.empty()) return why;
            return {};
        } catch (const std::exception& error) {
            const std::string_view all = error.what();
            return std::string(all.substr(0, all.find('\n'))); // the first mistake
        }
    };
    std::vector<std::string> refused;
    for (const std::filesystem::path& file : files)
        refused.push_back(file == config.scene_file ? std::string() : why_not(file));
    return refused;
}

json ControlHost::scene_tree(std::size_t camera) {
    json tree;
    ask([&] { tree = sources_.scene_tree(camera); });
    return tree;
}

RingFiles ControlHost::ring_files(std::size_t camera) {
    RingFiles files;
    ask([&] { files = hand_over_ring(*cameras_.at(camera)->watch); });
    return files;
}

std::string ControlHost::release(std::size_t camera) {
    std::string controller;
    ask([&] { controller = sources_.release(camera); });
    return controller;
}

CameraUnit::ProbeSource ControlHost::probe_source(std::size_t camera, const FrameInfo& frame) {
    CameraUnit::ProbeSource source;
    ask([&] { source = sources_.probe_source(camera, frame); });
    return source;
}

std::unique_ptr<service::Session> ControlHost::open() {
    return std::make_unique<ControlSession>(*this, cameras_, scenes_);
}

} // namespace obscura::emulator

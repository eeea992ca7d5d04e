// SPDX-License-Identifier: Apache-2.0
// Calls of a running daemon, for the clients of its call server.
#pragma once

#include "core/realtime/work_queue.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/control/camera_calls.hpp"
#include "emulator/control/daemon_calls.hpp"
#include "emulator/control/model_calls.hpp"
#include "emulator/control/probe_call.hpp"
#include "emulator/control/ring_calls.hpp"
#include "emulator/control/scene_requests.hpp"
#include "service/session.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Sessions are made, and their calls run, on threads of their clients. What only the
/// main thread may look at is asked of it by tick().
class ControlHost final : public service::Host {
public:
    /// What tick() asks of the daemon.
    struct Sources {
        std::function<std::shared_ptr<const nlohmann::ordered_json>()> state; ///< Monitor::state()
        std::function<std::filesystem::path()> scene;  ///< file of the scene that is shown
        std::function<DaemonConfig()> config;          ///< in use
        std::function<nlohmann::json()> configuration; ///< describe_configuration() of that in use
        ProbeSourceOf probe_source;                    ///< CameraUnit::probe_source()
        std::function<nlohmann::json(std::size_t camera)> scene_tree; ///< scene_tree() of a camera
        ReleaseControl release;
    };

    /// `scenes`: see scene_calls(); `cores`: see PixelProbes and ModelDesk.
    ControlHost(std::string version, CameraCalls::Cameras cameras, std::filesystem::path scenes,
                const ModelsSection& models, const CoreSet& cores, Sources sources);

    /// Answers what calls have asked of the main thread, which calls this several times a second.
    void tick();
    /// Calls are refused from now on what they ask of the main thread.
    void close() {
        asked_.close();
        scene_requests_.close();
        probes_.close();
        models_.close();
    }
    [[nodiscard]] SceneRequests& scene_requests() noexcept { return scene_requests_; }

    /// The state of the daemon, not older than the call, as the head of an answer. Throws Failure.
    /// Thread-safe; not on the main thread.
    [[nodiscard]] std::shared_ptr<const nlohmann::json> state();
    /// The answer to "configuration". Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] std::shared_ptr<const nlohmann::json> configuration();
    /// File of the scene that is shown. Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] std::filesystem::path shown_scene();
    /// Files of the models of the cameras' sensors. Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] std::vector<std::filesystem::path> sensor_models();
    /// See ScenesRefused. Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] std::vector<std::string> scenes_refused(const std::vector<std::filesystem::path>& files);
    /// The answer to "scene.describe". Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] nlohmann::json scene_tree(std::size_t camera);
    /// Takes control away, see ReleaseControl. Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] std::string release(std::size_t camera);

    /// Files of a reader of the camera's frame ring. Throws Failure or HardwareError. Thread-safe; not on the
    /// main thread.
    [[nodiscard]] RingFiles ring_files(std::size_t camera);

    /// Source of a probe of a frame. Throws Failure. Thread-safe; not on the main thread.
    [[nodiscard]] CameraUnit::ProbeSource probe_source(std::size_t camera, const FrameInfo& frame);
    [[nodiscard]] PixelProbes& probes() noexcept { return probes_; }
    [[nodiscard]] ModelDesk& models() noexcept { return models_; }

    [[nodiscard]] std::string version() const override { return version_; }
    [[nodiscard]] std::unique_ptr<service::Session> open() override;

private:
    /// Runs `work` on the main thread. Throws Failure when that ends.
    void ask(const std::function<void()>& work);

    const std::string version_;
    const CameraCalls::Cameras cameras_;
    const std::filesystem::path scenes_;
    SceneRequests scene_requests_;
    PixelProbes probes_;
    ModelDesk models_;
    const Sources sources_;
    WorkQueue asked_; ///< of the main thread
    /// Main thread: of this tick; null: not yet made.
    std::shared_ptr<const nlohmann::json> configuration_;
    std::mutex state_mutex_; ///< of what follows
    /// What the main thread said last, and the answer made of it by the first client that asked.
    std::shared_ptr<const nlohmann::ordered_json> snapshot_;
    std::shared_ptr<const nlohmann::json> state_;
};

} // namespace obscura::emulator

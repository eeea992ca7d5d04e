// SPDX-License-Identifier: Apache-2.0
// TCP and UDP server for an external simulator: poses of camera, bodies and lamps, and lockstep of frames.
#pragma once

#include "core/camera/camera_counters.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/time.hpp"
#include "emulator/camera/camera.hpp"
#include "emulator/render/pose_ring.hpp"
#include "emulator/render/render_scheduling.hpp"
#include "emulator/simulator/simulator_protocol.hpp"
#include "service/acceptor.hpp"
#include "service/tokens.hpp"
#include "sync/software.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace obscura::emulator {

/// Pose rings by the names of bodies and lamps in the scene; "camera" is the camera.
using PoseRings = std::map<std::string, std::shared_ptr<PoseRing>, std::less<>>;

/// Attaches a ring to the camera and to every named body and lamp in `scene`; of two with the same name, to
/// the first.
[[nodiscard]] PoseRings attach_pose_rings(scene::Scene& scene, double max_extrapolation_s);

/// TCP carries lines in both directions, UDP on the same port poses only; with a token there is no UDP, and
/// the first line of a connection proves the token. It has a thread of its own, and another one for steps. An
/// invalid line is answered with an error line; a client that does not read its answers is disconnected. A
/// step triggers a frame as soon as the camera is ready, and is answered when that frame's last row has been
/// released, or when the frame has failed.
class SimulatorServer {
public:
    /// What became of a step.
    struct StepResult {
        OutcomeRecord frame;
        QualityCounters quality;
        std::string refusal; ///< empty: the frame has come to its end
    };

    /// `camera` and `clock` must outlive the server. `listen` is "ADDRESS:PORT"; port 0: any.
    /// `token` of clients that come over the network; none: they need none.
    /// `render`: how the camera's frames are rendered. Where that goes before ordinary programs, so does the
    /// thread of this server, before rendering: poses that wait for it would come too late for the frame.
    SimulatorServer(std::string listen, PoseRings rings, Camera& camera, const Clock& clock,
                    const RenderScheduling& render = {}, const std::optional<service::Token>& token = {});
    ~SimulatorServer();
    SimulatorServer(const SimulatorServer&) = delete;
    SimulatorServer& operator=(const SimulatorServer&) = delete;

    /// Throws HardwareError or ConfigError.
    void start();
    void stop();
    /// Adds a pose, whose values are valid, to its ring. Returns empty, or the reason why it was refused.
    /// Thread-safe.
    [[nodiscard]] std::string pose(const PoseLine& pose);
    /// Makes a step at `scene`, later than `last`, which it becomes: the caller's step before. Returns when
    /// its frame has come to its end, or soon after `cancelled` has become true. Thread-safe.
    [[nodiscard]] StepResult step(Time scene, Time& last, const std::atomic<bool>& cancelled);
    /// Sets the trigger source of steps; null: steps are refused. `source` must outlive the next call.
    void step_with(sync::SoftwareTrigger* source);

    [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
    [[nodiscard]] SimulatorCounters counters() const noexcept;

private:
    struct Client {
        FileDescriptor fd;
        std::string input;
        bool gone = false;
        std::string challenge; ///< empty: nothing is to be proved, or has been
        std::string proof;     ///< waits until it is looked at
        std::string peer;      ///< address of its machine
        service::Tokens::Clock::time_point proof_due, admit_by;
        Time last_step{-1}; ///< scene time of the last step of this connection
    };
    /// Steps of the lines, one at a time, which the step thread makes for the server's.
    struct LineStep {
        std::mutex mutex;
        std::condition_variable changed;
        std::optional<Time> wanted;
        std::optional<StepResult> done;
        bool stopping = false;
        std::atomic<bool> cancelled{false};
    };

    void work();
    void wake() const;
    /// Whether there is a place for one more client; counts one that is refused.
    [[nodiscard]] bool has_place();
    void add_client(FileDescriptor fd);
    void receive(Client& client);
    void receive_datagrams();
    void handle_lines(Client& client);
    void handle(Client& client, std::string_view line);
    /// Line of a client that has not proved the token: takes the proof, or disconnects it.
    void take_proof(Client& client, const SimulatorLine& line);
    /// Looks at a proof whose time has come, and disconnects a client that takes too long for one.
    void admit(Client& client);
    /// As pose(), but does not count a refusal.
    std::string take_pose(const PoseLine& line);
    void begin_step(Client& client, Time scene);
    /// Answers the step that has been made, if any.
    void answer_step();
    /// Gives up the step of a client that has gone.
    void cancel_step();
    void run_steps();
    /// Makes the next step this caller's. Returns empty, or the reason why it cannot be made.
    [[nodiscard]] std::string claim_step(Time scene, Time& last);
    /// Makes the step that the caller has claimed, and returns when its frame has come to its end.
    [[nodiscard]] StepResult make_step(Time scene, const std::atomic<bool>& cancelled);
    /// Waits until the camera is ready and triggers it. Returns empty, or the reason why it did not.
    [[nodiscard]] std::string fire_step(Time scene, std::uint64_t request,
                                        const std::atomic<bool>& cancelled);
    void answer(Client& client, const std::string& line);
    [[nodiscard]] std::string state_line() const;
    void refuse(Client& client, const std::string& why);

    const std::string listen_;
    const PoseRings rings_;
    Camera& camera_;
    const Clock& clock_;
    RenderScheduling scheduling_;
    service::Tokens tokens_; ///< empty: every client may send lines
    std::atomic<sync::SoftwareTrigger*> source_{nullptr};
    std::atomic<bool> stopping_{false}, firing_{false}, step_claimed_{false};
    std::optional<service::Acceptor> acceptor_; ///< between start() and stop()
    FileDescriptor udp_, wake_;
    std::mutex pushing_; ///< into rings
    std::uint16_t port_ = 0;
    std::vector<std::unique_ptr<Client>> clients_;
    Client* step_client_ = nullptr; ///< waits for the answer to its step
    Time step_scene_;
    LineStep line_step_;
    bool bad_datagram_reported_ = false;
    std::atomic<std::uint64_t> connections_{0}, poses_{0}, steps_{0}, refused_{0};
    Heartbeat heartbeat_{"simulator"};
    std::thread thread_, step_thread_;
};

} // namespace obscura::emulator

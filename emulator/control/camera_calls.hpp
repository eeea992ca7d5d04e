// SPDX-License-Identifier: Apache-2.0
// Calls that read and change a running camera: settings, acquisition, triggers, poses, steps.
#pragma once

#include "core/time.hpp"
#include "emulator/control/controlled_camera.hpp"
#include "service/call.hpp"

#include <map>
#include <memory>
#include <vector>

namespace obscura::emulator {

/// Throws Failure if there is no camera of that number among so many.
void check_camera_number(std::size_t cameras, std::uint32_t number);
/// The camera of that number. Throws Failure.
[[nodiscard]] ControlledCamera& checked_camera(const std::vector<std::unique_ptr<ControlledCamera>>& cameras,
                                               std::uint32_t number);

/// Field of a call that says which camera of the daemon is meant.
[[nodiscard]] config::Key camera_key(std::uint32_t* number);

/// Arguments of a call about a camera that has no others.
struct CameraNumber {
    std::uint32_t camera = 0;

    [[nodiscard]] service::Fields fields() { return {{camera_key(&camera)}}; }
};

/// Camera calls of one client. Thread-bound to the thread that runs its calls.
class CameraCalls {
public:
    using Cameras = std::vector<std::unique_ptr<ControlledCamera>>;

    /// `cameras` outlives this.
    explicit CameraCalls(const Cameras& cameras) : cameras_(cameras) {}

    /// Valid while this lives.
    [[nodiscard]] service::Calls calls();

private:
    struct Choice;
    struct Get;
    struct Set;
    struct Trigger;
    struct PoseFields;
    struct Step;

    [[nodiscard]] ControlledCamera& camera(const Choice& choice) const;
    /// Runs `work` on the camera. While a client of another protocol controls it, throws Failure, or with
    /// `force` runs it and returns that client's address.
    std::string change(ControlledCamera& camera, const std::function<void()>& work, bool force = false) const;
    [[nodiscard]] SimulatorServer& simulator(const Choice& choice) const;
    [[nodiscard]] service::Answer features(const Choice& choice) const;
    [[nodiscard]] service::Answer get(const Get& get) const;
    [[nodiscard]] service::Answer set(const Set& set, const service::Work& work) const;
    [[nodiscard]] service::Answer trigger(const Trigger& trigger, service::Work& work) const;
    void pose(const PoseFields& pose) const;
    [[nodiscard]] service::Answer step(const Step& step, service::Work& work);

    const Cameras& cameras_;
    std::map<std::uint32_t, Time> last_steps_; ///< scene times, by the number of the camera
};

} // namespace obscura::emulator

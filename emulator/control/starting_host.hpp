// SPDX-License-Identifier: Apache-2.0
// Calls of a daemon that starts: its state and log are told, all else is refused with the progress.
#pragma once

#include "emulator/daemon/start_progress.hpp"
#include "service/session.hpp"

#include <nlohmann/json.hpp>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace obscura::emulator {

class ControlHost;

/// Stands before a ControlHost until that is there, so that the sockets are open from the beginning and stay
/// so. Has the calls of a running daemon. Thread-safe after construction.
class StartingHost final : public service::Host {
public:
    /// `head`: members of `daemon` in the state that are known before the start, see Monitor. `progress`
    /// outlives this.
    StartingHost(std::string version, const StartProgress& progress, nlohmann::json head);
    ~StartingHost() override;
    StartingHost(const StartingHost&) = delete;
    StartingHost& operator=(const StartingHost&) = delete;

    /// From now on `running` answers, on connections that are open as well. It outlives the sessions.
    void hand_over(ControlHost& running) noexcept { running_.store(&running); }

    [[nodiscard]] std::string version() const override { return version_; }
    [[nodiscard]] std::unique_ptr<service::Session> open() override;

    /// The answer to `state` so far.
    [[nodiscard]] nlohmann::json state() const;
    [[nodiscard]] ControlHost* running() const noexcept { return running_.load(); }
    [[nodiscard]] const StartProgress& progress() const noexcept { return progress_; }

private:
    const std::string version_;
    const StartProgress& progress_;
    const nlohmann::json head_;
    const Time begun_;
    std::unique_ptr<ControlHost> no_cameras_; ///< has the table of calls
    std::atomic<ControlHost*> running_{nullptr};
};

} // namespace obscura::emulator

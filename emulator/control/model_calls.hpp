// SPDX-License-Identifier: Apache-2.0
// Calls about models written in SuMoL: list, text, check, picture, store, remove.
#pragma once

#include "core/realtime/realtime.hpp"
#include "emulator/config/daemon_sections.hpp"
#include "emulator/control/idle_thread.hpp"
#include "emulator/control/model_store.hpp"
#include "emulator/control/scene_requests.hpp"
#include "models/program/execution.hpp"
#include "service/call.hpp"

#include <filesystem>
#include <functional>
#include <mutex>

namespace obscura::emulator {

/// What the calls of all clients share. Texts are examined on one thread at nice level 10. Thread-safe.
class ModelDesk {
public:
    /// `cores` of the thread; empty: any.
    ModelDesk(const ModelsSection& section, const CoreSet& cores);

    /// The calls "model.list", "model.get", "model.check", "model.plot", "model.put" and "model.remove".
    /// `requests` outlives them; `shown` gives the file of the scene that is shown.
    [[nodiscard]] service::Calls calls(SceneRequests& requests, std::function<std::filesystem::path()> shown);
    /// Refuses examinations from now on.
    void close() { thread_.close(); }

private:
    [[nodiscard]] service::Call check_call();
    [[nodiscard]] service::Call plot_call();
    [[nodiscard]] service::Call put_call(SceneRequests& requests,
                                         std::function<std::filesystem::path()> shown);
    [[nodiscard]] service::Call remove_call(SceneRequests& requests,
                                            std::function<std::filesystem::path()> shown);

    ModelStore store_;
    models::Execution execution_;
    std::mutex changes_; ///< one at a time
    IdleThread thread_;  ///< ends first
};

} // namespace obscura::emulator

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
#include <vector>

namespace obscura::emulator {

/// Files that a running daemon has models for.
struct ModelUsers {
    std::function<std::filesystem::path()> scene;                ///< file of the scene that is shown
    std::function<std::vector<std::filesystem::path>()> sensors; ///< files of the models of its sensors
};

/// What the calls of all clients share. Texts are examined on one thread at nice level 10. Thread-safe.
class ModelDesk {
public:
    /// `cores` of the thread; empty: any.
    ModelDesk(const ModelsSection& section, const CoreSet& cores);

    /// The calls "model.list", "model.get", "model.check", "model.plot", "model.put" and "model.remove".
    /// `requests` outlives them.
    [[nodiscard]] service::Calls calls(SceneRequests& requests, const ModelUsers& users);
    /// Refuses examinations from now on.
    void close() { thread_.close(); }

private:
    [[nodiscard]] service::Call check_call();
    [[nodiscard]] service::Call plot_call();
    [[nodiscard]] service::Call put_call(SceneRequests& requests,
                                         std::function<std::filesystem::path()> shown);
    [[nodiscard]] service::Call remove_call(SceneRequests& requests, ModelUsers users);

    ModelStore store_;
    models::Execution execution_;
    std::mutex changes_; ///< one at a time
    IdleThread thread_;  ///< ends first
};

} // namespace obscura::emulator

// SPDX-License-Identifier: Apache-2.0
#include "emulator/daemon/supervisor.hpp"

namespace obscura::emulator {

bool Supervisor::all_alive(const Heartbeats& workers, bool pipeline_moves, Time now) {
    missed_.clear();
    const auto miss = [this](const std::string& name) { missed_ += (missed_.empty() ? "" : ", ") + name; };
    pipeline_moved_ = pipeline_moved_ || pipeline_moves;
    if (!pipeline_moved_) miss("pipeline");
    std::map<const Heartbeat*, std::uint64_t> current;
    for (const Heartbeat* worker : workers) {
        const auto known = beats_.find(worker);
        current[worker] = worker->beats();
        // A new thread has until the next check.
        const bool heard = known == beats_.end() || known->second != worker->beats();
        if (!heard && !worker->may_be_silent(now)) miss(worker->name());
    }
    if (!missed_.empty()) return false;
    beats_ = std::move(current);
    pipeline_moved_ = false;
    return true;
}

} // namespace obscura::emulator

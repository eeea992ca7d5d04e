// SPDX-License-Identifier: Apache-2.0
#include "emulator/monitor/beat_times.hpp"

#include <utility>

namespace obscura::emulator {

void BeatTimes::note(Time now, const Heartbeats& heartbeats) {
    std::map<const Heartbeat*, Seen> seen;
    for (const Heartbeat* const heartbeat : heartbeats) {
        const std::uint64_t beats = heartbeat->beats();
        const auto before = seen_.find(heartbeat);
        const bool same = before != seen_.end() && before->second.beats == beats;
        seen[heartbeat] = {beats, same ? before->second.last : now};
    }
    seen_ = std::move(seen);
    order_ = heartbeats;
}

std::vector<BeatTimes::Age> BeatTimes::ages(Time now) const {
    std::vector<Age> ages;
    for (const Heartbeat* const heartbeat : order_) {
        const std::int64_t age_ns = now - seen_.at(heartbeat).last;
        ages.push_back({heartbeat->name(), static_cast<double>(age_ns) / static_cast<double>(ns_per_s),
                        heartbeat->may_be_silent(now)});
    }
    return ages;
}

} // namespace obscura::emulator

// SPDX-License-Identifier: Apache-2.0
#include "tools/batch/batch_state.hpp"

#include "host/interrupt.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <iterator>
#include <set>
#include <thread>
#include <utility>

namespace obscura::tools {
namespace {

/// State of one shard.
struct ShardState {
    std::uint64_t done = 0, bytes = 0;
    double seconds = 0;
    std::vector<std::int64_t> finished_s;
    std::set<std::string> hosts;
    std::vector<BadFrame> bad;
};

ShardState shard_state(const Plan& plan, const std::filesystem::path& batch, std::uint64_t shard,
                       FrameCheck check) {
    ShardRecords records(plan, batch, shard);
    records.update();
    ShardState state;
    for (const auto& [frame, record] : records.all()) {
        std::string why = explain_not_done(record, records.folder(), check);
        if (why.empty() && records.disputed().contains(frame)) why = "has been rendered with different bytes";
        if (!why.empty()) {
            state.bad.push_back({frame, (records.folder() / record.file).string(), std::move(why)});
            continue;
        }
        ++state.done;
        state.bytes += record.content.bytes;
        state.seconds += record.seconds;
        state.finished_s.push_back(record.finished_s);
        state.hosts.insert(record.host);
    }
    return state;
}

/// Calls `work(i)` for each i below `count` on some threads; the first exception ends it.
template<typename F>
void spread(std::uint64_t count, std::uint32_t threads, const F& work) {
    std::atomic<std::uint64_t> next{0};
    std::vector<std::exception_ptr> errors(std::max<std::uint32_t>(1, threads));
    const auto loop = [&](std::size_t thread) {
        try {
            for (std::uint64_t i = 0; (i = next.fetch_add(1)) < count && !host::interrupted();)
                work(i);
        } catch (...) {
            errors[thread] = std::current_exception();
            next = count;
        }
    };
    std::vector<std::jthread> others;
    for (std::size_t thread = 1; thread < errors.size(); ++thread)
        others.emplace_back(loop, thread);
    loop(0);
    others.clear();
    for (const std::exception_ptr& error : errors)
        if (error) std::rethrow_exception(error);
}

} // namespace

std::optional<double> BatchState::work_left_s() const {
    if (done == 0) return std::nullopt;
    return static_cast<double>(frames - done) * seconds / static_cast<double>(done);
}

std::optional<double> BatchState::left_s() const {
    if (recent == 0) return std::nullopt;
    return static_cast<double>(frames - done) * recent_s / static_cast<double>(recent);
}

BatchState batch_state(const Plan& plan, const std::filesystem::path& batch, FrameCheck check,
                       std::int64_t now_s, std::uint32_t threads) {
    if (threads == 0) threads = std::max(1U, std::thread::hardware_concurrency());
    std::vector<ShardState> shards(plan.shards());
    spread(shards.size(), threads,
           [&](std::uint64_t shard) { shards[shard] = shard_state(plan, batch, shard, check); });
    BatchState state;
    state.frames = plan.frames.count();
    state.shards = plan.shards();
    std::set<std::string> hosts;
    std::vector<std::int64_t> finished_s;
    for (std::uint64_t i = 0; i < shards.size(); ++i) {
        ShardState& shard = shards[i];
        state.done += shard.done;
        state.bytes += shard.bytes;
        state.seconds += shard.seconds;
        finished_s.insert(finished_s.end(), shard.finished_s.begin(), shard.finished_s.end());
        hosts.merge(shard.hosts);
        std::move(shard.bad.begin(), shard.bad.end(), std::back_inserter(state.bad));
        if (shard.done == plan.frames_of(i).count()) {
            ++state.shards_done;
        } else {
            state.unfinished.push_back(i);
            if (shard.done > 0) ++state.shards_begun;
        }
    }
    state.hosts = hosts.size();
    constexpr std::int64_t max_s = 900;
    const auto first = std::min_element(finished_s.begin(), finished_s.end());
    if (first == finished_s.end()) return state;
    const std::int64_t span_s = std::clamp<std::int64_t>(now_s - *first, 1, max_s);
    state.recent_s = static_cast<double>(span_s);
    state.recent = static_cast<std::uint64_t>(std::count_if(
        finished_s.begin(), finished_s.end(), [&](std::int64_t at_s) { return at_s >= now_s - span_s; }));
    return state;
}

} // namespace obscura::tools

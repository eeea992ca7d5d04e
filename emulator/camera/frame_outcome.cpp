// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_outcome.hpp"

#include "core/clock.hpp"

#include <algorithm>

namespace obscura::emulator {
namespace {

constexpr std::uint64_t join_halves(std::uint32_t high, std::uint32_t low) noexcept {
    return std::uint64_t{high} << 32U | low;
}
constexpr std::uint32_t high_half(std::uint64_t word) noexcept {
    return static_cast<std::uint32_t>(word >> 32U);
}
constexpr std::uint32_t low_half(std::uint64_t word) noexcept {
    return static_cast<std::uint32_t>(word);
}

} // namespace

OutcomeRing::Request OutcomeRing::request() noexcept {
    return {requests_.fetch_add(1, std::memory_order_relaxed) + 1,
            published_.load(std::memory_order_acquire)};
}

// The words are stored with release and loaded with acquire order, so that the sequence before them and the
// one after them are what a reader sees around them.
void OutcomeRing::publish(const OutcomeRecord& record) noexcept {
    const std::uint64_t number = published_.fetch_add(1, std::memory_order_acq_rel);
    Slot& slot = slots_[number % record_count];
    slot.sequence.store(2 * number + 1, std::memory_order_relaxed);
    const auto store = [&slot](Word word, std::uint64_t value) {
        slot.words[word].store(value, std::memory_order_release);
    };
    store(frame_id, record.frame_id);
    store(trigger_id, record.trigger_id);
    store(request_number, record.request);
    store(acquisition_flags, join_halves(record.acquisition, record.flags));
    store(rows, join_halves(record.late_rows, record.stalled_rows));
    store(outcome, static_cast<std::uint64_t>(record.outcome));
    slot.sequence.store(2 * number + 2, std::memory_order_release);
    changed_.notify();
}

std::optional<OutcomeRecord> OutcomeRing::find(Request& request) const noexcept {
    const std::uint64_t end = published_.load(std::memory_order_acquire);
    if (end - request.next > record_count) request.next = end - record_count;
    for (; request.next < end; ++request.next) {
        const Slot& slot = slots_[request.next % record_count];
        const std::uint64_t written = 2 * request.next + 2;
        const std::uint64_t before = slot.sequence.load(std::memory_order_acquire);
        if (before < written) return std::nullopt; // its writer notifies when it has done so
        std::array<std::uint64_t, word_count> words;
        std::transform(slot.words.begin(), slot.words.end(), words.begin(),
                       [](const auto& word) { return word.load(std::memory_order_acquire); });
        const bool whole = before == written && slot.sequence.load(std::memory_order_relaxed) == written;
        if (!whole || words[request_number] != request.number) continue;
        return OutcomeRecord{words[frame_id],
                             words[trigger_id],
                             words[request_number],
                             high_half(words[acquisition_flags]),
                             high_half(words[rows]),
                             low_half(words[rows]),
                             low_half(words[acquisition_flags]),
                             static_cast<FrameOutcome>(words[outcome])};
    }
    return std::nullopt;
}

std::optional<OutcomeRecord> OutcomeRing::wait(Request& request, Time deadline) noexcept {
    const std::uint64_t wakes = wakes_.load();
    for (;;) {
        const std::uint32_t seen = changed_.value();
        if (const std::optional<OutcomeRecord> record = find(request)) return record;
        if (wakes_.load() != wakes || MonotonicClock().now() >= deadline) return std::nullopt;
        changed_.wait(seen, deadline);
    }
}

void OutcomeRing::wake_all() noexcept {
    wakes_.fetch_add(1);
    changed_.notify();
}

} // namespace obscura::emulator

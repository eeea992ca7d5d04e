// SPDX-License-Identifier: Apache-2.0
#include "emulator/record/timing_log.hpp"

#include "emulator/record/timing_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <ostream>
#include <utility>

namespace obscura::emulator {

void TimingLog::set_transports(std::vector<std::string> kinds) {
    transports_ = std::move(kinds);
}

void TimingLog::keep_rows(std::size_t max_rows) {
    max_rows_ = max_rows;
    rows_.assign(capacity * max_rows, FrameTiming::not_released);
}

TransmitTimestamps& TimingLog::transmit_timestamps(std::uint32_t number) noexcept {
    TransmitTimestamps& timestamps = transmit_[number % transmit_.size()];
    timestamps.clear();
    return timestamps;
}

std::span<std::int32_t> TimingLog::next_rows(std::size_t rows) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (rows > max_rows_ || head - tail_.load(std::memory_order_acquire) == capacity) return {};
    const std::span<std::int32_t> all(rows_.data() + head % capacity * max_rows_, rows);
    std::fill(all.begin(), all.end(), FrameTiming::not_released);
    return all;
}

void TimingLog::push(const FrameTiming& timing) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == capacity) {
        lost_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    cells_[head % capacity] = timing;
    head_.store(head + 1, std::memory_order_release);
}

std::size_t TimingLog::drain(const std::function<void(const FrameTiming&)>& take, Time before) {
    const std::lock_guard lock(draining_);
    std::size_t count = 0;
    std::size_t tail = tail_.load(std::memory_order_relaxed);
    for (; tail != head_.load(std::memory_order_acquire); ++count) {
        const FrameTiming& frame = cells_[tail % capacity];
        if (frame.ended >= before) break;
        take(frame);
        tail_.store(++tail, std::memory_order_release);
    }
    return count;
}

void TimingLog::queued(const std::function<void(const FrameTiming&)>& look) const {
    const std::size_t head = head_.load(std::memory_order_acquire);
    for (std::size_t i = tail_.load(std::memory_order_relaxed); i != head; ++i)
        look(cells_[i % capacity]);
}

std::size_t TimingLog::drain(std::ostream& out, Time before, std::span<const std::int64_t> pace_ns) {
    return drain([&](const FrameTiming& frame) { out << row(frame, pace_ns); }, before);
}

std::string TimingLog::row(const FrameTiming& t, std::span<const std::int64_t> pace_ns) const {
    fmt::memory_buffer line;
    const auto to = std::back_inserter(line);
    const FrameRecord record = record_of(t, render_);
    for (const TimingColumn& column : timing_columns())
        fmt::format_to(to, "{},", column.value(record));
    const FrameQuality& q = t.quality;
    for (std::size_t g = 0; g < q.groups; ++g)
        line.push_back(static_cast<char>('0' + static_cast<int>(q.group_level[g])));
    for (std::size_t slot = 0; slot < transports_.size(); ++slot)
        fmt::format_to(to, ",{},{},{}", t.transmit != nullptr ? t.transmit->first(slot).ns : 0,
                       t.transmit != nullptr ? t.transmit->last(slot).ns : 0,
                       slot < pace_ns.size() ? pace_ns[slot] : 0);
    line.push_back(',');
    const char* separator = "";
    for (const std::int32_t us : t.row_lateness_us) {
        if (us == FrameTiming::not_released) break;
        fmt::format_to(to, "{}{}", separator, us);
        separator = " ";
    }
    line.push_back('\n');
    return fmt::to_string(line);
}

std::string TimingLog::header() const {
    std::string line;
    for (const TimingColumn& column : timing_columns())
        line += fmt::format("{},", column.name);
    line += "levels";
    for (const std::string& kind : transports_)
        line += fmt::format(",{0}_first_byte_ns,{0}_last_byte_ns,{0}_pace_ns", kind);
    return line + ",row_lateness_us\n";
}

} // namespace obscura::emulator

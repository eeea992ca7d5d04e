// SPDX-License-Identifier: Apache-2.0
#include "emulator/timing_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

std::size_t TimingLog::drain(std::ostream& out, Time before, std::span<const std::int64_t> pace_ns) {
    std::size_t count = 0;
    std::size_t tail = tail_.load(std::memory_order_relaxed);
    fmt::memory_buffer line;
    const auto to = std::back_inserter(line);
    for (; tail != head_.load(std::memory_order_acquire); ++count) {
        const FrameTiming& t = cells_[tail % capacity];
        if (t.ended >= before) break;
        line.clear();
        fmt::format_to(to, "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", t.frame_id, t.trigger_id,
                       t.edge.ns, t.seen.ns, t.pose.ns, t.render_begin.ns, t.render_end.ns, t.detector_end.ns,
                       t.due.ns, t.first.ns, t.last_due.ns, t.last.ns, t.rows, t.late_rows, t.worst_row_ns,
                       t.worst_row, t.flags);
        fmt::format_to(to, ",{},{},{},{},{},{},{},{:.0f},{},{}", t.facts.acquisition, t.facts.min_period_ns,
                       t.width, t.height, render_.threads, render_.cores, render_.samples_per_pixel,
                       1e6 * render_.target_error, render_.max_instants, t.work.render.rows);
        for (const std::int64_t part_ns : t.work.render.part_ns)
            fmt::format_to(to, ",{}", part_ns);
        fmt::format_to(to, ",{},{},{},{},{},{},{},{},{},{}", t.work.render.measured_ns,
                       t.work.render.measured_cpu_ns, t.work.render.preemptions, t.work.render.instants,
                       t.work.render.samples, t.work.render.rays, t.work.detector_wait_ns, t.work.detector_ns,
                       t.work.ahead_ns, std::llround(1e6 * t.work.ahead_error_px));
        const FrameQuality& q = t.quality;
        fmt::format_to(to, ",{},{},{},{},{},{},{},", static_cast<int>(q.level_max), q.rows_degraded,
                       q.reasons, std::llround(1e6 * static_cast<double>(q.error_rms)), q.budget_us,
                       q.spent_us, q.margin_us);
        for (const float value : {q.error_worst_group, q.error_goal, q.noise_ratio_p95, q.unknown_share})
            fmt::format_to(to, "{},", std::llround(1e6 * static_cast<double>(value)));
        fmt::format_to(to, "{},{},{},{},{},", q.instants, q.bounces, q.bounces_asked,
                       t.work.render.page_faults, t.stalled_rows);
        fmt::format_to(to, "{},{},{},", std::llround(1e6 * static_cast<double>(q.lod_deficit_share)),
                       static_cast<int>(q.lod_deficit_worst), q.tiles_missing);
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
        out.write(line.data(), static_cast<std::streamsize>(line.size()));
        tail_.store(++tail, std::memory_order_release);
    }
    return count;
}

void TimingLog::discard() noexcept {
    tail_.store(head_.load(std::memory_order_acquire), std::memory_order_release);
}

std::string TimingLog::header() const {
    std::string line = "frame_id,trigger_id,edge_ns,seen_ns,pose_ns,render_begin_ns,render_end_ns,"
                       "detector_end_ns,due_ns,first_ns,last_due_ns,last_ns,rows,late_rows,worst_row_ns,"
                       "worst_row,flags,acquisition,min_period_ns,width,height,render_threads,render_cores,"
                       "samples_per_pixel,target_error_ppm,max_instants,rendered_rows,setup_ns,sampling_ns,"
                       "grid_ns,wings_ns,points_ns,rest_ns,measured_ns,measured_cpu_ns,preemptions,"
                       "row_instants,samples,rays,detector_wait_ns,detector_ns,ahead_ns,ahead_error_upx,"
                       "level_max,rows_degraded,quality_reasons,error_ppm,budget_us,spent_us,margin_us,"
                       "error_worst_ppm,error_goal_ppm,noise_ratio_ppm,unknown_ppm,sampled_instants,bounces,"
                       "bounces_asked,page_faults,stalled_rows,"
                       "lod_deficit_ppm,lod_deficit_worst,tiles_missing,levels";
    for (const std::string& kind : transports_)
        line += fmt::format(",{0}_first_byte_ns,{0}_last_byte_ns,{0}_pace_ns", kind);
    return line + ",row_lateness_us\n";
}

} // namespace obscura::emulator

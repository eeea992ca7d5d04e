#include "emulator/timing_log.hpp"

#include <fmt/format.h>

#include <ostream>

namespace obscura::emulator {

void TimingLog::push(const FrameTiming& timing) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == capacity) {
        lost_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    cells_[head % capacity] = timing;
    head_.store(head + 1, std::memory_order_release);
}

std::size_t TimingLog::drain(std::ostream& out) {
    std::size_t count = 0;
    std::size_t tail = tail_.load(std::memory_order_relaxed);
    for (; tail != head_.load(std::memory_order_acquire); ++count) {
        const FrameTiming& t = cells_[tail % capacity];
        out << fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", t.frame_id, t.trigger_id,
                           t.edge.ns, t.seen.ns, t.render_begin.ns, t.render_end.ns, t.detector_end.ns,
                           t.due.ns, t.first.ns, t.last_due.ns, t.last.ns, t.rows, t.late_rows,
                           t.worst_row_ns, t.flags);
        tail_.store(++tail, std::memory_order_release);
    }
    return count;
}

void TimingLog::discard() noexcept {
    tail_.store(head_.load(std::memory_order_acquire), std::memory_order_release);
}

const char* TimingLog::header() noexcept {
    return "frame_id,trigger_id,edge_ns,seen_ns,render_begin_ns,render_end_ns,detector_end_ns,due_ns,first_"
           "ns,"
           "last_due_ns,last_ns,rows,late_rows,worst_row_ns,flags\n";
}

} // namespace obscura::emulator

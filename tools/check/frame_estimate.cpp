// SPDX-License-Identifier: Apache-2.0
#include "tools/check/frame_estimate.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::tools {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Time since construction, and CPU time of the process.
class Stopwatch {
public:
    [[nodiscard]] double seconds() const {
        return std::chrono::duration<double>(SteadyClock::now() - start_).count();
    }
    [[nodiscard]] double cpu_s() const {
        return static_cast<double>(std::clock() - cpu_start_) / CLOCKS_PER_SEC;
    }

private:
    SteadyClock::time_point start_ = SteadyClock::now();
    std::clock_t cpu_start_ = std::clock();
};

/// Sets a flag at a deadline, unless it is destroyed earlier.
class Deadline {
public:
    explicit Deadline(double seconds)
        : thread_([this, end = SteadyClock::now() + std::chrono::duration_cast<SteadyClock::duration>(
                                                        std::chrono::duration<double>(seconds))] {
              std::unique_lock lock(mutex_);
              if (!wake_.wait_until(lock, end, [this] { return over_; })) passed_.store(true);
          }) {}
    ~Deadline() {
        {
            const std::lock_guard lock(mutex_);
            over_ = true;
        }
        wake_.notify_all();
        thread_.join();
    }
    Deadline(const Deadline&) = delete;
    Deadline& operator=(const Deadline&) = delete;

    [[nodiscard]] const std::atomic<bool>& passed() const { return passed_; }

private:
    std::mutex mutex_; // guards over_
    std::condition_variable wake_;
    bool over_ = false;
    std::atomic<bool> passed_{false};
    std::thread thread_;
};

/// For a terrain's first frame, which makes its tiles: what takes longer is judged by a part of its rows.
constexpr double max_first_frame_s = 300;
/// Rows of a block. Progress is reported after each.
constexpr std::int32_t first_frame_rows = 64;

struct Block {
    const FrameWindow* window;
    std::int32_t first = 0, rows = 0; ///< rows of the window
};

/// Blocks of `block_rows`, in an order in which every beginning is spread over the frame.
std::vector<Block> blocks_of(const EstimatedFrame& frame, std::int32_t block_rows) {
    std::vector<Block> in_order;
    for (const FrameWindow& window : frame.windows)
        for (std::int32_t y = 0; y < window.sensor.height; y += block_rows)
            in_order.push_back({&window, y, std::min(block_rows, window.sensor.height - y)});
    // Bit reversal (van der Corput): the middle first, then the quarters, ...
    std::size_t power = 1;
    while (power < in_order.size())
        power *= 2;
    std::vector<Block> out;
    for (std::size_t i = 1; i <= power; ++i) {
        std::size_t reversed = 0;
        for (std::size_t bit = 1, mirror = power / 2; bit < power; bit *= 2, mirror /= 2)
            if ((i % power & bit) != 0) reversed |= mirror;
        if (reversed < in_order.size()) out.push_back(in_order[reversed]);
    }
    return out;
}

/// Renders the block into `values`; false when cancelled.
bool render_block(const renderer::Renderer& renderer, const EstimatedFrame& frame, const Block& block,
                  const std::atomic<bool>& cancel, std::vector<float>& values) {
    const FrameWindow& window = *block.window;
    const auto times = frame.rows.subspan(static_cast<std::size_t>(window.image_y + block.first),
                                          static_cast<std::size_t>(block.rows));
    const auto columns = static_cast<std::size_t>(window.sensor.width);
    values.resize(renderer.band_count() * times.size() * columns);
    renderer::RenderRequest request;
    request.window = window.sensor;
    request.frame_id = 1;
    if (!frame.push_broom) {
        request.common_mid = renderer::common_mid(frame.rows);
        request.first_row = block.first;
        request.rows = block.rows;
        request.row_times = times;
        return renderer.render(request, values, &cancel);
    }
    std::vector<float> line(renderer.band_count() * columns);
    request.window.height = request.rows = 1;
    for (std::size_t r = 0; r < times.size(); ++r) {
        request.row_times = times.subspan(r, 1);
        if (!renderer.render(request, line, &cancel)) return false;
        for (std::size_t b = 0; b < renderer.band_count(); ++b)
            std::copy_n(line.begin() + static_cast<std::ptrdiff_t>(b * columns), columns,
                        values.begin() + static_cast<std::ptrdiff_t>((b * times.size() + r) * columns));
    }
    return true;
}

} // namespace

FrameCost estimate_frame(const renderer::Renderer& renderer, const EstimatedFrame& frame, double limit_s,
                         const UseRows& use, const RowsDone& rows_done) {
    std::int64_t all_rows = 0;
    for (const FrameWindow& window : frame.windows)
        all_rows += window.sensor.height;
    FrameCost cost;
    if (all_rows == 0) return cost;
    const auto share_of = [&](std::int64_t rows) {
        return static_cast<double>(rows) / static_cast<double>(all_rows);
    };
    constexpr std::int32_t probe_rows = 16;
    std::vector<float> values;
    const auto use_block = [&](const Block& block) {
        use(values, frame.rows.subspan(static_cast<std::size_t>(block.window->image_y + block.first),
                                       static_cast<std::size_t>(block.rows)));
        return rows_done(share_of(block.rows));
    };

    // A terrain is judged by its first frame, which makes the tiles; later ones are timed.
    const bool terrain = !renderer.terrain_tiles().empty();
    if (terrain) {
        const Deadline deadline(max_first_frame_s);
        std::int64_t judged = 0;
        for (const Block& block : blocks_of(frame, std::min(first_frame_rows, frame.block_rows))) {
            if (!render_block(renderer, frame, block, deadline.passed(), values)) break;
            judged += block.rows;
            if (!use_block(block)) break;
        }
        cost.share = share_of(judged);
    }

    // A first block says whether the whole frame fits into the time; it also warms up the threads.
    const std::int32_t small = std::min(probe_rows, frame.block_rows);
    const Block probe = blocks_of(frame, small).front();
    const Stopwatch first;
    const bool ready = render_block(renderer, frame, probe, Deadline(limit_s).passed(), values);
    const double first_s = first.seconds(), first_cpu_s = first.cpu_s();
    cost.seconds = first_s / share_of(probe.rows);
    cost.cpu_s = first_cpu_s / share_of(probe.rows);
    cost.at_least = !ready;
    if (!ready) return cost;
    const bool whole = cost.seconds < limit_s;

    std::int64_t done = 0;
    double seconds = 0, cpu_s = 0;
    bool go_on = true;
    const auto take = [&](const Block& block, double took_s, double took_cpu_s) {
        done += block.rows;
        seconds += took_s;
        cpu_s += took_cpu_s;
        if (!terrain) go_on = use_block(block);
    };
    std::vector<Block> blocks = blocks_of(frame, whole ? frame.block_rows : small);
    if (!whole) {
        take(probe, first_s, first_cpu_s);
        blocks.erase(blocks.begin());
    }
    for (const Block& block : blocks) {
        if (!go_on) break;
        const Stopwatch watch;
        if (!render_block(renderer, frame, block, Deadline(limit_s - first_s - seconds).passed(), values))
            break;
        take(block, watch.seconds(), watch.cpu_s());
    }
    if (done == 0) return cost; // one large block, which was not ready in time
    if (!terrain) cost.share = share_of(done);
    cost.seconds = seconds / share_of(done);
    cost.cpu_s = cpu_s / share_of(done);
    return cost;
}

} // namespace obscura::tools

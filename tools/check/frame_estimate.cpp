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

/// For the tiles of all blocks.
constexpr double max_loading_s = 20;

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

/// Makes the tiles of terrains that the block needs, which stay for later frames: no cost of a frame. False:
/// `left_s`, from which it takes its time, was not enough.
bool load_tiles(const renderer::Renderer& renderer, const EstimatedFrame& frame, const Block& block,
                double& left_s) {
    renderer::RenderRequest request;
    request.window = block.window->sensor;
    request.frame_id = 1;
    request.first_row = block.first;
    request.rows = block.rows;
    request.row_times = frame.rows.subspan(static_cast<std::size_t>(block.window->image_y + block.first),
                                           static_cast<std::size_t>(block.rows));
    const Stopwatch watch;
    const bool done = renderer.load_tiles(request, [&](double) { return watch.seconds() < left_s; });
    left_s -= watch.seconds();
    return done;
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
                         const UseRows& use) {
    std::int64_t all_rows = 0;
    for (const FrameWindow& window : frame.windows)
        all_rows += window.sensor.height;
    FrameCost cost;
    if (all_rows == 0) return cost;
    const auto share_of = [&](std::int64_t rows) {
        return static_cast<double>(rows) / static_cast<double>(all_rows);
    };
    constexpr std::int32_t probe_rows = 16;
    double loading_left_s = max_loading_s;
    std::vector<float> values;

    // A first block says whether the whole frame fits into the time; it also warms up the threads.
    const std::int32_t small = std::min(probe_rows, frame.block_rows);
    const Block probe = blocks_of(frame, small).front();
    load_tiles(renderer, frame, probe, loading_left_s);
    const bool terrain = renderer.tiles_made() > 0;
    if (terrain) render_block(renderer, frame, probe, Deadline(limit_s).passed(), values);
    const Stopwatch first;
    const bool ready = render_block(renderer, frame, probe, Deadline(limit_s).passed(), values);
    const double first_s = first.seconds(), first_cpu_s = first.cpu_s();
    cost.seconds = first_s / share_of(probe.rows);
    cost.cpu_s = first_cpu_s / share_of(probe.rows);
    cost.at_least = !ready;
    if (!ready) return cost;
    // The tiles of a terrain may take too long: some rows are better than none.
    const bool whole = cost.seconds < limit_s && !terrain;

    std::int64_t done = 0;
    double seconds = 0, cpu_s = 0;
    const auto take = [&](const Block& block, double took_s, double took_cpu_s) {
        done += block.rows;
        seconds += took_s;
        cpu_s += took_cpu_s;
        use(values, frame.rows.subspan(static_cast<std::size_t>(block.window->image_y + block.first),
                                       static_cast<std::size_t>(block.rows)));
    };
    std::vector<Block> blocks = blocks_of(frame, whole ? frame.block_rows : small);
    if (!whole) {
        take(probe, first_s, first_cpu_s);
        blocks.erase(blocks.begin());
    }
    for (const Block& block : blocks) {
        if (!load_tiles(renderer, frame, block, loading_left_s)) break;
        bool rendered = false;
        double took_s = 0, took_cpu_s = 0;
        // A few tiles that rays take at random are made while it is rendered, which takes as long as many
        // rows.
        for (int attempt = 0; attempt < 3; ++attempt) {
            const std::uint64_t made = renderer.tiles_made();
            const Stopwatch watch;
            rendered =
                render_block(renderer, frame, block, Deadline(limit_s - first_s - seconds).passed(), values);
            took_s = watch.seconds();
            took_cpu_s = watch.cpu_s();
            if (!rendered || renderer.tiles_made() == made) break;
        }
        if (!rendered) break;
        take(block, took_s, took_cpu_s);
    }
    if (done == 0) return cost; // one large block, which was not ready in time
    cost.share = share_of(done);
    cost.seconds = seconds / cost.share;
    cost.cpu_s = cpu_s / cost.share;
    return cost;
}

} // namespace obscura::tools

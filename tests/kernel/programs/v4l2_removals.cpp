// SPDX-License-Identifier: Apache-2.0
// Takes a video node away from under the V4L2 transport, by unbinding its driver, and gives it back, again
// and again. Fails when the transport does not recover within 2 s, when the file transport beside it is
// disturbed, or when something leaks.
#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/error.hpp"
#include "tests/kernel/programs/pattern.hpp"
#include "transports/file/file_sink.hpp"
#include "transports/v4l2/v4l2_output.hpp"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

using namespace obscura;

namespace {

constexpr std::int32_t width = 1280, height = 720; // vivid's own

void write_to(const std::string& file, const std::string& text) {
    std::ofstream out(file);
    out << text << std::flush;
    if (!out) throw HardwareError("v4l2_removals: cannot write to " + file);
}

std::size_t open_files() {
    const std::filesystem::directory_iterator folder("/proc/self/fd");
    return static_cast<std::size_t>(std::distance(begin(folder), end(folder)));
}

/// Bytes that malloc has given out; exact, since main() allows it one arena.
std::size_t allocated() {
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

std::size_t mappings() {
    std::ifstream maps("/proc/self/maps");
    return static_cast<std::size_t>(
        std::count(std::istreambuf_iterator<char>(maps), std::istreambuf_iterator<char>(), '\n'));
}

struct Held {
    std::size_t files, maps, memory;
};

/// The least of a quarter of a second: while the file transport writes a frame it holds a file and its
/// buffers.
Held held() {
    Held least{open_files(), mappings(), allocated()};
    for (int i = 0; i < 50; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        least.files = std::min(least.files, open_files());
        least.maps = std::min(least.maps, mappings());
        least.memory = std::min(least.memory, allocated());
    }
    return least;
}

void run(std::map<std::string, std::string>& option) {
    const int removals = std::stoi(option["--removals"]);
    transports::V4l2Settings settings;
    settings.format = transports::V4l2Format::grey;
    settings.frame_counter = true;
    settings.required = true;
    settings.queue_frames = 20; // binding a driver may halt the emulated machine for half a second
    settings.device = option["--device"];
    transports::V4l2Context context;
    context.width = width, context.height = height, context.bits_per_pixel = 12;
    transports::V4l2Output output(settings, context);
    const std::filesystem::path folder = option["--files"];
    transports::FileSink other({.directory = folder, .format = images::FrameFormat::raw, .queue_frames = 20});
    output.start();
    other.start();

    FramePool pool(24, std::size_t{width} * height, height);
    std::atomic<bool> stopping{false};
    std::atomic<std::uint64_t> produced{0};
    std::thread camera([&] {
        MonotonicClock clock;
        Time edge = clock.now();
        for (std::uint64_t id = 1; !stopping; ++id) {
            // Binding a driver halts the emulated machine; edges of that time are not made up for in a burst.
            edge = std::max(edge + 50 * ns_per_ms, clock.now());
            clock.sleep_until(edge);
            const FrameRef frame = pool.acquire();
            if (!frame) continue;
            frame->info.frame_id = id;
            frame->info.trigger_edge = edge;
            frame->info.width = width, frame->info.height = height;
            frame->info.bits_per_pixel = 12;
            output.submit(frame);
            other.submit(frame);
            // Images are compared elsewhere; here every frame is only marked.
            std::fill(frame->pixels().begin(), frame->pixels().end(), rig::pattern(0, 0, id, 12));
            frame->publish_rows(height);
            ++produced;
            // The files are counted, not kept: they would fill the memory.
            std::error_code ignored;
            for (const char* end : {"raw", "toml"})
                std::filesystem::remove(folder / fmt::format("frame_{:06}.{}", id - 22, end), ignored);
        }
    });
    const auto delivered = [&] { return output.counters().delivered; };
    const auto wait_for_more = [&](std::uint64_t than) {
        MonotonicClock clock;
        const Time begin = clock.now();
        while (delivered() <= than) {
            if (clock.now() - begin > 10 * ns_per_s) throw HardwareError("v4l2_removals: no image in 10 s");
            clock.sleep_until(clock.now() + ns_per_ms);
        }
        return clock.now() - begin;
    };

    std::vector<std::int64_t> recovery_ns;
    Held before{};
    try {
        wait_for_more(3);
        for (int i = 0; i < removals; ++i) {
            if (i == 5) before = held();
            write_to(option["--driver"] + "/unbind", option["--name"]);
            const std::uint64_t lost = output.v4l2_counters().lost;
            MonotonicClock clock;
            while (output.v4l2_counters().lost == lost &&
                   output.v4l2_counters().lost <= static_cast<std::uint64_t>(i))
                clock.sleep_until(clock.now() + ns_per_ms);
            clock.sleep_until(clock.now() + 20 * ns_per_ms);
            write_to(option["--driver"] + "/bind", option["--name"]);
            recovery_ns.push_back(wait_for_more(delivered()));
        }
        wait_for_more(delivered() + 3);
    } catch (...) {
        stopping = true;
        camera.join();
        throw;
    }
    const Held after = held();
    stopping = true;
    camera.join();
    output.stop();
    other.stop();

    const auto c = output.counters(), o = other.counters();
    const auto v = output.v4l2_counters();
    std::cerr << fmt::format("files {} -> {}, mappings {} -> {}, memory {} -> {} bytes, frames held {}\n",
                             before.files, after.files, before.maps, after.maps, before.memory, after.memory,
                             pool.in_use());
    std::cerr << fmt::format(
        "node: {} frames, {} out, {} dropped, lost {} times, {} attempts refused; files: {} "
        "frames, {} written, {} dropped\n",
        c.submitted, c.delivered, c.dropped, v.lost, v.refused, o.submitted, o.delivered, o.dropped);
    std::sort(recovery_ns.begin(), recovery_ns.end());
    const std::size_t n = recovery_ns.size();
    const double median_ms = static_cast<double>(recovery_ns[n / 2]) * 1e-6;
    const double max_ms = static_cast<double>(recovery_ns.back()) * 1e-6;
    if (v.lost != static_cast<std::uint64_t>(removals))
        throw HardwareError("v4l2_removals: losses were not all seen");
    // An emulated machine on a busy one may be too slow for the frames as such.
    const bool busy = std::getenv("RIG_BUSY") != nullptr && *std::getenv("RIG_BUSY") != '\0';
    if (o.delivered + o.dropped != o.submitted || (o.dropped != 0 && !busy))
        throw HardwareError("v4l2_removals: the file transport was disturbed");
    if (c.delivered + c.dropped != c.submitted) throw HardwareError("v4l2_removals: frames were not counted");
    if (after.files > before.files || after.maps > before.maps + 4 || after.memory > before.memory + 16384 ||
        pool.in_use() != 0)
        throw HardwareError("v4l2_removals: something leaks");
    if (max_ms > (busy ? 5000 : 2000))
        throw HardwareError(fmt::format("v4l2_removals: recovery took {:.0f} ms", max_ms));
    std::cerr << fmt::format(
        "{} removals: node back to image out p50 {:.0f} ms, longest {:.0f} ms; nothing leaked, of {} "
        "frames {} were written to files\n",
        removals, median_ms, max_ms, o.submitted, o.delivered);
}

} // namespace

int main(int argc, char** argv) {
    mallopt(M_ARENA_MAX, 1);
    std::map<std::string, std::string> option;
    for (int i = 1; i + 1 < argc; i += 2)
        option[argv[i]] = argv[i + 1];
    try {
        run(option);
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
    return 0;
}

// SPDX-License-Identifier: Apache-2.0
// Feeds a video output node through the V4L2 transport with frames of a known pattern, one per edge of a
// timer, until the given number is out or it is told to stop (SIGTERM). Writes "frame_id edge_us" per frame,
// then the counters.
#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/error.hpp"
#include "tests/kernel/programs/pattern.hpp"
#include "transports/v4l2/v4l2_output.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <string>

using namespace obscura;

namespace {

std::atomic<bool> stopping{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

} // namespace

int main(int argc, char** argv) {
    transports::V4l2Settings settings;
    settings.frame_counter = true;
    settings.buffers = 32;
    settings.queue_frames = 7;
    transports::V4l2Context context;
    context.width = 320, context.height = 240, context.bits_per_pixel = 12;
    context.frame_rate_hz = 25;
    std::uint64_t frames = 0;
    std::string edges_file = "edges", counters_file = "counters";
    try {
        for (int i = 1; i + 1 < argc; i += 2) {
            const std::string option = argv[i], value = argv[i + 1];
            if (option == "--device")
                settings.device = value;
            else if (option == "--format")
                settings.format = enum_named<transports::V4l2Format>(value).value();
            else if (option == "--io")
                settings.io = enum_named<transports::V4l2Io>(value).value();
            else if (option == "--size" &&
                     std::sscanf(value.c_str(), "%dx%d", &context.width, &context.height) == 2)
                continue;
            else if (option == "--bits")
                context.bits_per_pixel = std::atoi(value.c_str());
            else if (option == "--rate")
                context.frame_rate_hz = std::atof(value.c_str());
            else if (option == "--frames")
                frames = std::strtoull(value.c_str(), nullptr, 10);
            else if (option == "--edges")
                edges_file = value;
            else if (option == "--counters")
                counters_file = value;
            else if (option == "--required")
                settings.required = value == "yes";
            else
                throw ConfigError("v4l2_stream: unknown option " + option);
        }
        struct sigaction action {};
        action.sa_handler = [](int) { stopping = true; };
        sigaction(SIGTERM, &action, nullptr);

        FramePool pool(8, static_cast<std::size_t>(context.width) * static_cast<std::size_t>(context.height),
                       static_cast<std::size_t>(context.height));
        transports::V4l2Output output(settings, context);
        output.start();
        std::ofstream edges(edges_file);
        MonotonicClock clock;
        const auto period_ns = static_cast<std::int64_t>(1e9 / context.frame_rate_hz);
        // Edges at an odd instant of their own, so that no other clock could give the same stamps.
        // Edges at an odd instant of their own, so that no other clock could give the same stamps. Those of a
        // time in which the emulated machine stood still are not made up for in a burst.
        Time edge = clock.now() + 1'234'567;
        for (std::uint64_t id = 1; !stopping && (frames == 0 || id <= frames);
             ++id, edge = std::max(edge + period_ns, clock.now())) {
            clock.sleep_until(edge);
            const FrameRef frame = pool.acquire();
            if (!frame) throw HardwareError("v4l2_stream: no frame free");
            frame->info.frame_id = id;
            frame->info.trigger_edge = edge;
            frame->info.width = context.width, frame->info.height = context.height;
            frame->info.bits_per_pixel = context.bits_per_pixel;
            edges << id << ' ' << edge.ns / 1000 << std::endl;
            output.submit(frame);
            for (std::int32_t y = 0; y < context.height; ++y) {
                const auto row = frame->row(y);
                for (std::int32_t x = 0; x < context.width; ++x)
                    row[static_cast<std::size_t>(x)] = rig::pattern(x, y, id, context.bits_per_pixel);
                if ((y + 1) % 16 == 0 || y + 1 == context.height) frame->publish_rows(y + 1);
            }
        }
        output.stop();
        const auto c = output.counters();
        const auto v = output.v4l2_counters();
        std::ofstream(counters_file) << fmt::format("submitted={} delivered={} dropped={} opened={} lost={} "
                                                    "refused={} problems={} no_node={} busy={} in_use={}\n",
                                                    c.submitted, c.delivered, c.dropped, v.opened, v.lost,
                                                    v.refused, v.problems, v.no_node, v.busy, pool.in_use());
    } catch (const Error& error) {
        std::cerr << error.what() << '\n';
        return error.status();
    }
    return 0;
}

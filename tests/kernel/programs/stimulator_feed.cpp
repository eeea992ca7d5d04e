// SPDX-License-Identifier: Apache-2.0
// Feeds a USB stimulator through the transport and says what its screen must show:
//     stimulator_feed SERIAL WIDTHxHEIGHT raw|lz4|windows FRAMES
// Exit status 0 when every frame arrived.
#include "core/clock.hpp"
#include "core/philox.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/stimulator_output.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

using namespace obscura;
using namespace obscura::transports;

namespace {

std::int64_t now_ns() {
    return MonotonicClock().now().ns;
}

/// Smooth, so that LZ4 has something to do; or noise.
std::uint16_t value(std::int32_t x, std::int32_t y, std::uint64_t frame, bool noisy) {
    if (noisy)
        return static_cast<std::uint16_t>(
            philox4x32({static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                        static_cast<std::uint32_t>(frame), 0},
                       {1, 1})[0] &
            255u);
    return static_cast<std::uint16_t>((static_cast<std::uint64_t>(y / 4) + frame * 7) & 255u);
}

class Feed {
public:
    Feed(std::string serial, std::int32_t width, std::int32_t height, Compression compression)
        : width_(width),
          height_(height),
          pool_(6, static_cast<std::size_t>(width * height) * 2, static_cast<std::size_t>(height) * 2),
          screen_(static_cast<std::size_t>(width * height)) {
        StimulatorSettings settings;
        settings.serial = std::move(serial);
        settings.white_dn = 255;
        settings.dither = Dither::none;
        settings.compression = compression;
        output_ = std::make_unique<StimulatorOutput>(
            settings, StimulatorContext{.sensor = {width, height, 8}}, make_libusb_bus());
        output_->start();
    }

    bool wait_connected(int seconds = 60) {
        return wait([&] { return output_->status().connected; }, seconds);
    }
    template<typename F>
    bool wait(F condition, int seconds = 60) {
        const std::int64_t end = now_ns() + seconds * ns_per_s;
        while (!condition()) {
            if (now_ns() > end) return false;
            std::this_thread::sleep_for(std::chrono::microseconds(500));
        }
        return true;
    }
    bool settled() {
        const TransportCounters c = output_->counters();
        return c.delivered + c.dropped == c.submitted;
    }

    /// Sends one frame of the given windows; the screen as it must be afterwards is kept.
    bool send(std::uint64_t id, const std::vector<Region>& windows, bool noisy) {
        FrameRef frame = pool_.acquire();
        if (!frame) return false;
        FrameInfo& info = frame->info;
        info.frame_id = id;
        info.bits_per_pixel = 8;
        info.window_count = static_cast<std::uint32_t>(windows.size());
        for (std::size_t i = 0; i < windows.size(); ++i) {
            info.windows[i].sensor = windows[i];
            info.windows[i].image_y = info.height;
            info.height += windows[i].height;
            info.width = std::max(info.width, windows[i].width);
        }
        for (std::size_t i = 0; i < windows.size(); ++i) {
            const Region& w = windows[i];
            for (std::int32_t y = 0; y < w.height; ++y) {
                for (std::int32_t x = 0; x < w.width; ++x) {
                    const std::uint16_t v = value(w.x + x, w.y + y, id, noisy);
                    frame->row(info.windows[i].image_y + y)[static_cast<std::size_t>(x)] = v;
                    screen_[static_cast<std::size_t>((w.y + y) * width_ + w.x + x)] =
                        static_cast<std::uint8_t>(v);
                }
            }
        }
        frame->publish_rows(info.height);
        return output_->submit(frame);
    }
    bool send_whole(std::uint64_t id, bool noisy) { return send(id, {{0, 0, width_, height_}}, noisy); }

    [[nodiscard]] std::uint32_t checksum() const {
        return static_cast<std::uint32_t>(::crc32(0, screen_.data(), static_cast<uInt>(screen_.size())));
    }
    StimulatorOutput& output() { return *output_; }
    [[nodiscard]] std::int32_t width() const { return width_; }
    [[nodiscard]] std::int32_t height() const { return height_; }
    FramePool& pool() { return pool_; }

private:
    std::int32_t width_, height_;
    FramePool pool_;
    std::vector<std::uint8_t> screen_;
    std::unique_ptr<StimulatorOutput> output_;
};

int stream(Feed& feed, const std::string& mode, std::uint64_t frames) {
    if (!feed.wait_connected()) {
        std::puts("no device");
        return 1;
    }
    const std::int64_t begin = now_ns();
    for (std::uint64_t id = 1; id <= frames; ++id) {
        bool taken = false;
        if (mode == "windows" && id > 1) {
            const auto step = static_cast<std::int32_t>(id);
            const std::int32_t w = feed.width(), h = feed.height();
            taken = feed.send(id,
                              {{(step * 13) % (w / 2), (step * 7) % (h / 4), w / 3, h / 5},
                               {(step * 5) % (w / 2), h / 2 + (step * 3) % (h / 4), w / 4, h / 8}},
                              id % 2 == 1);
        } else {
            taken = feed.send_whole(id, mode == "raw");
        }
        if (!taken) {
            std::puts("a frame was not taken");
            return 1;
        }
        // One at a time: this is about the picture, not about speed.
        if (!feed.wait([&] { return feed.settled(); })) {
            std::puts("a frame did not end");
            return 1;
        }
    }
    const double seconds = static_cast<double>(now_ns() - begin) * 1e-9;
    const TransportCounters c = feed.output().counters();
    const bool seen =
        feed.wait([&] { return feed.output().status().device_shown == feed.output().status().updates; }, 3);
    const StimulatorStatus s = feed.output().status();
    fmt::print("sent {} frames, {} updates, {} compressed, {} bytes of {}, {:.1f} frames/s, dropped {}, "
               "shown by the "
               "device {}, screen {:08x}\n",
               c.delivered, s.updates, s.compressed, c.bytes,
               frames * static_cast<std::uint64_t>(feed.width() * feed.height()),
               static_cast<double>(c.delivered) / seconds, c.dropped, s.device_shown, feed.checksum());
    const bool compressed_right = mode == "raw" ? s.compressed == 0 : s.compressed > 0;
    return c.delivered == frames && c.dropped == 0 && s.failed == 0 && seen && compressed_right ? 0 : 1;
}

} // namespace

int main(int argc, char* argv[]) {
    const std::vector<std::string> a(argv + 1, argv + argc);
    int width = 0, height = 0;
    if (a.size() != 4 || std::sscanf(a[1].c_str(), "%dx%d", &width, &height) != 2) return 64;
    Feed feed(a[0], width, height, a[2] == "raw" ? Compression::off : Compression::always);
    const int status = stream(feed, a[2], std::strtoull(a[3].c_str(), nullptr, 10));
    feed.output().stop();
    return status;
}

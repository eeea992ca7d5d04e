// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/camera_series.hpp"

#include "core/error.hpp"
#include "host/command_line.hpp"
#include "host/interrupt.hpp"
#include "tools/scene/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;
using Image = std::vector<std::uint16_t>;

constexpr double exposure_limit_us = 1e7;

class Camera {
public:
    explicit Camera(const CameraSeriesSettings& settings)
        : settings_(settings), receiver_(std::make_unique<Receiver>(settings.receiver)) {
        receiver_->set("TriggerMode", "Off");
        try {
            receiver_->set_flag("AcquisitionFrameRateEnable", false);
        } catch (const HardwareError&) {
            // A camera without this feature runs at the frame rate it is set to.
        }
        if (!settings.pixel_format.empty()) receiver_->set("PixelFormat", settings.pixel_format);
    }

    [[nodiscard]] std::string name() const {
        return fmt::format("{} {} {}", receiver_->get_text("DeviceVendorName"),
                           receiver_->get_text("DeviceModelName"), receiver_->get_text("DeviceSerialNumber"));
    }
    [[nodiscard]] double camera_min_us() const { return receiver_->least("ExposureTime"); }
    [[nodiscard]] int bits() const { return bits_; }
    [[nodiscard]] std::size_t width() const { return width_; }

    /// Receives `count` complete images at `exposure_us` and passes each to `take`.
    void shoot(double exposure_us, int count, const std::function<void(const Image&)>& take) {
        receiver_->set("ExposureTime", exposure_us);
        receiver_->start();
        const double timeout_s = settings_.timeout_s + 3e-6 * exposure_us;
        for (int taken = -1; taken < count;) {
            const std::optional<ReceivedFrame> frame = next(timeout_s);
            if (!frame)
                throw HardwareError(
                    fmt::format("{}: no frame for {:.3g} s", settings_.receiver.address, timeout_s));
            if (!frame->complete) continue;
            if (taken++ < 0) continue;
            const Image image = unpack_pixels(frame->pixel_format,
                                              static_cast<std::size_t>(frame->width) *
                                                  static_cast<std::size_t>(frame->height),
                                              frame->data, bits_);
            width_ = static_cast<std::size_t>(frame->width);
            if (image.empty())
                throw HardwareError(fmt::format("{}: pixel format {:#010x} is not monochrome",
                                                settings_.receiver.address, frame->pixel_format));
            take(image);
        }
        receiver_->stop();
    }
    emva::PairStatistics pairs(double exposure_us, int count) {
        emva::PairStatistics sum;
        Image first;
        shoot(exposure_us, 2 * count, [&](const Image& image) {
            if (first.empty()) {
                first = image;
                return;
            }
            const emva::PairStatistics pair = emva::pair_statistics(first, image);
            sum.mean += pair.mean / count;
            sum.variance += pair.variance / count;
            sum.spatial_variance += pair.spatial_variance / count;
            first.clear();
        });
        return sum;
    }

private:
    std::optional<ReceivedFrame> next(double timeout_s) {
        const auto give_up = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
        while (std::chrono::steady_clock::now() < give_up) {
            if (host::interrupted()) throw HardwareError("interrupted");
            if (auto frame = receiver_->receive(0.1)) return frame;
        }
        return std::nullopt;
    }

    const CameraSeriesSettings settings_;
    std::unique_ptr<Receiver> receiver_;
    int bits_ = 16;
    std::size_t width_ = 0;
};

/// Saturating exposure time in microseconds: doubles it until the mean no longer rises in proportion.
double find_longest(Camera& camera, double min_us) {
    double us = std::max(2 * min_us, 10.0);
    const double floor = camera.pairs(min_us, 1).mean;
    double before = camera.pairs(us, 1).mean;
    while (us < exposure_limit_us / 2) {
        us *= 2;
        const double mean = camera.pairs(us, 1).mean;
        // Saturated: the last increase is less than half of a linear response.
        if (mean > floor + 20 && mean - before < 0.5 * (before - floor)) return 0.75 * us;
        before = mean;
    }
    return us;
}

} // namespace

CameraSeries take_camera_series(const CameraSeriesSettings& settings) {
    Camera camera(settings);
    CameraSeries series;
    series.camera = camera.name();
    const double least = settings.min_us > 0 ? settings.min_us : camera.camera_min_us();
    const double most = settings.max_us > 0 ? settings.max_us : find_longest(camera, least);
    if (!(most > least))
        throw host::UsageError(fmt::format(
            "obscura characterise: the longest exposure time must exceed the shortest, they are {1} us and {0} us",
            least, most));
    Progress progress("characterise", static_cast<std::uint64_t>(settings.levels) + 2);
    for (int i = 0; i < settings.levels; ++i) {
        const double us = least + (most - least) * i / (settings.levels - 1);
        series.levels.push_back({1e-6 * us, camera.pairs(us, settings.pairs)});
        progress.done(static_cast<std::uint64_t>(i) + 1);
    }
    const auto stack = [&](double us, emva::ImageStack& into) {
        camera.shoot(us, settings.stack, [&](const Image& image) {
            if (into.pixels() == 0) into = emva::ImageStack(image.size());
            into.add(image);
        });
    };
    stack(least, series.low);
    series.half_exposure_s = 1e-6 * (least + most) / 2;
    stack((least + most) / 2, series.half);
    series.bits = camera.bits();
    series.width = camera.width();
    return series;
}

} // namespace obscura::tools

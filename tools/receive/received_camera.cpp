// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/received_camera.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::tools {
namespace {

/// Focal length and principal point to 1e-9, which the arithmetic on both sides keeps by far.
bool same(const Intrinsics& a, const Intrinsics& b) {
    const auto near = [](double x, double y) { return std::abs(x - y) <= 1e-9 * (1 + std::abs(y)); };
    for (std::size_t i = 0; i < 2; ++i)
        if (!near(a.focal_length_px[i], b.focal_length_px[i]) ||
            !near(a.principal_point_px[i], b.principal_point_px[i]))
            return false;
    return true;
}

} // namespace

void ReceivedCamera::add(const FrameChunks& chunks, const std::string& file) {
    const std::optional<Region> window =
        chunks.windows.size() == 1 ? std::optional(chunks.windows.front().sensor) : std::nullopt;
    if (frames_.empty())
        window_ = window;
    else
        same_window_ = same_window_ && window == window_;
    frames_.push_back({file, chunks.frame_id, 1e-9 * static_cast<double>(chunks.truth.mid_exposure.ns),
                       1e-6 * chunks.exposure_us, chunks.truth});
}

PictureCamera ReceivedCamera::camera(const std::vector<scene::Camera>& lenses, std::int32_t sensor_width,
                                     std::int32_t sensor_height) const {
    PictureCamera out;
    out.sensor_width = sensor_width, out.sensor_height = sensor_height;
    out.window = window_ && same_window_ ? *window_ : Region{0, 0, sensor_width, sensor_height};
    out.binning = binning_;
    if (frames_.empty()) return out;
    out.intrinsics = frames_.front().truth.intrinsics;
    if (lenses.empty()) return out;
    const auto lens = std::find_if(lenses.begin(), lenses.end(), [&](const scene::Camera& camera) {
        return same(camera.intrinsics(), out.intrinsics);
    });
    if (lens == lenses.end())
        throw InputError(fmt::format(
            "no camera of the configuration has the frames' focal length of {:.9g} px and principal point ({:.9g}, {:.9g}) px, the first has {:.9g} px and ({:.9g}, {:.9g}) px",
            out.intrinsics.focal_length_px[0], out.intrinsics.principal_point_px[0],
            out.intrinsics.principal_point_px[1], lenses.front().intrinsics().focal_length_px[0],
            lenses.front().intrinsics().principal_point_px[0],
            lenses.front().intrinsics().principal_point_px[1]));
    out.lens = *lens;
    return out;
}

} // namespace obscura::tools

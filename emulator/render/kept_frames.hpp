// SPDX-License-Identifier: Apache-2.0
// Light of the last whole frame, of which rows of the next ones can be made.
#pragma once

#include "core/time.hpp"
#include "emulator/render/frame_light.hpp"
#include "renderer/renderer.hpp"

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

namespace obscura::emulator {

/// Two stores of light: one has that of the last frame whose rows were all rendered, the other takes that of
/// the frame in progress. A frame with rows made of another one does not replace it: errors do not add up
/// from frame to frame, and which frame rows are made of follows from the levels alone. Thread-bound;
/// real-time safe after construction.
class KeptFrames {
public:
    using Make = std::function<std::unique_ptr<renderer::ReprojectionSource>()>;
    /// `make`: empty if nothing is kept.
    explicit KeptFrames(const Make& make = {});

    /// Where a frame that is rendered from now on is to keep its light; null: there is no room for it.
    [[nodiscard]] renderer::ReprojectionSource* begin(const FrameLight& light) noexcept;
    /// `frame` has been rendered with what begin() gave it: it is the last whole one if all its rows have
    /// been kept. `error`: FrameQuality::error_rms.
    void accept(const FrameLight& frame, double error) noexcept;

    struct Earlier {
        renderer::ReprojectionSource* light = nullptr; ///< null: there is none
        double error = 0;                              ///< FrameQuality::error_rms
        Time mid{};                                    ///< FrameLight::mid()
    };
    /// The last whole frame, if it can serve `light`: same renderer and windows.
    [[nodiscard]] Earlier earlier(const FrameLight& light) const noexcept;

private:
    std::array<std::unique_ptr<renderer::ReprojectionSource>, 2> kept_;
    std::vector<renderer::KeptWindow> windows_; ///< scratch space
    std::size_t whole_ = 0;                     ///< index of the last whole frame
    double error_ = 0;                          ///< of that
    Time mid_{};
};

} // namespace obscura::emulator

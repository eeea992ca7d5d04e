// SPDX-License-Identifier: Apache-2.0
#include "emulator/kept_frames.hpp"

#include <optional>

namespace obscura::emulator {

KeptFrames::KeptFrames(const Make& make) {
    if (!make) return;
    for (std::unique_ptr<renderer::KeptLight>& kept : kept_)
        kept = make();
}

renderer::KeptLight* KeptFrames::begin(const FrameLight& light) noexcept {
    const std::optional<Region> area = light.area();
    renderer::KeptLight* const kept = kept_[1 - whole_].get();
    if (kept == nullptr || !area) return nullptr;
    kept->begin_frame(*area);
    return kept;
}

void KeptFrames::accept(const FrameLight& frame, double error) noexcept {
    if (frame.keep == nullptr || !frame.keep->complete(*frame.renderer)) return;
    whole_ = frame.keep == kept_[0].get() ? 0 : 1;
    error_ = error;
    mid_ = frame.mid();
}

KeptFrames::Earlier KeptFrames::earlier(const FrameLight& light) const noexcept {
    renderer::KeptLight* const kept = kept_[whole_].get();
    if (kept == nullptr || !kept->complete(*light.renderer) || kept->area() != light.area()) return {};
    return {kept, error_, mid_};
}

} // namespace obscura::emulator

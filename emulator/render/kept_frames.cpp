// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/kept_frames.hpp"

#include <span>

namespace obscura::emulator {

KeptFrames::KeptFrames(const Make& make) {
    if (!make) return;
    for (std::unique_ptr<renderer::ReprojectionSource>& kept : kept_)
        kept = make();
    windows_.reserve(max_windows);
}

renderer::ReprojectionSource* KeptFrames::begin(const FrameLight& light) noexcept {
    renderer::ReprojectionSource* const kept = kept_[1 - whole_].get();
    if (kept == nullptr || light.blocks.empty()) return nullptr;
    windows_.clear();
    for (std::size_t w = 0; w < light.windows.size(); ++w)
        windows_.push_back(light.kept_window(w));
    return kept->begin_frame(windows_) ? kept : nullptr;
}

void KeptFrames::accept(const FrameLight& frame, double error) noexcept {
    if (frame.keep == nullptr || !frame.keep->complete(*frame.renderer)) return;
    whole_ = frame.keep == kept_[0].get() ? 0 : 1;
    error_ = error;
    mid_ = frame.mid();
}

KeptFrames::Earlier KeptFrames::earlier(const FrameLight& light) const noexcept {
    renderer::ReprojectionSource* const kept = kept_[whole_].get();
    if (kept == nullptr || !kept->complete(*light.renderer)) return {};
    const std::span<const renderer::KeptWindow> windows = kept->windows();
    if (windows.size() != light.windows.size()) return {};
    for (std::size_t w = 0; w < windows.size(); ++w)
        if (windows[w] != light.kept_window(w)) return {};
    return {kept, error_, mid_};
}

} // namespace obscura::emulator

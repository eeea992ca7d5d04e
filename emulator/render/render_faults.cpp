// SPDX-License-Identifier: Apache-2.0
#include "emulator/render/render_faults.hpp"

#include <cstring>
#include <exception>

namespace obscura::emulator {

void RenderFaults::note(std::uint64_t frame_id) noexcept {
    failed_frame_.store(frame_id, std::memory_order_release);
    count_.fetch_add(1, std::memory_order_acq_rel);
    Text none = Text::none;
    if (!state_.compare_exchange_strong(none, Text::being_written)) return;
    const auto keep = [this](const char* text) { std::strncpy(text_.data(), text, text_.size() - 1); };
    try {
        throw;
    } catch (const std::exception& error) {
        keep(error.what());
    } catch (...) {
        keep("an exception of an unknown type");
    }
    state_.store(Text::written, std::memory_order_release);
}

bool RenderFaults::take(std::uint64_t frame_id) noexcept {
    return failed_frame_.compare_exchange_strong(frame_id, 0);
}

std::string RenderFaults::take_text() {
    if (state_.load(std::memory_order_acquire) != Text::written) return {};
    std::string text = text_.data();
    state_.store(Text::none, std::memory_order_release);
    return text;
}

bool render_noting(const renderer::Renderer& renderer, const renderer::RenderRequest& request,
                   std::span<float> irradiance, const std::atomic<bool>* cancel, RenderFaults* faults) {
    if (faults == nullptr) return renderer.render(request, irradiance, cancel);
    try {
        return renderer.render(request, irradiance, cancel);
    } catch (...) {
        faults->note(request.frame_id);
        return false;
    }
}

} // namespace obscura::emulator

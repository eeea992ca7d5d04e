// SPDX-License-Identifier: Apache-2.0
// Exceptions of the renderer on real-time threads: counted, and told once, instead of ending the program.
#pragma once

#include "renderer/renderer.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>

namespace obscura::emulator {

/// What the renderer has thrown while frames of one camera were made. Thread-safe.
class RenderFaults {
public:
    /// In a handler of any exception: notes it as one of a frame. Real-time safe but for the exception.
    void note(std::uint64_t frame_id) noexcept;
    /// Whether rendering that frame has failed, once.
    [[nodiscard]] bool take(std::uint64_t frame_id) noexcept;
    [[nodiscard]] std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }
    /// What was thrown first since the last call; empty: nothing was.
    [[nodiscard]] std::string take_text();

private:
    std::atomic<std::uint64_t> count_{0}, failed_frame_{0};
    enum class Text : std::uint8_t { none, being_written, written };
    std::atomic<Text> state_{Text::none};
    std::array<char, 256> text_{}; ///< zero terminated
};

/// As Renderer::render(), but with `faults` what it throws is noted there, and rows may be missing; null: it
/// is passed on. Returns false if it has thrown, too.
bool render_noting(const renderer::Renderer& renderer, const renderer::RenderRequest& request,
                   std::span<float> irradiance, const std::atomic<bool>* cancel, RenderFaults* faults);

} // namespace obscura::emulator

// SPDX-License-Identifier: Apache-2.0
// Times of rows or pixels by a model of kind "timing", for one set of parameters.
#pragma once

#include "core/camera/frame.hpp"
#include "models/kinds/model_parameters.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace obscura::models {

/// What is read after a trigger.
struct TimedFrame {
    std::int32_t rows = 0, columns = 0; ///< of the window, at least 1
    std::int64_t exposure_ns = 0;       ///< as asked for

    bool operator==(const TimedFrame&) const noexcept = default;
};

/// Why a time cannot be.
enum class TimingFault : std::uint8_t { not_finite, before_trigger, no_exposure, too_late };

/// A time that cannot be, s after the trigger.
struct BadTiming {
    TimingFault fault{};
    std::int32_t row = 0, column = 0;
    double reset_s = 0, read_s = 0;
};

/// Times of the pixels of a row together.
struct TimedRow {
    Time first_reset, first_read, last_read;
    std::int64_t min_exposure_ns = 0, max_exposure_ns = 0;
};

/// Immutable; thread-safe. Times are whole nanoseconds after the trigger, rounded.
class TimingProgram {
public:
    /// Latest allowed read.
    static constexpr std::int64_t max_read_ns = 1000 * ns_per_s;

    /// Throws ConfigError `file:line:column: what`.
    TimingProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters);

    /// Whether the pixels of a row have times of their own.
    [[nodiscard]] bool by_pixel() const noexcept { return by_pixel_; }

    /// Times of the rows from `first_row` on; of a model by pixel, those of their middle pixels,
    /// column columns / 2. What cannot be is moved to what can: from the trigger to max_read_ns, at least
    /// 1 ns long. Returns the first such time. Real-time safe.
    std::optional<BadTiming> fill_rows(const TimedFrame& frame, std::int32_t first_row,
                                       std::span<RowTime> rows) const noexcept;
    /// The same for the pixels of a row from `first_column` on. Real-time safe. Places outside the frame have
    /// the times of the nearest one in it.
    std::optional<BadTiming> fill_pixels(const TimedFrame& frame, std::int32_t row, std::int32_t first_column,
                                         std::span<RowTime> pixels) const noexcept;
    /// All pixels of a row. Real-time safe.
    std::optional<BadTiming> sum_up(const TimedFrame& frame, std::int32_t row, TimedRow& all) const noexcept;

    /// One line on a time that cannot be, with the place in the text.
    [[nodiscard]] std::string explain(const BadTiming& bad) const;
    /// The same for the first of a frame; empty: all can be.
    [[nodiscard]] std::string explain(const TimedFrame& frame) const;

    [[nodiscard]] const std::string& why_interpreted() const noexcept { return bound_.why_interpreted; }
    [[nodiscard]] const Program& program() const noexcept { return *bound_.program; }
    /// Place of reset() in the text.
    [[nodiscard]] Place place() const noexcept { return model_->function("reset")->at; }

private:
    /// Times of the places (row + i * row_step, column + i * column_step).
    std::optional<BadTiming> fill(const TimedFrame& frame, RowTime* times, std::size_t count,
                                  std::int32_t row, std::int32_t row_step, std::int32_t column,
                                  std::int32_t column_step) const noexcept;

    std::shared_ptr<const Model> model_;
    BoundProgram bound_;
    bool by_pixel_ = false;
};

} // namespace obscura::models

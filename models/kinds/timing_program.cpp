// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/timing_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace obscura::models {
namespace {

enum TimingInput : std::int32_t { row_input, column_input, exposure_input, rows_input, columns_input };
constexpr std::size_t timing_inputs = 5;
constexpr std::size_t timing_lanes = 128;
static_assert(timing_lanes % Program::lane_step == 0);

std::vector<Value> timing_arguments(Graph& graph, bool by_pixel) {
    std::vector<Value> arguments{scalar_value(graph.input(row_input))};
    if (by_pixel) arguments.push_back(scalar_value(graph.input(column_input)));
    arguments.push_back(scalar_value(graph.input(exposure_input)));
    return arguments;
}

/// Sets `time` to what can be; returns what cannot.
std::optional<TimingFault> set_time(double reset_s, double read_s, RowTime& time) noexcept {
    constexpr auto max_s = static_cast<double>(TimingProgram::max_read_ns) * 1e-9;
    const auto whole_ns = [max_s](double seconds) {
        return std::llround((seconds > 0 ? std::min(seconds, max_s) : 0.0) * 1e9);
    };
    time.reset = Time{std::min<std::int64_t>(whole_ns(reset_s), TimingProgram::max_read_ns - 1)};
    time.read = Time{std::max<std::int64_t>(whole_ns(read_s), time.reset.ns + 1)};
    if (!std::isfinite(reset_s) || !std::isfinite(read_s)) return TimingFault::not_finite;
    if (read_s > max_s) return TimingFault::too_late;
    if (reset_s * 1e9 <= -0.5) return TimingFault::before_trigger;
    if (reset_s > read_s || whole_ns(read_s) <= whole_ns(reset_s)) return TimingFault::no_exposure;
    return {};
}

} // namespace

TimingProgram::TimingProgram(std::shared_ptr<const Model> model, const ModelParameters& parameters)
    : model_(std::move(model)) {
    const Function& reset = *model_->function("reset");
    const Function& read = *model_->function("read");
    if (reset.arguments.size() != read.arguments.size())
        refuse(*model_, read.at, "reset() and read() must have the same arguments");
    by_pixel_ = reset.arguments.size() == 3;
    Graph graph;
    Surroundings surroundings;
    surroundings.constants = {{"rows", scalar_value(graph.input(rows_input))},
                              {"columns", scalar_value(graph.input(columns_input))}};
    std::array<NodeId, 2> outputs{};
    for (const auto& [f, output] : {std::pair{&reset, &outputs[0]}, std::pair{&read, &outputs[1]}})
        *output = lowered(*model_, *f, parameters, timing_inputs, graph, timing_arguments(graph, by_pixel_),
                          surroundings)
                      .nodes[0];
    bound_ = bound_program(*model_, reset.at, graph, outputs, uniform_values(parameters), timing_inputs,
                           parameters.target);
}

std::optional<BadTiming> TimingProgram::fill(const TimedFrame& frame, RowTime* times, std::size_t count,
                                             std::int32_t row, std::int32_t row_step, std::int32_t column,
                                             std::int32_t column_step) const noexcept {
    using Lanes = std::array<double, timing_lanes>;
    std::array<Lanes, timing_inputs> inputs; // NOLINT(cppcoreguidelines-pro-type-member-init)
    std::array<Lanes, 2> outputs;            // NOLINT(cppcoreguidelines-pro-type-member-init)
    inputs[exposure_input].fill(static_cast<double>(frame.exposure_ns) * 1e-9);
    inputs[rows_input].fill(frame.rows);
    inputs[columns_input].fill(frame.columns);
    std::array<const double*, timing_inputs> in{};
    for (std::size_t k = 0; k < in.size(); ++k)
        in[k] = inputs[k].data();
    const std::array<double*, 2> out{outputs[0].data(), outputs[1].data()};
    std::optional<BadTiming> bad;
    for (std::size_t first = 0; first < count; first += timing_lanes) {
        const std::size_t used = std::min(timing_lanes, count - first);
        const std::size_t lanes = (used + Program::lane_step - 1) / Program::lane_step * Program::lane_step;
        for (std::size_t i = 0; i < lanes; ++i) {
            const auto at = static_cast<std::int32_t>(first + std::min(i, used - 1));
            inputs[row_input][i] = std::clamp(row + at * row_step, 0, frame.rows - 1);
            inputs[column_input][i] = std::clamp(column + at * column_step, 0, frame.columns - 1);
        }
        bound_.program->run(bound_.uniforms, in.data(), out.data(), lanes);
        for (std::size_t i = 0; i < used; ++i) {
            const double reset_s = outputs[0][i], read_s = outputs[1][i];
            const auto fault = set_time(reset_s, read_s, times[first + i]);
            if (fault && !bad)
                bad = {*fault, static_cast<std::int32_t>(inputs[row_input][i]),
                       static_cast<std::int32_t>(inputs[column_input][i]), reset_s, read_s};
        }
    }
    return bad;
}

std::optional<BadTiming> TimingProgram::fill_rows(const TimedFrame& frame, std::int32_t first_row,
                                                  std::span<RowTime> rows) const noexcept {
    return fill(frame, rows.data(), rows.size(), first_row, 1, frame.columns / 2, 0);
}

std::optional<BadTiming> TimingProgram::fill_pixels(const TimedFrame& frame, std::int32_t row,
                                                    std::int32_t first_column,
                                                    std::span<RowTime> pixels) const noexcept {
    if (by_pixel_) return fill(frame, pixels.data(), pixels.size(), row, 0, first_column, 1);
    RowTime whole;
    const auto bad = fill(frame, &whole, 1, row, 0, first_column, 0);
    std::fill(pixels.begin(), pixels.end(), whole);
    return bad;
}

std::optional<BadTiming> TimingProgram::sum_up(const TimedFrame& frame, std::int32_t row,
                                               TimedRow& all) const noexcept {
    std::array<RowTime, timing_lanes> times{};
    std::optional<BadTiming> bad;
    const std::int32_t columns = by_pixel_ ? frame.columns : 1;
    for (std::int32_t x = 0; x < columns; x += static_cast<std::int32_t>(timing_lanes)) {
        const std::span some(times.data(), std::min(timing_lanes, static_cast<std::size_t>(columns - x)));
        const auto worse = fill_pixels(frame, row, x, some);
        if (!bad) bad = worse;
        if (x == 0)
            all = {some[0].reset, some[0].read, some[0].read, some[0].exposure_ns(), some[0].exposure_ns()};
        for (const RowTime& t : some) {
            all.first_reset = std::min(all.first_reset, t.reset);
            all.first_read = std::min(all.first_read, t.read);
            all.last_read = std::max(all.last_read, t.read);
            all.min_exposure_ns = std::min(all.min_exposure_ns, t.exposure_ns());
            all.max_exposure_ns = std::max(all.max_exposure_ns, t.exposure_ns());
        }
    }
    return bad;
}

std::string TimingProgram::explain(const BadTiming& bad) const {
    const std::string at =
        by_pixel_ ? fmt::format("row {}, column {}", bad.row, bad.column) : fmt::format("row {}", bad.row);
    const auto said = [&](std::string_view function, std::string_view what) {
        const Place place = model_->function(function)->at;
        return fmt::format("{}:{}:{}: {}() {}", model_->name(), place.line, place.column, function, what);
    };
    switch (bad.fault) {
    case TimingFault::not_finite:
        return std::isfinite(bad.reset_s) ? said("read", fmt::format("is not finite at {}", at))
                                          : said("reset", fmt::format("is not finite at {}", at));
    case TimingFault::before_trigger:
        return said("reset", fmt::format("is {:.6g} s at {}, before the trigger: at least 0 is allowed",
                                         bad.reset_s, at));
    case TimingFault::too_late:
        return said("read", fmt::format("is {:.6g} s after the trigger at {}: at most {:g} s are allowed",
                                        bad.read_s, at, static_cast<double>(max_read_ns) * 1e-9));
    case TimingFault::no_exposure:
        break;
    }
    return said("read",
                fmt::format("is {:.9g} s at {}, and reset() is {:.9g} s: it must be at least 1 ns later",
                            bad.read_s, at, bad.reset_s));
}

std::string TimingProgram::explain(const TimedFrame& frame) const {
    TimedRow all;
    for (std::int32_t row = 0; row < frame.rows; ++row)
        if (const auto bad = sum_up(frame, row, all)) return explain(*bad);
    return "";
}

} // namespace obscura::models

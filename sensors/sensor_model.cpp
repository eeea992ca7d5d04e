// SPDX-License-Identifier: Apache-2.0
#include "sensors/sensor_model.hpp"

#include "core/error.hpp"
#include "models/kinds/sensor_checks.hpp"
#include "sensors/streams.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace obscura::sensors {
namespace {

using models::SensorProgram;
using models::SensorStage;

constexpr std::size_t model_step = models::Program::max_lanes;
/// Largest float below 2^31.
constexpr double max_modelled = 2147483520.0;

/// Values of `results` that differ from what was taken of them.
std::uint32_t replaced_of(const double* results, std::size_t n, double low, double high) noexcept {
    std::uint32_t replaced = 0;
    for (std::size_t i = 0; i < n; ++i)
        replaced += results[i] >= low && results[i] <= high ? 0U : 1U; // NaN is not
    return replaced;
}

using Values = std::array<double, model_step>;

/// Puts `taken` into `out`; whether a bit of it differs from `results`.
bool put(const Values& taken, const Values& results, std::size_t n, float* out) noexcept {
    std::uint64_t other = 0;
    for (std::size_t i = 0; i < n; ++i)
        other |= std::bit_cast<std::uint64_t>(taken[i]) ^ std::bit_cast<std::uint64_t>(results[i]);
    for (std::size_t i = 0; i < n; ++i)
        out[i] = static_cast<float>(taken[i]);
    return other != 0;
}

/// Takes charges over; returns how many were out of 0..2^31.
std::uint32_t take_charges(const Values& results, std::size_t n, float* out) noexcept {
    Values taken;
    for (std::size_t i = 0; i < n; ++i) {
        const double low = results[i] > 0 ? results[i] : 0; // NaN is not
        taken[i] = low < max_modelled ? low : max_modelled;
    }
    return put(taken, results, n, out) ? replaced_of(results.data(), n, 0, max_modelled) : 0;
}

/// Takes digital numbers over; returns how many were not finite.
std::uint32_t take_signals(const Values& results, std::size_t n, float* out) noexcept {
    Values taken;
    for (std::size_t i = 0; i < n; ++i) {
        const double number = results[i] == results[i] ? results[i] : 0;
        const double low = number > -max_modelled ? number : -max_modelled;
        taken[i] = low < max_modelled ? low : max_modelled;
    }
    constexpr double finite = std::numeric_limits<double>::max();
    return put(taken, results, n, out) ? replaced_of(results.data(), n, -finite, finite) : 0;
}

/// 0, 1, 2, ...
constexpr Values steps_right = [] {
    Values steps{};
    for (std::size_t i = 0; i < model_step; ++i)
        steps[i] = static_cast<double>(i);
    return steps;
}();

models::SensorConditions conditions_of(const SensorDescription& d) {
    return {d.detector.full_well_e,  d.detector.gain_dn_per_e, d.detector.offset_dn,
            d.detector.read_noise_e, d.readout.width,          d.readout.height};
}

} // namespace

models::SensorProgram sensor_program(const SensorDescription& d) {
    return {d.model.loaded->model, models::program_parameters(d.model), d.detector.full_well_e};
}

std::string explain_invalid_model(const SensorDescription& d) {
    if (d.model.loaded == nullptr) return {};
    const SensorProgram program = sensor_program(d);
    const bool bent = d.detector.nonlinearity != std::array<double, 4>{};
    if (program.has(SensorStage::collect) && bent)
        return fmt::format(
            "{}: collect() stands in place of full well and non-linearity: set nonlinearity_1 to nonlinearity_4 to 0",
            program.model().name());
    const auto report = report_on(program, conditions_of(d));
    if (const std::string why = refusal_by(report); !why.empty()) {
        const models::Place at = place_of(program, report);
        return fmt::format("{}:{}:{}: {}", program.model().name(), at.line, at.column, why);
    }
    return {};
}

std::vector<std::string> sensor_model_warnings(const SensorDescription& d) {
    std::vector<std::string> lines;
    if (d.model.loaded == nullptr) return lines;
    const SensorProgram program = sensor_program(d);
    for (const std::string& line : warnings_by(report_on(program, conditions_of(d))))
        lines.push_back(fmt::format("sensor: {}: {}", program.model().name(), line));
    if (const std::string& text = program.model().warnings(); !text.empty()) lines.push_back(text);
    return lines;
}

SensorModel::SensorModel(const SensorDescription& description) : program_(sensor_program(description)) {
    if (const std::string why = explain_invalid_model(description); !why.empty()) throw ConfigError(why);
    for (const SensorStage stage : models::sensor_stages) {
        if (!has(stage)) continue;
        const auto k = static_cast<std::size_t>(stage);
        uses_x_[k] = program_.program(stage).uses_input(SensorProgram::x);
        uses_y_[k] = program_.program(stage).uses_input(SensorProgram::y);
    }
}

void SensorModel::fill_normals(SensorStage stage, const ModelledRow& row, std::size_t first, std::size_t n,
                               double* const* out) const noexcept {
    std::array<std::array<float, model_step + kernels::padding>, 2> pair;
    const auto normals = static_cast<std::size_t>(program_.normals(stage));
    for (std::size_t k = 0; k < normals; k += 2) {
        // Windows take the lower half of the layer.
        const auto draw = static_cast<std::uint32_t>(
            static_cast<std::size_t>(stage) * (SensorProgram::max_normals / 2) + k / 2);
        kernels::normal_row(n,
                            stream_of(Effect::model, row.noise_key, row.frame,
                                      row.first_pixel + static_cast<std::uint32_t>(first), row.read,
                                      row.layer | draw << 8),
                            pair[0].data(), pair[1].data());
        for (std::size_t half = 0; half < 2 && k + half < normals; ++half)
            std::copy_n(pair[half].begin(), n, out[k + half]);
    }
}

std::uint32_t SensorModel::apply(SensorStage stage, const ModelledRow& row, const float* in, std::size_t n,
                                 float* out) const noexcept {
    const auto index = static_cast<std::size_t>(stage);
    std::array<Values, SensorProgram::max_inputs> inputs;
    std::array<const double*, SensorProgram::max_inputs> pointers;
    std::array<double*, SensorProgram::max_normals> normals;
    Values results;
    for (std::size_t k = 0; k < inputs.size(); ++k)
        pointers[k] = inputs[k].data();
    for (std::size_t k = 0; k < normals.size(); ++k)
        normals[k] = inputs[SensorProgram::first_normal + k].data();
    const auto used = static_cast<std::size_t>(SensorProgram::first_normal + program_.normals(stage));
    inputs[SensorProgram::y].fill(uses_y_[index] ? row.row : 0);
    std::uint32_t replaced = 0;
    for (std::size_t first = 0; first < n; first += model_step) {
        const std::size_t count = std::min(model_step, n - first);
        constexpr std::size_t step = models::Program::lane_step;
        const std::size_t lanes = (count + step - 1) / step * step;
        Values& value = inputs[SensorProgram::value];
        for (std::size_t i = 0; i < count; ++i)
            value[i] = static_cast<double>(in[first + i]);
        if (uses_x_[index]) {
            const double column = row.column + static_cast<double>(first);
            for (std::size_t i = 0; i < count; ++i)
                inputs[SensorProgram::x][i] = column + steps_right[i];
        }
        if (program_.normals(stage) > 0) fill_normals(stage, row, first, count, normals.data());
        if (count < lanes)
            for (std::size_t k = 0; k < used; ++k)
                std::fill(inputs[k].begin() + static_cast<std::ptrdiff_t>(count),
                          inputs[k].begin() + static_cast<std::ptrdiff_t>(lanes), 0.0);
        program_.run(stage, pointers, results.data(), lanes);
        replaced += stage == SensorStage::convert ? take_signals(results, count, out + first)
                                                  : take_charges(results, count, out + first);
    }
    return replaced;
}

} // namespace obscura::sensors

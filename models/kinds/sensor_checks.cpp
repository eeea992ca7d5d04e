// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/sensor_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace obscura::models {
namespace {

constexpr std::size_t checked_values = 2048;
static_assert(checked_values % Program::lane_step == 0);

/// Rising inputs: evenly spaced, and a quarter of them closer and closer towards the lower end.
std::vector<double> inputs_of(SensorStage stage, const SensorConditions& c) {
    const bool dn = stage == SensorStage::convert;
    const double from = dn ? c.black_dn - 6 * c.noise_e * c.gain_dn_per_e : 0;
    const double to = (dn ? c.black_dn : 0) + checked_wells * c.full_well_e * (dn ? c.gain_dn_per_e : 1);
    constexpr std::size_t close = checked_values / 4;
    std::vector<double> values{from};
    for (std::size_t i = 1; i < checked_values - close; ++i)
        values.push_back(from + (to - from) * static_cast<double>(i) / (checked_values - close - 1));
    for (std::size_t i = 0; i < close; ++i)
        values.push_back(from + (to - from) * std::pow(10.0, -8 * (static_cast<double>(i) + 0.5) / close));
    std::sort(values.begin(), values.end());
    return values;
}

/// Notes what `results` say of one pixel; `drawn`: with draws.
void note(SensorStageReport& report, const std::vector<double>& inputs, const std::vector<double>& results,
          int x, int y, bool drawn) {
    const double slack = 1e-9 * inputs.back();
    double highest = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const SensorValue here{inputs[i], results[i], x, y};
        if (!std::isfinite(results[i])) {
            if (!report.not_finite) report.not_finite = here;
            continue;
        }
        if (report.stage != SensorStage::convert && results[i] < 0 &&
            (!report.negative || results[i] < report.negative->result))
            report.negative = here;
        if (drawn) continue;
        const double more = results[i] - inputs[i];
        if (report.stage == SensorStage::collect && more > slack &&
            (!report.gain || more > report.gain->result - report.gain->input))
            report.gain = here;
        if (highest - results[i] > slack &&
            (!report.fall || highest - results[i] > report.before - report.fall->result)) {
            report.fall = here;
            report.before = highest;
        }
        highest = std::max(highest, results[i]);
    }
}

std::string_view unit_of(SensorStage stage) {
    return stage == SensorStage::convert ? "DN" : "e-";
}

std::string input_text(const SensorValue& v, SensorStage stage) {
    return fmt::format("for {:.6g} {} in pixel ({}, {})", v.input, unit_of(stage), v.x, v.y);
}

} // namespace

std::vector<SensorStageReport> report_on(const SensorProgram& sensor, const SensorConditions& c) {
    std::vector<SensorStageReport> reports;
    for (const SensorStage stage : sensor_stages) {
        if (!sensor.has(stage)) continue;
        SensorStageReport report{stage};
        const std::vector<double> inputs = inputs_of(stage, c);
        std::vector<double> x(checked_values), y(checked_values), draw(checked_values),
            results(checked_values);
        std::array<const double*, SensorProgram::max_inputs> from{inputs.data(), x.data(), y.data()};
        std::fill(from.begin() + SensorProgram::first_normal, from.end(), draw.data());
        for (const double sigma : {0.0, 4.0, -4.0}) {
            if (sigma != 0 && sensor.normals(stage) == 0) break;
            std::fill(draw.begin(), draw.end(), sigma);
            for (const int row : {0, c.height / 2, c.height - 1})
                for (const int column : {0, c.width / 2, c.width - 1}) {
                    std::fill(x.begin(), x.end(), column);
                    std::fill(y.begin(), y.end(), row);
                    sensor.run(stage, from, results.data(), checked_values);
                    note(report, inputs, results, column, row, sigma != 0);
                }
        }
        reports.push_back(report);
    }
    return reports;
}

Place place_of(const SensorProgram& sensor, const std::vector<SensorStageReport>& report) {
    for (const SensorStageReport& r : report)
        if (r.not_finite) return sensor.at(r.stage);
    for (const SensorStageReport& r : report)
        if (r.negative || r.gain || r.fall) return sensor.at(r.stage);
    return sensor.at(SensorStage::light);
}

std::string refusal_by(const std::vector<SensorStageReport>& report) {
    for (const SensorStageReport& r : report)
        if (r.not_finite)
            return fmt::format("{}() is not finite {}", SensorProgram::name_of(r.stage),
                               input_text(*r.not_finite, r.stage));
    return {};
}

std::vector<std::string> warnings_by(const std::vector<SensorStageReport>& report) {
    std::vector<std::string> lines;
    for (const SensorStageReport& r : report) {
        const std::string_view name = SensorProgram::name_of(r.stage), unit = unit_of(r.stage);
        if (r.negative)
            lines.push_back(fmt::format("{}() is negative {}: {:.4g} {}, which counts as 0", name,
                                        input_text(*r.negative, r.stage), r.negative->result, unit));
        if (r.gain)
            lines.push_back(fmt::format("{}() gives more charge than comes in {}: {:.6g} {}", name,
                                        input_text(*r.gain, r.stage), r.gain->result, unit));
        if (r.fall)
            lines.push_back(fmt::format("{}() falls from {:.6g} to {:.6g} {} {}", name, r.before,
                                        r.fall->result, unit, input_text(*r.fall, r.stage)));
    }
    return lines;
}

} // namespace obscura::models

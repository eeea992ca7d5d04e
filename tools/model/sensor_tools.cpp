// SPDX-License-Identifier: Apache-2.0
#include "tools/model/sensor_tools.hpp"

#include "images/writers/raw.hpp"
#include "models/kinds/sensor_checks.hpp"
#include "models/kinds/sensor_program.hpp"
#include "sensors/kernels.hpp"
#include "sensors/sensor_model.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

using models::SensorProgram;
using models::SensorStage;

constexpr std::string_view new_sensor = R"(// {0}: a response of pixels in SuMoL.
//
//   obscura model check {0}.sns            is it sound?
//   obscura model plot {0}.sns -o {0}.svg  transfer curve and photon transfer
//
// In a configuration or sensor file, beside it:
//   [sensor]
//   model = {{ model = "{0}.sns", knee = 30000 }}

// A parameter is a key of the sensor. Its comment gives unit, range and meaning.
parameter knee 35000;   //! e-, 1..1e7, Charge from which less and less is collected
parameter extra 8000;   //! e-, 1..1e7, Charge that is collected beyond the knee at most

// Charge that is kept of a charge, e-: in place of full well and non-linearity.
//   x, y  column and row of the pixel on the array
// All numbers are real: 1 / 2 is 0.5. `full_well` is that of the sensor, e-. normal(0) to normal(7) are draws of a
// standard normal distribution, of their own in each pixel and read.
scalar collect(scalar charge, scalar x, scalar y)
{{
    scalar beyond = max(charge - knee, 0);
    return min(charge, knee) + extra * (1 - exp(-beyond / extra));
}}

// More functions, if you want them:
//   scalar light(scalar mean, scalar x, scalar y)      expected charge before shot noise, e-
//   scalar convert(scalar signal, scalar x, scalar y)  signal before the converter, DN
)";

SensorProgram sensor_of(const models::ModelValues& p) {
    return {p.loaded->model, models::program_parameters(p), models::SensorConditions{}.full_well_e};
}

ModelCost sensor_cost(const models::ModelValues& p) {
    const SensorProgram sensor = sensor_of(p);
    ModelCost cost;
    for (const SensorStage stage : models::sensor_stages) {
        if (!sensor.has(stage)) continue;
        const ModelCost one = cost_of(sensor.program(stage), sensor.why_interpreted(stage));
        const std::string name(SensorProgram::name_of(stage));
        cost.operations += one.operations;
        cost.slots = std::max(cost.slots, one.slots);
        if (cost.why_interpreted.empty()) cost.why_interpreted = one.why_interpreted;
        cost.listing.insert(cost.listing.end(), one.listing.begin(), one.listing.end());
        cost.ns += one.ns;
        cost.facts.push_back({name,
                              fmt::format("{} operations, {} draws", one.operations, sensor.normals(stage)),
                              name + "_operations", one.operations});
    }
    return cost;
}

ModelVerdict sensor_check(const models::ModelValues& p) {
    const SensorProgram sensor = sensor_of(p);
    const models::SensorConditions conditions;
    const auto report = report_on(sensor, conditions);
    return {place_of(sensor, report), refusal_by(report), warnings_by(report),
            fmt::format("{} operations a pixel, up to {:g} full wells of {:g} e-", sensor_cost(p).operations,
                        models::checked_wells, conditions.full_well_e)};
}

/// What a stage gives for one value of a pixel; the value itself where the model does not have it.
double stage_value(const SensorProgram& sensor, SensorStage stage, double value, double x, double y,
                   double normal) {
    if (!sensor.has(stage)) return value;
    constexpr std::size_t lanes = models::Program::lane_step;
    std::array<std::array<double, lanes>, 4> rows{};
    rows[SensorProgram::value].fill(value);
    rows[SensorProgram::x].fill(x);
    rows[SensorProgram::y].fill(y);
    rows[SensorProgram::first_normal].fill(normal);
    std::array<const double*, SensorProgram::max_inputs> inputs;
    inputs.fill(rows[SensorProgram::first_normal].data());
    for (std::size_t k = 0; k < SensorProgram::first_normal; ++k)
        inputs[k] = rows[k].data();
    std::array<double, lanes> results{};
    sensor.run(stage, inputs, results.data(), lanes);
    return results[0];
}

ModelFacts sensor_eval(const models::ModelValues& p, const ModelPoint& at) {
    const SensorProgram sensor = sensor_of(p);
    ModelFacts facts;
    for (const SensorStage stage : models::sensor_stages) {
        if (!sensor.has(stage)) continue;
        const bool dn = stage == SensorStage::convert;
        const double value = stage_value(sensor, stage, at.at(dn ? "signal" : "charge"), at.at("x"),
                                         at.at("y"), at.at("normal"));
        const std::string name(SensorProgram::name_of(stage));
        facts.push_back(
            {name, fmt::format("{:.12g} {}", value, dn ? "DN" : "e-"), name + (dn ? "_dn" : "_e"), value});
    }
    return facts;
}

/// Mean and variance of a value.
struct Moments {
    double mean = 0, variance = 0;
};

/// Moments behind a stage of a normally distributed value.
Moments behind(const SensorProgram& sensor, SensorStage stage, Moments before) {
    if (!sensor.has(stage)) return before;
    constexpr int points = 256;
    constexpr double reach = 6; // sigma
    const double sigma = std::sqrt(before.variance);
    Moments after;
    double weights = 0, squares = 0;
    for (int i = 0; i < points; ++i) {
        const double z = reach * (2 * (i + 0.5) / points - 1);
        const double value = before.mean + sigma * z;
        const bool charge = stage != SensorStage::convert;
        const double result = stage_value(sensor, stage, charge ? std::max(0.0, value) : value, 0, 0, 0);
        const double weight = std::exp(-z * z / 2);
        weights += weight;
        after.mean += weight * result;
        squares += weight * result * result;
    }
    after.mean /= weights;
    after.variance = std::max(0.0, squares / weights - after.mean * after.mean);
    return after;
}

/// One exposure of the sensor of SensorConditions.
struct TransferPoint {
    double mean_e = 0;
    Moments kept_e, signal_dn;
};

std::vector<TransferPoint> transfer_of(const SensorProgram& sensor) {
    const models::SensorConditions c;
    const double most = models::checked_wells * c.full_well_e;
    constexpr int points = 200;
    std::vector<TransferPoint> curve;
    for (int i = 0; i <= points; ++i) {
        TransferPoint point;
        point.mean_e = most * std::pow(10.0, -4.0 * (points - i) / points);
        const double light = stage_value(sensor, SensorStage::light, point.mean_e, 0, 0, 0);
        point.kept_e = behind(sensor, SensorStage::collect, {light, light});
        if (!sensor.has(SensorStage::collect) && light > c.full_well_e) point.kept_e = {c.full_well_e, 0};
        const double k = c.gain_dn_per_e;
        point.signal_dn = behind(
            sensor, SensorStage::convert,
            {point.kept_e.mean * k + c.black_dn, (point.kept_e.variance + c.noise_e * c.noise_e) * k * k});
        curve.push_back(point);
    }
    return curve;
}

void sensor_plot(const models::ModelValues& p, std::string_view title, const std::filesystem::path& file) {
    const std::vector<TransferPoint> curve = transfer_of(sensor_of(p));
    if (file.extension() == ".csv") {
        std::string text = "mean_e,kept_e,kept_variance_e2,signal_dn,signal_variance_dn2\n";
        for (const TransferPoint& point : curve)
            fmt::format_to(std::back_inserter(text), "{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n",
                           point.mean_e, point.kept_e.mean, point.kept_e.variance, point.signal_dn.mean,
                           point.signal_dn.variance);
        images::write_text(file, text);
        return;
    }
    const double black = models::SensorConditions{}.black_dn;
    Plot transfer, photon;
    transfer.title = fmt::format("{}: transfer curve", title);
    transfer.x_label = "expected charge, e-";
    transfer.y_label = "signal, DN";
    photon.title = fmt::format("{}: photon transfer", title);
    photon.x_label = "signal above black, DN";
    photon.y_label = "variance, DN2";
    photon.log_x = photon.log_y = true;
    PlotSeries signal, variance;
    signal.drawn = variance.drawn = Drawn::line;
    for (const TransferPoint& point : curve) {
        signal.points.emplace_back(point.mean_e, point.signal_dn.mean);
        variance.points.emplace_back(point.signal_dn.mean - black, point.signal_dn.variance);
    }
    transfer.series.push_back(std::move(signal));
    photon.series.push_back(std::move(variance));
    images::write_text(file, svg(std::vector{std::move(transfer), std::move(photon)}));
}

ModelFacts sensor_bench(const models::ModelValues& p) {
    constexpr std::size_t pixels = 1024;
    const auto fact = [](std::string label, std::string name, double ns) {
        return ModelFact{std::move(label), fmt::format("{:8.2f}", ns), std::move(name), ns};
    };
    SensorDescription description;
    description.model = p;
    const sensors::SensorModel model(description);
    std::vector<float> in(pixels + sensors::kernels::padding), out(in.size()), z0(in.size()), z1(in.size()),
        scratch(4 * in.size());
    for (std::size_t i = 0; i < pixels; ++i)
        in[i] = static_cast<float>(60.0 * static_cast<double>(i));
    ModelFacts facts{fact("", "model_ns", nanoseconds_a_sample(pixels, [&] {
                              for (const SensorStage stage : models::sensor_stages)
                                  if (model.has(stage))
                                      (void)model.apply(stage, {}, in.data(), pixels, out.data());
                          }))};
    sensors::kernels::Chain chain;
    chain.full_well_e = 50'000;
    chain.inverse_full_well = 1 / chain.full_well_e;
    chain.nonlinearity[0] = 0.01F;
    facts.push_back(fact("built-in full well and non-linearity", "collect", nanoseconds_a_sample(pixels, [&] {
                             sensors::kernels::collect_row(chain, pixels, in.data());
                         })));
    facts.push_back(fact("built-in shot noise", "shot_noise", nanoseconds_a_sample(pixels, [&] {
                             sensors::kernels::poisson_row(in.data(), pixels, {}, out.data(), z0.data(),
                                                           z1.data(), scratch.data());
                         })));
    return facts;
}

} // namespace

const KindTools& sensor_tools() {
    static const KindTools tools{
        "sensor",
        new_sensor,
        sensor_cost,
        sensor_check,
        {{"charge", "e-", "Expected charge of light(), charge of collect()", 10'000, 0, 1e9},
         {"signal", "DN", "Signal of convert()", 1000, -1e6, 1e9},
         {"x", "px", "Column of the pixel on the array", 0, 0, 1e6},
         {"y", "px", "Row of the pixel on the array", 0, 0, 1e6},
         {"normal", "", "Value of all draws", 0, -100, 100}},
        sensor_eval,
        {{".svg",
          "transfer curve and photon transfer of a sensor with 50,000 e-, 0.08 DN/e- and 8 e- of noise"},
         {".csv", "a table of them"}},
        sensor_plot,
        sensor_bench};
    return tools;
}

} // namespace obscura::tools

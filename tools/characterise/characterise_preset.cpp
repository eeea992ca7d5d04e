// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/characterise_preset.hpp"

#include "core/error.hpp"
#include "sensors/dark_current.hpp"
#include "tools/characterise/laboratory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;

template<class Values>
double deviation(const Values& values) {
    double mean = 0, squares = 0;
    for (const auto v : values)
        mean += static_cast<double>(v);
    mean /= static_cast<double>(values.size());
    for (const auto v : values)
        squares += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
    return std::sqrt(squares / static_cast<double>(values.size()));
}
template<class Values>
double average(const Values& values) {
    double sum = 0;
    for (const auto v : values)
        sum += static_cast<double>(v);
    return sum / static_cast<double>(values.size());
}

} // namespace

Characterisation characterise_preset(const SensorDescription& description, double wavelength_m) {
    Laboratory bench(description, wavelength_m);
    const DetectorSettings& d = bench.sensor().detector;
    Characterisation result;
    result.subject = fmt::format("{}, {:.0f} nm, {:.1f} degC, simulated series", description.name,
                                 wavelength_m * 1e9, d.temperature_c);

    // Measure photon transfer: levels of light at one exposure time.
    bench.set_exposure(0.01);
    const double full_photons = bench.saturation_e() / bench.true_quantum_efficiency();
    std::vector<emva::Level> levels;
    const emva::PairStatistics dark = bench.pair(0);
    std::vector<double> fractions;
    for (int i = 1; i <= 48; ++i)
        fractions.push_back(0.02 * i);
    for (const double f : {0.98, 1.0, 1.02, 1.05, 1.1, 1.2})
        fractions.push_back(f);
    for (const double f : fractions)
        levels.push_back({f * full_photons, bench.pair(f * full_photons), dark});
    emva::LinearModel m;
    try {
        m = emva::evaluate(levels, emva::Method::full_well);
    } catch (const std::invalid_argument& error) {
        throw ConfigError(fmt::format("{}: {}", description.name, error.what()));
    }
    result.notes.push_back(
        fmt::format("K and R were fitted over {:.0f} % of the saturation.", 100 * m.fit_range));

    result.add_condition("Sensor", fmt::format("{}, {} x {} pixels", description.name,
                                               description.readout.width, description.readout.height));
    result.add_condition("Images", fmt::format("simulated, {} x {} pixels from the centre",
                                               bench.region().width, bench.region().height));
    result.add_condition("Light", fmt::format("{:.0f} nm, uniform, constant exposure time, varied irradiance",
                                              wavelength_m * 1e9));
    result.add_condition("Temperature", fmt::format("{:.1f} degC", d.temperature_c));
    result.add_condition("Exposure time", fmt::format("{:.4g} ms", 1e3 * bench.exposure_s()));
    result.add_condition("Bit depth", fmt::format("{} bit", d.adc_bits));
    result.add_condition("Levels", fmt::format("{}, up to {:.4g} photons per pixel, a pair of images each",
                                               levels.size(), levels.back().photons));
    result.add_condition("Left out",
                         "particle hits, RTS noise and defective pixels, which a laboratory masks");

    // Measure temporal dark noise, at a gain at which it exceeds the quantisation noise of the ADC.
    double gain_db = 0;
    bench.set_exposure(1e-9);
    emva::PairStatistics noise = bench.pair(0);
    while (noise.variance < 2 && gain_db < 36) {
        gain_db += 6;
        noise = bench.pair(0, gain_db);
    }
    if (gain_db > 0)
        result.notes.push_back(
            fmt::format("Dark noise and DSNU were measured at {:.0f} dB of gain.", gain_db));
    const double dark_gain = m.gain_dn_per_e * std::pow(10.0, gain_db / 20);
    const emva::DarkNoise dark_noise = emva::dark_noise(noise.variance, dark_gain);
    const double samples = d.double_sampling ? 2 : 1;
    const double reset_e = sensors::reset_noise_e(d);
    const double ratio = sensors::dark_current_ratio(d, d.temperature_c, d.dark_reference_c);
    const double true_noise =
        std::sqrt(samples * (d.read_noise_e * d.read_noise_e + reset_e * reset_e) +
                  d.row_noise_e * d.row_noise_e + d.dark_current_e_per_s * ratio * bench.exposure_s());

    // Measure DSNU and PRNU from stacks of images.
    constexpr int stack = 16;
    bench.set_exposure(0.01);
    const auto pixels = bench.shoot(0).size();
    std::vector<float> dark_mean, bright_mean;
    emva::ImageStack dark_stack(pixels), dark_stack_0(pixels), bright_stack(pixels);
    const double photons = (m.fit_range < 0.5 ? 0.2 : 0.5) * full_photons;
    for (int i = 0; i < stack; ++i) {
        dark_stack.add(bench.shoot(0, gain_db, &dark_mean));
        dark_stack_0.add(bench.shoot(0));
        bright_stack.add(bench.shoot(photons, 0, &bright_mean));
    }
    const double dsnu_e = std::sqrt(std::max(0.0, dark_stack.spatial_variance())) / dark_gain;
    std::vector<double> true_dark = bench.true_offsets(), true_bright(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        true_dark[i] += static_cast<double>(dark_mean[i]);
        true_bright[i] = static_cast<double>(bright_mean[i]) - static_cast<double>(dark_mean[i]);
    }
    const double prnu =
        std::sqrt(std::max(0.0, bright_stack.spatial_variance() - dark_stack_0.spatial_variance())) /
        (bright_stack.mean() - dark_stack_0.mean());

    // Measure dark current: slope of the mean against exposure time.
    const double current = std::max(d.dark_current_e_per_s * ratio, 1e-3);
    const double longest = std::clamp(2000 / current, 0.05, 100.0);
    std::vector<double> times, means, electrons;
    for (int i = 1; i <= 6; ++i) {
        bench.set_exposure(longest * i / 6);
        std::vector<float> truth;
        const Laboratory::Image image = bench.shoot(0, 0, &truth);
        times.push_back(bench.exposure_s());
        means.push_back((average(image) + average(bench.shoot(0))) / 2);
        electrons.push_back(average(truth));
    }

    const auto add = [&](std::string name, double measured, std::optional<double> truth, std::string unit,
                         double tolerance) -> Parameter& {
        // A parameter that the model sets to zero cannot be compared relatively.
        if (truth && !(*truth > 0)) truth.reset();
        result.parameters.push_back({std::move(name), measured, truth, std::move(unit), tolerance, false});
        return result.parameters.back();
    };
    add("gain", m.gain_dn_per_e, d.gain_dn_per_e, "DN/e-", 0.01);
    add("quantum_efficiency", m.quantum_efficiency, bench.true_quantum_efficiency(), "", 0.02);
    add("responsivity", m.responsivity_dn_per_photon, d.gain_dn_per_e * bench.true_quantum_efficiency(),
        "DN/photon", 0.01);
    add("dark_noise", dark_noise.electrons, true_noise, "e-", 0.02).upper_limit = dark_noise.upper_limit;
    add("saturation", m.saturation_e, bench.saturation_e(), "e-", 0.01);
    add("snr_max", m.snr_max_db, 10 * std::log10(bench.saturation_e()), "dB", 0.01);
    add("dynamic_range", m.dynamic_range_db, {}, "dB", 0);
    add("threshold", m.threshold_photons, {}, "photons", 0).upper_limit = m.dark_noise.upper_limit;
    add("linearity_error", m.linearity_error_percent, {}, "%", 0);
    add("dsnu", dsnu_e, deviation(true_dark), "e-", 0.03);
    add("prnu", 100 * prnu, 100 * deviation(true_bright) / average(true_bright), "%", 0.03);
    add("dark_current", emva::fit_line(times, means).slope / m.gain_dn_per_e,
        emva::fit_line(times, electrons).slope, "e-/s", 0.03);

    std::vector<double> dark_values(pixels), bright_values(pixels);
    const double dark_level = dark_stack.mean(), response = bright_stack.mean() - dark_stack_0.mean();
    for (std::size_t i = 0; i < pixels; ++i) {
        dark_values[i] = (dark_stack.pixel(i) - dark_level) / dark_gain;
        bright_values[i] = 100 * ((bright_stack.pixel(i) - dark_stack_0.pixel(i)) / response - 1);
    }
    const auto columns = static_cast<std::size_t>(bench.region().width);
    add_nonuniformity_parts("dsnu", dark_stack.spatial_parts(columns), 1 / dark_gain, "e-", result);
    add_nonuniformity_parts("prnu", bright_stack.spatial_parts(columns) - dark_stack_0.spatial_parts(columns),
                            100 / response, "%", result);
    // Temporal noise that is left in the mean of a stack.
    const double left = 1 / std::sqrt(static_cast<double>(stack));
    const double dark_left = std::sqrt(std::max(0.0, dark_stack.temporal_variance())) * left / dark_gain;
    const double bright_left =
        100 * std::sqrt(std::max(0.0, bright_stack.temporal_variance() + dark_stack_0.temporal_variance())) *
        left / response;
    result.add_condition("Stacks", fmt::format("{} images each, dark and at {:.0f} % of saturation", stack,
                                               100 * photons / full_photons));
    add_pattern_plots({"DSNU", dark_values, columns, "e-", dark_left}, result);
    add_pattern_plots({"PRNU", bright_values, columns, "%", bright_left}, result);
    add_series_plots(levels, m, {dsnu_e, prnu}, result);
    return result;
}

} // namespace obscura::tools

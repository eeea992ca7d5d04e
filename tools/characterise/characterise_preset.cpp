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

/// Images of a stack.
constexpr int stack_images = 16;

/// Levels of light at one exposure time.
struct PhotonTransfer {
    double full_photons = 0;
    std::vector<emva::Level> levels{};
    emva::LinearModel model{};
};

PhotonTransfer measure_transfer(Laboratory& bench, const std::string& name) {
    PhotonTransfer transfer;
    bench.set_exposure(0.01);
    transfer.full_photons = bench.saturation_e() / bench.true_quantum_efficiency();
    const emva::PairStatistics dark = bench.pair(0);
    std::vector<double> fractions;
    for (int i = 1; i <= 48; ++i)
        fractions.push_back(0.02 * i);
    for (const double f : {0.98, 1.0, 1.02, 1.05, 1.1, 1.2})
        fractions.push_back(f);
    for (const double f : fractions)
        transfer.levels.push_back({f * transfer.full_photons, bench.pair(f * transfer.full_photons), dark});
    try {
        transfer.model = emva::evaluate(transfer.levels, emva::Method::full_well);
    } catch (const std::invalid_argument& error) {
        throw ConfigError(fmt::format("{}: {}", name, error.what()));
    }
    return transfer;
}

void add_conditions(const SensorDescription& description, double wavelength_m, const Laboratory& bench,
                    const PhotonTransfer& transfer, Characterisation& result) {
    const DetectorSettings& d = bench.sensor().detector;
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
                                               transfer.levels.size(), transfer.levels.back().photons));
    result.add_condition("Left out",
                         "particle hits, RTS noise and defective pixels, which a laboratory masks");
}

/// Temporal noise in the dark, at a gain at which it exceeds the quantisation noise of the ADC.
struct DarkNoise {
    double gain_db = 0, gain_dn_per_e = 0;
    emva::DarkNoise noise{};
    double truth_e = 0;
};

DarkNoise measure_dark_noise(Laboratory& bench, double gain_dn_per_e) {
    const DetectorSettings& d = bench.sensor().detector;
    DarkNoise dark;
    double& gain_db = dark.gain_db;
    bench.set_exposure(1e-9);
    emva::PairStatistics noise = bench.pair(0);
    while (noise.variance < 2 && gain_db < 36) {
        gain_db += 6;
        noise = bench.pair(0, gain_db);
    }
    dark.gain_dn_per_e = gain_dn_per_e * std::pow(10.0, gain_db / 20);
    dark.noise = emva::dark_noise(noise.variance, dark.gain_dn_per_e);
    const double samples = d.double_sampling ? 2 : 1;
    const double reset_e = sensors::reset_noise_e(d);
    const double ratio = sensors::dark_current_ratio(d, d.temperature_c, d.dark_reference_c);
    dark.truth_e =
        std::sqrt(samples * (d.read_noise_e * d.read_noise_e + reset_e * reset_e) +
                  d.row_noise_e * d.row_noise_e + d.dark_current_e_per_s * ratio * bench.exposure_s());
    return dark;
}

/// DSNU and PRNU, from stacks of images.
struct Stacks {
    emva::ImageStack dark, dark_0, bright; ///< dark_0: at 0 dB
    double photons = 0;                    ///< of the bright one
    double dsnu_e = 0, prnu = 0;
    std::vector<double> true_dark{}, true_bright{};
};

Stacks measure_stacks(Laboratory& bench, const PhotonTransfer& transfer, const DarkNoise& dark) {
    bench.set_exposure(0.01);
    const std::size_t pixels = bench.shoot(0).size();
    std::vector<float> dark_mean, bright_mean;
    Stacks stacks{emva::ImageStack(pixels), emva::ImageStack(pixels), emva::ImageStack(pixels)};
    stacks.photons = (transfer.model.fit_range < 0.5 ? 0.2 : 0.5) * transfer.full_photons;
    for (int i = 0; i < stack_images; ++i) {
        stacks.dark.add(bench.shoot(0, dark.gain_db, &dark_mean));
        stacks.dark_0.add(bench.shoot(0));
        stacks.bright.add(bench.shoot(stacks.photons, 0, &bright_mean));
    }
    stacks.dsnu_e = std::sqrt(std::max(0.0, stacks.dark.spatial_variance())) / dark.gain_dn_per_e;
    stacks.true_dark = bench.true_offsets();
    stacks.true_bright.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        stacks.true_dark[i] += static_cast<double>(dark_mean[i]);
        stacks.true_bright[i] = static_cast<double>(bright_mean[i]) - static_cast<double>(dark_mean[i]);
    }
    stacks.prnu =
        std::sqrt(std::max(0.0, stacks.bright.spatial_variance() - stacks.dark_0.spatial_variance())) /
        (stacks.bright.mean() - stacks.dark_0.mean());
    return stacks;
}

/// Slope of the mean against exposure time.
struct DarkCurrent {
    double measured_dn_per_s, truth_e_per_s;
};

DarkCurrent measure_dark_current(Laboratory& bench) {
    const DetectorSettings& d = bench.sensor().detector;
    const double ratio = sensors::dark_current_ratio(d, d.temperature_c, d.dark_reference_c);
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
    return {emva::fit_line(times, means).slope, emva::fit_line(times, electrons).slope};
}

void add_parameters(const Laboratory& bench, const PhotonTransfer& transfer, const DarkNoise& dark,
                    const Stacks& stacks, const DarkCurrent& current, Characterisation& result) {
    const DetectorSettings& d = bench.sensor().detector;
    const emva::LinearModel& m = transfer.model;
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
    add("dark_noise", dark.noise.electrons, dark.truth_e, "e-", 0.02).upper_limit = dark.noise.upper_limit;
    add("saturation", m.saturation_e, bench.saturation_e(), "e-", 0.01);
    add("snr_max", m.snr_max_db, 10 * std::log10(bench.saturation_e()), "dB", 0.01);
    add("dynamic_range", m.dynamic_range_db, {}, "dB", 0);
    add("threshold", m.threshold_photons, {}, "photons", 0).upper_limit = m.dark_noise.upper_limit;
    add("linearity_error", m.linearity_error_percent, {}, "%", 0);
    add("dsnu", stacks.dsnu_e, deviation(stacks.true_dark), "e-", 0.03);
    add("prnu", 100 * stacks.prnu, 100 * deviation(stacks.true_bright) / average(stacks.true_bright), "%",
        0.03);
    add("dark_current", current.measured_dn_per_s / m.gain_dn_per_e, current.truth_e_per_s, "e-/s", 0.03);
}

void add_plots(const Laboratory& bench, const PhotonTransfer& transfer, const DarkNoise& dark,
               const Stacks& stacks, Characterisation& result) {
    const std::size_t pixels = stacks.true_dark.size();
    std::vector<double> dark_values(pixels), bright_values(pixels);
    const double dark_level = stacks.dark.mean(), response = stacks.bright.mean() - stacks.dark_0.mean();
    for (std::size_t i = 0; i < pixels; ++i) {
        dark_values[i] = (stacks.dark.pixel(i) - dark_level) / dark.gain_dn_per_e;
        bright_values[i] = 100 * ((stacks.bright.pixel(i) - stacks.dark_0.pixel(i)) / response - 1);
    }
    const auto columns = static_cast<std::size_t>(bench.region().width);
    add_nonuniformity_parts("dsnu", stacks.dark.spatial_parts(columns), 1 / dark.gain_dn_per_e, "e-", result);
    add_nonuniformity_parts("prnu",
                            stacks.bright.spatial_parts(columns) - stacks.dark_0.spatial_parts(columns),
                            100 / response, "%", result);
    // Temporal noise that is left in the mean of a stack.
    const double left = 1 / std::sqrt(static_cast<double>(stack_images));
    const double dark_left =
        std::sqrt(std::max(0.0, stacks.dark.temporal_variance())) * left / dark.gain_dn_per_e;
    const double bright_left =
        100 *
        std::sqrt(std::max(0.0, stacks.bright.temporal_variance() + stacks.dark_0.temporal_variance())) *
        left / response;
    result.add_condition("Stacks", fmt::format("{} images each, dark and at {:.0f} % of saturation",
                                               stack_images, 100 * stacks.photons / transfer.full_photons));
    add_pattern_plots({"DSNU", dark_values, columns, "e-", dark_left}, result);
    add_pattern_plots({"PRNU", bright_values, columns, "%", bright_left}, result);
    add_series_plots(transfer.levels, transfer.model, {stacks.dsnu_e, stacks.prnu}, result);
}

} // namespace

Characterisation characterise_preset(const SensorDescription& description, double wavelength_m) {
    Laboratory bench(description, wavelength_m);
    Characterisation result;
    result.subject = fmt::format("{}, {:.0f} nm, {:.1f} degC, simulated series", description.name,
                                 wavelength_m * 1e9, bench.sensor().detector.temperature_c);

    const PhotonTransfer transfer = measure_transfer(bench, description.name);
    result.notes.push_back(
        fmt::format("K and R were fitted over {:.0f} % of the saturation.", 100 * transfer.model.fit_range));
    add_conditions(description, wavelength_m, bench, transfer, result);
    const DarkNoise dark = measure_dark_noise(bench, transfer.model.gain_dn_per_e);
    if (dark.gain_db > 0)
        result.notes.push_back(
            fmt::format("Dark noise and DSNU were measured at {:.0f} dB of gain.", dark.gain_db));
    const Stacks stacks = measure_stacks(bench, transfer, dark);
    const DarkCurrent current = measure_dark_current(bench);
    add_parameters(bench, transfer, dark, stacks, current, result);
    add_plots(bench, transfer, dark, stacks, result);
    return result;
}

} // namespace obscura::tools

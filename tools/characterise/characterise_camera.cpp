// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/characterise_camera.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;

void add_camera_conditions(const CameraSeries& series, const CameraOptions& options,
                           Characterisation& result) {
    result.add_condition("Camera", series.camera);
    result.add_condition("Address", options.series.receiver.address);
    result.add_condition(
        "Light", options.dark ? "off"
                 : options.photons_per_s > 0
                     ? fmt::format("uniform, {:.4g} photons per pixel and second", options.photons_per_s)
                     : "uniform, constant, of unknown irradiance");
    result.add_condition("Exposure times",
                         fmt::format("{}, {:.4g} to {:.4g} ms, {} pairs of images each", series.levels.size(),
                                     1e3 * series.levels.front().exposure_s,
                                     1e3 * series.levels.back().exposure_s, options.series.pairs));
    result.add_condition("Bit depth", fmt::format("{} bit", series.bits));
    result.add_condition("Stacks",
                         fmt::format("{} images each, {} pixels", options.series.stack, series.low.pixels()));
}

} // namespace

Characterisation characterise_dark_camera(const CameraSeries& series, const CameraOptions& options) {
    Characterisation result;
    const double k = options.gain_dn_per_e > 0 ? options.gain_dn_per_e : 1;
    const char* unit = options.gain_dn_per_e > 0 ? "e-" : "DN";
    result.subject = fmt::format("{}, dark series of {} exposures", series.camera, series.levels.size());
    std::vector<double> times, means;
    for (const CameraLevel& level : series.levels) {
        times.push_back(level.exposure_s);
        means.push_back(level.pair.mean);
    }
    const emva::DarkNoise noise = emva::dark_noise(series.levels.front().pair.variance, k);
    result.add("dark_noise", noise.electrons, unit).upper_limit = noise.upper_limit;
    if (noise.upper_limit) result.notes.push_back(quantisation_note());
    result.add("dsnu", std::sqrt(std::max(0.0, series.low.spatial_variance())) / k, unit);
    add_nonuniformity_parts("dsnu", series.low.spatial_parts(series.width), 1 / k, unit, result);
    result.add("dark_current", emva::fit_line(times, means).slope / k, fmt::format("{}/s", unit));
    std::vector<double> values(series.low.pixels());
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = (series.low.pixel(i) - series.low.mean()) / k;
    add_camera_conditions(series, options, result);
    add_pattern_plots({"DSNU", values, series.width, unit, 0}, result);
    return result;
}

Characterisation characterise_lit_camera(const CameraSeries& series, const CameraOptions& options) {
    Characterisation result;
    result.subject =
        fmt::format("{}, {} exposures of {:.0f} to {:.0f} us", series.camera, series.levels.size(),
                    series.levels.front().exposure_s * 1e6, series.levels.back().exposure_s * 1e6);
    const double rate = options.photons_per_s > 0 ? options.photons_per_s : 1;
    const CameraLevel& reference = series.levels.front();
    std::vector<emva::Level> levels;
    for (std::size_t i = 1; i < series.levels.size(); ++i)
        levels.push_back({rate * (series.levels[i].exposure_s - reference.exposure_s), series.levels[i].pair,
                          reference.pair});
    if (!(levels.back().bright.mean > levels.back().dark.mean + 10))
        throw HardwareError(fmt::format(
            "{}: the image does not grow brighter with ExposureTime; a uniform, constant light is wanted, or --dark",
            options.series.receiver.address));
    emva::LinearModel m;
    try {
        m = emva::evaluate(levels, emva::Method::full_well);
    } catch (const std::invalid_argument& error) {
        throw HardwareError(fmt::format("{}: {}", options.series.receiver.address, error.what()));
    }
    add_camera_conditions(series, options, result);
    result.notes.push_back(fmt::format("K was fitted over {:.0f} % of the saturation.", 100 * m.fit_range));
    result.notes.push_back(
        "The shortest exposure replaces the dark image; "
        "to measure dark noise, DSNU and dark current, switch the light off and run with --dark and with this K as --gain.");
    result.add("gain", m.gain_dn_per_e, "DN/e-");
    if (options.photons_per_s > 0) {
        result.add("quantum_efficiency", m.quantum_efficiency, "");
        result.add("responsivity", m.responsivity_dn_per_photon, "DN/photon");
        result.add("threshold", m.threshold_photons, "photons").upper_limit = m.dark_noise.upper_limit;
    }
    result.add("saturation", m.saturation_e, "e-");
    result.add("snr_max", m.snr_max_db, "dB");
    result.add("linearity_error", m.linearity_error_percent, "%");
    const double response = series.half.mean() - series.low.mean();
    const double prnu =
        std::sqrt(std::max(0.0, series.half.spatial_variance() - series.low.spatial_variance())) / response;
    result.add("prnu", 100 * prnu, "%");
    add_nonuniformity_parts("prnu",
                            series.half.spatial_parts(series.width) - series.low.spatial_parts(series.width),
                            100 / response, "%", result);
    std::vector<double> values(series.half.pixels());
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = 100 * ((series.half.pixel(i) - series.low.pixel(i)) / response - 1);
    add_pattern_plots({"PRNU", values, series.width, "%", 0}, result);
    // The pattern at the shortest exposure takes the place of the dark one.
    const double dsnu_e = std::sqrt(std::max(0.0, series.low.spatial_variance())) / m.gain_dn_per_e;
    add_series_plots(levels, m, {dsnu_e, prnu}, result,
                     options.photons_per_s > 0 ? "photons per pixel" : "exposure time less shortest, s");
    return result;
}

} // namespace obscura::tools

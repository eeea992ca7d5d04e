// SPDX-License-Identifier: Apache-2.0
// Verb `obscura characterise`: EMVA 1288 characterisation of a sensor file, an image series or a camera.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "sensors/dark_current.hpp"
#include "sensors/emva1288.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/photometry.hpp"
#include "sensors/sensor.hpp"
#include "sensors/sensor_file.hpp"
#include "tools/support/camera_series.hpp"
#include "tools/support/characterise_report.hpp"
#include "tools/support/characterise_series.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;
using Image = std::vector<std::uint16_t>;

constexpr double planck_times_light_j_m = 6.62607015e-34 * 299'792'458.0;
constexpr double aperture_m = 0.02;

/// Simulated laboratory set-up: the sensor, or a window of at most 1024 x 1024 pixels in its centre, under
/// uniform light or in the dark. The mean response of the whole array is 1, that of a window is not.
class Laboratory {
public:
    Laboratory(SensorDescription sensor, double wavelength_m)
        : sensor_(std::move(sensor)),
          wavelength_m_(wavelength_m),
          band_{wavelength_m - 0.5e-9, wavelength_m + 0.5e-9},
          detector_(prepared(sensor_), {&band_, 1}, aperture_m, 1288) {
        const ReadoutSettings& r = sensor_.readout;
        region_.width = std::min(1024, r.width);
        region_.height = std::min(1024, r.height);
        region_.x = (r.width - region_.width) / 2 / r.window_step * r.window_step;
        region_.y = (r.height - region_.height) / 2 / r.window_step * r.window_step;
    }

    /// Saturation capacity in electrons: full well, or the charge that reaches the ADC's maximum if less.
    [[nodiscard]] double saturation_e() const {
        const DetectorSettings& d = sensor_.detector;
        const double top = (std::exp2(d.adc_bits) - 1 - d.offset_dn) / d.gain_dn_per_e;
        const auto bent = [&](double n) {
            const double x = n / d.full_well_e;
            double bend = 0;
            for (std::size_t i = 4; i-- > 0;)
                bend = (bend + d.nonlinearity[i]) * x;
            return n * (1 - bend);
        };
        double low = 0, high = d.full_well_e;
        if (bent(high) <= top) return high;
        for (int i = 0; i < 100; ++i)
            (bent((low + high) / 2) < top ? low : high) = (low + high) / 2;
        return low;
    }

    [[nodiscard]] double true_quantum_efficiency() const {
        return sensors::quantum_efficiency(sensor_.detector.quantum_efficiency, wavelength_m_) *
               sensor_.detector.fill_factor;
    }

    void set_exposure(double seconds) {
        const sensors::WindowRequest window{region_, std::max<std::int64_t>(1, std::llround(seconds * 1e9))};
        if (const std::string why = plan_readout(sensor_.readout, {&window, 1}, Time{}, plan_); !why.empty())
            throw ConfigError(fmt::format("{}: {}", sensor_.name, why));
    }
    [[nodiscard]] double exposure_s() const { return to_seconds(plan_.rows[0].exposure_ns()); }

    /// Exposes one image. `photons` is the mean number per pixel and exposure; `mean_e`, if not null, takes
    /// the expected electrons of each pixel before noise.
    Image shoot(double photons, double gain_db = 0, std::vector<float>* mean_e = nullptr) {
        const auto pixels = static_cast<std::size_t>(region_.area());
        const double energy_j = photons * planck_times_light_j_m / wavelength_m_;
        const double pupil_m2 = std::numbers::pi / 4 * aperture_m * aperture_m;
        const double irradiance = energy_j / exposure_s() / pupil_m2 / sensor_.detector.transmission;
        const std::vector<float> light(pixels, static_cast<float>(irradiance));
        Image dn(pixels);
        sensors::ExposureTruth truth;
        if (mean_e != nullptr) {
            mean_e->resize(pixels);
            truth.mean_e = *mean_e;
        }
        detector_.forget();
        detector_.expose(plan_, {0, plan_.height, plan_.width, light, 0, 0}, ++frame_, gain_db, dn, truth);
        return dn;
    }
    emva::PairStatistics pair(double photons, double gain_db = 0) {
        const Image a = shoot(photons, gain_db);
        return emva::pair_statistics(a, shoot(photons, gain_db));
    }
    /// True offset of each pixel of the window, in electrons: the fixed pattern that the model applies.
    [[nodiscard]] std::vector<double> true_offsets() const {
        std::vector<double> offsets;
        const sensors::FixedPattern& pattern = detector_.fixed_pattern();
        for (std::int32_t y = region_.y; y < region_.y + region_.height; ++y) {
            const float* row = pattern.row_of(pattern.offset_e, y, region_.x);
            for (std::int32_t x = 0; x < region_.width; ++x)
                offsets.push_back(row == nullptr ? 0.0 : static_cast<double>(row[x]));
        }
        return offsets;
    }
    [[nodiscard]] const SensorDescription& sensor() const { return sensor_; }
    [[nodiscard]] const Region& region() const { return region_; }

private:
    static const SensorDescription& prepared(SensorDescription& sensor) {
        // Without particles and RTS noise, and without defective pixels, which a laboratory masks.
        DetectorSettings& d = sensor.detector;
        d.hit_flux_per_cm2_s = 0;
        d.rts_fraction = 0;
        d.dead_fraction = d.stuck_fraction = 0;
        d.dead_rows = d.dead_columns = 0;
        d.test_pattern = TestPattern::off;
        return sensor;
    }

    SensorDescription sensor_;
    double wavelength_m_;
    SpectralBand band_;
    sensors::Detector detector_;
    Region region_;
    sensors::ReadoutPlan plan_;
    std::uint64_t frame_ = 0;
};

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

Characterisation characterise(const SensorDescription& description, double wavelength_m) {
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
    add_series_plots(levels, m, result);
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
        const Image image = bench.shoot(0, 0, &truth);
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
    return result;
}

struct CameraOptions {
    CameraSeriesSettings series;
    double photons_per_s = 0; ///< photons per pixel and second; 0: unknown
    bool dark = false;        ///< the series is taken without light
    /// System gain K of an earlier lit series, used with `dark`; 0: unknown.
    double gain_dn_per_e = 0;
};

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

/// Dark noise, DSNU and dark current of a series without light. In electrons if K is given, else in DN.
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
    result.add("dark_current", emva::fit_line(times, means).slope / k, fmt::format("{}/s", unit));
    std::vector<double> values(series.low.pixels());
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = (series.low.pixel(i) - series.low.mean()) / k;
    add_camera_conditions(series, options, result);
    add_pattern_plots({"DSNU", values, series.width, unit, 0}, result);
    return result;
}

/// Photon transfer under constant light with varying exposure time. The shortest exposure replaces the dark
/// image, so dark current counts as light; its statistics are the same (Poisson).
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
        throw HardwareError(fmt::format("{}: the image does not grow brighter with ExposureTime; a uniform, "
                                        "constant light is wanted, or --dark",
                                        options.series.receiver.address));
    emva::LinearModel m;
    try {
        m = emva::evaluate(levels, emva::Method::full_well);
    } catch (const std::invalid_argument& error) {
        throw HardwareError(fmt::format("{}: {}", options.series.receiver.address, error.what()));
    }
    add_series_plots(levels, m, result,
                     options.photons_per_s > 0 ? "photons per pixel" : "exposure time less shortest, s");
    add_camera_conditions(series, options, result);
    result.notes.push_back(fmt::format("K was fitted over {:.0f} % of the saturation.", 100 * m.fit_range));
    result.notes.push_back(
        "The shortest exposure replaces the dark image; to measure dark noise, DSNU and dark current, switch "
        "the light off and run with --dark and with this K as --gain.");
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
    result.add("prnu",
               100 *
                   std::sqrt(std::max(0.0, series.half.spatial_variance() - series.low.spatial_variance())) /
                   response,
               "%");
    std::vector<double> values(series.half.pixels());
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = 100 * ((series.half.pixel(i) - series.low.pixel(i)) / response - 1);
    add_pattern_plots({"PRNU", values, series.width, "%", 0}, result);
    return result;
}

class Characterise final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "measures a sensor after EMVA 1288: gain, noise, saturation, patterns";
        line.description =
            "Measures gain, noise, saturation capacity, linearity, DSNU, PRNU and dark current from "
            "digital numbers alone. The images come from one of three sources: --preset simulates bright "
            "and dark series of a sensor and compares each result with the value in the sensor file; "
            "--series reads the descriptor and the images of an EMVA 1288 reference set; --camera takes a "
            "series from a running GigE Vision camera in front of a uniform, constant light, with "
            "exposure times that rise until the image saturates. The exit status is 1 when a result "
            "deviates from the value in the sensor file by more than its tolerance.";
        line.option("--preset", &preset_, "NAME",
                    "Sensor to simulate: a name that `obscura sensor list` prints, or a .toml file");
        line.option("--series", &series_, "DIR",
                    "EMVA 1288 descriptor file, or the folder of one named EMVA1288_Data.txt, with the "
                    "images that it names");
        line.option("--camera", &camera_.series.receiver.address, "HOST",
                    "GigE Vision camera in front of a uniform, constant light: IPv4 address or host name");
        line.flag("--dark", camera_.dark,
                  "With --camera: take a dark series, with the light off, and measure dark noise, DSNU and "
                  "dark current");
        line.number("--gain", &camera_.gain_dn_per_e, "K",
                    "With --dark: system gain K in DN/e-, as measured without --dark (0: results in DN)", 0,
                    1e6);
        line.number("--photons-per-s", &camera_.photons_per_s, "P",
                    "With --camera: photons per pixel and second that the light delivers, needed for the "
                    "quantum efficiency (0: unknown)",
                    0, 1e15);
        line.number("--least-us", &camera_.series.least_us, "US",
                    "With --camera: shortest exposure time in microseconds (0: the camera's minimum)", 0,
                    1e7);
        line.number("--most-us", &camera_.series.most_us, "US",
                    "With --camera: longest exposure time in microseconds (0: found by raising it until the "
                    "image saturates)",
                    0, 1e7);
        line.number("--levels", &camera_.series.levels, "N",
                    "With --camera: number of exposure times, evenly spaced", 5, 1000);
        line.option("--pixel-format", &camera_.series.pixel_format, "FORMAT",
                    "With --camera: PixelFormat, one of Mono8 to Mono16, Mono10p and Mono12p (default: the "
                    "camera's setting)");
        line.number("--packet-size", &camera_.series.receiver.packet_size, "BYTES",
                    "With --camera: GevSCPSPacketSize (0: negotiated)", 0, 65532);
        line.number("--wavelength-nm", &wavelength_nm_, "NM",
                    "With --preset: wavelength of the simulated light in nanometres", 200, 2000);
        line.option("-o,--output", &output_, "FILE", "Also write the report with its plots as one HTML page");
        line.flag("--json", json_, "Print the results as JSON instead of a table");
        line.examples = {"obscura characterise --preset has2 -o has2.html",
                         "obscura characterise --series EMVA1288_ReferenceSet_001_CCD_12Bit --json",
                         "obscura characterise --camera 127.0.0.1 -o lit.html",
                         "obscura characterise --camera 127.0.0.1 --dark --gain 0.041 --most-us 2000000"};
    }

    int run() override {
        const std::string& address = camera_.series.receiver.address;
        if (int{preset_.empty()} + int{series_.empty()} + int{address.empty()} != 2)
            throw UsageError(
                "obscura characterise: exactly one of --preset, --series and --camera is wanted");
        if (camera_.dark && !(camera_.series.most_us > 0))
            throw UsageError("obscura characterise: --dark needs --most-us, the longest exposure");
        Characterisation result;
        if (!address.empty()) {
            const CameraSeries series = take_camera_series(camera_.series);
            result = camera_.dark ? characterise_dark_camera(series, camera_)
                                  : characterise_lit_camera(series, camera_);
        } else if (series_.empty()) {
            const std::filesystem::path file = config::file_or_shipped(config::shipped_sensors, preset_);
            const SensorDescription sensor = sensors::load_sensor(file);
            if (!(sensors::quantum_efficiency(sensor.detector.quantum_efficiency, wavelength_nm_ * 1e-9) >
                  0) ||
                !(sensor.detector.transmission > 0) || !(sensor.detector.fill_factor > 0))
                throw ConfigError(
                    fmt::format("{}: the sensor has no sensitivity at {} nm: quantum efficiency, "
                                "transmission or fill factor is 0",
                                file.string(), wavelength_nm_));
            result = characterise(sensor, wavelength_nm_ * 1e-9);
        } else {
            result = characterise_series(series_);
        }
        result.sort();
        if (!output_.empty()) {
            std::ofstream file(output_);
            file << to_html(result);
            file.close();
            if (!file) throw OutputError(fmt::format("{}: cannot be written", output_));
        }
        std::fputs((json_ ? to_json(result) : to_text(result)).c_str(), stdout);
        const bool good = std::all_of(result.parameters.begin(), result.parameters.end(),
                                      [](const Parameter& p) { return p.good(); });
        return good ? exit_ok : exit_failure;
    }

private:
    CameraOptions camera_;
    std::string preset_, series_, output_;
    double wavelength_nm_ = 550;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_characterise() {
    return std::make_unique<Characterise>();
}

} // namespace obscura::tools

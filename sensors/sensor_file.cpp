// SPDX-License-Identifier: Apache-2.0
#include "sensors/sensor_file.hpp"

#include "config/shipped_files.hpp"
#include "core/camera/camera.hpp"
#include "core/camera/pixel_pitch.hpp"
#include "core/camera/setting_table.hpp"
#include "models/kinds/timing_program.hpp"
#include "models/values/model_table.hpp"
#include "sensors/response_pattern.hpp"
#include "sensors/sensor_model.hpp"

#include <fmt/format.h>

#include <memory>
#include <utility>

namespace obscura::sensors {
namespace {

constexpr double micro = 1e-6;

config::Keys keys_of(SensorDescription& s);
config::Keys keys_of(ReadoutSettings& s);
config::Keys keys_of(DetectorSettings& s);

/// Reads `model = { model = "FILE.sns", PARAMETER = VALUE }`. The detector has been read.
void read_model(SensorDescription& sensor, const config::ReadTable& table) {
    if (auto own = models::read_model(table, "model", "sensor")) sensor.model = *std::move(own);
    table.refuse_if_thrown("model", [&] {
        if (const std::string why = explain_invalid_model(sensor); !why.empty()) table.refuse("model", why);
    });
}

/// Reads `shutter = { model = "FILE.tim", PARAMETER = VALUE }`.
void read_timing(ReadoutSettings& s, const config::ReadTable& table) {
    if (auto own = models::read_model(table, "shutter", "timing")) {
        table.refuse_if_thrown("shutter", [&] {
            s.timing = std::make_shared<const models::TimingProgram>(own->loaded->model,
                                                                     models::program_parameters(*own));
            s.timing_values = std::make_shared<const models::ModelValues>(*std::move(own));
            s.shutter = Shutter::model;
        });
    } else if (s.shutter == Shutter::model && s.timing == nullptr && table.has("shutter")) {
        table.refuse("shutter", "times of your own have a table: write shutter = { model = \"FILE.tim\" }");
    }
}

} // namespace

config::Section section_of(SensorDescription& sensor) {
    config::Section readout;
    readout.name = "readout";
    readout.help = "When each row of the chip is reset and read.";
    readout.keys = keys_of(sensor.readout);
    readout.annotated = true;
    readout.check = [&r = sensor.readout](const config::ReadTable& table) {
        if (!(r.sample_instant_ns < r.reset_instant_ns && r.reset_instant_ns < r.row_overhead_ns))
            table.refuse_table(
                fmt::format("sample_instant_ns {} < reset_instant_ns {} < row_overhead_ns {} does not hold",
                            r.sample_instant_ns, r.reset_instant_ns, r.row_overhead_ns));
        read_timing(r, table);
    };
    config::Section detector;
    detector.name = "detector";
    detector.help =
        "Detector: from light to charge, from charge to a voltage, from the voltage to a digital number.";
    detector.keys = keys_of(sensor.detector);
    detector.annotated = true;
    detector.check = [&d = sensor.detector](const config::ReadTable& table) {
        if (d.offset_dn >= static_cast<double>(1 << d.adc_bits))
            table.refuse_table(
                fmt::format("offset_dn {} is above the full scale of {} bits", d.offset_dn, d.adc_bits));
        if (const std::string why = explain_invalid_prnu(d); !why.empty()) table.refuse_table(why);
    };
    config::Section section;
    section.name = "sensor";
    section.help = "The sensor. Values may stand as { value = ..., provenance = \"...\", source = \"...\" }.";
    section.keys = keys_of(sensor);
    section.tables = {std::move(readout), std::move(detector)};
    section.annotated = true;
    const auto word = std::make_shared<std::string>(); // where a table is wanted
    section.keys.push_back(
        config::key("model", word.get())
            .or_table([&sensor, word] { return models::table_text(sensor.model); })
            .help(
                "Response of the pixels by a model of your own: model = { model = \"FILE.sns\", PARAMETER = VALUE }, see models.md; empty: none"));
    section.check = [&sensor, word](const config::ReadTable& table) {
        if (!word->empty())
            table.refuse("model", "allowed is a table: write model = { model = \"FILE.sns\" }");
        read_model(sensor, table);
        if (const std::string why = explain_invalid_row_pitch(sensor.pixel_pitch_m, sensor.pixel_pitch_y_m);
            !why.empty())
            table.refuse("pixel_pitch_y_um", why);
    };
    return section;
}

config::Section referring_section_of(SensorDescription& sensor) {
    config::Section section = section_of(sensor);
    // Read by `before`; the row here is for its type and the reference.
    section.keys.insert(
        section.keys.begin(),
        config::key("file", config::Path{&sensor.file, false})
            .unprinted()
            .help("Sensor file, or the name of a shipped sensor (\"has2\"), that is read first; "
                  "the keys below override its values"));
    section.before = [&sensor](const config::Value& table, const config::Where& where,
                               config::Mistakes& mistakes) {
        const config::Member* file = table.find("file");
        if (file == nullptr) return;
        std::string path;
        config::Value only_file;
        only_file.members.push_back(*file);
        mistakes.collect([&] {
            read_keys(only_file, where, {config::key("file", config::Path{&path, false})});
            path = config::file_of_key(file->value, where.in("file"), path, config::shipped_sensors);
            const config::Value root = config::parse_file(path);
            read_section(&root, root.at, {path, ""}, section_of(sensor), mistakes);
        });
    };
    return section;
}

SensorDescription load_sensor(const std::filesystem::path& file) {
    SensorDescription sensor;
    sensor.name = file.stem().string();
    const config::Value root = config::parse_file(file);
    if (root.members.empty()) fail({file, ""}, root.at, "an empty sensor file; at least its name is needed");
    config::Mistakes mistakes;
    read_section(&root, root.at, {file, ""}, section_of(sensor), mistakes);
    mistakes.throw_if_any();
    return sensor;
}

std::string explain_invalid(const DetectorSettings& settings) {
    DetectorSettings s = settings; // the keys bind to what can be written
    if (std::string why = config::explain_out_of_range(keys_of(s)); !why.empty()) return why;
    if (std::string why = explain_invalid_prnu(s); !why.empty()) return why;
    if (s.quantum_efficiency.empty()) return "quantum_efficiency: empty, at least one point is needed";
    for (std::size_t i = 0; i < s.quantum_efficiency.size(); ++i) {
        const SpectralPoint& p = s.quantum_efficiency[i];
        if (!(p.wavelength_m > 0) || (i > 0 && !(p.wavelength_m > s.quantum_efficiency[i - 1].wavelength_m)))
            return fmt::format("quantum_efficiency: wavelength {} m: above 0 and rising is allowed",
                               p.wavelength_m);
    }
    return {};
}

std::string explain_invalid(const SensorDescription& description) {
    SensorDescription s = description;
    if (std::string why = config::explain_out_of_range(keys_of(s)); !why.empty()) return why;
    if (std::string why = explain_invalid_row_pitch(s.pixel_pitch_m, s.pixel_pitch_y_m); !why.empty())
        return "pixel_pitch_y_um: " + why;
    if (std::string why = config::explain_out_of_range(keys_of(s.readout)); !why.empty()) return why;
    return explain_invalid(s.detector);
}

namespace {

config::Keys keys_of(SensorDescription& s) {
    return {
        config::key("name", &s.name).help("Name of the sensor"),
        config::key("serial", &s.serial)
            .range(0, 9e15)
            .help("Serial number of the specimen: seed of its fixed patterns and defects"),
        config::key("pixel_pitch_um", config::Scaled{&s.pixel_pitch_m, micro})
            .unit("um")
            .range(0.1, 1000)
            .help("Pixel pitch"),
        config::key("pixel_pitch_y_um", config::Scaled{&s.pixel_pitch_y_m, micro})
            .unit("um")
            .range(0, 1000)
            .help("Pitch of the rows where pixels are not square; 0: pixel_pitch_um"),
    };
}

config::Keys keys_of(ReadoutSettings& s) {
    return {
        config::key("width", &s.width)
            .unit("px")
            .range(1, max_sensor_extent)
            .help("Columns of the pixel array"),
        config::key("height", &s.height)
            .unit("px")
            .range(1, max_sensor_extent)
            .help("Rows of the pixel array"),
        config::key("shutter", &s.shutter)
            .or_table([&s] {
                return s.shutter == Shutter::model && s.timing_values ? models::table_text(*s.timing_values)
                                                                      : std::string();
            })
            .help("Shutter: how exposures of rows relate to each other; times of your own: "
                  "shutter = { model = \"FILE.tim\", PARAMETER = VALUE }, see models.md"),
        config::key("pixel_clock_hz", &s.pixel_clock_hz)
            .unit("Hz")
            .range(1e3, 1e11)
            .help("Pixel clock of one output"),
        config::key("outputs", &s.outputs)
            .range(1, 4096)
            .help("Outputs: pixels of a row that are read at the same time"),
        config::key("row_overhead_ns", &s.row_overhead_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Row time without its pixels: T_row = row_overhead + ceil(width / outputs) / pixel_clock"),
        config::key("sample_instant_ns", &s.sample_instant_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Instant of the signal sample within a row slot"),
        config::key("reset_instant_ns", &s.reset_instant_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Instant of the reset within a row slot: sample_instant < reset_instant < row_overhead"),
        config::key("frame_overhead_ns", &s.frame_overhead_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Global shutter: duration of the charge transfer between exposure and readout"),
        config::key("overlapped", &s.overlapped)
            .help("The next exposure may start while a frame is read out"),
        config::key("window_mode", &s.window_mode)
            .help("How a rolling shutter serves several windows: one after the other, or all in every cycle"),
        config::key("windows_max", &s.windows_max)
            .range(1, 32)
            .help("Largest number of windows that are read in one frame"),
        config::key("window_overhead_ns", &s.window_overhead_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Time after the last row of each window"),
        config::key("blanking_rows", &s.blanking_rows)
            .range(0, 1e6)
            .help("Idle row slots at the end of each readout cycle"),
        config::key("stretch_blanking", &s.stretch_blanking)
            .help("Add idle row slots for an exposure that is longer than the readout cycle"),
        config::key("exposure_step_ns", &s.exposure_step_ns)
            .unit("ns")
            .range(1, 1e9)
            .help("Global shutter and push-broom: increment of the exposure time"),
        config::key("exposure_max_ns", &s.exposure_max_ns)
            .unit("ns")
            .range(0, static_cast<double>(max_exposure_ns))
            .help(
                "Longest exposure that the chip's own counter holds; 0: it has none, the host times exposures"),
        config::key("line_rate_hz", &s.line_rate_hz)
            .unit("Hz")
            .range(1e-3, 1e7)
            .help("Push-broom: line rate"),
        config::key("window_step", &s.window_step)
            .unit("px")
            .range(1, 4096)
            .help("Increment of the offsets of a window"),
        config::key("strict", &s.strict)
            .help("Refuse windows that the chip cannot read; otherwise crop and align them"),
    };
}

config::Keys keys_of(DetectorSettings& s) {
    return {
        config::key("transmission", &s.transmission).range(0, 1).help("Transmission of the optics"),
        config::key("quantum_efficiency", config::Curve{&s.quantum_efficiency})
            .range(0, 1)
            .help("Quantum efficiency as pairs of wavelength in nm and value; "
                  "linear between them, constant beyond the first and the last"),
        config::key("fill_factor", &s.fill_factor)
            .range(0, 1)
            .help("Sensitive fraction of the pixel area, if quantum_efficiency does not include it"),
        config::key("prnu_local", &s.prnu_local)
            .range(0, 1)
            .help(
                "PRNU of single pixels: relative standard deviation of the response to uniform light, crosstalk included, as EMVA 1288 measures it"),
        config::key("prnu_global", &s.prnu_global)
            .range(0, 1)
            .help(
                "PRNU over the array: relative standard deviation of the response by bowl, gradient, columns and stitched fields together"),
        config::key("prnu_bowl_weight", &s.prnu_bowl_weight)
            .range(0, 1)
            .help(
                "Relative amplitude in prnu_global of a bowl: response falls with the square of the distance from about the centre"),
        config::key("prnu_gradient_weight", &s.prnu_gradient_weight)
            .range(0, 1)
            .help(
                "Relative amplitude in prnu_global of a linear gradient, in a direction given by the serial"),
        config::key("prnu_column_weight", &s.prnu_column_weight)
            .range(0, 1)
            .help("Relative amplitude in prnu_global of gains that differ from column to column"),
        config::key("prnu_stitching_weight", &s.prnu_stitching_weight)
            .range(0, 1)
            .help(
                "Relative amplitude in prnu_global of gains that differ from field to field of a stitched exposure, in steps at the seams"),
        config::key("stitch_columns", &s.stitch_columns)
            .range(1, 64)
            .help(
                "Fields of a stitched exposure side by side; 1 for chips that fit into one field, to some 25 mm"),
        config::key("stitch_rows", &s.stitch_rows)
            .range(1, 64)
            .help("Fields of a stitched exposure one below the other"),
        config::key("crosstalk_edge", &s.crosstalk_edge)
            .range(0, 0.2)
            .help("Crosstalk: fraction of a pixel's charge that goes to each of its 4 edge neighbours"),
        config::key("crosstalk_corner", &s.crosstalk_corner)
            .range(0, 0.05)
            .help("Crosstalk: fraction of a pixel's charge that goes to each of its 4 diagonal neighbours"),
        config::key("parasitic_light", &s.parasitic_light)
            .range(0, 1)
            .help("Global shutter: parasitic light sensitivity of the storage node relative to the pixel"),
        config::key("smear_row_ns", &s.smear_row_ns)
            .unit("ns")
            .range(0, 1e+09)
            .help(
                "Frame-transfer CCD: time per row for which the charge is exposed during the transfer; 0: no smear"),
        config::key("optical_black_rows", &s.optical_black_rows)
            .range(0, 65536)
            .help("Optically black rows, which follow the electrically black ones"),
        config::key("electrical_black_rows", &s.electrical_black_rows)
            .range(0, 65536)
            .help("Electrically black rows, the first of the array: without charge"),
        config::key("temperature_c", &s.temperature_c)
            .unit("degC")
            .range(-200, 150)
            .help("Temperature of the sensor"),
        config::key("dark_reference_c", &s.dark_reference_c)
            .unit("degC")
            .range(-200, 150)
            .help("Reference temperature of the dark currents"),
        config::key("dark_law", &s.dark_law).help("Law by which the dark current rises with temperature"),
        config::key("dark_doubling_k", &s.dark_doubling_k)
            .unit("K")
            .range(0.1, 1000)
            .help("Doubling law: temperature rise that doubles the dark current"),
        config::key("dark_current_e_per_s", &s.dark_current_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("Mean dark current of the array at the reference temperature"),
        config::key("dark_nonuniformity_e_per_s", &s.dark_nonuniformity_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("DSNU: standard deviation of the dark current over the array, log-normal"),
        config::key("hot_fraction", &s.hot_fraction)
            .range(0, 1)
            .help("Hot pixels: fraction of pixels with additional dark current"),
        config::key("hot_current_e_per_s", &s.hot_current_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("Hot pixels: mean additional dark current, exponentially distributed"),
        config::key("rts_fraction", &s.rts_fraction)
            .range(0, 1)
            .help("RTS noise of the dark current: fraction of pixels with two levels"),
        config::key("rts_current_e_per_s", &s.rts_current_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("RTS noise of the dark current: mean difference of the levels, exponentially distributed"),
        config::key("hit_flux_per_cm2_s", &s.hit_flux_per_cm2_s)
            .unit("/cm2/s")
            .range(0, 1e+06)
            .help("Flux of cosmic rays and protons through the array"),
        config::key("hit_depth_um", config::Scaled{&s.hit_depth_m, micro})
            .unit("um")
            .range(0.1, 1000)
            .help("Depth of the layer that collects the charge of particle tracks"),
        config::key("hit_charge_e_per_um", config::Scaled{&s.hit_charge_e_per_m, 1 / micro})
            .unit("e-/um")
            .range(0, 1e+06)
            .help("Mean charge per length of a particle track"),
        config::key("full_well_e", &s.full_well_e).unit("e-").range(1, 1e+07).help("Full well capacity"),
        config::key("blooming", &s.blooming)
            .range(0, 1)
            .help("Blooming: fraction of the charge above full well that goes to the 4 edge neighbours"),
        config::key("nonlinearity_1", &s.nonlinearity[0])
            .range(-1, 1)
            .help("Nonlinearity c1 of S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well"),
        config::key("nonlinearity_2", &s.nonlinearity[1])
            .range(-1, 1)
            .help("Nonlinearity c2 of S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well"),
        config::key("nonlinearity_3", &s.nonlinearity[2])
            .range(-1, 1)
            .help("Nonlinearity c3 of S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well"),
        config::key("nonlinearity_4", &s.nonlinearity[3])
            .range(-1, 1)
            .help("Nonlinearity c4 of S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well"),
        config::key("lag", &s.lag)
            .range(0, 1)
            .help("Image lag: fraction of a frame's charge that appears in the next frame"),
        config::key("read_noise_e", &s.read_noise_e)
            .unit("e-")
            .range(0, 100000)
            .help("Read noise: standard deviation of one sample of the amplifier"),
        config::key("double_sampling", &s.double_sampling)
            .help(
                "Double sampling: a destructive read subtracts the level of the reset that follows, which doubles the variance of read noise and kTC noise"),
        config::key("conversion_gain_uv_per_e", config::Scaled{&s.conversion_gain_v_per_e, micro})
            .unit("uV/e-")
            .range(0, 10000)
            .help("Conversion gain of the sense node, which determines the kTC noise; 0: no kTC noise"),
        config::key("reset_mode", &s.reset_mode)
            .help("Reset of the sense node; soft halves the variance of the kTC noise"),
        config::key("offset_fpn_e", &s.offset_fpn_e)
            .unit("e-")
            .range(0, 100000)
            .help("Standard deviation of the offsets of pixels"),
        config::key("column_fpn_e", &s.column_fpn_e)
            .unit("e-")
            .range(0, 100000)
            .help("Standard deviation of the offsets of columns"),
        config::key("row_noise_e", &s.row_noise_e)
            .unit("e-")
            .range(0, 100000)
            .help("Standard deviation of the temporal noise common to a row"),
        config::key("follower_rts_fraction", &s.follower_rts_fraction)
            .range(0, 1)
            .help(
                "RTS noise of the source follower: fraction of pixels with two levels, which are three in the difference of two samples"),
        config::key("follower_rts_e", &s.follower_rts_e)
            .unit("e-")
            .range(0, 100000)
            .help(
                "RTS noise of the source follower: mean difference of the levels, exponentially distributed"),
        config::key("gain_dn_per_e", &s.gain_dn_per_e)
            .unit("DN/e-")
            .range(1e-06, 1e+06)
            .help("System gain K at 0 dB"),
        config::key("offset_dn", &s.offset_dn).unit("DN").range(0, 65535).help("Black level"),
        config::key("adc_bits", &s.adc_bits)
            .unit("bit")
            .range(min_adc_bits, max_adc_bits)
            .help("Resolution of the ADC"),
        config::key("adc_inl_dn", &s.adc_inl_dn)
            .unit("DN")
            .range(0, 1000)
            .help("INL of the ADC: peak deviation of the transfer curve"),
        config::key("adc_dnl_dn", &s.adc_dnl_dn)
            .unit("DN")
            .range(0, 100)
            .help("DNL of the ADC: standard deviation of the code widths"),
        config::key("dead_fraction", &s.dead_fraction)
            .range(0, 1)
            .help("Fraction of pixels without response"),
        config::key("stuck_fraction", &s.stuck_fraction)
            .range(0, 1)
            .help("Fraction of pixels that always give the same digital number"),
        config::key("dead_rows", &s.dead_rows).range(0, 65536).help("Number of rows without signal"),
        config::key("dead_columns", &s.dead_columns).range(0, 65536).help("Number of columns without signal"),
        config::key("test_pattern", &s.test_pattern)
            .help("Test pattern of the sensor; ramp: (x + y) mod 2^adc_bits instead of the image"),
        config::key("response_map", config::Path{&s.response_map, true, true})
            .help("FITS image of the relative response of pixels, instead of a generated one; empty: none"),
        config::key("dark_map", config::Path{&s.dark_map, true, true})
            .help(
                "FITS image of the dark current in e-/s at the reference temperature, instead of a generated one; empty: none"),
        config::key("offset_map", config::Path{&s.offset_map, true, true})
            .help("FITS image of the offsets in e-, instead of generated ones; empty: none"),
    };
}

} // namespace

} // namespace obscura::sensors

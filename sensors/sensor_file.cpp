// SPDX-License-Identifier: Apache-2.0
#include "sensors/sensor_file.hpp"

#include <fmt/format.h>

namespace obscura::sensors {
namespace {

constexpr double micro = 1e-6;

config::Keys keys_of(SensorDescription& s);
config::Keys keys_of(ReadoutSettings& s);
config::Keys keys_of(DetectorSettings& s);

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
    };
    config::Section detector;
    detector.name = "detector";
    detector.help = "How light becomes charge, charge a voltage, and the voltage a digital number.";
    detector.keys = keys_of(sensor.detector);
    detector.annotated = true;
    detector.check = [&d = sensor.detector](const config::ReadTable& table) {
        if (d.offset_dn >= static_cast<double>(1 << d.adc_bits))
            table.refuse_table(
                fmt::format("offset_dn {} is above the full scale of {} bits", d.offset_dn, d.adc_bits));
    };
    config::Section section;
    section.name = "sensor";
    section.help = "The chip. Values may stand as { value = ..., provenance = \"...\", source = \"...\" }.";
    section.keys = keys_of(sensor);
    section.tables = {std::move(readout), std::move(detector)};
    section.annotated = true;
    return section;
}

config::Section referring_section_of(SensorDescription& sensor) {
    config::Section section = section_of(sensor);
    // Read by `before`; the row here is for its type and the reference.
    section.keys.insert(section.keys.begin(),
                        config::key("file", config::Path{&sensor.file})
                            .unprinted()
                            .help("Sensor file that is read first; the other keys override its values"));
    section.before = [&sensor](const config::Value& table, const config::Where& where,
                               config::Mistakes& mistakes) {
        const config::Member* file = table.find("file");
        if (file == nullptr) return;
        std::string path;
        config::Value only_file;
        only_file.members.push_back(*file);
        mistakes.collect([&] {
            read_keys(only_file, where, {config::key("file", config::Path{&path})});
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
    if (std::string why = config::explain_out_of_range(keys_of(s.readout)); !why.empty()) return why;
    return explain_invalid(s.detector);
}

namespace {

config::Keys keys_of(SensorDescription& s) {
    return {
        config::key("name", &s.name).help("Name of the chip"),
        config::key("serial", &s.serial).range(0, 9e15).help("Specimen: seeds the fixed patterns"),
        config::key("pixel_pitch_um", config::Scaled{&s.pixel_pitch_m, micro})
            .unit("um")
            .range(0.1, 1000)
            .help("Pixel pitch"),
    };
}

config::Keys keys_of(ReadoutSettings& s) {
    return {
        config::key("width", &s.width).unit("px").range(1, 65536).help("Columns of the array"),
        config::key("height", &s.height).unit("px").range(1, 65536).help("Rows of the array"),
        config::key("shutter", &s.shutter).help("Shutter"),
        config::key("pixel_clock_hz", &s.pixel_clock_hz)
            .unit("Hz")
            .range(1e3, 1e11)
            .help("Pixel clock of one output"),
        config::key("outputs", &s.outputs).range(1, 4096).help("Pixels of a row read at once"),
        config::key("row_overhead_ns", &s.row_overhead_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Row time beside the pixels: T_row = row_overhead + ceil(width / outputs) / pixel_clock"),
        config::key("sample_instant_ns", &s.sample_instant_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Signal sample inside a row slot"),
        config::key("reset_instant_ns", &s.reset_instant_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Reset inside a row slot: sample_instant < reset_instant < row_overhead"),
        config::key("frame_overhead_ns", &s.frame_overhead_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("Global shutter: charge transfer between exposure and readout"),
        config::key("overlapped", &s.overlapped)
            .help("The next exposure may start while a frame is read out"),
        config::key("window_mode", &s.window_mode)
            .help("How a rolling shutter serves several windows: one after the other, or all in every cycle"),
        config::key("windows_max", &s.windows_max).range(1, 32).help("Windows at once"),
        config::key("window_overhead_ns", &s.window_overhead_ns)
            .unit("ns")
            .range(0, 1e9)
            .help("After the last row of each window"),
        config::key("blanking_rows", &s.blanking_rows)
            .range(0, 1e6)
            .help("Idle row slots at the end of each cycle"),
        config::key("stretch_blanking", &s.stretch_blanking)
            .help("Add idle slots for an exposure that is longer than the cycle"),
        config::key("exposure_step_ns", &s.exposure_step_ns)
            .unit("ns")
            .range(1, 1e9)
            .help("Global shutter and push-broom: exposures are multiples of this"),
        config::key("line_rate_hz", &s.line_rate_hz)
            .unit("Hz")
            .range(1e-3, 1e7)
            .help("Push-broom: lines per second"),
        config::key("window_step", &s.window_step)
            .unit("px")
            .range(1, 4096)
            .help("Place of a window is a multiple of this"),
        config::key("strict", &s.strict).help("Refuse impossible windows; otherwise crop and align them"),
    };
}

config::Keys keys_of(DetectorSettings& s) {
    return {
        config::key("transmission", &s.transmission).range(0, 1).help("Transmission of the optics"),
        config::key("quantum_efficiency", config::Curve{&s.quantum_efficiency})
            .range(0, 1)
            .help("[wavelength_nm, quantum efficiency] pairs; linear between, ends held"),
        config::key("fill_factor", &s.fill_factor)
            .range(0, 1)
            .help("Share of the pixel that is sensitive, where the curve leaves it out"),
        config::key("prnu_local", &s.prnu_local)
            .range(0, 1)
            .help("Response: relative rms from pixel to pixel"),
        config::key("prnu_global", &s.prnu_global)
            .range(0, 1)
            .help("Response: relative rms of the slow variation over the array"),
        config::key("crosstalk_edge", &s.crosstalk_edge)
            .range(0, 0.2)
            .help("Share of a pixel's charge that each of 4 neighbours gets"),
        config::key("crosstalk_corner", &s.crosstalk_corner)
            .range(0, 0.05)
            .help("The same for each of the 4 diagonal neighbours"),
        config::key("parasitic_light", &s.parasitic_light)
            .range(0, 1)
            .help("Global shutter: sensitivity of the storage node, relative to the pixel"),
        config::key("smear_row_ns", &s.smear_row_ns)
            .unit("ns")
            .range(0, 1e+09)
            .help("Frame-transfer CCD: time per row under the open sky"),
        config::key("optical_black_rows", &s.optical_black_rows)
            .range(0, 65536)
            .help("Rows under a shield, after the electrically black ones"),
        config::key("electrical_black_rows", &s.electrical_black_rows)
            .range(0, 65536)
            .help("First rows of the array: no charge at all"),
        config::key("temperature_c", &s.temperature_c)
            .unit("degC")
            .range(-200, 150)
            .help("Temperature of the chip"),
        config::key("dark_reference_c", &s.dark_reference_c)
            .unit("degC")
            .range(-200, 150)
            .help("Temperature at which the dark currents hold"),
        config::key("dark_law", &s.dark_law).help("How dark current rises with temperature"),
        config::key("dark_doubling_k", &s.dark_doubling_k)
            .unit("K")
            .range(0.1, 1000)
            .help("Doubling law: doubles every so many kelvin"),
        config::key("dark_current_e_per_s", &s.dark_current_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("Dark current, mean over the array"),
        config::key("dark_nonuniformity_e_per_s", &s.dark_nonuniformity_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("Dark current: rms over the array, log-normal"),
        config::key("hot_fraction", &s.hot_fraction)
            .range(0, 1)
            .help("Share of pixels with additional dark current"),
        config::key("hot_current_e_per_s", &s.hot_current_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("Its mean, exponentially distributed"),
        config::key("rts_fraction", &s.rts_fraction)
            .range(0, 1)
            .help("Share of pixels whose dark current jumps between two levels"),
        config::key("rts_current_e_per_s", &s.rts_current_e_per_s)
            .unit("e-/s")
            .range(0, 1e+09)
            .help("Mean distance of the levels, exponentially distributed"),
        config::key("hit_flux_per_cm2_s", &s.hit_flux_per_cm2_s)
            .unit("/cm2/s")
            .range(0, 1e+06)
            .help("Cosmic rays and protons through the array"),
        config::key("hit_depth_um", config::Scaled{&s.hit_depth_m, micro})
            .unit("um")
            .range(0.1, 1000)
            .help("Depth of the layer that collects their charge"),
        config::key("hit_charge_e_per_um", config::Scaled{&s.hit_charge_e_per_m, 1 / micro})
            .unit("e-/um")
            .range(0, 1e+06)
            .help("Mean charge along their tracks"),
        config::key("full_well_e", &s.full_well_e).unit("e-").range(1, 1e+07).help("Full well capacity"),
        config::key("blooming", &s.blooming)
            .range(0, 1)
            .help("Share of the charge above full well that goes to the 4 neighbours"),
        config::key("nonlinearity_1", &s.nonlinearity[0])
            .range(-1, 1)
            .help("S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c1"),
        config::key("nonlinearity_2", &s.nonlinearity[1])
            .range(-1, 1)
            .help("S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c2"),
        config::key("nonlinearity_3", &s.nonlinearity[2])
            .range(-1, 1)
            .help("S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c3"),
        config::key("nonlinearity_4", &s.nonlinearity[3])
            .range(-1, 1)
            .help("S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c4"),
        config::key("lag", &s.lag).range(0, 1).help("Share of a frame's charge that shows in the next one"),
        config::key("read_noise_e", &s.read_noise_e)
            .unit("e-")
            .range(0, 100000)
            .help("Amplifier noise of one sample"),
        config::key("double_sampling", &s.double_sampling)
            .help("A destructive read subtracts the reset level that follows: both noises count twice"),
        config::key("conversion_gain_uv_per_e", config::Scaled{&s.conversion_gain_v_per_e, micro})
            .unit("uV/e-")
            .range(0, 10000)
            .help("Of the sense node; gives the kTC noise, 0: none"),
        config::key("reset_mode", &s.reset_mode).help("A soft reset halves the variance of kTC noise"),
        config::key("offset_fpn_e", &s.offset_fpn_e)
            .unit("e-")
            .range(0, 100000)
            .help("rms of the pixels' offsets"),
        config::key("column_fpn_e", &s.column_fpn_e)
            .unit("e-")
            .range(0, 100000)
            .help("rms of the columns' offsets"),
        config::key("row_noise_e", &s.row_noise_e)
            .unit("e-")
            .range(0, 100000)
            .help("Temporal noise common to a row"),
        config::key("follower_rts_fraction", &s.follower_rts_fraction)
            .range(0, 1)
            .help("Share of pixels whose amplifier jumps between two levels: three in the difference of two "
                  "samples"),
        config::key("follower_rts_e", &s.follower_rts_e)
            .unit("e-")
            .range(0, 100000)
            .help("Mean distance of these levels, exponentially distributed"),
        config::key("gain_dn_per_e", &s.gain_dn_per_e)
            .unit("DN/e-")
            .range(1e-06, 1e+06)
            .help("System gain K at 0 dB"),
        config::key("offset_dn", &s.offset_dn).unit("DN").range(0, 65535).help("Black level"),
        config::key("adc_bits", &s.adc_bits).unit("bit").range(8, 16).help("Depth of the converter"),
        config::key("adc_inl_dn", &s.adc_inl_dn)
            .unit("DN")
            .range(0, 1000)
            .help("Converter: peak deviation of the transfer curve"),
        config::key("adc_dnl_dn", &s.adc_dnl_dn)
            .unit("DN")
            .range(0, 100)
            .help("Converter: rms deviation of the code widths"),
        config::key("dead_fraction", &s.dead_fraction).range(0, 1).help("Pixels without response"),
        config::key("stuck_fraction", &s.stuck_fraction)
            .range(0, 1)
            .help("Pixels that always give the same number"),
        config::key("dead_rows", &s.dead_rows).range(0, 65536).help("Rows that give nothing"),
        config::key("dead_columns", &s.dead_columns).range(0, 65536).help("Columns that give nothing"),
        config::key("test_pattern", &s.test_pattern).help("ramp: (x + y) mod 2^bits in place of the image"),
        config::key("response_map", config::Path{&s.response_map, true, true})
            .help("FITS image of the relative response, in place of the generated one"),
        config::key("dark_map", config::Path{&s.dark_map, true, true})
            .help("FITS image of the dark current, e-/s at the reference temperature"),
        config::key("offset_map", config::Path{&s.offset_map, true, true})
            .help("FITS image of the offsets, e-"),
    };
}

} // namespace

} // namespace obscura::sensors

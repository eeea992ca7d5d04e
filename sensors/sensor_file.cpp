#include "sensors/sensor_file.hpp"

#include <fmt/format.h>

namespace obscura::sensors {
namespace {

constexpr double micro = 1e-6;

/// A key whose words stand for the values of an enumeration.
template<typename Enum>
config::Word word(Enum& target, std::vector<std::pair<std::string_view, Enum>> words) {
    const auto set = [&target, words](std::string_view name) {
        for (const auto& [text, value] : words)
            if (text == name) target = value;
    };
    const auto get = [&target, words] {
        for (const auto& [text, value] : words)
            if (value == target) return std::string(text);
        return std::string();
    };
    return {set, get};
}

/// A sensor whose figures contradict each other; `where` and `at` name the table they came from.
void check_sensor(const SensorDescription& sensor, const config::Where& where, config::Position at) {
    const ReadoutSettings& r = sensor.readout;
    if (!(r.sample_instant_ns < r.reset_instant_ns && r.reset_instant_ns < r.row_overhead_ns))
        fail(where.in("readout"), at,
             fmt::format("sample_instant_ns {} < reset_instant_ns {} < row_overhead_ns {} does not hold",
                         r.sample_instant_ns, r.reset_instant_ns, r.row_overhead_ns));
    const DetectorSettings& d = sensor.detector;
    if (d.offset_dn >= static_cast<double>(1 << d.adc_bits))
        fail(where.in("detector"), at,
             fmt::format("offset_dn {} is above the full scale of {} bits", d.offset_dn, d.adc_bits));
}

} // namespace

void read_sensor(const config::Value& table, const config::Where& where, SensorDescription& sensor,
                 bool may_refer) {
    if (const config::Member* file = table.find("file"); may_refer && file != nullptr) {
        std::string path;
        config::Value only_file;
        only_file.members.push_back(*file);
        read_keys(only_file, where, {{"file", config::Path{&path}}});
        read_sensor(config::parse_file(path), {path, ""}, sensor, false);
    }
    std::vector<std::string_view> tables{"readout", "detector"};
    if (may_refer) tables.push_back("file");
    read_keys(table, where, keys_of(sensor), tables, true);
    const auto read_part = [&](std::string_view name, const config::Keys& keys) {
        if (const config::Member* member = table.find(name))
            read_keys(expect_table(member->value, where.in(name)), where.in(name), keys, {}, true);
    };
    read_part("readout", keys_of(sensor.readout));
    read_part("detector", keys_of(sensor.detector));
    const config::Member* readout = table.find("readout");
    check_sensor(sensor, where, readout != nullptr ? readout->at : table.at);
}

SensorDescription load_sensor(const std::filesystem::path& file) {
    SensorDescription sensor;
    sensor.name = file.stem().string();
    const config::Value root = config::parse_file(file);
    if (root.members.empty()) fail({file, ""}, root.at, "an empty sensor file; at least its name is needed");
    read_sensor(root, {file, ""}, sensor, false);
    return sensor;
}

config::Keys keys_of(SensorDescription& s) {
    return {
        {"name", &s.name, {}, {}, {}, "Name of the chip"},
        {"serial", &s.serial, {}, {0, 9e15}, {}, "Specimen: seeds the fixed patterns"},
        {"pixel_pitch_um", config::Scaled{&s.pixel_pitch_m, micro}, "um", {0.1, 1000}, {}, "Pixel pitch"},
    };
}

config::Keys keys_of(ReadoutSettings& s) {
    const config::Word shutter = word(
        s.shutter,
        {{"rolling", Shutter::rolling}, {"global", Shutter::global}, {"push-broom", Shutter::push_broom}});
    const config::Word window_mode = word(
        s.window_mode, {{"sequential", WindowMode::sequential}, {"interleaved", WindowMode::interleaved}});
    return {
        {"width", &s.width, "px", {1, 65536}, {}, "Columns of the array"},
        {"height", &s.height, "px", {1, 65536}, {}, "Rows of the array"},
        {"shutter", shutter, {}, {}, {"rolling", "global", "push-broom"}, "Shutter"},
        {"pixel_clock_hz", &s.pixel_clock_hz, "Hz", {1e3, 1e11}, {}, "Pixel clock of one output"},
        {"outputs", &s.outputs, {}, {1, 4096}, {}, "Pixels of a row read at once"},
        {"row_overhead_ns",
         &s.row_overhead_ns,
         "ns",
         {0, 1e9},
         {},
         "Row time beside the pixels: T_row = row_overhead + ceil(width / outputs) / pixel_clock"},
        {"sample_instant_ns", &s.sample_instant_ns, "ns", {0, 1e9}, {}, "Signal sample inside a row slot"},
        {"reset_instant_ns",
         &s.reset_instant_ns,
         "ns",
         {0, 1e9},
         {},
         "Reset inside a row slot: sample_instant < reset_instant < row_overhead"},
        {"frame_overhead_ns",
         &s.frame_overhead_ns,
         "ns",
         {0, 1e9},
         {},
         "Global shutter: charge transfer between exposure and readout"},
        {"overlapped", &s.overlapped, {}, {}, {}, "The next exposure may start while a frame is read out"},
        {"window_mode",
         window_mode,
         {},
         {},
         {"sequential", "interleaved"},
         "How a rolling shutter serves several windows: one after the other, or all in every cycle"},
        {"windows_max", &s.windows_max, {}, {1, 32}, {}, "Windows at once"},
        {"window_overhead_ns",
         &s.window_overhead_ns,
         "ns",
         {0, 1e9},
         {},
         "After the last row of each window"},
        {"blanking_rows", &s.blanking_rows, {}, {0, 1e6}, {}, "Idle row slots at the end of each cycle"},
        {"stretch_blanking",
         &s.stretch_blanking,
         {},
         {},
         {},
         "Add idle slots for an exposure that is longer than the cycle"},
        {"exposure_step_ns",
         &s.exposure_step_ns,
         "ns",
         {1, 1e9},
         {},
         "Global shutter and push-broom: exposures are multiples of this"},
        {"line_rate_hz", &s.line_rate_hz, "Hz", {1e-3, 1e7}, {}, "Push-broom: lines per second"},
        {"window_step", &s.window_step, "px", {1, 4096}, {}, "Place of a window is a multiple of this"},
        {"strict", &s.strict, {}, {}, {}, "Refuse impossible windows; otherwise crop and align them"},
    };
}

config::Keys keys_of(DetectorSettings& s) {
    return {
        {"transmission", &s.transmission, {}, {0, 1}, {}, "Transmission of the optics"},
        {"quantum_efficiency",
         config::Curve{&s.quantum_efficiency},
         {},
         {0, 1},
         {},
         "[wavelength_nm, quantum efficiency] pairs; linear between, ends held"},
        {"fill_factor",
         &s.fill_factor,
         {},
         {0, 1},
         {},
         "Share of the pixel that is sensitive, where the curve leaves it out"},
        {"prnu_local", &s.prnu_local, {}, {0, 1}, {}, "Response: relative rms from pixel to pixel"},
        {"prnu_global",
         &s.prnu_global,
         {},
         {0, 1},
         {},
         "Response: relative rms of the slow variation over the array"},
        {"crosstalk_edge",
         &s.crosstalk_edge,
         {},
         {0, 0.2},
         {},
         "Share of a pixel's charge that each of 4 neighbours gets"},
        {"crosstalk_corner",
         &s.crosstalk_corner,
         {},
         {0, 0.05},
         {},
         "The same for each of the 4 diagonal neighbours"},
        {"parasitic_light",
         &s.parasitic_light,
         {},
         {0, 1},
         {},
         "Global shutter: sensitivity of the storage node, relative to the pixel"},
        {"smear_row_ns",
         &s.smear_row_ns,
         "ns",
         {0, 1e+09},
         {},
         "Frame-transfer CCD: time per row under the open sky"},
        {"optical_black_rows",
         &s.optical_black_rows,
         {},
         {0, 65536},
         {},
         "Rows under a shield, after the electrically black ones"},
        {"electrical_black_rows",
         &s.electrical_black_rows,
         {},
         {0, 65536},
         {},
         "First rows of the array: no charge at all"},
        {"temperature_c", &s.temperature_c, "degC", {-200, 150}, {}, "Temperature of the chip"},
        {"dark_reference_c",
         &s.dark_reference_c,
         "degC",
         {-200, 150},
         {},
         "Temperature at which the dark currents hold"},
        {"dark_law",
         word(s.dark_law, {{"doubling", DarkLaw::doubling}, {"band-gap", DarkLaw::band_gap}}),
         {},
         {},
         {"doubling", "band-gap"},
         "How dark current rises with temperature"},
        {"dark_doubling_k",
         &s.dark_doubling_k,
         "K",
         {0.1, 1000},
         {},
         "Doubling law: doubles every so many kelvin"},
        {"dark_current_e_per_s",
         &s.dark_current_e_per_s,
         "e-/s",
         {0, 1e+09},
         {},
         "Dark current, mean over the array"},
        {"dark_nonuniformity_e_per_s",
         &s.dark_nonuniformity_e_per_s,
         "e-/s",
         {0, 1e+09},
         {},
         "Dark current: rms over the array, log-normal"},
        {"hot_fraction", &s.hot_fraction, {}, {0, 1}, {}, "Share of pixels with additional dark current"},
        {"hot_current_e_per_s",
         &s.hot_current_e_per_s,
         "e-/s",
         {0, 1e+09},
         {},
         "Its mean, exponentially distributed"},
        {"rts_fraction",
         &s.rts_fraction,
         {},
         {0, 1},
         {},
         "Share of pixels whose dark current jumps between two levels"},
        {"rts_current_e_per_s",
         &s.rts_current_e_per_s,
         "e-/s",
         {0, 1e+09},
         {},
         "Mean distance of the levels, exponentially distributed"},
        {"hit_flux_per_cm2_s",
         &s.hit_flux_per_cm2_s,
         "/cm2/s",
         {0, 1e+06},
         {},
         "Cosmic rays and protons through the array"},
        {"hit_depth_um",
         config::Scaled{&s.hit_depth_m, micro},
         "um",
         {0.1, 1000},
         {},
         "Depth of the layer that collects their charge"},
        {"hit_charge_e_per_um",
         config::Scaled{&s.hit_charge_e_per_m, 1 / micro},
         "e-/um",
         {0, 1e+06},
         {},
         "Mean charge along their tracks"},
        {"full_well_e", &s.full_well_e, "e-", {1, 1e+07}, {}, "Full well capacity"},
        {"blooming",
         &s.blooming,
         {},
         {0, 1},
         {},
         "Share of the charge above full well that goes to the 4 neighbours"},
        {"nonlinearity_1",
         &s.nonlinearity[0],
         {},
         {-1, 1},
         {},
         "S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c1"},
        {"nonlinearity_2",
         &s.nonlinearity[1],
         {},
         {-1, 1},
         {},
         "S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c2"},
        {"nonlinearity_3",
         &s.nonlinearity[2],
         {},
         {-1, 1},
         {},
         "S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c3"},
        {"nonlinearity_4",
         &s.nonlinearity[3],
         {},
         {-1, 1},
         {},
         "S = N (1 - c1 x - c2 x^2 - c3 x^3 - c4 x^4), x = N / full well: c4"},
        {"lag", &s.lag, {}, {0, 1}, {}, "Share of a frame's charge that shows in the next one"},
        {"read_noise_e", &s.read_noise_e, "e-", {0, 100000}, {}, "Amplifier noise of one sample"},
        {"double_sampling",
         &s.double_sampling,
         {},
         {},
         {},
         "A destructive read subtracts the reset level that follows: both noises count twice"},
        {"conversion_gain_uv_per_e",
         config::Scaled{&s.conversion_gain_v_per_e, micro},
         "uV/e-",
         {0, 10000},
         {},
         "Of the sense node; gives the kTC noise, 0: none"},
        {"reset_mode",
         word(s.reset_mode, {{"hard", ResetMode::hard}, {"soft", ResetMode::soft}}),
         {},
         {},
         {"hard", "soft"},
         "A soft reset halves the variance of kTC noise"},
        {"offset_fpn_e", &s.offset_fpn_e, "e-", {0, 100000}, {}, "rms of the pixels' offsets"},
        {"column_fpn_e", &s.column_fpn_e, "e-", {0, 100000}, {}, "rms of the columns' offsets"},
        {"row_noise_e", &s.row_noise_e, "e-", {0, 100000}, {}, "Temporal noise common to a row"},
        {"follower_rts_fraction",
         &s.follower_rts_fraction,
         {},
         {0, 1},
         {},
         "Share of pixels whose amplifier jumps between two levels: three in the difference of two samples"},
        {"follower_rts_e",
         &s.follower_rts_e,
         "e-",
         {0, 100000},
         {},
         "Mean distance of these levels, exponentially distributed"},
        {"gain_dn_per_e", &s.gain_dn_per_e, "DN/e-", {1e-06, 1e+06}, {}, "System gain K at 0 dB"},
        {"offset_dn", &s.offset_dn, "DN", {0, 65535}, {}, "Black level"},
        {"adc_bits", &s.adc_bits, "bit", {8, 16}, {}, "Depth of the converter"},
        {"adc_inl_dn", &s.adc_inl_dn, "DN", {0, 1000}, {}, "Converter: peak deviation of the transfer curve"},
        {"adc_dnl_dn", &s.adc_dnl_dn, "DN", {0, 100}, {}, "Converter: rms deviation of the code widths"},
        {"dead_fraction", &s.dead_fraction, {}, {0, 1}, {}, "Pixels without response"},
        {"stuck_fraction", &s.stuck_fraction, {}, {0, 1}, {}, "Pixels that always give the same number"},
        {"dead_rows", &s.dead_rows, {}, {0, 65536}, {}, "Rows that give nothing"},
        {"dead_columns", &s.dead_columns, {}, {0, 65536}, {}, "Columns that give nothing"},
        {"test_pattern",
         word(s.test_pattern, {{"off", TestPattern::off}, {"ramp", TestPattern::ramp}}),
         {},
         {},
         {"off", "ramp"},
         "ramp: (x + y) mod 2^bits in place of the image"},
        {"response_map",
         config::Path{&s.response_map, true, true},
         {},
         {},
         {},
         "FITS image of the relative response, in place of the generated one"},
        {"dark_map",
         config::Path{&s.dark_map, true, true},
         {},
         {},
         {},
         "FITS image of the dark current, e-/s at the reference temperature"},
        {"offset_map", config::Path{&s.offset_map, true, true}, {}, {}, {}, "FITS image of the offsets, e-"},
    };
}

} // namespace obscura::sensors

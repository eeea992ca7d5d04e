// SPDX-License-Identifier: Apache-2.0
// Verb `obscura sensor`: list of sensors, sensor parameters with provenance, readout plans, fixed patterns.
#include "sensors/sensor.hpp"

#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "images/writers/raw.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/sensor_file.hpp"
#include "tools/pictures/readout_picture.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>

namespace obscura::tools {
namespace {

using sensors::ReadoutPlan;
using sensors::WindowRequest;

std::string text_of(const config::Value& value) {
    using Kind = config::Value::Kind;
    switch (value.kind) {
    case Kind::boolean:
        return value.boolean ? "true" : "false";
    case Kind::integer:
        return fmt::format("{}", value.integer);
    case Kind::real:
        return fmt::format("{}", value.real);
    case Kind::string:
        return value.string;
    case Kind::array:
        return value.items.size() > 1 ? fmt::format("{} points", value.items.size()) : "1 point";
    default:
        return "?";
    }
}

double number(std::string_view text, std::string_view whole) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size())
        throw host::UsageError(
            fmt::format("obscura sensor: --windows: \"{}\" in \"{}\" is no number", text, whole));
    return value;
}

std::vector<std::string_view> split(std::string_view text, char by) {
    std::vector<std::string_view> parts;
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(by, at), text.size());
        parts.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return parts;
}

std::int64_t nanoseconds(double us) {
    // Clamp to an integer far beyond any exposure: the readout plan refuses it with a proper message.
    return std::llround(std::clamp(us * 1e3, -1e18, 1e18));
}

/// "X,Y,WIDTH,HEIGHT,EXPOSURE_US[,SAMPLING,READS];..."
std::vector<WindowRequest> parse_windows(const std::string& text) {
    std::vector<WindowRequest> windows;
    for (const std::string_view part : split(text, ';')) {
        const auto fields = split(part, ',');
        if (fields.size() != 5 && fields.size() != 7)
            throw host::UsageError(
                fmt::format("obscura sensor: --windows: \"{}\": "
                            "X,Y,WIDTH,HEIGHT,EXPOSURE_US and optionally SAMPLING,READS are wanted",
                            part));
        const auto pixels = [&](std::size_t i) {
            return static_cast<std::int32_t>(std::clamp(number(fields[i], part), -1e9, 1e9));
        };
        WindowRequest w;
        w.region = {pixels(0), pixels(1), pixels(2), pixels(3)};
        w.exposure_ns = nanoseconds(number(fields[4], part));
        if (fields.size() == 7) {
            if (fields[5] == "destructive")
                w.sampling = Sampling::destructive;
            else if (fields[5] == "non-destructive")
                w.sampling = Sampling::non_destructive;
            else if (fields[5] == "cds")
                w.sampling = Sampling::cds;
            else if (fields[5] == "ramp")
                w.sampling = Sampling::ramp;
            else
                throw host::UsageError(fmt::format(
                    "obscura sensor: --windows: \"{}\": destructive, non-destructive, cds or ramp are allowed",
                    fields[5]));
            w.reads = pixels(6);
        }
        windows.push_back(w);
    }
    return windows;
}

class Sensor final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "shows sensor parameters and readout timing: row reset and read times";
        line.description =
            "The action list prints the shipped sensors. show prints every parameter of a sensor with its provenance and source. plan prints the readout of a frame: for each window the reset and read times of its first and last row and the exposure obtained; "
            "as text, as JSON, or as a picture of rows against time. maps writes the sensor's fixed-pattern maps (response, dark current, offset), which depend on its serial number, as FITS files. "
            "flags prints the bits of the readout flags, which the cards Wnn_FLAG of frames have. "
            "NAME is a shipped sensor or the path of a sensor file.";
        host::Option& action = line.positional("ACTION", &action_, "What to print or write");
        action.choices = {"list", "show", "plan", "maps", "flags"};
        host::Option& name = line.positional(
            "NAME", &name_, "Sensor (show, plan, maps): a name that list prints, or a .toml file");
        name.required = false;
        line.option("--exposure-us", &exposure_us_, "US",
                    "With plan: exposure time of the full array in microseconds");
        line.option(
            "--windows", &windows_, "LIST",
            "With plan: read windows instead of the full array, each X,Y,WIDTH,HEIGHT,EXPOSURE_US[,SAMPLING,READS], separated by ';'; "
            "SAMPLING is destructive, non-destructive, cds or ramp");
        line.option("--svg", &svg_, "FILE", "With plan: also write the picture of rows against time as SVG");
        line.option("-o,--output", &output_, "DIR", "With maps: folder for the FITS files, which must exist");
        line.flag("--json", json_, "With list, show, plan and flags: print JSON");
        line.examples = {
            "obscura sensor list", "obscura sensor show has2",
            "obscura sensor plan has2 --exposure-us 66000 --svg has2.svg",
            "obscura sensor plan has3-like --json --windows \"0,0,20,20,100;0,200,300,300,15000\""};
    }

    int run() override {
        if (action_ == "list") return list();
        if (action_ == "flags") return flags();
        if (name_.empty())
            throw host::UsageError("obscura sensor: NAME is missing; obscura sensor list prints the sensors");
        const std::filesystem::path file = config::file_or_shipped(config::shipped_sensors, name_);
        const SensorDescription sensor = sensors::load_sensor(file);
        if (const std::string why = sensors::explain_invalid(sensor.detector); !why.empty())
            throw ConfigError(fmt::format("{}: detector.{}", file.string(), why));
        if (action_ == "show") return show(file, sensor);
        if (action_ == "maps") return maps(sensor);
        return plan(sensor);
    }

private:
    int list() const {
        nlohmann::json all = nlohmann::json::array();
        for (const auto& file : config::shipped_files(config::shipped_sensors)) {
            const SensorDescription s = sensors::load_sensor(file);
            if (json_)
                all.push_back({{"name", file.stem().string()},
                               {"chip", s.name},
                               {"width", s.readout.width},
                               {"height", s.readout.height},
                               {"pixel_pitch_um", s.pixel_pitch_m * 1e6},
                               {"pixel_pitch_y_um", s.row_pitch_m() * 1e6},
                               {"adc_bits", s.detector.adc_bits},
                               {"file", file.string()}});
            else
                fmt::print(
                    "{:<12} {:<12} {:>5} x {:<5} {:>6.2f}{} um {:>3} bit\n", file.stem().string(), s.name,
                    s.readout.width, s.readout.height, s.pixel_pitch_m * 1e6,
                    s.row_pitch_m() == s.pixel_pitch_m ? "" : fmt::format(" x {:.2f}", s.row_pitch_m() * 1e6),
                    s.detector.adc_bits);
        }
        if (json_) fmt::print("{}\n", all.dump(2));
        return exit_ok;
    }

    int flags() const {
        nlohmann::ordered_json all = nlohmann::ordered_json::array();
        for (const sensors::ReadoutFlagName& flag : sensors::readout_flags())
            if (json_)
                all.push_back({{"bit", std::countr_zero(flag.bit)},
                               {"value", flag.bit},
                               {"name", flag.name},
                               {"meaning", flag.meaning}});
            else
                fmt::print("{:>4}  {:<17} {}\n", flag.bit, flag.name, flag.meaning);
        if (json_) fmt::print("{}\n", all.dump(2));
        return exit_ok;
    }

    int show(const std::filesystem::path& file, const SensorDescription& sensor) const {
        const config::Value root = config::parse_file(file);
        nlohmann::json all;
        const auto each = [&](const config::Value& table, const std::string& path, auto&& again) -> void {
            for (const config::Member& member : table.members) {
                const config::Member* value = member.value.find("value");
                if (value == nullptr && member.value.kind == config::Value::Kind::table) {
                    again(member.value, path + member.key + ".", again);
                    continue;
                }
                const auto note = [&](const char* key) {
                    const config::Member* found = member.value.find(key);
                    return found != nullptr ? found->value.string : std::string("not given");
                };
                const bool annotated = value != nullptr;
                const std::string text = text_of(annotated ? value->value : member.value);
                if (json_)
                    all[path + member.key] = {{"value", text},
                                              {"provenance", annotated ? note("provenance") : ""},
                                              {"source", annotated ? note("source") : ""}};
                else
                    fmt::print("{:<38} {:<12} {:<9} {}\n", path + member.key, text,
                               annotated ? note("provenance") : "", annotated ? note("source") : "");
            }
        };
        if (!json_) fmt::print("{}: {}\n", file.string(), sensor.name);
        each(root, "", each);
        if (json_) fmt::print("{}\n", all.dump(2));
        return exit_ok;
    }

    int maps(const SensorDescription& sensor) const {
        if (output_.empty()) throw host::UsageError("obscura sensor maps: -o DIR is missing");
        sensors::FixedPattern(sensor).write_fits(output_, sensor);
        fmt::print("{0}/response.fits, {0}/dark_e_per_s.fits and {0}/offset_e.fits written\n", output_);
        return exit_ok;
    }

    int plan(const SensorDescription& sensor) const {
        std::vector<WindowRequest> windows;
        if (windows_.empty())
            windows.push_back(
                {{0, 0, sensor.readout.width, sensor.readout.height}, nanoseconds(exposure_us_)});
        else
            windows = parse_windows(windows_);
        ReadoutPlan plan;
        if (const std::string why = plan_readout(sensor.readout, windows, Time{}, plan); !why.empty())
            throw ConfigError(fmt::format("{}: {}", name_, why));
        if (!svg_.empty()) images::write_text(svg_, readout_picture(sensor.name, plan));
        if (json_)
            print_json(sensor, plan);
        else
            print_text(sensor, plan);
        return exit_ok;
    }

    static void print_json(const SensorDescription& sensor, const ReadoutPlan& plan) {
        nlohmann::json out{{"sensor", sensor.name},
                           {"row_ns", plan.row_ns},
                           {"readout_ns", plan.readout_ns},
                           {"cycle_ns", plan.cycle_ns},
                           {"frame_period_ns", plan.frame_period_ns},
                           {"windows", nlohmann::json::array()}};
        for (const FrameWindow& w : plan.windows) {
            const auto first = static_cast<std::size_t>(w.image_y);
            const std::size_t last = first + static_cast<std::size_t>(w.sensor.height) - 1;
            out["windows"].push_back({{"x", w.sensor.x},
                                      {"y", w.sensor.y},
                                      {"width", w.sensor.width},
                                      {"height", w.sensor.height},
                                      {"rows", w.sensor.height},
                                      {"read_index", w.read_index},
                                      {"first_reset_ns", plan.rows[first].reset.ns},
                                      {"first_read_ns", plan.rows[first].read.ns},
                                      {"last_read_ns", plan.rows[last].read.ns},
                                      {"exposure_ns",
                                       {{"min", w.exposure_min_ns},
                                        {"max", w.exposure_max_ns},
                                        {"requested", w.exposure_requested_ns}}},
                                      {"flags", nlohmann::json::array()}});
            const std::string names = sensors::flag_names(w.flags);
            if (!names.empty())
                for (const std::string_view name : split(names, '|'))
                    out["windows"].back()["flags"].push_back(name);
        }
        fmt::print("{}\n", out.dump(2));
    }

    static void print_text(const SensorDescription& sensor, const ReadoutPlan& plan) {
        fmt::print("{}: row {:.3f} us, readout {:.3f} ms, frame period {:.3f} ms (at most {:.3f} frames/s)\n",
                   sensor.name, static_cast<double>(plan.row_ns) * 1e-3,
                   static_cast<double>(plan.readout_ns) * 1e-6,
                   static_cast<double>(plan.frame_period_ns) * 1e-6,
                   1e9 / static_cast<double>(plan.frame_period_ns));
        for (const FrameWindow& w : plan.windows) {
            const auto first = static_cast<std::size_t>(w.image_y);
            const std::size_t last = first + static_cast<std::size_t>(w.sensor.height) - 1;
            fmt::print(
                "window {} {}x{} at ({}, {}): exposure {:.3f} us asked, {:.3f} to {:.3f} us obtained{}{}\n",
                w.request, w.sensor.width, w.sensor.height, w.sensor.x, w.sensor.y,
                static_cast<double>(w.exposure_requested_ns) * 1e-3,
                static_cast<double>(w.exposure_min_ns) * 1e-3, static_cast<double>(w.exposure_max_ns) * 1e-3,
                w.flags != 0 ? ", " : "", sensors::flag_names(w.flags));
            fmt::print(
                "  first row: reset {:.3f} us, read {:.3f} us; last row: reset {:.3f} us, read {:.3f} us\n",
                static_cast<double>(plan.rows[first].reset.ns) * 1e-3,
                static_cast<double>(plan.rows[first].read.ns) * 1e-3,
                static_cast<double>(plan.rows[last].reset.ns) * 1e-3,
                static_cast<double>(plan.rows[last].read.ns) * 1e-3);
        }
    }

    std::string action_, name_, windows_, svg_, output_;
    double exposure_us_ = 10'000;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_sensor() {
    return std::make_unique<Sensor>();
}

} // namespace obscura::tools

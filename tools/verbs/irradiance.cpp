// SPDX-License-Identifier: Apache-2.0
// Verb `obscura irradiance`: light that surfaces receive and absorb, and its force and torque.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "host/interrupt.hpp"
#include "images/writers/raw.hpp"
#include "renderer/received/received_light.hpp"
#include "renderer/received/receivers.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tools/irradiance/patch_table.hpp"
#include "tools/scene/progress.hpp"
#include "tools/scene/scene_time.hpp"
#include "tools/scene/vector_json.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;
using renderer::BodyReceivedLight;
using renderer::ReceivedLight;

class Irradiance final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        std::string endings;
        for (const auto& [ending, what] : patch_file_endings())
            endings += fmt::format("{}{} ({})", endings.empty() ? "" : ", ", ending, what);
        line.summary = "computes the light that surfaces receive and absorb, and its force and torque";
        line.description =
            "Gathers the light on each patch of the scene's bodies at an instant: facets of meshes, cells of longitude and latitude of other shapes. "
            "It comes from the Sun with its disc, from lamps, from other bodies and the body itself after any number of reflections, and by way of mirrors. "
            "Printed are sums over each body: power by cause, absorbed power, and force and torque of the light (body frame; about its origin). "
            "With --until they are printed as CSV for a series of times. "
            "Light is that in the bands of the scene; with --whole-spectrum the Sun's light of all wavelengths is divided among them, which force and heat need. "
            "Where it comes from and what is left out: docs/irradiance.md.";
        line.positional("SCENE", &scene_, "Scene file (TOML), or the name of a shipped scene");
        line.option("-o,--output", &output_, "FILE",
                    "File of the patches, by the ending of its name: " + endings +
                        "; of several bodies one file each, with the body's name before the ending. "
                        "With --until the CSV file of the series");
        line.option("-t,--time", &time_, "T", scene_time_help);
        line.option("--until", &until_, "T", "Last time of a series, as --time");
        line.number("--step", &step_s_, "S", "Seconds between the times of a series", 1e-3, 1e9);
        line.option("--bodies", &settings_.bodies, "NAME",
                    "Only this body; may be given several times. All light counts");
        line.flag("--whole-spectrum", settings_.whole_spectrum,
                  "Divide the light of the whole solar spectrum among the bands");
        line.number("--points", &settings_.points, "N",
                    "Points of each patch at least, with a shadow ray to each light", 1, 4096);
        line.number("--directions", &settings_.directions, "N",
                    "Directions over the hemisphere of each patch at least, to surfaces nearby", 1, 65536);
        line.number("--far-directions", &settings_.far_directions, "N",
                    "Directions from each patch at least, to each body far away", 1, 65536);
        line.number("--bounces", &settings_.max_bounces, "N", "Most reflections; 0: direct light only", 0,
                    1000);
        line.number("--photons", &settings_.photons, "N",
                    "Photons from each light to each mirror; 0: no light by way of mirrors", 0,
                    1'000'000'000);
        line.number("--rows", &settings_.rows, "N", "Cells from pole to pole of bodies without facets", 4,
                    2000);
        line.number("--seed", &settings_.seed, "N", "Seed of the random numbers", 0, 1e15);
        line.number("--threads", &settings_.threads, "N", "Threads; 0: one per core", 0, 1024);
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura irradiance demo",
            "obscura irradiance demo --whole-spectrum -o light.ply",
            "obscura irradiance scene.toml --until 86400 --step 600 --whole-spectrum -o push.csv",
        };
    }

    int run() override {
        const std::filesystem::path file = output_;
        std::vector<std::string_view> endings;
        for (const auto& [ending, what] : patch_file_endings())
            endings.push_back(ending);
        const bool series = !until_.empty();
        if (!output_.empty() && series && file.extension() != ".csv")
            throw host::UsageError(fmt::format("obscura irradiance: --output {}: a series is written as .csv",
                                               printable(output_)));
        if (!output_.empty()) host::require_ending("obscura irradiance: --output", file, endings);
        if (series && json_)
            throw host::UsageError("obscura irradiance: --json prints one instant, not a series");
        scene::Scene scene = scene::load_scene(config::file_or_shipped(config::shipped_scenes, scene_));
        const double begin_s = scene_time_of(scene, time_, "obscura irradiance: --time");
        const double end_s = series ? scene_time_of(scene, until_, "obscura irradiance: --until") : begin_s;
        if (end_s < begin_s)
            throw host::UsageError(
                fmt::format("obscura irradiance: --until {}: before --time {}", until_, time_));
        const auto steps = static_cast<std::uint64_t>((end_s - begin_s) / step_s_ + 1e-9);
        constexpr std::uint64_t max_steps = 1'000'000;
        if (steps > max_steps)
            throw host::UsageError(
                fmt::format("obscura irradiance: --until: {} times, allowed {}", steps, max_steps));
        std::optional<Progress> progress;
        std::uint64_t step = 0;
        settings_.go_on = [&](double share) {
            if (progress) progress->done(step * 1000 + static_cast<std::uint64_t>(1000 * share));
            return !host::interrupted();
        };
        renderer::ReceivedLightMap map(std::move(scene), settings_);
        progress.emplace("light", 1000 * (steps + 1));
        if (!series) {
            const std::optional<ReceivedLight> light = map.at(begin_s);
            progress.reset();
            if (!light) return exit_failure;
            print(begin_s, *light);
            write(*light);
            return exit_ok;
        }
        std::string csv = "time_s,body,force_x_n,force_y_n,force_z_n,torque_x_nm,torque_y_nm,torque_z_nm,";
        for (const auto& [cause, name] : enum_names(renderer::LightCause{}))
            csv += fmt::format("{}_w,", name);
        csv += "absorbed_w,lit_area_m2\n";
        for (; step <= steps; ++step) {
            const double time_s = begin_s + static_cast<double>(step) * step_s_;
            const std::optional<ReceivedLight> light = map.at(time_s);
            if (!light) return exit_failure;
            for (const BodyReceivedLight& body : light->bodies)
                csv += series_line(time_s, body);
        }
        progress.reset();
        if (output_.empty())
            fmt::print("{}", csv);
        else
            images::write_text(file, csv);
        return exit_ok;
    }

private:
    /// Force in inertial axes, as a dynamics simulator adds it up; torque in body axes.
    static std::string series_line(double time_s, const BodyReceivedLight& body) {
        const Vec3 f = rotate(body.to_inertial, body.sums.force_n), t = body.sums.torque_nm;
        std::string line =
            fmt::format("{},{},{},{},{},{},{},{},", time_s, body.name, f.x, f.y, f.z, t.x, t.y, t.z);
        for (const double power : body.sums.incident_w)
            line += fmt::format("{},", power);
        return line + fmt::format("{},{}\n", body.sums.absorbed_w, body.sums.lit_area_m2);
    }

    void print(double time_s, const ReceivedLight& light) const {
        if (json_) return print_json(time_s, light);
        const std::size_t bands = light.bodies.empty() ? 0 : light.bodies.front().bands;
        fmt::print(
            "t = {:g} s; light of {} band{}, {:.1f} % of the Sun's power{}; {} reflections, {:.3g} million rays\n",
            time_s, bands, bands == 1 ? "" : "s", 100 * light.solar_share,
            settings_.whole_spectrum ? ", the rest divided among them" : "", light.bounces,
            static_cast<double>(light.rays) / 1e6);
        fmt::print("\n{:<18} {:>9} {:>11}", "body", "patches", "area m2");
        for (const auto& [cause, name] : enum_names(renderer::LightCause{}))
            fmt::print(" {:>12}", fmt::format("{} W", name));
        fmt::print(" {:>12}  {:<34}  {}\n", "absorbed W", "force N (body frame)", "torque N m");
        for (const BodyReceivedLight& body : light.bodies) {
            fmt::print("{:<18} {:>9} {:>11.5g}", printable(body.name), body.receivers->patches().size(),
                       body.receivers->area_m2());
            for (const double power : body.sums.incident_w)
                fmt::print(" {:>12.6g}", power);
            fmt::print(" {:>12.6g}  {:<34}  {}\n", body.sums.absorbed_w, vector_text(body.sums.force_n),
                       vector_text(body.sums.torque_nm));
        }
        for (const std::string& note : light.notes)
            print_message("obscura irradiance: " + note);
    }

    static std::string vector_text(Vec3 v) { return fmt::format("{:.4g} {:.4g} {:.4g}", v.x, v.y, v.z); }

    void print_json(double time_s, const ReceivedLight& light) const {
        Json out{{"time_s", time_s},
                 {"solar_share", light.solar_share},
                 {"whole_spectrum", settings_.whole_spectrum},
                 {"bounces", light.bounces},
                 {"rays", light.rays},
                 {"inner_share", light.inner_share},
                 {"notes", light.notes},
                 {"bodies", Json::array()}};
        for (const BodyReceivedLight& body : light.bodies) {
            Json incident = Json::object();
            for (const auto& [cause, name] : enum_names(renderer::LightCause{}))
                incident[std::string(name)] = body.sums.incident_w[static_cast<std::size_t>(cause)];
            out["bodies"].push_back({{"name", body.name},
                                     {"patches", body.receivers->patches().size()},
                                     {"area_m2", body.receivers->area_m2()},
                                     {"incident_w", incident},
                                     {"absorbed_w", body.sums.absorbed_w},
                                     {"leaving_w", body.sums.leaving_w},
                                     {"emitted_w", body.sums.emitted_w},
                                     {"lit_area_m2", body.sums.lit_area_m2},
                                     {"force_n", vector_json(body.sums.force_n)},
                                     {"torque_nm", vector_json(body.sums.torque_nm)},
                                     {"to_inertial", quaternion_json(body.to_inertial)}});
        }
        fmt::print("{}\n", out.dump(-1, ' ', false, Json::error_handler_t::replace));
    }

    void write(const ReceivedLight& light) const {
        if (output_.empty()) return;
        const std::filesystem::path file = output_;
        for (const BodyReceivedLight& body : light.bodies) {
            std::filesystem::path target = file;
            if (light.bodies.size() > 1)
                target.replace_filename(
                    fmt::format("{}-{}{}", file.stem().string(), body.name, file.extension().string()));
            write_patch_table(target, patch_table(body));
        }
    }

    std::string scene_, output_, time_ = "0", until_;
    double step_s_ = 60;
    bool json_ = false;
    renderer::ReceivedLightSettings settings_;
};

} // namespace

std::unique_ptr<Verb> make_irradiance() {
    return std::make_unique<Irradiance>();
}

} // namespace obscura::tools

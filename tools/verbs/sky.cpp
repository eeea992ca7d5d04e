// SPDX-License-Identifier: Apache-2.0
// Verb `obscura sky`: stars and bodies in the field of a scene's camera, as a table and as a chart.
#include "config/shipped_files.hpp"
#include "core/camera/scene_truth.hpp"
#include "core/units.hpp"
#include "ephemeris/stars/star_names.hpp"
#include "ephemeris/time/leap_seconds.hpp"
#include "ephemeris/time/time_text.hpp"
#include "images/writers/raw.hpp"
#include "renderer/renderer.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "tools/pictures/sky_chart.hpp"
#include "tools/scene/scene_time.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;

class Sky final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "lists what is in the camera's field: stars with names, bodies; draws a chart";
        line.description =
            "Prints the stars, sky objects, bodies and landmarks that a scene's camera has in its field at an instant: name, number in the scene, V magnitude, right ascension and declination (J2000), pixel, and whether a body hides it. "
            "Pixels are true positions with distortion, light time and aberration; "
            "the centre of the upper left pixel is (0, 0). "
            "With --output also a chart with names and a coordinate grid, as SVG or PNG by the name's ending: the field as the camera sees it, bodies with limb and terminator. "
            "Nothing is rendered. "
            "The same positions for frames with exposure and readout: --truth-table of obscura render and obscura capture (docs/truth.md).";
        line.positional("SCENE", &scene_, "Scene file (TOML), or the name of a shipped scene");
        line.option("-t,--time", &time_, "T", scene_time_help);
        line.number("--faintest", &faintest_, "V", "Leave out stars that are fainter than this V magnitude",
                    -30, 99);
        line.option("-o,--output", &output_, "FILE", "Chart to write: .svg or .png");
        line.number("--side", &side_, "PX", "Longer side of the field in the chart, in pixels", 200, 8000);
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura sky demo",
            "obscura sky config/scenes/demo.toml --time 60 --faintest 5 -o sky.svg",
            "obscura sky demo --json",
        };
    }

    int run() override {
        const std::string ending = std::filesystem::path(output_).extension().string();
        if (!output_.empty() && ending != ".svg" && ending != ".png")
            throw host::UsageError(
                fmt::format("obscura sky: --output {}: the name must end in .svg or .png", output_));
        const scene::Scene scene = scene::load_scene(config::file_or_shipped(config::shipped_scenes, scene_));
        time_s_ = scene_time_of(scene, time_, "obscura sky: --time");
        const renderer::Renderer renderer(scene, {});
        FrameWindow window;
        window.sensor = {0, 0, scene.camera.width, scene.camera.height};
        const Time when{std::llround(time_s_ * 1e9)};
        const std::vector<RowTime> rows(static_cast<std::size_t>(scene.camera.height), RowTime{when, when});
        renderer::TruthRequest request;
        request.windows = {&window, 1};
        request.rows = rows;
        request.features = request.body_light = false;
        if (output_.empty()) request.curve_points = 0; // the chart alone shows them
        SceneTruth truth;
        renderer.list_truth(request, truth);
        const ephemeris::StarNames names;
        print(scene, truth, names);
        if (output_.empty()) return exit_ok;
        const Drawing drawing = draw_sky({.scene = scene,
                                          .truth = truth,
                                          .names = names,
                                          .curve_points = static_cast<std::int32_t>(request.curve_points),
                                          .time_s = time_s_,
                                          .faintest_v = faintest_,
                                          .side = side_});
        if (ending == ".svg")
            images::write_text(output_, drawing.svg());
        else
            drawing.write_png(output_);
        return exit_ok;
    }

private:
    /// Instant of the scene time, in UTC; empty: the scene has no epoch.
    [[nodiscard]] std::string instant_of(const scene::Scene& scene) const {
        if (!scene.epoch) return {};
        return ephemeris::write_time({scene.epoch->tai_ns + std::llround(time_s_ * 1e9)},
                                     ephemeris::TimeScale::utc, ephemeris::TimeForm::iso,
                                     ephemeris::system_leap_seconds(), 3);
    }

    void print(const scene::Scene& scene, const SceneTruth& truth, const ephemeris::StarNames& names) const {
        std::vector<const TruthEntry*> stars, bodies, landmarks, sky_objects;
        for (const TruthEntry& e : truth.entries) {
            if (e.kind == TruthKind::star && e.object >= 0 && e.magnitude_v <= faintest_) stars.push_back(&e);
            if (is_sky_object(e) && e.magnitude_v <= faintest_) sky_objects.push_back(&e);
            if (e.visibility == TruthVisibility::outside) continue;
            if (e.kind == TruthKind::body) bodies.push_back(&e);
            if (e.kind == TruthKind::landmark) landmarks.push_back(&e);
        }
        std::stable_sort(stars.begin(), stars.end(), [](const TruthEntry* a, const TruthEntry* b) {
            return a->magnitude_v < b->magnitude_v;
        });
        const auto [ra, dec] = boresight_of(truth.poses.front().pose);
        const std::string instant = instant_of(scene);
        Json out{{"time_s", time_s_},
                 {"instant", instant.empty() ? Json(nullptr) : Json(instant)},
                 {"boresight_ra_deg", ra / degree},
                 {"boresight_dec_deg", dec / degree},
                 {"bodies", Json::array()},
                 {"landmarks", Json::array()},
                 {"sky_objects", Json::array()},
                 {"stars", Json::array()}};
        if (!json_)
            fmt::print(
                "t = {:g} s{}, boresight RA {:.4f} deg, Dec {:+.4f} deg (J2000); {} bodies, {} stars\n",
                time_s_, instant.empty() ? "" : fmt::format(" ({})", instant), ra / degree, dec / degree,
                bodies.size(), stars.size());
        print_places("body", "bodies", bodies, out);
        print_places("landmark", "landmarks", landmarks, out);
        print_sky_objects(sky_objects, out);
        if (!json_ && !stars.empty())
            fmt::print("\n{:<16} {:<10} {:>7} {:>6} {:>10} {:>10} {:>11} {:>11}  {}\n", "star", "", "number",
                       "V", "RA deg", "Dec deg", "x px", "y px", "seen");
        for (const TruthEntry* e : stars) {
            const scene::Star star = scene::star_of(scene, static_cast<std::uint32_t>(e->object));
            const ephemeris::StarName name = names.at(star.right_ascension_rad, star.declination_rad);
            const double star_ra = star.right_ascension_rad / degree,
                         star_dec = star.declination_rad / degree;
            if (json_)
                out["stars"].push_back({{"name", name.proper},
                                        {"designation", name.designation},
                                        {"object", e->object},
                                        {"magnitude_v", e->magnitude_v},
                                        {"ra_deg", star_ra},
                                        {"dec_deg", star_dec},
                                        {"x_px", e->x_px},
                                        {"y_px", e->y_px},
                                        {"visibility", name_of(e->visibility)}});
            else
                fmt::print("{:<16} {:<10} {:>7} {:>6.2f} {:>10.4f} {:>+10.4f} {:>11} {:>11}  {}\n",
                           name.proper, name.designation, e->object, e->magnitude_v, star_ra, star_dec,
                           pixel(e->x_px), pixel(e->y_px), name_of(e->visibility));
        }
        if (json_) fmt::print("{}\n", out.dump(-1, ' ', false, Json::error_handler_t::replace));
    }

    /// Bodies or landmarks.
    void print_places(const char* title, const char* list, const std::vector<const TruthEntry*>& entries,
                      Json& out) const {
        if (!json_ && !entries.empty())
            fmt::print("\n{:<22} {:>14} {:>11} {:>11}  {}\n", title, "range m", "x px", "y px", "seen");
        for (const TruthEntry* e : entries) {
            if (!json_) {
                fmt::print("{:<22} {:>14.6g} {:>11} {:>11}  {}\n", e->name.view(), e->range_m, pixel(e->x_px),
                           pixel(e->y_px), name_of(e->visibility));
                continue;
            }
            Json entry{{"name", e->name.view()},  {"object", e->object},
                       {"range_m", e->range_m},   {"x_px", number(e->x_px)},
                       {"y_px", number(e->y_px)}, {"visibility", name_of(e->visibility)}};
            if (e->kind == TruthKind::body)
                entry["visible_share"] = e->visible_share;
            else
                entry["lit"] = e->lit;
            out[list].push_back(std::move(entry));
        }
    }

    /// What moves or varies, and galaxies.
    void print_sky_objects(const std::vector<const TruthEntry*>& entries, Json& out) const {
        if (!json_ && !entries.empty())
            fmt::print("\n{:<22} {:<8} {:>6} {:>14} {:>11} {:>11}  {}\n", "sky object", "", "V", "range m",
                       "x px", "y px", "seen");
        for (const TruthEntry* e : entries) {
            const char* const kind = e->kind == TruthKind::galaxy ? "galaxy"
                                     : std::isfinite(e->range_m)  ? "point"
                                                                  : "star";
            if (!json_)
                fmt::print("{:<22} {:<8} {:>6.2f} {:>14.6g} {:>11} {:>11}  {}\n", e->name.view(), kind,
                           e->magnitude_v, e->range_m, pixel(e->x_px), pixel(e->y_px),
                           name_of(e->visibility));
            else
                out["sky_objects"].push_back(
                    {{"name", e->name.view()},
                     {"kind", kind},
                     {"magnitude_v", e->magnitude_v},
                     {"range_m", std::isfinite(e->range_m) ? Json(e->range_m) : Json(nullptr)},
                     {"x_px", e->x_px},
                     {"y_px", e->y_px},
                     {"visibility", name_of(e->visibility)}});
        }
    }

    static std::string pixel(double value) { return std::isnan(value) ? "-" : fmt::format("{:.4f}", value); }
    static Json number(double value) { return std::isnan(value) ? Json(nullptr) : Json(value); }

    std::string scene_, output_, time_ = "0";
    double time_s_ = 0, faintest_ = 99;
    std::int32_t side_ = 1000;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_sky() {
    return std::make_unique<Sky>();
}

} // namespace obscura::tools

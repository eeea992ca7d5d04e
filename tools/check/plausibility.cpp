// SPDX-License-Identifier: Apache-2.0
#include "tools/check/plausibility.hpp"

#include "core/solar_spectrum.hpp"
#include "core/text/printable.hpp"
#include "ephemeris/time/calendar.hpp"
#include "ephemeris/time/time_scale.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/world/model_warnings.hpp"
#include "renderer/world/pose_age.hpp"
#include "renderer/world/preset_range.hpp"
#include "tools/check/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace obscura::tools {
namespace {

// Limits of the plausible.
constexpr double widest_pinhole_rad = 2.3;     ///< 132 degrees: the image grows as the tangent
constexpr double narrowest_field_rad = 2e-5;   ///< 4 arcsec
constexpr double fastest_f_number = 0.5;       ///< the limit of any lens in air
constexpr double slowest_f_number = 500;       ///< diffraction spreads over some hundred um
constexpr double dot_px = 4;                   ///< smaller meshes are dots
constexpr double small_mesh_m = 60;            ///< smaller than bodies in space, larger than many in km
constexpr double resolved_px = 4;              ///< found in any part of a frame's rows
constexpr double saturated_share_limit = 0.05; ///< of the pixels
constexpr double nearest_sun_au = 0.04;        ///< Parker Solar Probe's perihelion is at 0.046
constexpr double farthest_planet_au = 60;
constexpr double low_altitude_radii = 20; ///< of the bounding sphere, up to which a height is worth a word
constexpr std::size_t max_checked_instants = 32;

double degrees(double rad) {
    return rad * 180 / std::numbers::pi;
}
double arcsec(double rad) {
    return degrees(rad) * 3600;
}

/// A length with the unit in which it is easily read.
std::string length_text(double m) {
    constexpr double au_m = astronomical_unit_m;
    if (!std::isfinite(m)) return "-";
    if (m >= 0.1 * au_m) return fmt::format("{:.4g} au", m / au_m);
    if (m >= 10'000) return fmt::format("{:.4g} km", m / 1000);
    if (m >= 1) return fmt::format("{:.4g} m", m);
    return fmt::format("{:.4g} mm", m * 1000);
}
std::string angle_text(double rad) {
    return degrees(rad) >= 0.1 ? fmt::format("{:.4g} deg", degrees(rad))
                               : fmt::format("{:.4g} arcsec", arcsec(rad));
}
std::string duration_text(double ms) {
    return ms >= 10'000 ? fmt::format("{:.3g} s", ms / 1000) : fmt::format("{:.3g} ms", ms);
}
std::string field_text(const renderer::View& view) {
    return fmt::format("{} x {}", angle_text(view.field_x_rad), angle_text(view.field_y_rad));
}
/// Says that a figure is of a part of the rows.
std::string share_text(double rows_share) {
    return rows_share < 1 ? fmt::format(" (in {:.2g} % of the rows)", 100 * rows_share) : "";
}
std::string in_quotes(const std::string& name) {
    return fmt::format("\"{}\"", name);
}

bool in_any(std::span<const renderer::View> views, std::size_t body) {
    return std::any_of(views.begin(), views.end(),
                       [&](const renderer::View& view) { return view.bodies[body].in_field; });
}

} // namespace

std::vector<double> instants_of(const scene::Scene& scene, double first_s) {
    std::vector<double> all;
    const auto collect = [&](const scene::Motion& motion, const scene::Joint& joint) {
        for (const scene::TimedPose& sample : motion.samples)
            if (motion.samples.size() > 1) all.push_back(sample.time_s);
        for (const scene::Joint::Sample& sample : joint.samples)
            all.push_back(sample.time_s);
    };
    collect(scene.camera.motion, scene.camera.joint);
    for (const scene::Body& body : scene.bodies)
        collect(body.motion, body.joint);
    std::sort(all.begin(), all.end());
    std::vector<double> out{first_s};
    for (std::size_t i = 0; i < max_checked_instants && !all.empty(); ++i)
        if (const double t = all[i * (all.size() - 1) / (max_checked_instants - 1)];
            t > first_s && t > out.back())
            out.push_back(t);
    return out;
}

Plausibility::Plausibility(std::string camera, const renderer::Renderer& renderer,
                           std::span<const double> frames_s, bool posed)
    : camera_(std::move(camera)), posed_(posed), catalogue_(scene::star_totals(renderer.scene())) {
    std::vector<renderer::View> views;
    const std::size_t stride = std::max<std::size_t>(1, frames_s.size() / max_checked_instants);
    for (std::size_t i = 0; i < frames_s.size(); i += stride)
        views.push_back(renderer.view(Time{std::llround(frames_s[i] * 1e9)}));
    view_ = views.front();
    for (const renderer::SeenBody& body : view_.bodies)
        resolved_ = resolved_ || (body.in_field && body.extent_px >= resolved_px);
    judge_lens(renderer.scene().camera);
    judge_date(renderer.scene());
    sun_scale_ = renderer.scene().sun.irradiance_scale;
    judge_maps();
    if (!posed_) return;
    judge_sun(renderer.scene());
    judge_presets(renderer.scene());
    judge_ages(renderer.scene(), frames_s.front());
    judge_bodies(renderer.scene(), views);
    judge_field(renderer.scene(), views);
}

void Plausibility::add(std::string_view what, std::string text) {
    if (!camera_.empty()) text = fmt::format("{}: {}", camera_, text);
    oddities_.push_back({std::string(what), std::move(text)});
}

void Plausibility::judge_lens(const scene::Camera& camera) {
    const double widest = std::max(view_.field_x_rad, view_.field_y_rad);
    const double f_number = camera.aperture_m > 0 ? camera.focal_length_m / camera.aperture_m : 1;
    const bool wide = camera.projection == scene::Projection::pinhole && widest > widest_pinhole_rad;
    const bool narrow = widest < narrowest_field_rad;
    if (!wide && !narrow && f_number >= fastest_f_number && f_number <= slowest_f_number) return;
    const bool is_short = wide || f_number < fastest_f_number;
    add("focal_length",
        fmt::format(
            "the field of view is {} and the lens f/{:.3g}, with focal_length_mm = {:.6g}, aperture_mm = {:.6g} and pixel_pitch_um = {:.6g}: is the focal length in {}? "
            "Try focal_length_mm = {:.6g}",
            field_text(view_), f_number, camera.focal_length_m * 1e3, camera.aperture_m * 1e3,
            camera.pixel_pitch_m * 1e6, is_short ? "metres" : "micrometres",
            camera.focal_length_m * (is_short ? 1e6 : 1)));
}

void Plausibility::judge_date(const scene::Scene& scene) {
    const ephemeris::LeapSeconds leap_seconds = ephemeris::system_leap_seconds();
    if (scene.epoch && is_past_expiry(*scene.epoch, leap_seconds))
        add("leap_seconds",
            fmt::format(
                "the epoch lies after {}, when the leap seconds of {} expire: if one has been announced since, dates in UTC are wrong by 1 s. "
                "Update the package tzdata, or give the epoch in TAI, TT or TDB",
                ephemeris::date_text(*leap_seconds.expires_utc_s / 86'400), leap_seconds.source));
}

void Plausibility::judge_presets(const scene::Scene& scene) {
    for (std::string& line : renderer::presets_out_of_range(scene, view_))
        add("preset_range", std::move(line));
    for (std::string& line : renderer::model_warnings(scene))
        add("model", std::move(line));
}

void Plausibility::judge_ages(const scene::Scene& scene, double at_s) {
    for (const renderer::AgedPoses& aged : renderer::aged_poses(scene, at_s))
        add("pose_age", aged.text() + ". Check the scene's epoch and daemon.scene_start_s");
    for (std::string& text : renderer::instant_attitudes(scene))
        add("attitude_instant", std::move(text));
}

void Plausibility::judge_maps() {
    for (const renderer::SeenBody& body : view_.bodies)
        for (const std::string& text : body.warnings)
            add("map", fmt::format("{}: {}", in_quotes(body.name), text));
}

void Plausibility::judge_sun(const scene::Scene& scene) {
    if (!(sun_scale_ > 0)) return;
    const auto inside = std::find_if(view_.bodies.begin(), view_.bodies.end(), [&](const auto& body) {
        return body.sun_distance_m < scene.sun.radius_m;
    });
    const bool camera_inside = view_.sun_distance_m < scene.sun.radius_m;
    const double distance_m =
        inside != view_.bodies.end() && !camera_inside ? inside->sun_distance_m : view_.sun_distance_m;
    const double distance_au = distance_m / astronomical_unit_m;
    // Kilometres that were given as metres.
    std::string cure = "Check its position_m";
    const double given_au = scene.sun.path ? distance_au : length(scene.sun.position_m) / astronomical_unit_m;
    const bool in_km = given_au * 1000 > nearest_sun_au && given_au * 1000 < farthest_planet_au;
    if (in_km)
        cure = fmt::format("Is its position_m in kilometres? 1000 times as large it is {:.4g} au long",
                           given_au * 1000);
    if (camera_inside || inside != view_.bodies.end())
        add("inside_sun", fmt::format("{} is inside the Sun, {} from its centre, its radius is {}. {}",
                                      camera_inside ? "the camera" : in_quotes(inside->name),
                                      length_text(distance_m), length_text(scene.sun.radius_m), cure));
    else if (distance_au < nearest_sun_au && in_km)
        add("sun_unit", fmt::format("the Sun is {} from the camera and gives {:.4g} W/m2 there. {}",
                                    length_text(distance_m), sun_w_m2(distance_m), cure));
}

double Plausibility::sun_w_m2(double distance_m) const {
    const double au = distance_m / astronomical_unit_m;
    return sun_scale_ * solar_band_irradiance_w_m2(solar_spectrum_from_m, solar_spectrum_to_m) / (au * au);
}

void Plausibility::judge_bodies(const scene::Scene& scene, std::span<const renderer::View> views) {
    for (std::size_t i = 0; i < view_.bodies.size(); ++i) {
        const auto inside = std::find_if(views.begin(), views.end(), [&](const renderer::View& view) {
            return view.bodies[i].around_camera;
        });
        if (inside != views.end()) {
            const renderer::SeenBody& body = inside->bodies[i];
            add("camera_inside",
                fmt::format(
                    "the camera is inside {}, which is {} across, {} from its origin: check the camera's position_m, and the unit of the body's size",
                    in_quotes(body.name), length_text(body.extent_m), length_text(body.distance_m)));
        }
        const renderer::SeenBody& body = view_.bodies[i];
        const auto* mesh = scene.bodies[i].shape.get_if<renderer::MeshFileParameters>();
        // Undeclared kilometres: a dot that would be a picture if it were 1000 times as large.
        if (mesh != nullptr && mesh->metres_per_unit == 1 && body.extent_m < small_mesh_m &&
            body.extent_px < dot_px && body.extent_px * 1000 > 2 * dot_px &&
            body.extent_m * 500 < body.distance_m)
            add("mesh_unit", fmt::format("{} is {} across and {:.2g} px, {} away: one dot. "
                                         "If the mesh {} is in kilometres, try metres_per_unit = 1000",
                                         in_quotes(body.name), length_text(body.extent_m), body.extent_px,
                                         length_text(body.distance_m), mesh->path));
    }
}

void Plausibility::judge_field(const scene::Scene& scene, std::span<const renderer::View> views) {
    bool body_in_field = false, all_behind = true, covered = false;
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < view_.bodies.size(); ++i) {
        const renderer::SeenBody& body = view_.bodies[i];
        body_in_field = body_in_field || in_any(views, i);
        all_behind = all_behind && body.boresight_rad > std::numbers::pi / 2;
        covered = covered ||
                  (body.in_field && body.extent_px > 2.0 * std::max(scene.camera.width, scene.camera.height));
        if (body.boresight_rad < view_.bodies[nearest].boresight_rad) nearest = i;
    }
    const bool star_in_field =
        std::any_of(views.begin(), views.end(), [](const auto& v) { return v.stars > 0; });
    const bool sun_in_field =
        std::any_of(views.begin(), views.end(), [](const auto& v) { return v.sun_in_field; });

    if (!body_in_field && !view_.bodies.empty()) {
        const renderer::SeenBody& body = view_.bodies[nearest];
        add(all_behind ? "behind_camera" : "outside_field",
            fmt::format(
                "no body is in the field of {}{}: {}{} is {:.4g} deg from the boresight{}. "
                "Try look_at, or check boresight or orientation (scalar first, from the camera's axes, +z the boresight, to J2000)",
                field_text(view_), star_in_field ? "" : ", and no star",
                view_.bodies.size() > 1 ? "the nearest, " : "", in_quotes(body.name),
                degrees(body.boresight_rad), all_behind ? ", behind the camera" : ""));
        return;
    }
    if (star_in_field || covered) return;
    if (!body_in_field && !sun_in_field && scene.stray_light.empty() && catalogue_.count == 0) {
        add("nothing_in_field",
            "nothing is in the field: the scene has no body and no star. Add [[body]] or [stars]");
    } else if (catalogue_.count > 0) {
        add(body_in_field || sun_in_field ? "no_star" : "nothing_in_field",
            fmt::format(
                "{} in the field of {}: the {} stars of the catalogue, to magnitude {:.3g}, have {:.2g} in a field of that size on average. "
                "Try a larger limiting_magnitude or a deeper catalogue",
                body_in_field || sun_in_field ? "no star is" : "no body and no star are", field_text(view_),
                catalogue_.count, catalogue_.faintest_v,
                static_cast<double>(catalogue_.count) * view_.field_x_rad * view_.field_y_rad /
                    (4 * std::numbers::pi)));
    }
}

void Plausibility::judge_dark(std::string text, double rows_share) {
    // The field's own oddities explain a dark frame; a few rows do not find small things.
    static constexpr std::string_view causes[] = {"nothing_in_field", "behind_camera", "outside_field",
                                                  "mesh_unit", "camera_inside"};
    const bool explained = std::any_of(oddities_.begin(), oddities_.end(), [](const Oddity& oddity) {
        return std::find(std::begin(causes), std::end(causes), oddity.what) != std::end(causes);
    });
    if (!posed_ || explained || (rows_share < 1 && !resolved_)) return;
    add("dark", std::move(text));
}

void Plausibility::add_signal(const SignalFigures& signal) {
    signal_ = signal;
    const double above_dn = signal.brightest_dn - signal.black_dn;
    if (above_dn < 1)
        judge_dark(
            fmt::format(
                "the brightest expected signal is {:.2g} DN above black ({:.3g} e-): the frame is dark. "
                "Try a longer exposure_us (now {:.6g}), more gain_db, or check the Sun and the unit of lengths",
                std::max(0.0, above_dn), signal.brightest_e, signal.exposure_us),
            signal.rows_share);
    if (posed_ && signal.saturated_share > saturated_share_limit) {
        // brightest_e is not limited by the full well: what would fill 80 % of the range.
        const double range_dn = signal.max_dn - signal.black_dn;
        const double over = std::max(above_dn / range_dn, signal.brightest_e / signal.full_well_e);
        const double fitting_us = 0.8 * signal.obtained_us / over;
        // A rolling shutter has exposures from one row slot up.
        const std::string cure =
            signal.obtained_us > 1.5 * signal.exposure_us
                ? fmt::format(
                      "exposure_us = {:.6g}, but the sensor exposes for {:.6g} us, its row time: try less gain_db, a higher pixel_clock_hz or a smaller aperture_mm",
                      signal.exposure_us, signal.obtained_us)
                : fmt::format("try exposure_us = {:.3g} (now {:.6g})", fitting_us, signal.exposure_us);
        add("saturated",
            fmt::format(
                "{:.0f} % of the pixels are saturated{}, the brightest would be at {:.3g} times the range: {}",
                100 * signal.saturated_share, share_text(signal.rows_share), over, cure));
    }
}

void Plausibility::judge_light(double brightest, double rows_share) {
    if (!(brightest > 0))
        judge_dark(
            "nothing in the field gives any light: check the Sun's place, the lamps, and on which side of the body the camera is",
            rows_share);
}

void Plausibility::add_light(double brightest, std::string_view unit, double rows_share) {
    light_ = brightest;
    light_unit_ = unit;
    light_share_ = rows_share;
    judge_light(brightest, rows_share);
}

void Plausibility::judge_tiles(std::string_view body, std::uint64_t made, std::uint64_t slots) {
    add("tile_memory",
        fmt::format(
            "a frame made {} tiles of the surface of {}, and there is room for {}: they push each other out and are made again and again. "
            "Try a tile_memory_mib some times as large, or a larger cell_px",
            made, body, slots));
}

void Plausibility::add_times(const TimeFigures& times) {
    times_ = times;
    // Rounding of rates to nanoseconds is not worth a word.
    if (times.period_ms && times.shortest_period_ms > *times.period_ms * (1 + 1e-6))
        add("readout",
            fmt::format(
                "a frame takes the sensor {} (exposure {}, readout {}), but triggers come every {}: some will be missed. "
                "Try a shorter exposure_us, a higher pixel_clock_hz or rate_hz = {:.3g}",
                duration_text(times.shortest_period_ms), duration_text(times.exposure_ms),
                duration_text(times.readout_ms), duration_text(*times.period_ms),
                std::floor(1e6 / times.shortest_period_ms) / 1e3));
}

void Plausibility::add_rendering(const RenderFigures& rendering) {
    rendering_ = rendering;
    if (times_ && times_->period_ms && rendering.ms > *times_->period_ms)
        add("render_time",
            fmt::format(
                "rendering takes this machine {} {} a frame (estimated), but triggers come every {}: frames will be late. "
                "Try fewer samples_per_pixel, max_instants = 1, fewer bounces or a smaller region",
                rendering.at_least ? "more than" : "about", duration_text(rendering.ms),
                duration_text(*times_->period_ms)));
}

std::vector<Plausibility::Line> Plausibility::lines() const {
    std::vector<Line> out;
    const std::string before = camera_.empty() ? "" : camera_ + ": ";
    const auto line = [&](std::string_view label, std::string text) {
        out.push_back({before + std::string(label), std::move(text)});
    };
    line("field of view", field_text(view_));
    line("pixel scale", fmt::format("{:.4g} arcsec", arcsec(view_.pixel_rad)));
    line("Sun", sun_scale_ > 0
                    ? fmt::format("{:.4g} au away, {:.4g} W/m2 at the camera (200 nm to 4 um)",
                                  view_.sun_distance_m / astronomical_unit_m, sun_w_m2(view_.sun_distance_m))
                    : "none");
    constexpr std::size_t max_bodies = 12;
    for (std::size_t i = 0; i < std::min(max_bodies, view_.bodies.size()); ++i) {
        const renderer::SeenBody& b = view_.bodies[i];
        std::string text =
            fmt::format("{} across, {} away, ", length_text(b.extent_m), length_text(b.distance_m));
        text += std::isfinite(b.extent_px) ? fmt::format("{:.4g} px", b.extent_px)
                                           : "the camera is in its bounding sphere";
        text += fmt::format(", {} a pixel", length_text(view_.pixel_rad * b.surface_m));
        if (b.phase_rad) text += fmt::format(", phase {:.4g} deg", degrees(*b.phase_rad));
        if (!b.in_field)
            text +=
                fmt::format(", outside the field ({:.4g} deg from the boresight)", degrees(b.boresight_rad));
        line("body " + b.name, std::move(text));
        if (b.altitude_m && *b.altitude_m < low_altitude_radii * b.extent_m / 2)
            line("ground of " + b.name,
                 fmt::format("{} below the camera{}", length_text(*b.altitude_m),
                             b.sun_elevation_rad ? fmt::format(", where the Sun is {:.4g} deg {} the horizon",
                                                               std::abs(degrees(*b.sun_elevation_rad)),
                                                               *b.sun_elevation_rad < 0 ? "below" : "above")
                                                 : ""));
        for (const std::string& note : b.notes)
            line("maps of " + b.name, note);
    }
    if (view_.bodies.size() > max_bodies)
        line("bodies", fmt::format("{} more", view_.bodies.size() - max_bodies));
    if (catalogue_.count > 0)
        line("stars", fmt::format("{} in the field{}", view_.stars,
                                  view_.faintest_v
                                      ? fmt::format(", the faintest of magnitude {:.3g}", *view_.faintest_v)
                                      : ""));
    if (signal_) {
        const SignalFigures& s = *signal_;
        line("brightest signal",
             fmt::format("{:.4g} e-, {:.3g} % of full well ({:.4g} e-), {:.4g} of {:.0f} DN{}", s.brightest_e,
                         100 * s.brightest_e / s.full_well_e, s.full_well_e,
                         std::min(s.brightest_dn, s.max_dn), s.max_dn, share_text(s.rows_share)));
        line("saturated",
             fmt::format("{:.2g} % of the pixels{}", 100 * s.saturated_share, share_text(s.rows_share)));
    }
    if (light_)
        line("brightest pixel", fmt::format("{:.4g} {}{}", *light_, light_unit_, share_text(light_share_)));
    if (times_)
        line("readout", fmt::format("{}, a frame in {} at least{}", duration_text(times_->readout_ms),
                                    duration_text(times_->shortest_period_ms),
                                    times_->period_ms ? fmt::format(", triggers every {}",
                                                                    duration_text(*times_->period_ms))
                                                      : ""));
    if (rendering_)
        line("rendering",
             fmt::format("{} {} a frame on this machine (estimated){}",
                         rendering_->at_least ? "more than" : "about", duration_text(rendering_->ms),
                         rendering_->loaded_ms > 1.5 * rendering_->ms
                             ? fmt::format(", {} as it is loaded now", duration_text(rendering_->loaded_ms))
                             : ""));
    return out;
}

std::string Plausibility::json() const {
    using Json = nlohmann::ordered_json;
    const auto number = [](double value) { return std::isfinite(value) ? Json(value) : Json(); };
    const auto optional = [&](const std::optional<double>& value) { return value ? number(*value) : Json(); };
    Json out = Json::object();
    if (!camera_.empty()) out["camera"] = camera_;
    out["field_of_view_deg"] = {degrees(view_.field_x_rad), degrees(view_.field_y_rad)};
    out["pixel_scale_arcsec"] = arcsec(view_.pixel_rad);
    if (sun_scale_ > 0)
        out["sun"] = {{"distance_au", number(view_.sun_distance_m / astronomical_unit_m)},
                      {"irradiance_w_m2", number(sun_w_m2(view_.sun_distance_m))}};
    out["bodies"] = Json::array();
    for (const renderer::SeenBody& b : view_.bodies) {
        Json body = Json::object();
        body["name"] = b.name;
        body["extent_m"] = number(b.extent_m);
        body["distance_m"] = number(b.distance_m);
        body["extent_px"] = number(b.extent_px);
        body["m_per_px"] = number(view_.pixel_rad * b.surface_m);
        body["phase_deg"] = b.phase_rad ? number(degrees(*b.phase_rad)) : Json();
        body["boresight_deg"] = number(degrees(b.boresight_rad));
        body["in_field"] = b.in_field;
        body["around_camera"] = b.around_camera;
        body["altitude_m"] = optional(b.altitude_m);
        body["sun_elevation_deg"] = b.sun_elevation_rad ? number(degrees(*b.sun_elevation_rad)) : Json();
        body["sun_distance_au"] = number(b.sun_distance_m / astronomical_unit_m);
        if (!b.notes.empty()) body["notes"] = b.notes;
        out["bodies"].push_back(std::move(body));
    }
    out["sun_in_field"] = view_.sun_in_field;
    out["stars_in_field"] = view_.stars;
    out["faintest_star_v"] = optional(view_.faintest_v);
    if (signal_)
        out["signal"] = {{"brightest_e", number(signal_->brightest_e)},
                         {"full_well_e", number(signal_->full_well_e)},
                         {"brightest_dn", number(std::min(signal_->brightest_dn, signal_->max_dn))},
                         {"black_dn", number(signal_->black_dn)},
                         {"full_scale_dn", number(signal_->max_dn)},
                         {"saturated_share", number(signal_->saturated_share)},
                         {"rows_share", number(signal_->rows_share)}};
    if (light_)
        out["brightest_pixel"] = {
            {"value", number(*light_)}, {"unit", light_unit_}, {"rows_share", number(light_share_)}};
    if (times_)
        out["timing"] = {{"trigger_period_ms", optional(times_->period_ms)},
                         {"shortest_period_ms", number(times_->shortest_period_ms)},
                         {"exposure_ms", number(times_->exposure_ms)},
                         {"readout_ms", number(times_->readout_ms)}};
    if (rendering_)
        out["rendering"] = {{"estimated_ms", number(rendering_->ms)},
                            {"loaded_ms", number(rendering_->loaded_ms)},
                            {"at_least", rendering_->at_least}};
    out["warnings"] = Json::array();
    for (const Oddity& oddity : oddities_)
        out["warnings"].push_back({{"what", oddity.what}, {"text", oddity.text}});
    return out.dump(2, ' ', false, Json::error_handler_t::replace);
}

void Plausibility::add_to(Report& report) const {
    report.add_object("plausibility", json());
    for (const Line& line : lines())
        report.add_line(line.label, line.text);
}

void Plausibility::warn(std::string_view verb) {
    for (; warned_ < oddities_.size(); ++warned_)
        print_message(fmt::format("obscura {}: warning: {}", verb, oddities_[warned_].text));
}

} // namespace obscura::tools

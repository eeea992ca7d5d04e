// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/sky_chart.hpp"

#include "core/units.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/world/scene_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace obscura::tools {
namespace {

constexpr double pi = std::numbers::pi;
constexpr Rgb sky{11, 16, 32}, field{17, 25, 48}, border{110, 125, 160}, grid{44, 60, 98},
    grid_text{120, 140, 185}, label{225, 230, 245}, title{240, 243, 250}, body{52, 60, 78},
    body_lit{255, 226, 160}, body_dark{96, 104, 124}, terminator{255, 170, 90}, sun{255, 236, 150};
constexpr double margin = 44, top = 60, bottom = 64;
constexpr std::size_t max_labels = 60;
/// Radius of a star of the faintest magnitude, and how much it grows with each magnitude.
constexpr double min_radius = 0.8, radius_per_magnitude = 0.85, max_radius = 8;

/// Colour of a star by B-V.
Rgb star_colour(double b_v) {
    struct Stop {
        double b_v;
        Rgb colour;
    };
    constexpr std::array stops{Stop{-0.3, {165, 190, 255}}, Stop{0.0, {205, 220, 255}},
                               Stop{0.4, {248, 247, 255}},  Stop{0.8, {255, 238, 214}},
                               Stop{1.2, {255, 214, 160}},  Stop{1.8, {255, 176, 110}}};
    if (!(b_v > stops.front().b_v)) return stops.front().colour;
    for (std::size_t i = 1; i < stops.size(); ++i)
        if (b_v < stops[i].b_v) {
            const double s = (b_v - stops[i - 1].b_v) / (stops[i].b_v - stops[i - 1].b_v);
            Rgb mixed{};
            for (std::size_t c = 0; c < mixed.size(); ++c)
                mixed[c] = static_cast<std::uint8_t>(
                    std::lround(stops[i - 1].colour[c] + s * (stops[i].colour[c] - stops[i - 1].colour[c])));
            return mixed;
        }
    return stops.back().colour;
}

/// Angle as text, with as many digits as its step needs.
std::string degrees_text(double value_deg, double step_deg) {
    return step_deg >= 1 ? fmt::format("{:.0f}\u00b0", value_deg)
                         : fmt::format("{:.{}f}\u00b0", value_deg, step_deg >= 0.1 ? 1 : 2);
}

class SkyPainter {
public:
    explicit SkyPainter(const SkyChart& chart)
        : chart_(chart),
          camera_(chart.scene.camera),
          scale_(chart.side / static_cast<double>(std::max(camera_.width, camera_.height))),
          width_(camera_.width * scale_),
          height_(camera_.height * scale_),
          drawing_(static_cast<std::int32_t>(std::lround(width_ + 2 * margin)),
                   static_cast<std::int32_t>(std::lround(height_ + top + bottom)), sky) {}

    Drawing draw() {
        drawing_.polygon(frame(), field);
        draw_grid();
        draw_bodies();
        draw_landmarks();
        draw_stars();
        draw_sky_objects();
        std::vector<DrawnPoint> edge = frame();
        edge.push_back(edge.front());
        drawing_.line(edge, 1.2, border);
        draw_texts();
        return std::move(drawing_);
    }

private:
    [[nodiscard]] DrawnPoint at(double x_px, double y_px) const {
        return {margin + (x_px + 0.5) * scale_, top + (y_px + 0.5) * scale_};
    }
    [[nodiscard]] std::vector<DrawnPoint> frame() const {
        const double w = camera_.width - 0.5, h = camera_.height - 0.5;
        return {at(-0.5, -0.5), at(w, -0.5), at(w, h), at(-0.5, h)};
    }
    [[nodiscard]] bool in_frame(double x_px, double y_px) const {
        return x_px >= -0.5 && y_px >= -0.5 && x_px <= camera_.width - 0.5 && y_px <= camera_.height - 0.5;
    }

    void draw_grid() {
        const renderer::ScenePoses poses(places_only());
        const Pose camera = poses.camera(chart_.time_s);
        const std::unique_ptr<renderer::Projection> lens = renderer::make_projection(camera_);
        const Vec3 beta = rotate(conjugate(camera.orientation),
                                 poses.camera_velocity_m_s(chart_.time_s) / renderer::light_speed_m_s);
        const auto project = [&](double ra, double dec) -> std::optional<renderer::ImagePoint> {
            const Vec3 direction{std::cos(dec) * std::cos(ra), std::cos(dec) * std::sin(ra), std::sin(dec)};
            const Vec3 own = rotate(conjugate(camera.orientation), direction);
            const auto p = lens->project(length(beta) > 0 ? renderer::aberrate(own, beta) : own);
            return p && in_frame(p->x, p->y) ? p : std::nullopt;
        };
        const auto [ra0, dec0] = boresight_of(camera);
        const double reach = std::min(lens->field_angle_rad(0), pi);
        constexpr std::array steps_deg{0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0};
        const auto step_for = [&](double span) {
            for (const double s : steps_deg)
                if (s * degree >= span / 7) return s;
            return steps_deg.back();
        };
        const double least = std::max(-pi / 2, dec0 - reach), most = std::min(pi / 2, dec0 + reach);
        const bool pole = std::abs(dec0) + reach >= pi / 2 - 1e-9;
        const double half = pole ? pi : std::asin(std::min(1.0, std::sin(reach) / std::cos(dec0)));
        const double dec_step = step_for(2 * reach), ra_step = pole ? 30 : step_for(2 * half);
        constexpr int points = 240;
        for (double d = std::ceil(least / degree / dec_step) * dec_step; d * degree <= most; d += dec_step) {
            if (std::abs(d) > 89.999) continue;
            draw_curve(
                [&, ra0 = ra0](int i) { return project(ra0 + half * (2.0 * i / points - 1), d * degree); },
                points, degrees_text(d, dec_step));
        }
        const double first = std::ceil((ra0 - half) / degree / ra_step) * ra_step;
        for (double r = first; r * degree < ra0 + half - (pole ? 1e-9 : 0); r += ra_step)
            draw_curve([&](int i) { return project(r * degree, least + (most - least) * i / points); },
                       points, degrees_text(std::fmod(r + 720, 360), ra_step));
    }

    /// Scene of the camera and bodies, without what the grid does not need.
    [[nodiscard]] scene::Scene places_only() const {
        scene::Scene s = chart_.scene;
        s.stars.clear();
        return s;
    }

    template<typename Project>
    void draw_curve(const Project& project, int points, const std::string& text) {
        std::vector<DrawnPoint> part;
        bool named = false;
        const auto end = [&] {
            if (part.size() > 4 && !named) {
                const auto [x, y] = part[part.size() / 40 + 1];
                const auto [w, h] = Drawing::text_size(text);
                const DrawnPoint place{std::clamp(x + 3, margin + 3, margin + width_ - w - 3),
                                       std::clamp(y - 8, top + 8, top + height_ - 8)};
                drawing_.text(place, text, grid_text);
                named = true;
            }
            drawing_.line(std::move(part), 0.8, grid);
            part.clear();
        };
        for (int i = 0; i <= points; ++i) {
            if (const auto p = project(i))
                part.push_back(at(p->x, p->y));
            else
                end();
        }
        end();
    }

    void draw_bodies() {
        struct Curve {
            std::vector<const TruthEntry*> limb, terminator;
        };
        std::vector<Curve> curves(chart_.scene.bodies.size() + 1);
        std::vector<const TruthEntry*> bodies;
        for (const TruthEntry& e : chart_.truth.entries) {
            const auto index = static_cast<std::size_t>(e.object);
            if (e.kind == TruthKind::limb) curves[index].limb.push_back(&e);
            if (e.kind == TruthKind::terminator) curves[index].terminator.push_back(&e);
            if (e.kind == TruthKind::body && e.visibility != TruthVisibility::outside) bodies.push_back(&e);
        }
        std::sort(bodies.begin(), bodies.end(),
                  [](const TruthEntry* a, const TruthEntry* b) { return a->range_m > b->range_m; });
        for (const TruthEntry* e : bodies) {
            const Curve& curve = curves[static_cast<std::size_t>(e->object)];
            const Rgb colour = e->name.view() == scene::sun_name ? sun : body;
            std::vector<DrawnPoint> outline;
            for (const TruthEntry* p : curve.limb)
                outline.push_back(at(p->x_px, p->y_px));
            drawing_.polygon(outline, colour);
            draw_runs(curve.limb, 1.6, false);
            draw_runs(curve.terminator, 1.2, true);
            if (std::isnan(e->x_px) || !in_frame(e->x_px, e->y_px)) continue;
            const DrawnPoint centre = at(e->x_px, e->y_px);
            drawing_.disc(centre, outline.empty() ? 3.5 : 1.5, outline.empty() ? body_lit : label);
            add_label(centre, 6, std::string(e->name.view()), title);
        }
    }

    void draw_landmarks() {
        for (const TruthEntry& e : chart_.truth.entries) {
            if (e.kind != TruthKind::landmark || e.visibility != TruthVisibility::visible) continue;
            const auto [x, y] = at(e.x_px, e.y_px);
            drawing_.line({{x - 3, y}, {x + 3, y}}, 1, label);
            drawing_.line({{x, y - 3}, {x, y + 3}}, 1, label);
            add_label({x, y}, 5, std::string(e.name.view()), label);
        }
    }

    /// Lines between neighbouring points of a curve.
    void draw_runs(const std::vector<const TruthEntry*>& points, double width, bool dashed) {
        for (std::size_t i = 0; i < points.size(); ++i) {
            const TruthEntry& a = *points[i];
            const TruthEntry& b = *points[(i + 1) % points.size()];
            const std::int32_t step = b.item - a.item;
            const bool closes = a.item + 1 == chart_.curve_points && b.item == 0;
            if (step != 1 && !closes) continue;
            const Rgb colour = dashed ? terminator : a.lit && b.lit ? body_lit : body_dark;
            drawing_.line({at(a.x_px, a.y_px), at(b.x_px, b.y_px)}, width, colour);
        }
    }

    void draw_stars() {
        std::vector<const TruthEntry*> stars;
        for (const TruthEntry& e : chart_.truth.entries)
            if (e.kind == TruthKind::star && e.object >= 0 && e.visibility != TruthVisibility::hidden &&
                e.magnitude_v <= chart_.faintest_v)
                stars.push_back(&e);
        if (stars.empty()) return;
        std::sort(stars.begin(), stars.end(),
                  [](const TruthEntry* a, const TruthEntry* b) { return a->magnitude_v > b->magnitude_v; });
        faintest_ = stars.front()->magnitude_v;
        for (const TruthEntry* e : stars) {
            const scene::Star star = scene::star_of(chart_.scene, static_cast<std::uint32_t>(e->object));
            drawing_.disc(at(e->x_px, e->y_px), radius_of(e->magnitude_v),
                          star_colour(star.colour_b_v.value_or(0.6)));
        }
        std::size_t labels = 0;
        for (auto e = stars.rbegin(); e != stars.rend() && labels < max_labels; ++e) {
            const scene::Star star = scene::star_of(chart_.scene, static_cast<std::uint32_t>((*e)->object));
            const ephemeris::StarName name = chart_.names.at(star.right_ascension_rad, star.declination_rad);
            if (name.shortest().empty()) continue;
            if (add_label(at((*e)->x_px, (*e)->y_px), radius_of((*e)->magnitude_v) + 2, name.shortest(),
                          label))
                ++labels;
        }
    }

    void draw_sky_objects() {
        for (const TruthEntry& e : chart_.truth.entries) {
            if (!is_sky_object(e) || e.visibility == TruthVisibility::hidden ||
                e.magnitude_v > chart_.faintest_v)
                continue;
            const auto [x, y] = at(e.x_px, e.y_px);
            constexpr double half = 5;
            drawing_.line({{x, y - half}, {x + half, y}, {x, y + half}, {x - half, y}, {x, y - half}}, 1.2,
                          label);
            add_label({x, y}, half + 2, std::string(e.name.view()), label);
        }
    }

    [[nodiscard]] double radius_of(double magnitude) const {
        return std::min(max_radius,
                        min_radius + radius_per_magnitude * std::max(0.0, *faintest_ - magnitude));
    }

    /// Places a text beside a mark where it covers no other; whether there is room.
    bool add_label(DrawnPoint centre, double clear, const std::string& text, Rgb colour) {
        const auto [w, h] = Drawing::text_size(text);
        const auto [x, y] = centre;
        for (const DrawnPoint& place : {DrawnPoint{x + clear, y},
                                        {x - clear - w, y},
                                        {x - w / 2, y - clear - h / 2},
                                        {x - w / 2, y + clear + h / 2}}) {
            const Box box{place.first, place.second - h / 2, place.first + w, place.second + h / 2};
            if (box.x0 < margin || box.y0 < top || box.x1 > margin + width_ || box.y1 > top + height_)
                continue;
            if (std::any_of(taken_.begin(), taken_.end(), [&](const Box& t) {
                    return box.x0 < t.x1 && t.x0 < box.x1 && box.y0 < t.y1 && t.y0 < box.y1;
                }))
                continue;
            taken_.push_back(box);
            drawing_.text(place, text, colour);
            return true;
        }
        return false;
    }

    void draw_texts() {
        const auto [ra, dec] = boresight_of(chart_.truth.poses.front().pose);
        const std::string name = chart_.scene.name.empty() ? "Field of the camera" : chart_.scene.name;
        drawing_.text({margin, 22}, name, title);
        drawing_.text(
            {margin, 42},
            fmt::format("t = {:g} s   boresight RA {:.3f}\u00b0 Dec {:+.3f}\u00b0 (J2000)   {} x {} px",
                        chart_.time_s, ra / degree, dec / degree, camera_.width, camera_.height),
            grid_text);
        if (!faintest_) return;
        // Scale of magnitudes.
        double x = margin + 8;
        const double y = top + height_ + 32;
        const int bright = static_cast<int>(std::floor(*faintest_ - max_radius / radius_per_magnitude)) + 1;
        for (int m = std::max(bright, -2); m <= static_cast<int>(std::ceil(*faintest_)); ++m) {
            drawing_.disc({x, y}, radius_of(m), label);
            drawing_.text({x + 11, y}, fmt::format("V {}", m), grid_text);
            x += 62;
        }
    }

    struct Box {
        double x0, y0, x1, y1;
    };
    const SkyChart& chart_;
    const scene::Camera& camera_;
    double scale_, width_, height_;
    Drawing drawing_;
    std::optional<double> faintest_{};
    std::vector<Box> taken_;
};

} // namespace

std::pair<double, double> boresight_of(const Pose& camera) {
    const Vec3 z = rotate(camera.orientation, {0, 0, 1});
    const double ra = std::atan2(z.y, z.x);
    return {ra < 0 ? ra + 2 * pi : ra, std::asin(std::clamp(z.z, -1.0, 1.0))};
}

Drawing draw_sky(const SkyChart& chart) {
    return SkyPainter(chart).draw();
}

} // namespace obscura::tools

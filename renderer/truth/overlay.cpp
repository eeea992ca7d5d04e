// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/overlay.hpp"

#include "renderer/integrators/star_rows.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/truth/curves.hpp"
#include "renderer/truth/limb_span.hpp"
#include "renderer/truth/row_states.hpp"
#include "renderer/truth/sight.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace obscura::renderer {
namespace {

/// Shorter motions are none.
constexpr double min_motion_px = 0.5;
/// Bodies whose bounding sphere is smaller have no limb.
constexpr double min_radius_px = 0.5;

class OverlayMaker {
public:
    OverlayMaker(const TruthScene& scene, const OverlayRequest& request)
        : scene_(scene),
          request_(request),
          states_(scene, request.windows, request.rows, request.rows, request.push_broom, {}, {}),
          middle_(states_.state_at(to_seconds(request.mid.ns))) {}

    [[nodiscard]] std::vector<OverlayBody> bodies() {
        use_light(scene_.sun_w_m2);
        std::vector<OverlayBody> list;
        for (std::size_t b = 0; b < std::min(scene_.scene.bodies.size(), request_.max_bodies); ++b)
            list.push_back(body(b));
        return list;
    }

    [[nodiscard]] std::vector<OverlayStar> stars() {
        const std::size_t bands = scene_.scene.bands.size();
        std::vector<Candidate> candidates;
        for (std::size_t i = 0; i < scene_.stars.numbers.size() && scene_.stars.numbers[i] != no_star; ++i)
            candidates.push_back(
                {light_of(std::span(scene_.stars.irradiance_w_m2).subspan(i * bands, bands)), i, false});
        for (std::size_t i = 0; i < scene_.sky.size(); ++i)
            if (const auto source = sky_source(i, middle_)) {
                std::vector<double> irradiance(bands);
                scene_.sky.irradiance(i, *source, irradiance);
                candidates.push_back({light_of(irradiance), i, true});
            }
        // Most catalogues have more in the field than are wanted: take one by one what is brightest.
        const auto fainter = [](const Candidate& a, const Candidate& b) {
            return a.light != b.light ? a.light < b.light : a.index > b.index;
        };
        std::make_heap(candidates.begin(), candidates.end(), fainter);
        std::vector<OverlayStar> list;
        for (auto end = candidates.end(); end != candidates.begin() && list.size() < request_.max_stars;
             --end) {
            std::pop_heap(candidates.begin(), end, fainter);
            add(*(end - 1), list);
        }
        return list;
    }

private:
    /// A star of the field, or a sky object.
    struct Candidate {
        double light = 0;
        std::size_t index = 0;
        bool sky = false;
    };

    [[nodiscard]] double light_of(std::span<const double> irradiance_w_m2) const {
        double sum = 0;
        for (std::size_t b = 0; b < irradiance_w_m2.size(); ++b)
            sum += irradiance_w_m2[b] * response(b);
        return sum;
    }
    [[nodiscard]] double response(std::size_t band) const {
        const auto& electrons = request_.electrons_per_s_per_w_m2;
        return band < electrons.size() ? electrons[band] : 1;
    }
    /// Light of the next objects, for the centroid of the PSF.
    void use_light(std::span<const double> irradiance_w_m2) {
        weights_.assign(irradiance_w_m2.begin(), irradiance_w_m2.end());
        for (std::size_t b = 0; b < weights_.size(); ++b)
            weights_[b] *= response(b);
        states_.set_band_weights(weights_);
    }

    /// Landing in the window where it is seen, else where it is on the pixels, else by the first window.
    std::pair<std::optional<Landing>, std::size_t> land(const RowStates::Direction& towards,
                                                        const RowStates::Seen& seen) {
        std::pair<std::optional<Landing>, std::size_t> best{std::nullopt, 0};
        for (std::size_t w = 0; w < request_.windows.size(); ++w) {
            const std::optional<Landing> landing = states_.land(w, towards, seen);
            if (!landing) continue;
            const auto rank = [](const Landing& l) { return l.seen > 0 ? 2 : l.inside > 0 ? 1 : 0; };
            if (!best.first || rank(*landing) > rank(*best.first)) best = {landing, w};
        }
        return best;
    }

    [[nodiscard]] OverlayBody body(std::size_t b) {
        OverlayBody out;
        out.name = scene_.scene.bodies[b].name;
        out.position_m = middle_.bodies[b].pose.position_m;
        const auto towards = [&](const TruthState& s) { return towards_point(s, b, {}); };
        const Vec3 direction = towards(middle_);
        out.range_m = length(direction);
        const double radius_m = scene_.bodies[b].shape->bounding_radius_m();
        if (radius_m < out.range_m)
            out.radius_px = std::asin(radius_m / out.range_m) / scene_.lens.local_pixel_angle_rad(direction);
        const auto [landing, window] = land(towards, [](const TruthState&, Vec3) { return true; });
        if (landing) {
            out.at = landing->at;
            out.motion = motion(b, request_.windows[window]);
        }
        if (out.radius_px.value_or(min_radius_px) >= min_radius_px) out.limb = limb(b);
        return out;
    }

    [[nodiscard]] std::optional<OverlayBody::Motion> motion(std::size_t b, const FrameWindow& window) {
        if (request_.push_broom) return std::nullopt;
        const auto at = [&](const RowTime& row) -> std::optional<ImagePoint> {
            const TruthState& state = states_.state_at(to_seconds(row.mid().ns));
            ImagePoint shift;
            const auto point = states_.project(state, towards_point(state, b, {}), shift);
            if (!point) return std::nullopt;
            return ImagePoint{point->x - window.sensor.x, point->y - window.sensor.y + window.image_y};
        };
        const auto start = at(request_.rows.front()), end = at(request_.rows.back());
        if (!start || !end || std::hypot(end->x - start->x, end->y - start->y) <= min_motion_px)
            return std::nullopt;
        return OverlayBody::Motion{*start, *end};
    }

    [[nodiscard]] std::vector<LimbPoint> limb(std::size_t b) {
        std::vector<LimbPoint> points;
        const auto span = limb_span(scene_, states_, b, request_.limb_points);
        if (!span) return points;
        const BodyCurve curve(scene_, b, TruthKind::limb, *span, states_);
        for (std::size_t w = 0; w < request_.windows.size(); ++w) {
            bool begins = true;
            for (std::uint32_t i = 0; i < span->points; ++i) {
                const auto landing = limb_landing(curve, b, i, w);
                if (landing) points.push_back({landing->at, curve.lit(*landing->state, i), begins});
                begins = !landing;
            }
        }
        return points;
    }

    [[nodiscard]] std::optional<Landing> limb_landing(const BodyCurve& curve, std::size_t b, std::uint32_t i,
                                                      std::size_t window) {
        if (!curve.has(states_.middle_of(window), i)) return std::nullopt;
        const auto towards = [&](const TruthState& s) { return towards_point(s, b, curve.point_m(s, i)); };
        const auto seen = [&](const TruthState& s, Vec3 d) { return !is_hidden(scene_, s, d, length(d), b); };
        std::optional<Landing> landing = states_.land(window, towards, seen);
        if (landing && landing->seen == 0) landing.reset();
        return landing;
    }

    [[nodiscard]] std::optional<SkySource> sky_source(std::size_t i, const TruthState& state) const {
        return scene_.sky.at(i, scene_.bodies, state.camera.position_m, state.time_s);
    }

    /// Appends a candidate that is seen in the image.
    void add(const Candidate& candidate, std::vector<OverlayStar>& list) {
        OverlayStar star;
        double range_m = no_hit;
        StarPlace place;
        if (candidate.sky) {
            const auto source = sky_source(candidate.index, middle_);
            if (!source) return;
            star.name = scene_.sky.object(candidate.index).name;
            star.magnitude_v = source->magnitude_v;
            range_m = source->distance_m;
            place.direction = source->direction;
        } else {
            place = scene_.stars.places[candidate.index];
        }
        const auto towards = [&](const TruthState& s) {
            const auto source = candidate.sky ? sky_source(candidate.index, s) : std::nullopt;
            const StarObserver observer =
                candidate.sky ? StarObserver{} : star_observer(scene_.scene, s.camera.position_m, s.time_s);
            return s.camera_from_inertial * (source ? source->direction : place.from(observer));
        };
        const auto seen = [&](const TruthState& s, Vec3 d) { return !is_hidden(scene_, s, d, range_m); };
        use_candidate_light(candidate);
        const auto landing = land(towards, seen).first;
        if (!landing || landing->seen == 0) return;
        star.at = landing->at;
        if (!candidate.sky) {
            const scene::Star from = scene::star_of(scene_.scene, scene_.stars.numbers[candidate.index]);
            star.magnitude_v = from.magnitude_v;
            star.right_ascension_rad = from.right_ascension_rad;
            star.declination_rad = from.declination_rad;
        }
        list.push_back(std::move(star));
    }

    void use_candidate_light(const Candidate& candidate) {
        const std::size_t bands = scene_.scene.bands.size();
        if (!candidate.sky) {
            use_light(std::span(scene_.stars.irradiance_w_m2).subspan(candidate.index * bands, bands));
        } else if (const auto source = sky_source(candidate.index, middle_)) {
            std::vector<double> irradiance(bands);
            scene_.sky.irradiance(candidate.index, *source, irradiance);
            use_light(irradiance);
        }
    }

    const TruthScene& scene_;
    const OverlayRequest& request_;
    RowStates states_;
    const TruthState& middle_;
    std::vector<double> weights_;
};

} // namespace

Overlay make_overlay(const TruthScene& scene, const OverlayRequest& request) {
    Overlay overlay;
    overlay.bodies_of = scene.scene.bodies.size();
    if (request.windows.empty() || request.rows.empty()) return overlay;
    OverlayMaker maker(scene, request);
    overlay.bodies = maker.bodies();
    overlay.stars = maker.stars();
    return overlay;
}

} // namespace obscura::renderer

// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/scene_truth.hpp"

#include "core/solar_spectrum.hpp"
#include "core/units.hpp"
#include "renderer/integrators/star_rows.hpp"
#include "renderer/lights/detector_response.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/truth/body_light.hpp"
#include "renderer/truth/curves.hpp"
#include "renderer/truth/disc_shares.hpp"
#include "renderer/truth/features.hpp"
#include "renderer/truth/row_states.hpp"
#include "renderer/truth/sight.hpp"
#include "renderer/truth/signal.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory_resource>

namespace obscura::renderer {
namespace {

void set_place(TruthEntry& entry, std::size_t window, const Landing& landing) {
    entry.window = static_cast<std::uint16_t>(window);
    entry.x_px = landing.at.x, entry.y_px = landing.at.y;
    entry.psf_x_px = landing.psf_shift.x, entry.psf_y_px = landing.psf_shift.y;
    entry.time = landing.row.mid();
    entry.exposure_ns = landing.row.exposure_ns();
}

TruthVisibility visibility_of(double seen, double inside) {
    if (!(inside > 0)) return TruthVisibility::outside;
    if (!(seen > 0)) return TruthVisibility::hidden;
    return seen < 1 - 1e-9 ? TruthVisibility::partly : TruthVisibility::visible;
}

/// Rate of electrons in each band, or the irradiance without a detector.
void set_band_signal(const TruthDetector& detector, std::span<const double> irradiance_w_m2,
                     std::pmr::vector<double>& signal) {
    signal.assign(irradiance_w_m2.begin(), irradiance_w_m2.end());
    for (std::size_t b = 0; b < std::min(signal.size(), detector.electrons_per_s_per_w_m2.size()); ++b)
        signal[b] *= detector.electrons_per_s_per_w_m2[b];
}

double sum_of(std::span<const double> values) {
    double sum = 0;
    for (const double v : values)
        sum += v;
    return sum;
}

/// Middle of a landing on the sensor, without the shift of the PSF.
ImagePoint on_sensor(const FrameWindow& window, const Landing& landing) {
    return {landing.at.x + window.sensor.x - landing.psf_shift.x,
            landing.at.y - window.image_y + window.sensor.y - landing.psf_shift.y};
}

/// Identity of a crater or boulder as 16 hexadecimal digits.
class FeatureName {
public:
    explicit FeatureName(std::uint64_t id) {
        for (std::size_t i = digits_.size(); i-- > 0; id >>= 4)
            digits_[i] = "0123456789abcdef"[id & 15];
    }
    [[nodiscard]] std::string_view view() const { return {digits_.data(), digits_.size()}; }

private:
    std::array<char, 16> digits_{};
};

class Lister {
public:
    Lister(const TruthScene& scene, const TruthRequest& request, SceneTruth& truth)
        : scene_(scene),
          request_(request),
          row_times_(request.row_times.empty() ? request.rows : request.row_times),
          states_(scene, request.windows, request.rows, row_times_, request.push_broom, request.pixel_times,
                  request.workspace),
          signal_(&states_.memory()),
          truth_(truth) {}

    void add_poses() {
        const auto middle_of = [](std::span<const RowTime> rows) {
            return midpoint(rows.front().reset, rows.back().read);
        };
        truth_.mid_exposure = middle_of(row_times_);
        const double middle_s = to_seconds(middle_of(request_.rows).ns);
        const TruthState& state = states_.state_at(middle_s);
        truth_.sun_position_m = state.sun_m;
        const auto add = [&](std::string_view name, const Pose& pose) {
            const Vec3 to_sun = state.sun_m - pose.position_m;
            truth_.poses.push_back({{}, pose, rotate(conjugate(pose.orientation), normalized(to_sun))});
            truth_.poses.back().name.set(name);
        };
        add("camera", state.camera);
        for (std::size_t b = 0; b < scene_.scene.bodies.size(); ++b)
            add(scene_.scene.bodies[b].name,
                seen_pose(scene_.scene, scene_.bodies, b, state.camera.position_m, middle_s));
    }

    void add_bodies() {
        use_sunlight();
        for (std::size_t b = 0; b < scene_.bodies.size(); ++b)
            add_body(b);
    }

    void add_landmarks() {
        use_sunlight();
        for (std::size_t i = 0; i < scene_.scene.landmarks.size(); ++i)
            add_landmark(i);
    }

    void add_stars() {
        const std::size_t bands = scene_.scene.bands.size();
        for (std::size_t i = 0; i < scene_.stars.numbers.size(); ++i) {
            if (scene_.stars.numbers[i] == no_star) break; // the last ones
            const std::span irradiance = std::span(scene_.stars.irradiance_w_m2).subspan(i * bands, bands);
            use_light(irradiance);
            const StarPlace& place = scene_.stars.places[i];
            const auto towards = [&](const TruthState& s) {
                return s.camera_from_inertial *
                       place.from(star_observer(scene_.scene, s.camera.position_m, s.time_s));
            };
            const auto seen = [&](const TruthState& s, Vec3 d) { return !is_hidden(scene_, s, d, no_hit); };
            TruthEntry entry;
            entry.kind = TruthKind::star;
            entry.object = static_cast<std::int32_t>(scene_.stars.numbers[i]);
            const scene::Star star = scene::star_of(scene_.scene, scene_.stars.numbers[i]);
            entry.magnitude_v = star.magnitude_v;
            entry.range_m = no_hit;
            add_point_source(entry, towards, seen, sum_of_bands(irradiance, star));
        }
    }

    /// The sky objects that move or vary: as stars, with their names and the object number -1.
    void add_sky() {
        std::pmr::vector<double> irradiance(scene_.scene.bands.size(), &states_.memory());
        for (std::size_t i = 0; i < scene_.sky.size(); ++i) {
            const auto source = [&](const TruthState& s) {
                return scene_.sky.at(i, scene_.bodies, s.camera.position_m, s.time_s);
            };
            const double middle_s = to_seconds(truth_.mid_exposure.ns);
            const auto middle = scene_.sky.at(
                i, scene_.bodies, camera_pose(scene_.scene, scene_.bodies, middle_s).position_m, middle_s);
            if (!middle) continue;
            scene_.sky.irradiance(i, *middle, irradiance);
            use_light(irradiance);
            const auto towards = [&](const TruthState& s) {
                return s.camera_from_inertial * source(s).value_or(*middle).direction;
            };
            const auto seen = [&](const TruthState& s, Vec3 d) {
                return !is_hidden(scene_, s, d, middle->distance_m);
            };
            TruthEntry entry;
            entry.kind = TruthKind::star;
            entry.object = -1;
            entry.name.set(scene_.sky.object(i).name);
            entry.magnitude_v = middle->magnitude_v;
            entry.range_m = middle->distance_m;
            scene::Star star = scene_.sky.object(i).star;
            star.magnitude_v = middle->magnitude_v;
            add_point_source(entry, towards, seen, sum_of_bands(irradiance, star));
        }
    }

    void add_galaxies() {
        for (const SkySources::Galaxy& galaxy : scene_.sky.galaxies()) {
            use_light(galaxy.irradiance_w_m2);
            const StarPlace place{galaxy.direction, {}, 0};
            const auto towards = [&](const TruthState& s) {
                return s.camera_from_inertial *
                       place.from(star_observer(scene_.scene, s.camera.position_m, s.time_s));
            };
            const auto seen = [&](const TruthState& s, Vec3 d) { return !is_hidden(scene_, s, d, no_hit); };
            TruthEntry entry;
            entry.kind = TruthKind::galaxy;
            entry.object = -1;
            entry.name.set(galaxy.object->name);
            entry.magnitude_v = galaxy.object->star.magnitude_v;
            entry.range_m = no_hit;
            add_point_source(entry, towards, seen, sum_of_bands(galaxy.irradiance_w_m2, galaxy.object->star));
        }
    }

    void add_curves() {
        use_sunlight();
        for (std::size_t b = 0; b < scene_.scene.bodies.size() && request_.curve_points > 0; ++b) {
            add_curve(b, TruthKind::limb);
            add_curve(b, TruthKind::terminator);
        }
    }

    void add_features() {
        use_sunlight();
        for (std::size_t b = 0; b < scene_.scene.bodies.size(); ++b) {
            if (scene_.bodies[b].shape->tiles() == nullptr) continue;
            FeatureFinder finder(scene_, states_, b);
            std::int32_t number = 0;
            for (const FeatureInView& found : finder.find())
                add_feature(b, found, number++);
        }
    }

private:
    /// Light of the next entries, in each band.
    void use_light(std::span<const double> irradiance_w_m2) {
        set_band_signal(request_.detector, irradiance_w_m2, signal_);
        states_.set_band_weights(signal_);
    }
    void use_sunlight() { use_light(scene_.sun_w_m2); }
    [[nodiscard]] bool counts_electrons() const {
        return !request_.detector.electrons_per_s_per_w_m2.empty();
    }
    /// Expected electrons per second of a light.
    [[nodiscard]] double electrons_per_s(const BandLight& light) const {
        double sum = 0;
        const auto& response = request_.detector.electrons_per_s_per_w_m2;
        for (std::size_t b = 0; b < std::min(scene_.sun_w_m2.size(), response.size()); ++b)
            sum += light[b] * response[b];
        return sum;
    }
    /// Irradiance of a body's light: without the weight of a detector's response on its colour.
    [[nodiscard]] double sum_of_bands(const BandLight& light, std::size_t body) const {
        double sum = 0;
        for (std::size_t b = 0; b < scene_.sun_w_m2.size(); ++b)
            sum += light[b] *
                   (body < scene_.scene.bodies.size() ? energy_of_response(scene_.scene.bodies[body], b) : 1);
        return sum;
    }
    /// Irradiance of a star's light, likewise.
    [[nodiscard]] double sum_of_bands(std::span<const double> light, const scene::Star& star) const {
        if (scene_.star_energy_um.empty()) return sum_of(light);
        const StarBins spectrum = star_spectrum(star);
        double sum = 0;
        for (const StarBins& weights_um : scene_.star_energy_um)
            sum += star_irradiance_w_m2(star, spectrum, weights_um);
        return sum;
    }

    /// Sets the light of a body that is seen, in all its pixels in the window.
    void set_body_light(TruthEntry& entry, std::size_t body, std::size_t window, double time_s) {
        if (scene_.light == nullptr || !request_.body_light || !(entry.visible_share > 0)) return;
        const BandLight light = scene_.light->irradiance(body, time_s, request_.windows[window].sensor);
        const double irradiance_w_m2 = sum_of_bands(light, body);
        if (!(irradiance_w_m2 > 0)) return;
        entry.irradiance_w_m2 = irradiance_w_m2;
        if (counts_electrons()) entry.signal_e = electrons_per_s(light) * to_seconds(entry.exposure_ns);
    }

    /// Sets the light of the pixel that has a landmark, of its radiance.
    void set_landmark_light(TruthEntry& entry, std::size_t body, std::size_t window, const Landing& landing,
                            Vec3 towards) {
        if (scene_.light == nullptr || !(landing.seen > 0)) return;
        const TruthState& state = *landing.state;
        const ImagePoint at = on_sensor(request_.windows[window], landing);
        const double pixel = scene_.lens.solid_angle_sr(at.x, at.y) * states_.transmission(state, towards);
        BandLight light = scene_.light->radiance(body, state.time_s, normalized(towards));
        for (double& band : light)
            band *= pixel;
        entry.irradiance_w_m2 = sum_of_bands(light, body);
        if (counts_electrons())
            entry.peak_e = electrons_per_s(light) * to_seconds(entry.exposure_ns) * landing.seen;
    }

    void push(const TruthEntry& entry) {
        if (request_.max_entries > 0 && truth_.entries.size() >= request_.max_entries)
            ++truth_.entries_left_out;
        else
            truth_.entries.push_back(entry);
    }

    [[nodiscard]] std::string_view name_of(std::size_t body) const {
        return body < scene_.scene.bodies.size() ? std::string_view(scene_.scene.bodies[body].name)
                                                 : scene::sun_name;
    }

    /// Adds `entry` for each window in which a point source of the light in use lands.
    void add_point_source(TruthEntry entry, const RowStates::Direction& towards, const RowStates::Seen& seen,
                          double irradiance_w_m2) {
        entry.irradiance_w_m2 = irradiance_w_m2;
        for (std::size_t w = 0; w < request_.windows.size(); ++w) {
            const std::optional<Landing> landing = states_.land(w, towards, seen);
            if (!landing || landing->inside == 0) continue;
            TruthEntry landed = entry;
            set_place(landed, w, *landing);
            landed.visible_share = landing->seen;
            landed.visibility = visibility_of(landing->seen, landing->inside);
            if (counts_electrons()) {
                // The image of a galaxy is not that of a point.
                const double signal_e = sum_of(signal_) * landing->seconds;
                if (entry.kind == TruthKind::galaxy)
                    landed.signal_e = signal_e;
                else
                    set_signal(landed, request_.detector, signal_e,
                               image_of_point(scene_, on_sensor(request_.windows[w], *landing),
                                              landing->streak, signal_));
            }
            push(landed);
        }
    }

    /// Sets where a point of a body is on it.
    void set_point(TruthEntry& entry, std::size_t body, Vec3 point_m) const {
        entry.point_m = point_m;
        const SurfaceTiles* const tiles = scene_.bodies[body].shape->tiles();
        if (tiles != nullptr && tiles->domain().is_plane()) return;
        entry.latitude_deg = std::atan2(point_m.z, std::hypot(point_m.x, point_m.y)) / degree;
        entry.longitude_deg = std::atan2(point_m.y, point_m.x) / degree;
    }

    /// Point of a landmark; of a terrain where the frame's tiles have it, if a direction was given.
    [[nodiscard]] Vec3 landmark_m(std::size_t i, std::size_t body) {
        const Vec3 point_m = scene_.landmarks_m[i];
        if (scene_.bodies[body].shape->tiles() == nullptr || scene_.scene.landmarks[i].position_m)
            return point_m;
        return surface_point(scene_, states_.middle_of(0), body, point_m).value_or(point_m);
    }

    void add_landmark(std::size_t i) {
        const scene::Landmark& landmark = scene_.scene.landmarks[i];
        const auto body = static_cast<std::size_t>(scene::index_of(scene_.scene.bodies, landmark.body));
        const Vec3 point_m = landmark_m(i, body);
        const double slack_m = surface_slack_m(scene_, body);
        const auto towards = [&](const TruthState& s) { return towards_point(s, body, point_m); };
        const auto seen = [&](const TruthState& s, Vec3 d) {
            return faces_camera(scene_, s, body, point_m, slack_m) &&
                   !is_hidden(scene_, s, d, length(d), body);
        };
        TruthEntry entry;
        entry.kind = TruthKind::landmark;
        entry.time = truth_.mid_exposure;
        entry.object = static_cast<std::int32_t>(body);
        entry.item = static_cast<std::int32_t>(i);
        entry.name.set(landmark.name);
        set_point(entry, body, point_m);
        std::optional<TruthEntry> outside;
        bool added = false;
        for (std::size_t w = 0; w < request_.windows.size(); ++w) {
            const std::optional<Landing> landing = states_.land(w, towards, seen);
            const TruthState& state = landing ? *landing->state : states_.middle_of(w);
            TruthEntry here = entry;
            if (landing) set_place(here, w, *landing);
            here.range_m = length(towards(state));
            here.lit = is_lit(scene_, state, body, point_m, slack_m);
            here.visible_share = landing ? landing->seen : 0;
            here.visibility =
                landing ? visibility_of(landing->seen, landing->inside) : TruthVisibility::outside;
            if (here.visibility == TruthVisibility::outside) {
                if (!outside) outside = here;
                continue;
            }
            if (landing) set_landmark_light(here, body, w, *landing, towards(state));
            push(here);
            added = true;
        }
        if (!added && outside) push(*outside);
    }

    void add_feature(std::size_t body, const FeatureInView& found, std::int32_t number) {
        const auto towards = [&](const TruthState& s) { return towards_point(s, body, found.point_m); };
        // Its point is one of the surface that hides it, but for the rounding of the ray.
        const double slack_m =
            detail_of(scene_, states_.middle_of(0), body).cell_rad * length(towards(states_.middle_of(0))) +
            1e-9 * scene_.bodies[body].shape->bounding_radius_m();
        const auto seen = [&](std::span<const TruthState* const> states, std::span<const Vec3> directions,
                              std::span<bool> answers) {
            face_cameras(scene_, states, body, found.point_m, slack_m, answers);
            for (std::size_t i = 0; i < states.size(); ++i)
                if (answers[i])
                    answers[i] = !is_hidden(scene_, *states[i], directions[i], length(directions[i]), body);
        };
        TruthEntry entry;
        entry.kind =
            found.feature.kind == terrain::FeatureKind::crater ? TruthKind::crater : TruthKind::boulder;
        entry.object = static_cast<std::int32_t>(body);
        entry.item = number;
        entry.name.set(FeatureName(found.feature.id).view());
        entry.diameter_m = found.feature.diameter_m;
        set_point(entry, body, found.point_m);
        for (std::size_t w = 0; w < request_.windows.size(); ++w) {
            const std::optional<Landing> landing = states_.land_together(w, towards, seen);
            if (!landing || landing->inside == 0) continue;
            set_place(entry, w, *landing);
            entry.range_m = length(towards(*landing->state));
            entry.lit = is_lit(scene_, *landing->state, body, found.point_m, slack_m);
            entry.visible_share = landing->seen;
            entry.visibility = visibility_of(landing->seen, landing->inside);
            push(entry);
        }
    }

    void add_body(std::size_t b) {
        const auto towards = [&](const TruthState& s) { return towards_point(s, b, {}); };
        const auto seen = [](const TruthState& /*s*/, Vec3 /*d*/) { return true; };
        TruthEntry entry;
        entry.kind = TruthKind::body;
        entry.time = truth_.mid_exposure;
        entry.object = static_cast<std::int32_t>(b);
        entry.name.set(name_of(b));
        entry.visibility = TruthVisibility::outside;
        entry.visible_share = 0;
        bool added = false;
        std::optional<TruthEntry> outside;
        for (std::size_t w = 0; w < request_.windows.size(); ++w) {
            const std::optional<Landing> landing = states_.land(w, towards, seen);
            const TruthState& state = landing ? *landing->state : states_.middle_of(w);
            const DiscShares shares = disc_shares(scene_, states_, b, w, state);
            entry.range_m = length(state.bodies[b].pose.position_m - state.camera.position_m);
            entry.x_px = entry.y_px = TruthEntry::unknown;
            if (landing) set_place(entry, w, *landing);
            entry.visible_share = shares.seen;
            entry.visibility = visibility_of(shares.seen, shares.inside);
            if (b >= scene_.scene.bodies.size()) { // the Sun
                const double distances = astronomical_unit_m / entry.range_m;
                entry.irradiance_w_m2 = sum_of(scene_.sun_w_m2) * distances * distances;
                if (counts_electrons())
                    entry.signal_e =
                        sum_of(signal_) * distances * distances * shares.seen * to_seconds(entry.exposure_ns);
            } else {
                entry.irradiance_w_m2 = entry.signal_e = TruthEntry::unknown;
                set_body_light(entry, b, w, state.time_s);
            }
            if (entry.visibility == TruthVisibility::outside) {
                if (!outside) outside = entry;
                continue;
            }
            push(entry);
            added = true;
        }
        if (!added && outside) push(*outside);
    }

    void add_curve(std::size_t b, TruthKind kind) {
        const BodyCurve curve(scene_, b, kind, CurveSpan::turn(request_.curve_points), states_);
        for (std::uint32_t i = 0; i < request_.curve_points; ++i) {
            const auto towards = [&](const TruthState& s) {
                return towards_point(s, b, curve.point_m(s, i));
            };
            const auto seen = [&](const TruthState& s, Vec3 d) {
                return curve.near_side(s, i) && !is_hidden(scene_, s, d, length(d), b);
            };
            if (!curve.has(states_.middle_of(0), i)) continue;
            for (std::size_t w = 0; w < request_.windows.size(); ++w) {
                const std::optional<Landing> landing = states_.land(w, towards, seen);
                if (!landing || landing->seen == 0) continue;
                TruthEntry entry;
                entry.kind = kind;
                entry.object = static_cast<std::int32_t>(b);
                entry.item = static_cast<std::int32_t>(i);
                entry.name.set(name_of(b));
                set_place(entry, w, *landing);
                entry.range_m = length(towards(*landing->state));
                entry.visible_share = landing->seen;
                entry.visibility = visibility_of(landing->seen, landing->inside);
                entry.lit = kind == TruthKind::terminator || curve.lit(*landing->state, i);
                push(entry);
            }
        }
    }

    const TruthScene& scene_;
    const TruthRequest& request_;
    std::span<const RowTime> row_times_;
    RowStates states_;
    std::pmr::vector<double> signal_; ///< rate of the entries' light in each band, see set_band_signal()
    SceneTruth& truth_;
};

} // namespace

void list_truth(const TruthScene& scene, const TruthRequest& request, SceneTruth& truth) {
    truth.frame_id = request.frame_id;
    truth.poses.clear();
    truth.entries.clear();
    truth.entries_left_out = 0;
    if (request.windows.empty() || request.rows.empty()) return;
    Lister lister(scene, request, truth);
    lister.add_poses();
    lister.add_bodies();
    lister.add_landmarks();
    lister.add_stars();
    lister.add_sky();
    lister.add_galaxies();
    lister.add_curves();
    if (request.features) lister.add_features();
}

} // namespace obscura::renderer

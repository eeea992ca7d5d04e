// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/caustics.hpp"

#include "renderer/camera/aberration.hpp"
#include "renderer/lights/sunlight.hpp"
#include "renderer/materials/hemisphere.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Mirrors that a photon meets at most.
constexpr int max_mirrors = 16;
/// Photons of one block, whose landings are added up in order.
constexpr std::uint64_t block_photons = 65536;

/// A photon that has ended on a patch.
struct PhotonLanding {
    std::uint32_t patch = PatchHit::none;
    float power = 0;        ///< per W/m2 of the Sun at 1 au, or per W/sr of the lamp
    Vec3 at_m, direction;   ///< frame of the body that it ended on
    std::int32_t body = -1; ///< among PatchScene::bodies
};

/// 16 photons on their way, in the frame of the mirror they are aimed at.
struct Photons {
    RayPacket rays;
    Doubles power; ///< 0: none
};

/// Shoots photons of one light at one mirror.
class PhotonShooter {
public:
    /// `lamp`: -1: the Sun.
    PhotonShooter(const PatchRays& rays, const PatchBody& mirror, std::ptrdiff_t lamp, std::uint64_t photons,
                  std::uint64_t seed)
        : rays_(rays), mirror_(mirror), lamp_(lamp), photons_(photons) {
        const SeedWords words =
            seed_words(seed, static_cast<std::uint64_t>(lamp + 1), SamplePurpose::photons, mirror.index, 0);
        for (int i = 0; i < packet_size; ++i)
            first_[i] = words[0];
        const BodyState& own = rays.state(mirror);
        radius_m_ = own.shape->bounding_radius_m();
        for (const PatchBody& body : rays.scene().bodies) {
            const BodyState& other = rays.state(body);
            reach_m_ = std::max(reach_m_, length(other.seen.position_at(0) - own.seen.position_at(0)) +
                                              other.shape->bounding_radius_m());
        }
        reach_m_ += radius_m_;
    }

    /// Photons [begin, begin + 16), of which the first `landings.size()` count.
    void shoot(std::uint64_t begin, std::span<PhotonLanding> landings, std::uint64_t& count) const {
        Photons photons;
        aim(begin, landings.size(), photons);
        for (int bounce = 0; bounce <= max_mirrors && photons.rays.active.any(); ++bounce) {
            count += static_cast<std::uint64_t>(photons.rays.active.count());
            follow(bounce, photons, landings);
        }
    }

private:
    void aim(std::uint64_t begin, std::size_t wanted, Photons& out) const {
        Words index{};
        for (int i = 0; i < packet_size; ++i)
            index[i] = static_cast<std::uint32_t>(begin) + static_cast<std::uint32_t>(i);
        Doubles u, v, s, t;
        sobol_pair(index, first_, u, v);
        sobol_second_pair(index, first_, s, t);
        if (lamp_ < 0)
            aim_sun(u, v, s, t, out);
        else
            aim_lamp(u, v, out);
        std::fill_n(out.rays.t_max.v, packet_size, no_hit);
        std::fill_n(out.rays.level_u.v, packet_size, 0.5);
        out.rays.coherent = true;
        for (std::size_t i = 0; i < packet_size; ++i)
            out.rays.active.on[i] = i < wanted && out.power.v[i] > 0 ? -1 : 0;
    }

    /// Through the disc of the mirror's bounding sphere that faces the Sun, from beyond all bodies.
    void aim_sun(const Doubles& u, const Doubles& v, const Doubles& s, const Doubles& t, Photons& out) const {
        const BodyState& own = rays_.state(mirror_);
        const scene::Sun& sun = rays_.scene().built->scene.sun;
        const Vec3 axis = normalized(own.sun_m);
        Vec3s place;
        for (int i = 0; i < packet_size; ++i)
            place.set(i, radius_m_ * std::sqrt(u[i]) * around(axis, 0, v[i]));
        Vec3s to_sun;
        Doubles solid_angle;
        sample_sun(place, own.sun_m, sun, s, t, to_sun, solid_angle);
        const double radiance = sun_radiance_per_irradiance(sun.radius_m);
        const double area_m2 = std::numbers::pi * radius_m_ * radius_m_;
        for (int i = 0; i < packet_size; ++i) {
            const Vec3 d = to_sun.lane(i);
            out.rays.origin.set(i, place.lane(i) + 2 * reach_m_ * d);
            out.rays.direction.set(i, -d);
            out.power[i] = radiance * solid_angle[i] * dot(d, axis) * area_m2 / static_cast<double>(photons_);
        }
    }

    /// Within the cone of the mirror's bounding sphere.
    void aim_lamp(const Doubles& u, const Doubles& v, Photons& out) const {
        const auto number = static_cast<std::size_t>(lamp_);
        const scene::Lamp& lamp = rays_.scene().built->lighting.lamps[number];
        const auto [position, axis] = rays_.lamp(mirror_, number);
        const double distance = length(position);
        const bool outside = distance > 1.001 * radius_m_;
        const double sine = outside ? radius_m_ / distance : 1;
        const double height = outside ? 1 - std::sqrt(1 - sine * sine) : 2; // 1 - cosine of the cone
        const Vec3 towards = outside ? -position / distance : Vec3{0, 0, 1};
        const double solid_angle = 2 * std::numbers::pi * height;
        for (int i = 0; i < packet_size; ++i) {
            const Vec3 d = around(towards, 1 - height * u[i], v[i]);
            out.rays.origin.set(i, position);
            out.rays.direction.set(i, d);
            out.power[i] = beam_share(lamp, dot(axis, d)) * solid_angle / static_cast<double>(photons_);
        }
    }

    /// One flight of all photons: those that meet a mirror go on, others land if they have met one before.
    void follow(int bounce, Photons& photons, std::span<PhotonLanding> landings) const {
        const PatchScene& scene = rays_.scene();
        HitPacket hits;
        rays_.nearest(mirror_.index, photons.rays, hits);
        PatchHit found[packet_size];
        rays_.patches(mirror_.index, photons.rays, hits, found);
        Lanes going{};
        for (int i = 0; i < packet_size; ++i) {
            if (photons.rays.active.on[i] == 0 || hits.body[i] < 0) continue;
            const std::int32_t place = scene.place_of[static_cast<std::size_t>(hits.body[i])];
            const PatchBody& body = scene.bodies[static_cast<std::size_t>(place)];
            // Photons are aimed at one mirror: those that meet another one first are that one's.
            if (bounce == 0 && hits.body[i] != mirror_.index) continue;
            if (body.table->mirror()) {
                going.on[i] = bounce < max_mirrors ? -1 : 0;
            } else if (found[i].patch < PatchHit::inner_side) {
                land(i, place, photons, hits, found[i].patch, landings[static_cast<std::size_t>(i)]);
            }
        }
        photons.rays.active = going;
        photons.rays.coherent = false;
        reflect(hits, photons);
    }

    void land(int lane, std::int32_t place, const Photons& photons, const HitPacket& hits,
              std::uint32_t patch, PhotonLanding& out) const {
        const BodyState& here = rays_.state(mirror_);
        const BodyState& there = rays_.row().bodies[static_cast<std::size_t>(hits.body[lane])];
        const Mat3 turn = relative_rotation(here, there);
        out.patch = patch;
        out.power = static_cast<float>(photons.power[lane]);
        out.direction = turn * photons.rays.direction.lane(lane);
        out.at_m =
            turn * (photons.rays.origin.lane(lane) + hits.t[lane] * photons.rays.direction.lane(lane)) +
            relative_origin(here, there, 0);
        out.body = place;
    }

    /// Turns the photons that are on their way at the mirrors that they have met.
    void reflect(const HitPacket& hits, Photons& photons) const {
        Lanes left = photons.rays.active;
        const Doubles path{};
        for (int i = 0; i < packet_size; ++i) {
            if (left.on[i] == 0) continue;
            const std::int32_t index = hits.body[i];
            const BodyState& at = rays_.row().bodies[static_cast<std::size_t>(index)];
            RayPacket view;
            rays_.instants().between(mirror_.index, index, {}, photons.rays.origin, photons.rays.direction,
                                     path, view);
            view.active = photons.rays.active;
            SurfacePacket surface;
            at.shape->surface(view, hits, index, surface);
            const Mat3 turn = relative_rotation(at, rays_.state(mirror_));
            const Vec3 origin = relative_origin(at, rays_.state(mirror_), 0);
            const double r = at.material->mirror_reflectance();
            for (int k = i; k < packet_size; ++k) {
                if (left.on[k] == 0 || hits.body[k] != index) continue;
                left.on[k] = 0;
                const Vec3 n = surface.normal.lane(k), d = view.direction.lane(k);
                photons.rays.direction.set(k, turn * normalized(d - 2 * dot(d, n) * n));
                photons.rays.origin.set(k, turn * surface.shadow_origin.lane(k) + origin);
                photons.power[k] *= r;
            }
        }
    }

    const PatchRays& rays_;
    const PatchBody& mirror_;
    const std::ptrdiff_t lamp_;
    const std::uint64_t photons_;
    Words first_{};
    double radius_m_ = 0, reach_m_ = 0;
};

} // namespace

Caustics shoot_photons(const PatchRays& rays, std::span<const double> sun_w_m2, std::uint64_t photons,
                       std::uint64_t seed, const std::function<bool(std::uint64_t)>& go_on) {
    const PatchScene& scene = rays.scene();
    const std::size_t bands = scene.bands;
    Caustics out;
    out.pushes.resize(scene.bodies.size());
    if (!scene.mirrors || photons == 0) return out;
    std::vector<double> power(scene.patches * bands);
    const auto lamps = static_cast<std::ptrdiff_t>(scene.built->lighting.lamps.size());
    std::uint64_t shot = 0;
    for (const PatchBody& mirror : scene.bodies) {
        if (!mirror.table->mirror()) continue;
        for (std::ptrdiff_t lamp = scene.built->lighting.has_sun() ? -1 : 0; lamp < lamps; ++lamp) {
            const std::span<const double> light =
                lamp < 0 ? sun_w_m2
                         : std::span<const double>(
                               scene.built->lighting.lamps[static_cast<std::size_t>(lamp)].intensity_w_sr);
            if (light.empty()) continue;
            const PhotonShooter shooter(rays, mirror, lamp, photons, seed);
            std::vector<PhotonLanding> landings;
            for (std::uint64_t begin = 0; begin < photons; begin += block_photons) {
                if (!go_on(shot + begin)) return out;
                landings.assign(std::min(block_photons, photons - begin), {});
                std::vector<std::uint64_t> counts((landings.size() + packet_size - 1) / packet_size);
                tbb::parallel_for(std::size_t{0}, counts.size(), [&](std::size_t p) {
                    const std::span<PhotonLanding> all(landings);
                    const std::size_t first = p * packet_size;
                    shooter.shoot(begin + first,
                                  all.subspan(first, std::min(all.size() - first, std::size_t{packet_size})),
                                  counts[p]);
                });
                for (const std::uint64_t count : counts)
                    out.rays += count;
                for (const PhotonLanding& landing : landings) {
                    if (landing.patch == PatchHit::none) continue;
                    double all = 0;
                    for (std::size_t b = 0; b < bands; ++b) {
                        power[landing.patch * bands + b] += landing.power * light[b];
                        all += landing.power * light[b];
                    }
                    out.landed_w += all;
                    out.pushes[static_cast<std::size_t>(landing.body)].add(
                        landing.at_m, all / light_speed_m_s * landing.direction);
                }
            }
            shot += photons;
        }
    }
    out.power_w.assign(power.begin(), power.end());
    return out;
}

} // namespace obscura::renderer

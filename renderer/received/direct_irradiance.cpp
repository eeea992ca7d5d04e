// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/direct_irradiance.hpp"

#include "renderer/camera/aberration.hpp"
#include "renderer/lights/sunlight.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

namespace obscura::renderer {
namespace {

/// Direct light on one packet of patches after another.
class DirectGather {
public:
    DirectGather(const PatchRays& rays, const PatchBody& body, std::span<const double> sun_w_m2,
                 std::uint32_t points, std::uint64_t seed, DirectIrradiance& out)
        : rays_(rays), body_(body), sun_w_m2_(sun_w_m2), points_(points), seed_(seed), out_(out) {
        const PatchScene& scene = rays.scene();
        const std::size_t patches = body.receivers->patches().size();
        bands_ = scene.bands;
        spectral_ = scene.built->bodies[static_cast<std::size_t>(body.index)].material->spectral();
        out.channels = spectral_ ? bands_ : 1;
        has_sun_ = scene.built->lighting.has_sun();
        out.area_m2.assign(patches, 0);
        out.sun.assign(patches, 0);
        out.lit_share.assign(patches, 0);
        out.sun_share.assign(patches * out.channels, 0);
        if (!scene.built->lighting.lamps.empty())
            out.lamps.assign(patches * bands_, 0), out.lamps_reflected.assign(patches * bands_, 0);
        for (const PatchBody& other : scene.bodies)
            if (other.index != body.index) others_.push_back(other.index);
    }

    void run() {
        const std::size_t packets = body_.receivers->packets();
        std::vector<Push> pushes(packets);
        std::atomic<std::uint64_t> count{0};
        tbb::parallel_for(std::size_t{0}, packets, [&](std::size_t p) {
            count.fetch_add(gather(p, pushes[p]), std::memory_order_relaxed);
        });
        for (const Push& push : pushes) // in order: the same sum on any number of threads
            out_.push.add(push);
        out_.rays = count;
    }

private:
    std::uint64_t gather(std::size_t packet, Push& push) {
        std::uint64_t count = 0;
        PatchPoints at;
        Words seeds;
        body_.receivers->seeds(packet, seed_, Receivers::Draw::direct, seeds);
        for (std::uint32_t k = 0; k < points_; ++k) {
            Doubles random[4];
            draw(seeds, 0, k, random);
            body_.receivers->points(packet, random[0], random[1], points_, at);
            for (std::size_t i = 0; i < at.count; ++i)
                out_.area_m2[at.patch[i]] += at.area_m2.v[i];
            if (has_sun_) count += add_sun(at, random[2], random[3], push);
            for (std::size_t l = 0; l < rays_.scene().built->lighting.lamps.size(); ++l)
                count += add_lamp(at, l, push);
        }
        for (std::size_t i = 0; i < at.count; ++i)
            finish(at.patch[i]);
        return count;
    }

    /// Sums over points become means.
    void finish(std::size_t patch) {
        const double area = out_.area_m2[patch];
        if (!(area > 0)) return;
        for (std::size_t c = 0; c < out_.channels; ++c)
            if (out_.sun[patch] > 0) out_.sun_share[patch * out_.channels + c] /= out_.sun[patch];
        out_.sun[patch] /= area;
        out_.lit_share[patch] /= area;
        for (std::size_t b = 0; b < bands_ && !out_.lamps.empty(); ++b) {
            out_.lamps[patch * bands_ + b] /= area;
            out_.lamps_reflected[patch * bands_ + b] /= area;
        }
    }

    /// Rays along `direction` from points that face it, those that nothing blocks; returns their number.
    std::uint64_t shadow(const PatchPoints& at, std::span<const std::int32_t> others,
                         RayPacket& light) const {
        light.origin = at.surface.shadow_origin;
        light.active = {};
        for (std::size_t i = 0; i < at.count; ++i) {
            const auto lane = static_cast<int>(i);
            const bool faces = dot(at.surface.facet_normal.lane(lane), light.direction.lane(lane)) > 0;
            light.active.on[i] = faces && at.area_m2[lane] > 0 ? -1 : 0;
        }
        const auto count = static_cast<std::uint64_t>(light.active.count());
        rays_.occlude(body_, others, light);
        return count;
    }

    std::uint64_t add_sun(const PatchPoints& at, const Doubles& u, const Doubles& v, Push& push) {
        const BodyState& state = rays_.state(body_);
        const scene::Sun& sun = rays_.scene().built->scene.sun;
        RayPacket light;
        Doubles solid_angle;
        sample_sun(at.surface.position, state.sun_m, sun, u, v, light.direction, solid_angle);
        std::fill_n(light.t_max.v, packet_size, no_hit);
        const std::uint64_t count = shadow(at, state.occluders, light);
        // A point of the disc says whether the Sun is seen. Where all of the disc is above the horizon its
        // light is that of its centre, which has no noise.
        scene::Sun even;
        even.radius_m = sun.radius_m;
        const Doubles middle{};
        Vec3s centre;
        Doubles whole;
        sample_sun(at.surface.position, state.sun_m, even, middle, middle, centre, whole);
        for (int i = 0; i < packet_size; ++i) {
            const double sine = sun.radius_m / length(state.sun_m - at.surface.position.lane(i));
            if (!(dot(at.surface.facet_normal.lane(i), centre.lane(i)) > sine)) continue;
            light.direction.set(i, centre.lane(i));
            solid_angle[i] = whole[i];
        }
        const double radiance = sun_radiance_per_irradiance(sun.radius_m);
        for (std::size_t i = 0; i < at.count; ++i) {
            if (light.active.on[i] == 0) continue;
            const auto lane = static_cast<int>(i);
            const std::size_t patch = at.patch[i];
            const Vec3 normal = at.surface.facet_normal.lane(lane), d = light.direction.lane(lane);
            const double cosine = dot(normal, d);
            const double power = radiance * solid_angle[lane] * cosine * at.area_m2[lane]; // per W/m2 at 1 au
            out_.sun[patch] += power;
            out_.lit_share[patch] += at.area_m2[lane];
            Vec3 pressed{};
            double all = 0;
            Reflected reflected;
            for (std::size_t b = 0; b < bands_; ++b) {
                if (b == 0 || spectral_) reflected = body_.table->at(cosine, b);
                if (b < out_.channels) out_.sun_share[patch * out_.channels + b] += power * reflected.share;
                all += sun_w_m2_[b];
                pressed = pressed + sun_w_m2_[b] * body_.factor_of(patch, b, bands_) *
                                        recoil(reflected, normal, d, cosine);
            }
            push.add(at.surface.position.lane(lane), -power / light_speed_m_s * (all * d + pressed));
        }
        return count;
    }

    /// Momentum times c of the reflected light per power, before the factor.
    [[nodiscard]] static Vec3 recoil(const Reflected& reflected, Vec3 normal, Vec3 d, double cosine) {
        const Vec3 tangent = d - cosine * normal;
        const double size = length(tangent);
        return reflected.normal * normal + (size > 0 ? reflected.tangent / size * tangent : Vec3{0, 0, 0});
    }

    std::uint64_t add_lamp(const PatchPoints& at, std::size_t number, Push& push) {
        const scene::Lamp& lamp = rays_.scene().built->lighting.lamps[number];
        if (lamp.intensity_w_sr.empty()) return 0;
        const auto [position, axis] = rays_.lamp(body_, number);
        RayPacket light;
        Doubles falloff;
        for (int i = 0; i < packet_size; ++i) {
            const Vec3 to_lamp = position - at.surface.position.lane(i);
            const double distance = length(to_lamp);
            light.direction.set(i, distance > 0 ? to_lamp / distance : Vec3{0, 0, 1});
            light.t_max[i] = distance;
            falloff[i] = distance > 0
                             ? beam_share(lamp, -dot(axis, light.direction.lane(i))) / (distance * distance)
                             : 0;
        }
        const std::uint64_t count = shadow(at, others_, light);
        for (std::size_t i = 0; i < at.count; ++i) {
            if (light.active.on[i] == 0) continue;
            const auto lane = static_cast<int>(i);
            const std::size_t patch = at.patch[i];
            const Vec3 normal = at.surface.facet_normal.lane(lane), d = light.direction.lane(lane);
            const double cosine = dot(normal, d), power = falloff[lane] * cosine * at.area_m2[lane];
            Vec3 pressed{};
            Reflected reflected;
            for (std::size_t b = 0; b < bands_; ++b) {
                if (b == 0 || spectral_) reflected = body_.table->at(cosine, b);
                const double w = power * lamp.intensity_w_sr[b], factor = body_.factor_of(patch, b, bands_);
                out_.lamps[patch * bands_ + b] += w;
                out_.lamps_reflected[patch * bands_ + b] += w * factor * reflected.share;
                pressed = pressed + w * (d + factor * recoil(reflected, normal, d, cosine));
            }
            push.add(at.surface.position.lane(lane), -1 / light_speed_m_s * pressed);
        }
        return count;
    }

    const PatchRays& rays_;
    const PatchBody& body_;
    const std::span<const double> sun_w_m2_;
    const std::uint32_t points_;
    const std::uint64_t seed_;
    DirectIrradiance& out_;
    std::size_t bands_ = 0;
    bool spectral_ = false, has_sun_ = false;
    std::vector<std::int32_t> others_;
};

} // namespace

DirectIrradiance gather_direct(const PatchRays& rays, const PatchBody& body, std::span<const double> sun_w_m2,
                               std::uint32_t points, std::uint64_t seed) {
    DirectIrradiance out;
    DirectGather(rays, body, sun_w_m2, points, seed, out).run();
    return out;
}

} // namespace obscura::renderer

// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/balance.hpp"

#include "renderer/camera/aberration.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace obscura::renderer {
namespace {

/// Light is in balance when no radiosity changes by more than this share of the largest.
constexpr double balanced = 1e-6;
/// Patches of one task.
constexpr std::size_t patch_grain = 256;

/// Calls `work(patch)` for all patches of a body, several at a time.
template<typename Work>
void for_patches(std::size_t patches, const Work& work) {
    tbb::parallel_for(std::size_t{0}, (patches + patch_grain - 1) / patch_grain, [&](std::size_t g) {
        const std::size_t end = std::min(patches, (g + 1) * patch_grain);
        for (std::size_t patch = g * patch_grain; patch < end; ++patch)
            work(patch);
    });
}

} // namespace

Balance::Balance(const PatchRays& rays, std::span<const BodyExchange> exchange,
                 std::span<const DirectIrradiance> direct, const Caustics& caustics,
                 std::span<const double> sun_w_m2)
    : rays_(rays),
      scene_(rays.scene()),
      exchange_(exchange),
      direct_(direct),
      caustics_(caustics),
      sun_w_m2_(sun_w_m2),
      bands_(scene_.bands),
      source_(scene_.patches * bands_),
      near_(source_.size()),
      far_(source_.size()),
      far_law_(source_.size()) {
    set_sources();
    radiosity_ = source_;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i)
        correct_far(i);
}

double Balance::caustic_w_m2(std::size_t i, std::size_t patch, std::size_t band) const {
    const double area = direct_[i].area_m2[patch];
    if (caustics_.power_w.empty() || !(area > 0)) return 0;
    return caustics_.power_w[(scene_.bodies[i].first + patch) * bands_ + band] / area;
}

void Balance::set_sources() {
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
        const PatchBody& body = scene_.bodies[i];
        const DirectIrradiance& direct = direct_[i];
        const std::size_t patches = body.receivers->patches().size();
        for_patches(patches, [&](std::size_t patch) {
            for (std::size_t b = 0; b < bands_; ++b) {
                double m = std::numbers::pi * body.emission_of(patch, b, bands_);
                if (!body.table->mirror()) {
                    const double factor = body.factor_of(patch, b, bands_);
                    const double share = direct.reflected_share(patch, b);
                    m += direct.sun[patch] * share * factor * sun_w_m2_[b];
                    if (!direct.lamps.empty()) m += direct.lamps_reflected[patch * bands_ + b];
                    m += factor * body.table->diffuse(b) * caustic_w_m2(i, patch, b);
                }
                source_[(body.first + patch) * bands_ + b] = static_cast<float>(m);
            }
        });
    }
}

void Balance::correct_far(std::size_t i) {
    const BodyExchange& exchange = exchange_[i];
    if (exchange.far_directions == 0 || !scene_.built->lighting.has_sun()) return;
    const PatchBody& body = scene_.bodies[i];
    const BodyState& here = rays_.state(body);
    for_patches(body.receivers->patches().size(), [&](std::size_t patch) {
        const Vec3 at = body.receivers->patches()[patch].centre_m;
        const BodyExchange::FarHit* const hits = &exchange.far[patch * exchange.far_directions];
        std::vector<double> sum(bands_);
        for (std::size_t k = 0; k < exchange.far_directions; ++k) {
            if (hits[k].patch == PatchHit::none) continue;
            const std::size_t place = scene_.body_of(hits[k].patch);
            const PatchBody& other = scene_.bodies[place];
            const std::size_t from = hits[k].patch - other.first;
            const DirectIrradiance& lit = direct_[place];
            if (other.table->mirror() || !(lit.sun[from] > 0)) continue;
            const BodyState& there = rays_.state(other);
            const Patch& source = other.receivers->patches()[from];
            const Vec3 eye = relative_rotation(here, there) * at + relative_origin(here, there, 0);
            const Vec3 out = normalized(eye - source.centre_m),
                       in = normalized(there.sun_m - source.centre_m);
            constexpr double grazing = 0.02; // cells at the terminator are partly lit
            const double cos_in = std::max(grazing, dot(source.normal, in));
            ScatterPacket s;
            std::fill_n(s.cos_in.v, packet_size, cos_in);
            std::fill_n(s.cos_out.v, packet_size, std::max(1e-9, dot(source.normal, out)));
            std::fill_n(s.cos_phase.v, packet_size, std::clamp(dot(in, out), -1.0, 1.0));
            Channels r;
            const bool spectral = there.material->spectral();
            if (spectral)
                there.material->reflectances(s, r);
            else
                there.material->reflectance(s, r.v[0]);
            for (std::size_t b = 0; b < bands_; ++b) {
                const double law = std::numbers::pi * r.v[spectral ? b : 0][0] / cos_in;
                const double share = lit.reflected_share(from, b);
                sum[b] += hits[k].weight * lit.sun[from] * sun_w_m2_[b] * other.factor_of(from, b, bands_) *
                          (law - share);
            }
        }
        for (std::size_t b = 0; b < bands_; ++b)
            far_law_[(body.first + patch) * bands_ + b] = static_cast<float>(sum[b]);
    });
}

void Balance::gather(std::size_t i) {
    const PatchBody& body = scene_.bodies[i];
    const BodyExchange& exchange = exchange_[i];
    for_patches(body.receivers->patches().size(), [&](std::size_t patch) {
        std::array<double, max_channels> near{}, far{};
        for (std::size_t k = 0; k < exchange.directions; ++k) {
            const std::uint32_t from = exchange.near[patch * exchange.directions + k];
            if (from >= PatchHit::inner_side) continue;
            for (std::size_t b = 0; b < bands_; ++b)
                near[b] += radiosity_[from * bands_ + b];
        }
        for (std::size_t k = 0; k < exchange.far_directions; ++k) {
            const BodyExchange::FarHit& from = exchange.far[patch * exchange.far_directions + k];
            if (from.patch >= PatchHit::inner_side) continue;
            for (std::size_t b = 0; b < bands_; ++b)
                far[b] += static_cast<double>(from.weight) * radiosity_[from.patch * bands_ + b];
        }
        const std::size_t at = (body.first + patch) * bands_;
        for (std::size_t b = 0; b < bands_; ++b) {
            near_[at + b] = static_cast<float>(near[b] / std::max(exchange.directions, 1U));
            far_[at + b] = static_cast<float>(std::max(0.0, far[b] + far_law_[at + b]));
        }
    });
}

std::uint32_t Balance::solve(std::uint32_t max_bounces) {
    std::vector<float> next(radiosity_.size());
    for (std::uint32_t bounce = 1; bounce <= max_bounces; ++bounce) {
        for (std::size_t i = 0; i < scene_.bodies.size(); ++i)
            gather(i);
        double change = 0, largest = 0;
        for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
            const PatchBody& body = scene_.bodies[i];
            const std::size_t patches = body.receivers->patches().size();
            for (std::size_t patch = 0; patch < patches; ++patch)
                for (std::size_t b = 0; b < bands_; ++b) {
                    const std::size_t at = (body.first + patch) * bands_ + b;
                    const double rho =
                        body.table->mirror() ? 0 : body.table->diffuse(b) * body.factor_of(patch, b, bands_);
                    next[at] =
                        source_[at] + static_cast<float>(rho * (static_cast<double>(near_[at]) + far_[at]));
                    change = std::max(change, std::abs(static_cast<double>(next[at]) - radiosity_[at]));
                    largest = std::max(largest, static_cast<double>(next[at]));
                }
        }
        radiosity_.swap(next);
        if (change <= balanced * largest) return bounce;
    }
    return max_bounces;
}

Push Balance::exchanged_push(std::size_t i, std::uint64_t seed) const {
    const PatchBody& body = scene_.bodies[i];
    const BodyExchange& exchange = exchange_[i];
    const BodyState& here = rays_.state(body);
    const Receivers& receivers = *body.receivers;
    const auto brightness = [&](std::uint32_t patch) {
        double sum = 0;
        for (std::size_t b = 0; b < bands_; ++b)
            sum += radiosity_[patch * bands_ + b];
        return sum;
    };
    std::vector<Push> pushes(receivers.packets());
    Doubles middle;
    std::fill_n(middle.v, packet_size, 0.5);
    tbb::parallel_for(std::size_t{0}, pushes.size(), [&](std::size_t p) {
        PatchPoints at;
        receivers.points(p, middle, middle, 1, at);
        std::array<Vec3, packet_size> momentum{};
        Words seeds;
        receivers.seeds(p, seed, Receivers::Draw::near, seeds);
        for (std::uint32_t k = 0; k < exchange.directions; ++k) {
            bool any = false;
            for (std::size_t lane = 0; lane < at.count; ++lane)
                any = any || exchange.near[at.patch[lane] * exchange.directions + k] < PatchHit::inner_side;
            if (!any) continue;
            Vec3s direction;
            near_directions(seeds, k, at.surface.facet_normal, direction);
            for (std::size_t lane = 0; lane < at.count; ++lane) {
                const std::uint32_t from = exchange.near[at.patch[lane] * exchange.directions + k];
                if (from < PatchHit::inner_side)
                    momentum[lane] = momentum[lane] - brightness(from) / exchange.directions *
                                                          direction.lane(static_cast<int>(lane));
            }
        }
        for (std::size_t lane = 0; lane < at.count; ++lane) {
            const std::size_t patch = at.patch[lane];
            const Patch& own = receivers.patches()[patch];
            for (std::size_t k = 0; k < exchange.far_directions; ++k) {
                const BodyExchange::FarHit& hit = exchange.far[patch * exchange.far_directions + k];
                if (hit.patch >= PatchHit::inner_side) continue;
                const PatchBody& other = scene_.bodies[scene_.body_of(hit.patch)];
                const BodyState& there = rays_.state(other);
                const Vec3 source = relative_rotation(there, here) *
                                        other.receivers->patches()[hit.patch - other.first].centre_m +
                                    relative_origin(there, here, 0);
                momentum[lane] =
                    momentum[lane] - hit.weight * brightness(hit.patch) * normalized(source - own.centre_m);
            }
            // Diffuse light that leaves, but for the Sun's and the lamps' first reflection, whose recoil has
            // been counted by the law: emission and the reflection of exchanged light and caustics.
            double leaving = 0;
            for (std::size_t b = 0; b < bands_; ++b) {
                const std::size_t k = (body.first + patch) * bands_ + b;
                const double factor = body.factor_of(patch, b, bands_);
                const double diffuse = body.table->mirror() ? 0 : body.table->diffuse(b) * factor;
                leaving += std::numbers::pi * body.emission_of(patch, b, bands_) +
                           diffuse * (near_[k] + far_[k] + caustic_w_m2(i, patch, b));
            }
            const double lambert = 2.0 / 3;
            const double area = direct_[i].area_m2[patch];
            pushes[p].add(own.centre_m,
                          area / light_speed_m_s * (momentum[lane] - lambert * leaving * own.normal));
        }
    });
    Push sum;
    for (const Push& push : pushes)
        sum.add(push);
    return sum;
}

BodyReceivedLight Balance::light_of(std::size_t i, std::uint64_t seed) const {
    const PatchBody& body = scene_.bodies[i];
    const DirectIrradiance& direct = direct_[i];
    const std::size_t patches = body.receivers->patches().size();
    const std::size_t values = patches * bands_, first = body.first * bands_;
    BodyReceivedLight out;
    out.bands = bands_;
    out.receivers = body.receivers;
    out.lit_share.assign(direct.lit_share.begin(), direct.lit_share.end());
    out.to_inertial = rays_.state(body).seen.pose.orientation;
    auto& incident = out.incident_w_m2;
    auto& sun = incident[static_cast<std::size_t>(LightCause::sun)];
    sun.resize(values);
    for (std::size_t k = 0; k < values; ++k)
        sun[k] = static_cast<float>(direct.sun[k / bands_] * sun_w_m2_[k % bands_]);
    incident[static_cast<std::size_t>(LightCause::lamps)].assign(direct.lamps.begin(), direct.lamps.end());
    const auto part = [&](const std::vector<float>& all) {
        return std::vector<float>(all.begin() + static_cast<std::ptrdiff_t>(first),
                                  all.begin() + static_cast<std::ptrdiff_t>(first + values));
    };
    if (exchange_[i].far_directions > 0)
        incident[static_cast<std::size_t>(LightCause::planetshine)] = part(far_);
    if (exchange_[i].directions > 0) incident[static_cast<std::size_t>(LightCause::bodies)] = part(near_);
    if (!caustics_.power_w.empty()) {
        auto& caustic = incident[static_cast<std::size_t>(LightCause::caustic)];
        for (std::size_t k = 0; k < values; ++k)
            caustic.push_back(static_cast<float>(caustic_w_m2(i, k / bands_, k % bands_)));
    }
    out.radiosity_w_m2 = part(radiosity_);
    out.absorbed_w_m2.resize(values);
    for (std::size_t k = 0; k < values; ++k) {
        const std::size_t patch = k / bands_, b = k % bands_;
        const double factor = body.factor_of(patch, b, bands_);
        double absorbed = sun[k] * (1 - factor * direct.reflected_share(patch, b));
        if (!direct.lamps.empty()) absorbed += direct.lamps[k] - direct.lamps_reflected[k];
        absorbed += (1 - factor * body.table->diffuse(b)) *
                    (near_[first + k] + far_[first + k] + caustic_w_m2(i, patch, b));
        out.absorbed_w_m2[k] = static_cast<float>(absorbed);
    }
    add_sums(i, out);
    Push push = direct.push;
    push.add(exchanged_push(i, seed));
    push.add(caustics_.pushes[i]);
    out.sums.force_n = push.force;
    out.sums.torque_nm = push.torque;
    return out;
}

void Balance::add_sums(std::size_t i, BodyReceivedLight& out) const {
    const PatchBody& body = scene_.bodies[i];
    ReceivedSums& sums = out.sums;
    for (std::size_t patch = 0; patch < body.receivers->patches().size(); ++patch) {
        const double area = direct_[i].area_m2[patch];
        sums.lit_area_m2 += area * out.lit_share[patch];
        for (std::size_t b = 0; b < bands_; ++b) {
            const std::size_t k = patch * bands_ + b;
            for (std::size_t c = 0; c < light_causes; ++c)
                if (!out.incident_w_m2[c].empty()) sums.incident_w[c] += area * out.incident_w_m2[c][k];
            sums.absorbed_w += area * out.absorbed_w_m2[k];
            sums.leaving_w += area * out.radiosity_w_m2[k];
            sums.emitted_w += area * std::numbers::pi * body.emission_of(patch, b, bands_);
        }
    }
}

} // namespace obscura::renderer

// SPDX-License-Identifier: Apache-2.0
// Row at several instants of its exposure: poses by lane of a packet, whose rays are each at an instant of
// their own.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// The states of a row at the instants of its exposure, as rays see them. A ray in the frame of a body is the
/// same at any instant, so that only the transformations between frames depend on it. `instant`: the index of
/// each lane's instant; not read where there is only one. Does not own the states; thread-safe.
class Instants {
public:
    /// One instant: all lanes share it.
    Instants(const RowState& only) : states_(&only, 1) {}
    /// States that join_instants() has prepared; at least one.
    explicit Instants(std::span<const RowState> states) : states_(states) {}

    [[nodiscard]] std::size_t count() const { return states_.size(); }
    [[nodiscard]] bool one() const { return states_.size() == 1; }
    /// The first: for what is the same at all instants.
    [[nodiscard]] const RowState& front() const { return states_.front(); }
    [[nodiscard]] std::span<const RowState> states() const { return states_; }
    [[nodiscard]] const RowState& at(const Words& instant, int lane) const {
        return one() ? states_.front() : states_[instant.v[lane]];
    }
    [[nodiscard]] const BodyState& body(std::int32_t body, const Words& instant, int lane) const {
        return at(instant, lane).bodies[static_cast<std::size_t>(body)];
    }

    /// Scene times of the lanes.
    void times(const Words& instant, SampleTimes& out) const {
        for (int i = 0; i < packet_size; ++i)
            out.t[i] = at(instant, i).time_s;
        out.duration_s = front().duration_s;
    }
    /// Whether a body moves along its light, at some instant: ApparentBody::moves().
    [[nodiscard]] bool moves(std::int32_t body) const;
    /// Camera rays (unit, camera frame) in the frame of a body: sets origin, direction and stretch.
    void from_camera(std::int32_t body, const Words& instant, const Vec3s& direction, RayPacket& rays) const;
    /// Rays in the frame of body `from` in that of body `to`: sets origin, direction and stretch of `out`.
    /// They start at the end of paths from the camera of the length `path_m`.
    void between(std::int32_t from, std::int32_t to, const Words& instant, const Vec3s& origin,
                 const Vec3s& direction, const Doubles& path_m, RayPacket& out) const;
    /// Vectors in the frame of a body, in inertial axes.
    void to_inertial(std::int32_t body, const Words& instant, const Vec3s& in, Vec3s& out) const;
    /// Directions of light in the frame of a body, unit vectors, in the inertial frame.
    void directions_to_inertial(std::int32_t body, const Words& instant, const Vec3s& in, Vec3s& out) const;
    /// Samples the Sun's disc from positions in the frame of a body: see renderer::sample_sun().
    void sample_sun(std::int32_t body, const Words& instant, const Vec3s& position, const scene::Sun& sun,
                    const Doubles& u, const Doubles& v, Vec3s& direction, Doubles& solid_angle_sr) const;

private:
    std::span<const RowState> states_;
};

/// What a body may cover at any instant of a row.
struct SweptBody {
    Vec3 direction;          ///< unit, camera frame: to the body's centre at the middle instant
    double reach_chord2 = 5; ///< as BodyState::reach_chord2, about that direction
    std::uint32_t samples = 0;
    bool large = true;
    bool small = false; ///< at some instant
    /// Its state of the largest reference radiance; null: targeted at all instants.
    const BodyState* brightest = nullptr;
};

/// Makes what must be the same at all instants the same: frames and occluders. Fills `swept`.
void join_instants(std::span<RowState> states, std::vector<SweptBody>& swept);

} // namespace obscura::renderer

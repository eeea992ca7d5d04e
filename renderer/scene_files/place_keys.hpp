// SPDX-License-Identifier: Apache-2.0
// Keys of scene files for place, attitude and motion, and for the joint to a parent body.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

#include <string>

namespace obscura::scene {

/// Place, attitude and motion of the camera, a lamp or a body.
struct PlaceKeys {
    Vec3 position_m;
    Quat orientation;
    Vec3 boresight{0, 0, 1}, up{0, -1, 0}, look_at_m;
    std::string trajectory;
    Vec3 spin_axis{0, 0, 1};
    double spin_rate_rad_s = 0;
};
/// Of the camera or a lamp, which looks along its z axis.
[[nodiscard]] config::Keys camera_place_keys(PlaceKeys& place);
[[nodiscard]] config::Keys body_place_keys(PlaceKeys& place);

/// How a body, a lamp or the camera hangs on a body.
struct JointKeys {
    std::string parent;
    Joint::Kind kind = Joint::Kind::fixed;
    Vec3 axis{0, 0, 1};
    double angle_rad = 0, offset_m = 0;
    std::string table;
};
[[nodiscard]] config::Keys keys_of(JointKeys& joint);

/// The motion that was read into `place`; reads the trajectory that it names. What is wrong becomes a
/// mistake of `table`.
[[nodiscard]] Motion motion_of(const PlaceKeys& place, const config::ReadTable& table);

/// The joint that was read into `keys`; reads the table that it names. What is wrong becomes a mistake of
/// `table`.
[[nodiscard]] Joint joint_of(const JointKeys& keys, const config::ReadTable& table);

} // namespace obscura::scene

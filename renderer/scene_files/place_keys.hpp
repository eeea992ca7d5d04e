// SPDX-License-Identifier: Apache-2.0
// Keys of scene files for position, attitude and motion, and for the joint to a parent body.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene_files/scene_epoch.hpp"
#include "renderer/scene_files/surface_keys.hpp"

#include <string>

namespace obscura::scene {

/// Position, attitude and motion of the camera, a lamp or a body, as keys give them.
struct PlaceKeys {
    Vec3 position_m;
    Quat orientation;
    Vec3 boresight{0, 0, 1}, up{0, -1, 0}, look_at_m;
    std::string look_at;              ///< name of a body
    std::string trajectory, attitude; ///< files
    double max_extrapolation_s = 0;
    SharedEpoch epoch{};  ///< of the scene; null: of no file that is read
    bool kernels = false; ///< the scene has kernels, which know frames
    bool looks = false;   ///< of the camera or a lamp: a trajectory of positions needs an attitude beside it
    Vec3 spin_axis{0, 0, 1};
    double spin_rate_rad_s = 0;
    SurfaceKeys surface{};
};
/// Keys of the camera or a lamp, which look along the z axis, and of a body.
[[nodiscard]] config::Keys camera_place_keys(PlaceKeys& place);
[[nodiscard]] config::Keys body_place_keys(PlaceKeys& place);

/// Joint of a body, a lamp or the camera to its parent, as keys give it.
struct JointKeys {
    std::string parent;
    std::string relative_to; ///< parent of which only the place counts, not the axes
    Joint::Kind kind = Joint::Kind::fixed;
    Vec3 axis{0, 0, 1};
    double angle_rad = 0, offset_m = 0;
    std::string table;
};
[[nodiscard]] config::Keys keys_of(JointKeys& joint);
/// The key of JointKeys::relative_to, bound to `name`.
[[nodiscard]] config::Key relative_to_key(std::string& name);

/// Motion from the values of `place`; reads the files. Errors become mistakes of `table`.
[[nodiscard]] Motion motion_of(const PlaceKeys& place, const config::ReadTable& table);

/// Sets the parent, and whether its axes count. Errors become mistakes of `table`.
void set_parent(const JointKeys& keys, const config::ReadTable& table, std::string& parent, Motion& motion);

/// Joint from the values of `keys`; reads the joint table. Errors become mistakes of `table`.
[[nodiscard]] Joint joint_of(const JointKeys& keys, const config::ReadTable& table);

} // namespace obscura::scene

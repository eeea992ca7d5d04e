// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/place_keys.hpp"

#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/units.hpp"
#include "ephemeris/trajectories/aem.hpp"
#include "ephemeris/trajectories/oem.hpp"
#include "renderer/scene/sampled_pose_path.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene/trajectory.hpp"
#include "renderer/scene_files/section_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

namespace obscura::scene {
namespace {

config::Key file_attitude_key(PlaceKeys& s) {
    return config::key("attitude", config::Path{&s.attitude})
        .help("Attitudes over time instead of orientation: CSV table time_s,qw,qx,qy,qz or CCSDS AEM file");
}

config::Key extrapolation_key(PlaceKeys& s) {
    return config::key("max_extrapolation_s", &s.max_extrapolation_s)
        .unit("s")
        .range(0, 1e6)
        .help(
            "Time for which trajectory and attitude go on beyond their ends and in gaps, with the rates that they state or else those of the last two rows; "
            "after that they hold");
}

/// The keys, those for places on bodies after that for positions.
config::Keys with_surface_keys(config::Keys keys, PlaceKeys& s) {
    const config::Keys more = keys_of(s.surface, true);
    keys.insert(keys.begin() + 1, more.begin(), more.end());
    return keys;
}

} // namespace

config::Keys camera_place_keys(PlaceKeys& s) {
    s.looks = true;
    config::Keys keys{
        config::key("position_m", &s.position_m)
            .unit("m")
            .range(anywhere)
            .help("Position in the inertial frame, or in the parent's"),
        config::key("orientation", &s.orientation)
            .range(-1.001, 1.001)
            .help("Quaternion [w, x, y, z] from camera axes (x right, y down, z boresight) to inertial"),
        config::key("boresight", &s.boresight)
            .range(anywhere)
            .help("Direction of view (z axis), instead of orientation"),
        config::key("look_at_m", &s.look_at_m)
            .unit("m")
            .range(anywhere)
            .help("Point at which the z axis is aimed, instead of orientation; in the frame of position_m"),
        config::key("look_at", &s.look_at)
            .help(
                "Name of the body at whose centre, of the landmark, or \"sun\", at which the z axis is aimed at every instant, where the camera sees it; "
                "instead of orientation"),
        config::key("up", &s.up)
            .range(anywhere)
            .help(
                "Direction that is up in the image, in the frame of position_m, with boresight, look_at_m or look_at"),
        config::key("trajectory", config::Path{&s.trajectory})
            .help(
                "CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz, instead of position and orientation; "
                "with longitude_deg,latitude_deg,altitude_m in place of x_m,y_m,z_m over the parent; "
                "without the last four columns, or as CCSDS OEM file, it holds positions only, and look_at, look_at_m, boresight, orientation or attitude gives the attitude"),
        file_attitude_key(s),
        extrapolation_key(s),
    };
    return with_surface_keys(std::move(keys), s);
}

config::Keys body_place_keys(PlaceKeys& s) {
    config::Keys keys{
        config::key("position_m", &s.position_m)
            .unit("m")
            .range(anywhere)
            .help("Position of the body frame's origin, inertial or in the parent's frame"),
        config::key("orientation", &s.orientation)
            .range(-1.001, 1.001)
            .help("Quaternion [w, x, y, z] from body axes to inertial, at time 0"),
        config::key("trajectory", config::Path{&s.trajectory})
            .help(
                "CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz, instead of position and orientation; "
                "with longitude_deg,latitude_deg,altitude_m in place of x_m,y_m,z_m over the parent; "
                "without the last four columns, or as CCSDS OEM file, it holds positions only, and orientation or attitude gives the attitude"),
        file_attitude_key(s),
        extrapolation_key(s),
        config::key("spin_axis", &s.spin_axis)
            .range(anywhere)
            .help("Axis of the body's uniform spin, body frame"),
        config::key("spin_rate_deg_per_s", config::Scaled{&s.spin_rate_rad_s, degree})
            .unit("deg/s")
            .range(-36000, 36000)
            .help("Rate of the body's uniform spin; 0: none"),
    };
    return with_surface_keys(std::move(keys), s);
}

config::Key relative_to_key(std::string& name) {
    return config::key("relative_to", &name)
        .help(
            "Body from whose origin positions count, with inertial axes: as parent, but without the turning of the body; "
            "empty: none");
}

config::Keys keys_of(JointKeys& s) {
    return {
        config::key("parent", &s.parent)
            .help("Body in whose frame position, orientation or trajectory are; empty: the inertial frame"),
        relative_to_key(s.relative_to),
        config::key("joint", &s.kind)
            .help(
                "Joint to the parent: fixed, hinge (turns about joint_axis) or slide (moves along joint_axis)"),
        config::key("joint_axis", &s.axis)
            .range(anywhere)
            .help("Axis of the joint to the parent, in the moving frame"),
        config::key("joint_angle_deg", config::Scaled{&s.angle_rad, degree})
            .unit("deg")
            .range(-1e6, 1e6)
            .help("Angle of a hinge joint, constant"),
        config::key("joint_offset_m", &s.offset_m)
            .unit("m")
            .range(anywhere)
            .help("Offset of a slide joint, constant"),
        config::key("joint_table", config::Path{&s.table, true, true})
            .help(
                "CSV table time_s,angle_deg (hinge) or time_s,offset_m (slide), instead of a constant; empty: none"),
    };
}

namespace {

/// Keys of the attitude, of which one may be given.
constexpr std::array attitude_keys{"orientation", "boresight", "look_at_m", "look_at", "attitude"};

/// Refuses a message whose reference frame cannot be the one that its poses are in: a parent's frame may have
/// any name but that of inertial axes, a frame of the scene's kernels is known there, all else is inertial.
void check_frame(const ephemeris::PathFrames& frames, const std::filesystem::path& file,
                 const config::ReadTable& table, bool kernels) {
    const std::string name = printable(frames.frame, 40);
    if (table.has("parent")) {
        if (ephemeris::is_inertial_frame(frames.frame))
            throw ConfigError(fmt::format(
                "{}: reference frame {}: with inertial axes \"relative_to\" is wanted in place of \"parent\"",
                file.string(), name));
        return;
    }
    if (!ephemeris::is_inertial_frame(frames.frame) && !(kernels && !table.has("relative_to")))
        throw ConfigError(
            fmt::format("{}: reference frame {}, allowed without a parent are ICRF, GCRF, EME2000 and J2000",
                        file.string(), name));
}

using ReadMessage = ephemeris::PathFile (*)(const std::filesystem::path&, const ephemeris::LeapSeconds&);
/// Path of a message, in the scene's time. Throws ConfigError.
ephemeris::SampledPath message_path(ReadMessage read, const std::string& file, const PlaceKeys& place,
                                    const config::ReadTable& table) {
    ephemeris::PathFile path = read(file, ephemeris::system_leap_seconds());
    check_frame(path.frames, file, table, place.kernels);
    return {std::move(path), place.epoch ? place.epoch->required(file) : ephemeris::Epoch{},
            place.max_extrapolation_s};
}

ephemeris::SampledPath table_path(const std::string& file, const std::vector<TimedPose>& samples,
                                  const PlaceKeys& place) {
    return {path_of_table(file, samples), {}, place.max_extrapolation_s};
}

/// Reads the trajectory into `motion`, or into `parts` where it must be more than a table of poses. Returns
/// whether it holds positions only.
bool read_trajectory_file(const PlaceKeys& place, const config::ReadTable& table, Motion& motion,
                          PathParts& parts) {
    switch (path_format(place.trajectory)) {
    case PathFormat::oem:
        parts.positions = message_path(ephemeris::read_oem, place.trajectory, place, table);
        motion.message_centre = parts.positions->frames().centre;
        motion.message_frame = parts.positions->frames().frame;
        return true;
    case PathFormat::aem:
        throw ConfigError(fmt::format(
            "{}: is an attitude message (AEM), which belongs to the key \"attitude\"", place.trajectory));
    case PathFormat::csv:
        break;
    }
    Trajectory read = read_trajectory(place.trajectory);
    const bool over_body = !read.places.empty();
    if (over_body) {
        motion.on_surface = surface_track(place.surface, std::move(read.places), table);
    } else if (place.max_extrapolation_s > 0 || table.has("attitude")) {
        parts.positions = table_path(place.trajectory, read.samples, place);
        if (read.has_attitude) parts.attitudes = parts.positions;
    }
    motion.samples = std::move(read.samples);
    return !read.has_attitude;
}

/// Reads the trajectory. Returns whether it holds positions only, and reports keys of the attitude beside a
/// trajectory that has attitudes of its own.
bool read_positions(const PlaceKeys& place, const config::ReadTable& table, Motion& motion,
                    PathParts& parts) {
    const std::size_t before = table.mistakes().count();
    bool positions_only = false;
    table.mistakes().collect([&] { positions_only = read_trajectory_file(place, table, motion, parts); });
    if (table.mistakes().count() != before) return false;
    const bool given = std::any_of(attitude_keys.begin(), attitude_keys.end(),
                                   [&](const char* key) { return table.has(key); });
    if (positions_only && place.looks && !given)
        table.refuse(
            "trajectory",
            "has no columns qw,qx,qy,qz: "
            "\"look_at\", \"look_at_m\", \"boresight\", \"orientation\" or \"attitude\" is wanted beside it");
    if (positions_only) return true;
    for (const char* key : attitude_keys)
        if (table.has(key))
            table.refuse(key, "cannot stand beside a \"trajectory\" with columns qw,qx,qy,qz");
    return false;
}

ephemeris::SampledPath read_attitude_file(const PlaceKeys& place, const config::ReadTable& table) {
    switch (path_format(place.attitude)) {
    case PathFormat::aem:
        return message_path(ephemeris::read_aem, place.attitude, place, table);
    case PathFormat::oem:
        throw ConfigError(fmt::format("{}: is no attitude message (AEM) and no table, allowed is {}",
                                      place.attitude, attitude_columns));
    case PathFormat::csv:
        break;
    }
    return table_path(place.attitude, read_attitudes(place.attitude), place);
}

/// The axis of coordinates that is farthest from `direction`, as a value of a file.
std::string_view axis_across(Vec3 direction) {
    const double x = std::abs(direction.x), y = std::abs(direction.y), z = std::abs(direction.z);
    return x <= y && x <= z ? "[1, 0, 0]" : y <= z ? "[0, 1, 0]" : "[0, 0, 1]";
}

/// Sets the attitude of every sample of `motion`, or its aim, by the keys of `place`.
void set_attitude(const PlaceKeys& place, const config::ReadTable& table, Motion& motion) {
    // Up in local axes is up, not the -y of a camera in orbit.
    const bool local = motion.on_surface && motion.on_surface->axes == PlaceAxes::east_north_up;
    Vec3 up = local && !table.has("up") ? Vec3{0, 0, 1} : place.up;
    if (table.has("look_at") || (table.has("look_at_m") && (table.has("trajectory") || motion.on_surface))) {
        motion.aim = Aim{place.look_at, place.look_at_m, up, local};
        return;
    }
    Quat orientation = place.orientation;
    if (table.has("boresight") || table.has("look_at_m")) {
        const char* key = table.has("boresight") ? "boresight" : "look_at_m";
        const Vec3 boresight = table.has("boresight") ? place.boresight : place.look_at_m - place.position_m;
        const auto parallel_to = [&](Vec3 up) {
            return !(length(cross(boresight, up)) > 1e-9 * length(boresight) * length(up));
        };
        // Along the default another direction is as good.
        if (!table.has("up") && parallel_to(up)) up = {up.y, up.z, up.x};
        if (!(length(boresight) > 0))
            table.refuse(key, "is the camera's own position");
        else if (parallel_to(up))
            table.refuse(key,
                         fmt::format("is parallel to \"up\", which leaves the rotation about it open; write "
                                     "another direction, for instance up = {}",
                                     axis_across(boresight)));
        else
            orientation = look_along(boresight, up);
    }
    for (TimedPose& sample : motion.samples)
        sample.pose.orientation = orientation;
}

} // namespace

Motion motion_of(const PlaceKeys& place, const config::ReadTable& table) {
    const std::size_t before = table.mistakes().count();
    exclude(table, "position_m", "trajectory");
    const bool rows = table.has("trajectory") && is_surface_trajectory(place.trajectory);
    check_surface_keys(table, rows);
    if (table.has("max_extrapolation_s") && !table.has("trajectory") && !table.has("attitude"))
        table.refuse("max_extrapolation_s", "belongs to \"trajectory\" or \"attitude\"");
    for (std::size_t i = 0; i < attitude_keys.size(); ++i)
        for (std::size_t j = i + 1; j < attitude_keys.size(); ++j)
            exclude(table, attitude_keys[i], attitude_keys[j]);
    exclude(table, "up", "orientation");
    require_direction(table, place.boresight, "boresight");
    require_direction(table, place.up, "up");
    require_direction(table, place.spin_axis, "spin_axis");
    if (table.has("look_at") && place.look_at.empty())
        table.refuse("look_at", "is empty, the name of a body is wanted");
    Motion motion;
    if (table.mistakes().count() != before) return motion;

    motion.spin_axis = place.spin_axis;
    motion.spin_rate_rad_s = place.spin_rate_rad_s;
    motion.samples = {{0, {place.position_m, {}}}};
    if (has_surface_place(table)) motion.on_surface = surface_track(place.surface, {}, table);
    PathParts parts;
    const bool positions_only = !table.has("trajectory") || read_positions(place, table, motion, parts);
    if (table.has("attitude"))
        table.mistakes().collect([&] {
            parts.attitudes = read_attitude_file(place, table);
            const std::string& frame = parts.attitudes->frames().frame;
            if (!motion.message_frame.empty() && !frame.empty() && frame != motion.message_frame &&
                !(ephemeris::is_inertial_frame(frame) && ephemeris::is_inertial_frame(motion.message_frame)))
                table.refuse("attitude",
                             fmt::format("is relative to {}, the trajectory to {}: allowed is one frame",
                                         printable(frame, 40), printable(motion.message_frame, 40)));
            if (!frame.empty()) motion.message_frame = frame;
        });
    if (table.mistakes().count() != before) return motion;
    if (positions_only && table.has("up") &&
        !(table.has("boresight") || table.has("look_at_m") || table.has("look_at")))
        table.refuse_table("\"up\" needs \"boresight\", \"look_at_m\" or \"look_at\"");
    if (positions_only) set_attitude(place, table, motion);
    if (!parts.positions && !parts.attitudes) return motion;
    parts.constant = motion.samples.front().pose;
    motion.path = make_path(std::move(parts));
    motion.samples = samples_of(*motion.path);
    return motion;
}

void set_parent(const JointKeys& keys, const config::ReadTable& table, std::string& parent, Motion& motion) {
    exclude(table, "relative_to", "parent");
    motion.inertial_axes = !keys.relative_to.empty();
    parent = motion.inertial_axes ? keys.relative_to : keys.parent;
}

Joint joint_of(const JointKeys& keys, const config::ReadTable& table) {
    using Kind = Joint::Kind;
    const std::size_t before = table.mistakes().count();
    const auto only_with = [&](const char* key, bool fits, const char* kinds) {
        if (table.has(key) && !fits) table.refuse(key, fmt::format("belongs to joint = {}", kinds));
    };
    only_with("joint", !keys.parent.empty() || !keys.relative_to.empty() || keys.kind == Kind::fixed,
              "\"fixed\" where there is no parent");
    only_with("joint_axis", keys.kind != Kind::fixed, "\"hinge\" or \"slide\"");
    only_with("joint_table", keys.kind != Kind::fixed, "\"hinge\" or \"slide\"");
    only_with("joint_angle_deg", keys.kind == Kind::hinge, "\"hinge\"");
    only_with("joint_offset_m", keys.kind == Kind::slide, "\"slide\"");
    if (keys.kind != Kind::fixed &&
        (table.has("look_at") || (table.has("look_at_m") && table.has("trajectory"))))
        table.refuse(table.has("look_at") ? "look_at" : "look_at_m",
                     "belongs to joint = \"fixed\": it gives the attitude at every instant");
    exclude(table, "joint_angle_deg", "joint_table");
    exclude(table, "joint_offset_m", "joint_table");
    require_direction(table, keys.axis, "joint_axis");
    Joint joint{keys.kind, keys.axis, {}};
    if (joint.kind == Kind::fixed || table.mistakes().count() != before) return joint;
    const bool hinge = joint.kind == Kind::hinge;
    if (table.has("joint_table"))
        table.mistakes().collect([&] {
            joint.samples =
                read_joint_table(keys.table, hinge ? "angle_deg" : "offset_m", hinge ? degree : 1);
        });
    else
        joint.samples = {{0, hinge ? keys.angle_rad : keys.offset_m}};
    return joint;
}

} // namespace obscura::scene

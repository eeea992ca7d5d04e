// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/kernel_keys.hpp"

#include "core/error.hpp"
#include "ephemeris/kernels/body_names.hpp"
#include "ephemeris/kernels/default_ephemeris.hpp"
#include "renderer/scene/sampled_pose_path.hpp"
#include "renderer/scene_files/section_rules.hpp"

#include <fmt/format.h>

namespace obscura::scene {
namespace {

constexpr int sun = 10;

/// Whether the file says where the Sun is.
bool sun_is_given(const config::Value& root) {
    const config::Member* const table = root.find("sun");
    if (table == nullptr) return false;
    for (const char* key : {"position_m", "direction", "distance_au"})
        if (table->value.find(key) != nullptr) return true;
    return false;
}

} // namespace

config::Keys KernelKeys::keys() {
    return {
        config::key("epoch", &epoch->text)
            .help(
                "Instant of scene time 0, \"2007-02-28T12:00:00Z\" or another text that `obscura time` reads, UTC without a scale; "
                "empty: the scene has no date"),
        config::key("kernels", config::Files{&files})
            .help(
                "SPICE kernels in order of rising priority (SPK, PCK, CK, text and meta-kernels), for \"ephemeris\" of bodies, camera and lamps; "
                "the Sun is where they have it, unless [sun] says where; "
                "without the key the file that `obscura import ephemeris` made"),
        config::key("centre", &centre)
            .help("Body of the kernels at whose place at the epoch the origin of the inertial frame is; "
                  "that frame has J2000 axes and is at rest relative to the solar system barycentre"),
    };
}

KernelKeys::KernelKeys(const Scene& scene)
    : epoch(std::make_shared<SceneEpoch>(SceneEpoch{"", scene.epoch})),
      read_(scene.kernels != nullptr),
      of_scene_(true),
      frame_(scene.kernels) {}

std::shared_ptr<const KernelFrame> KernelKeys::frame() {
    if (read_) return frame_;
    std::vector<std::filesystem::path> kernel_files(files.begin(), files.end());
    if (files.empty()) {
        if (of_scene_) throw ConfigError("the scene has no \"kernels\"");
        const auto found = ephemeris::find_default_ephemeris();
        if (!found)
            throw ConfigError(
                fmt::format("the scene has no \"kernels\", and there is no default ephemeris {}: "
                            "`obscura import ephemeris` makes it from Debian's casacore-data-jpl-de405",
                            ephemeris::place_of_new_default_ephemeris().string()));
        kernel_files.push_back(*found);
    }
    read_ = true;
    key_at_fault_ = "epoch";
    try {
        const auto start = epoch->get();
        if (!start) {
            key_at_fault_ = "kernels";
            fault_ = files.empty() ? "\"ephemeris\" needs the key \"epoch\": the instant of scene time 0"
                                   : "need the key \"epoch\": the instant of scene time 0";
            return nullptr;
        }
        key_at_fault_ = "kernels";
        const ephemeris::Ephemeris kernels(kernel_files);
        key_at_fault_ = "centre";
        frame_ = std::make_shared<KernelFrame>(kernels, *start, kernels.body(centre));
    } catch (const Error& error) {
        fault_ = error.what();
    }
    return frame_;
}

void KernelKeys::check(Scene& scene, const config::ReadTable& root) {
    root.refuse_if_thrown("epoch", [&] { scene.epoch = epoch->get(); });
    if (files.empty() && !read_) {
        if (root.has("centre"))
            root.refuse("centre", "belongs to \"kernels\" or \"ephemeris\", the scene has neither");
        return;
    }
    scene.kernels = frame();
    // A mistake of the epoch is reported above.
    if (!fault_.empty() && key_at_fault_ != "epoch") root.refuse(key_at_fault_, fault_);
    if (!scene.kernels || sun_is_given(*root.table())) return;
    try {
        scene.sun.path = slow_kernel_path(scene.kernels, sun);
        scene.sun.position_m = scene.sun.position_at(0);
    } catch (const Error&) {
        if (scene.sun.irradiance_scale > 0)
            root.refuse("kernels",
                        "have no place of the Sun at the epoch: [sun] needs position_m or direction");
    }
}

config::Keys keys_of(KernelPlaceKeys& keys, bool looks) {
    return {
        config::key("ephemeris", &keys.body)
            .help(
                looks
                    ? "Body or spacecraft of the scene's kernels (name or NAIF code) at which the frame of position_m, orientation and trajectory is; "
                      "empty: none"
                    : "Body or spacecraft of the scene's kernels (name or NAIF code) whose place and rotation this body has; "
                      "an ellipsoid without radii_m has its radii; "
                      "position_m, orientation and trajectory are then in its frame; empty: none"),
        config::key("ephemeris_frame", &keys.frame)
            .help(looks ? "Axes of that frame, a frame of the kernels (of a CK: \"NH_LORRI\"); empty: J2000"
                        : "Axes of the body, a frame of the kernels (\"IAU_EUROPA\", \"MOON_ME_DE421\"); "
                          "empty: the body's own in the kernels; \"J2000\": no rotation"),
    };
}

namespace {

/// Refuses a message about another body than `other`, "MARS (parent)" or so, if both are known.
void require_centre(const Motion& motion, const ephemeris::BodyNames& names, const std::string& other,
                    const char* what, const config::ReadTable& table) {
    const auto centre = names.id(motion.message_centre), own = names.id(other);
    if (centre && own && *centre != *own)
        table.refuse("trajectory",
                     fmt::format("is about {}, which is not the {} {}: without it the kernels of the scene "
                                 "place the message",
                                 motion.message_centre, what, other));
}

/// Puts a message without a parent where its centre is, by the kernels of the scene.
void place_message(Motion& motion, KernelKeys& kernels, const config::ReadTable& table) {
    try {
        const auto scene = kernels.frame();
        if (!scene) return; // reported with the kernels
        const bool inertial = ephemeris::is_inertial_frame(motion.message_frame);
        motion.path = kernel_path(scene, scene->kernels().body(motion.message_centre),
                                  inertial ? std::string("J2000") : motion.message_frame, motion.path);
        for (TimedPose& sample : motion.samples)
            sample.pose = motion.path->at(sample.time_s);
    } catch (const Error& error) {
        table.refuse("trajectory", error.what());
    }
}

} // namespace

bool follow_kernels(Motion& motion, const std::string& parent, const KernelPlaceKeys& keys, bool looks,
                    KernelKeys& kernels, const config::ReadTable& table) {
    const bool message = !motion.message_centre.empty() && motion.path;
    if (message && !parent.empty())
        require_centre(motion, ephemeris::BodyNames(ephemeris::KernelPool{}), parent, "parent", table);
    if (keys.body.empty()) {
        if (!keys.frame.empty()) table.refuse("ephemeris_frame", "needs \"ephemeris\"");
        if (message && parent.empty() && !kernels.files.empty()) place_message(motion, kernels, table);
        return false;
    }
    for (const char* key : {"parent", "relative_to", "spin_rate_deg_per_s"})
        if (table.has(key)) table.refuse(key, "cannot stand beside \"ephemeris\"");
    // Its point would be in the inertial frame.
    if (table.has("trajectory")) exclude(table, "look_at_m", "ephemeris");
    try {
        const auto scene = kernels.frame();
        if (!scene) return false; // reported with the kernels
        const int body = scene->kernels().body(keys.body);
        std::string frame = keys.frame;
        if (frame.empty()) frame = looks ? "J2000" : scene->kernels().body_frame_name(body);
        if (message)
            require_centre(motion, ephemeris::BodyNames(scene->kernels().pool()), keys.body, "ephemeris",
                           table);
        const bool inertial = ephemeris::is_inertial_frame(frame);
        if (!motion.message_frame.empty() && motion.message_frame != ephemeris::kernel_name(frame) &&
            !(inertial && ephemeris::is_inertial_frame(motion.message_frame)))
            table.refuse(
                table.has("trajectory") ? "trajectory" : "attitude",
                fmt::format("is in the frame {}, the ephemeris in {}: \"ephemeris_frame\" must name the "
                            "frame of the message",
                            motion.message_frame, frame));
        if (motion.samples.size() > 1 && !motion.path) motion.path = path_of_samples(motion.samples);
        motion.path = motion.path ? kernel_path(scene, body, frame, motion.path)
                                  : kernel_path(scene, body, frame, motion.samples.front().pose);
        for (TimedPose& sample : motion.samples)
            sample.pose = motion.path->at(sample.time_s);
        return true;
    } catch (const Error& error) {
        table.refuse("ephemeris", error.what());
    }
    return false;
}

} // namespace obscura::scene

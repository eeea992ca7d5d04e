// SPDX-License-Identifier: Apache-2.0
// Verb `obscura pose`: poses of a scene's camera over time, and poses from which it sees a body as wanted.
#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/units.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/trajectory.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/scene_files/surface_places.hpp"
#include "renderer/world/scene_poses.hpp"
#include "tools/scene/camera_file.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

using Json = nlohmann::ordered_json;
using renderer::BodyView;
using renderer::ScenePoses;

constexpr double not_given = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint64_t max_pose_instants = 1'000'000;
constexpr const char* convention =
    "quaternion w x y z, turns vectors of the camera's axes (x right, y down, z boresight) into the inertial frame";

Vec3 parse_vector(std::string_view text, std::string_view option) {
    std::array<double, 3> v{};
    const char* at = text.data();
    const char* const end = at + text.size();
    bool good = true;
    for (std::size_t i = 0; i < v.size() && good; ++i) {
        const auto [rest, error] = std::from_chars(at, end, v[i]);
        const bool last = i + 1 == v.size();
        good =
            error == std::errc{} && std::isfinite(v[i]) && (last ? rest == end : rest != end && *rest == ',');
        at = rest + 1;
    }
    if (!good)
        throw host::UsageError(
            fmt::format("obscura pose: {} \"{}\": allowed is X,Y,Z, for example 0,-2000,500", option,
                        printable(text, 60)));
    return {v[0], v[1], v[2]};
}

/// A body or the Sun as the camera sees it.
struct NamedView {
    std::string name;
    BodyView view;
    bool is_sun = false;
    bool in_picture = false;
};

/// The camera at an instant and all that it may see.
struct Instant {
    double time_s = 0;
    Pose camera;
    std::vector<NamedView> views{}; ///< bodies in the order of the scene, then the Sun

    [[nodiscard]] Vec3 boresight() const { return rotate(camera.orientation, {0, 0, 1}); }
};

class PoseVerb final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints or computes poses of a scene's camera: attitude, ranges, phase angles, pixels";
        line.description =
            "Prints the camera's pose at one instant of a scene or at several, and how it sees each body and the Sun: range to the centre, phase angle (Sun, body, camera), angle off the boresight and pixel; "
            "(0, 0) is the centre of the upper left pixel. Nothing is rendered, no mesh is read. "
            "With --look-at the camera of the scene is aimed at a body, and with --position or --range placed too; "
            "the result can be pasted into the scene's [camera]. --csv prints a trajectory that `trajectory` of a scene reads, also one with attitudes for a camera that has positions and look_at.";
        line.positional("SCENE", &scene_file_, "Scene file (TOML), or the name of a shipped scene");
        line.number("--time", &time_s_, "S", "Scene time in seconds", -1e9, 1e9);
        line.number("--from", &from_s_, "S", "First of several scene times, with --to and --step", -1e9, 1e9);
        line.number("--to", &to_s_, "S", "Last scene time at most", -1e9, 1e9);
        line.number("--step", &step_s_, "S", "Time from one pose to the next (default: 1)", 1e-6, 1e9);
        line.flag("--trajectory", trajectory_, "Print a pose for each row of the camera's trajectory");
        line.option("--look-at", &look_at_, "BODY",
                    "Aim the camera at the centre of this body, or at \"sun\"");
        line.option(
            "--up", &up_, "X,Y,Z",
            "With --look-at: direction that is up in the image, in the inertial frame (default: 0,0,1)");
        line.option(
            "--position", &position_, "X,Y,Z",
            "With --look-at: position of the camera in the inertial frame, in metres (default: the scene's)");
        line.number("--range", &range_m_, "M",
                    "With --look-at: distance of the camera from the body's centre in metres", 1e-3, 1e15);
        line.number(
            "--phase", &phase_deg_, "DEG",
            "With --range: phase angle, between Sun and camera at the body (default: the camera stays in its direction from the body)",
            0, 180);
        line.number(
            "--azimuth", &azimuth_deg_, "DEG",
            "With --phase: side on which the camera stands off the line from body to Sun, as one sees it who looks from the body at the Sun: 0 right, 90 up, 180 left, 270 down",
            -360, 360);
        line.flag("--csv", csv_, "Print a trajectory: a CSV table time_s,x_m,y_m,z_m,qw,qx,qy,qz");
        line.flag("--json", json_, "Print one JSON object");
        line.option(
            "--intrinsics", &intrinsics_, "FILE",
            "Also write camera matrix, distortion coefficients and poses as JSON that OpenCV's FileStorage reads");
        line.examples = {
            "obscura pose demo",
            "obscura pose config/scenes/demo.toml --from 0 --to 60 --step 10 --csv",
            "obscura pose demo --look-at asteroid --range 20000 --phase 45",
            "obscura pose demo --look-at asteroid --position 0,-30000,5000 --json",
        };
    }

    int run() override {
        check_options();
        const std::filesystem::path file = config::file_or_shipped(config::shipped_scenes, scene_file_);
        scene::Scene scene = scene::load_scene(file);
        scene.stars.clear(); // each instant may have a copy of the scene
        const std::vector<double> times = times_of(scene);
        std::vector<Instant> instants;
        std::vector<CameraFileFrame> frames;
        const ScenePoses as_given(scene);
        for (const double time_s : times) {
            std::optional<ScenePoses> placed;
            if (!look_at_.empty()) placed.emplace(aimed(as_given, time_s));
            const ScenePoses& poses = placed ? *placed : as_given;
            instants.push_back(instant_of(poses, time_s));
            if (!intrinsics_.empty()) frames.push_back(frame_of(poses, instants.back(), instants.size()));
        }
        if (!intrinsics_.empty())
            write_camera_file(
                intrinsics_,
                PictureCamera::of_scene(scene.camera, {0, 0, scene.camera.width, scene.camera.height}),
                frames);
        if (csv_)
            print_csv(scene, instants);
        else if (json_)
            print_json(scene, instants);
        else
            print_text(scene, instants);
        return exit_ok;
    }

private:
    void check_options() const {
        const auto refuse = [](bool wrong, const char* text) {
            if (wrong) throw host::UsageError(fmt::format("obscura pose: {}", text));
        };
        const bool several = !std::isnan(from_s_) || !std::isnan(to_s_);
        refuse(csv_ && json_, "--csv and --json exclude each other");
        refuse(several && (std::isnan(from_s_) || std::isnan(to_s_)), "--from and --to go together");
        refuse(several && !std::isnan(time_s_), "--time excludes --from and --to");
        refuse(several && to_s_ < from_s_, "--to is before --from");
        refuse(!several && !std::isnan(step_s_), "--step goes with --from and --to");
        refuse(trajectory_ && (several || !std::isnan(time_s_)),
               "--trajectory excludes --time, --from and --to");
        const bool placed = !position_.empty() || !std::isnan(range_m_) || !up_.empty();
        refuse(placed && look_at_.empty(), "--position, --range and --up need --look-at");
        refuse(!position_.empty() && !std::isnan(range_m_), "--position and --range exclude each other");
        refuse(!std::isnan(phase_deg_) && std::isnan(range_m_), "--phase needs --range");
        refuse(!std::isnan(azimuth_deg_) && std::isnan(phase_deg_), "--azimuth needs --phase");
    }

    [[nodiscard]] std::vector<double> times_of(const scene::Scene& scene) const {
        std::vector<double> times;
        if (trajectory_)
            for (const scene::TimedPose& sample : scene.camera.motion.samples)
                times.push_back(sample.time_s);
        else if (std::isnan(from_s_))
            times.push_back(std::isnan(time_s_) ? 0 : time_s_);
        else {
            const double step_s = std::isnan(step_s_) ? 1 : step_s_;
            const double count = std::floor((to_s_ - from_s_) / step_s + 1e-9) + 1;
            if (count > static_cast<double>(max_pose_instants))
                throw host::UsageError(
                    fmt::format("obscura pose: {:.0f} poses from --from to --to: allowed are {}", count,
                                max_pose_instants));
            for (double i = 0; i < count; ++i)
                times.push_back(from_s_ + i * step_s);
        }
        return times;
    }

    /// The scene with its camera placed and aimed as the options say.
    [[nodiscard]] ScenePoses aimed(const ScenePoses& as_given, double time_s) const {
        scene::Scene scene = as_given.scene();
        const Vec3 up = up_.empty() ? Vec3{0, 0, 1} : parse_vector(up_, "--up");
        if (!(length(up) > 0))
            throw host::UsageError("obscura pose: --up: a vector that is not zero is wanted");
        const Vec3 before = as_given.camera(time_s).position_m;
        const Vec3 position = !position_.empty()     ? parse_vector(position_, "--position")
                              : std::isnan(range_m_) ? before
                                                     : stand_off(as_given, time_s, before, up);
        scene.camera.parent.clear();
        scene.camera.joint = {};
        scene.camera.velocity_m_s = as_given.camera_velocity_m_s(time_s);
        scene.camera.motion = {};
        scene.camera.motion.samples = {{0, {position, {}}}};
        scene.camera.motion.aim = scene::Aim{.body = look_at_, .up = up};
        scene::aim_at_landmark(scene, scene.camera.motion);
        if (const std::string why = scene::explain_missing_target(scene, scene.camera.motion); !why.empty())
            throw host::UsageError(fmt::format("obscura pose: --look-at {}", why));
        return ScenePoses(std::move(scene));
    }

    /// Position at --range and --phase from the body.
    [[nodiscard]] Vec3 stand_off(const ScenePoses& poses, double time_s, Vec3 before, Vec3 up) const {
        const std::int32_t index = scene::index_of(poses.scene().bodies, look_at_);
        if (index < 0 && look_at_ == scene::sun_name && !std::isnan(phase_deg_))
            throw host::UsageError("obscura pose: --phase: the Sun has no phase angle");
        const Vec3 sun = poses.scene().sun.position_at(time_s);
        const Vec3 centre =
            index < 0 ? sun : poses.body(static_cast<std::size_t>(index), time_s).pose.position_m;
        if (std::isnan(phase_deg_)) {
            if (!(length(before - centre) > 0))
                throw host::UsageError(
                    "obscura pose: --range: the camera is in the body's centre; give --phase too");
            return centre + range_m_ * normalized(before - centre);
        }
        const Vec3 to_sun = normalized(sun - centre);
        Vec3 right = cross(to_sun, up);
        if (!(length(right) > 1e-6 * length(up))) {
            Vec3 unused;
            orthonormal_basis(to_sun, right, unused);
        }
        right = normalized(right);
        const Vec3 upward = cross(right, to_sun);
        const double azimuth = std::isnan(azimuth_deg_) ? 0 : azimuth_deg_ * degree;
        const Vec3 side = std::cos(azimuth) * right + std::sin(azimuth) * upward;
        const double phase = phase_deg_ * degree;
        return centre + range_m_ * (std::cos(phase) * to_sun + std::sin(phase) * side);
    }

    static Instant instant_of(const ScenePoses& poses, double time_s) {
        Instant instant{.time_s = time_s, .camera = poses.camera(time_s)};
        const scene::Scene& scene = poses.scene();
        const auto add = [&](const std::string& name, const BodyView& view, bool is_sun) {
            const bool in_picture = view.pixel && view.pixel->x >= -0.5 && view.pixel->y >= -0.5 &&
                                    view.pixel->x < scene.camera.width - 0.5 &&
                                    view.pixel->y < scene.camera.height - 0.5;
            instant.views.push_back({name, view, is_sun, in_picture});
        };
        for (std::size_t i = 0; i < scene.bodies.size(); ++i)
            add(scene.bodies[i].name, poses.body(i, time_s), false);
        add(scene::sun_name, poses.sun(time_s), true);
        return instant;
    }

    static CameraFileFrame frame_of(const ScenePoses& poses, const Instant& instant, std::uint64_t number) {
        CameraFileFrame frame{.number = number, .time_s = instant.time_s};
        frame.truth.camera = instant.camera;
        frame.truth.sun_position_m = poses.scene().sun.position_at(instant.time_s);
        for (const NamedView& body : instant.views) {
            if (body.is_sun || frame.truth.body_count == max_truth_bodies) continue;
            BodyTruth& truth = frame.truth.bodies[frame.truth.body_count++];
            std::copy_n(body.name.begin(), std::min(body.name.size(), truth.name.size() - 1),
                        truth.name.begin());
            truth.pose = body.view.pose;
        }
        return frame;
    }

    static std::string csv_row(const Instant& i) {
        const Vec3 p = i.camera.position_m;
        const Quat q = i.camera.orientation;
        return fmt::format("{},{},{},{},{},{},{},{}\n", i.time_s, p.x, p.y, p.z, q.w, q.x, q.y, q.z);
    }

    void print_csv(const scene::Scene& scene, const std::vector<Instant>& instants) const {
        fmt::print("# Camera of the scene \"{}\": metres in the inertial frame; {}.\n{}\n", scene.name,
                   convention, scene::trajectory_columns);
        for (const Instant& instant : instants)
            fmt::print("{}", csv_row(instant));
    }

    static void print_json(const scene::Scene& scene, const std::vector<Instant>& instants) {
        const auto vector = [](Vec3 v) { return Json{v.x, v.y, v.z}; };
        Json out{{"scene", scene.name},
                 {"orientation", convention},
                 {"pixels", "(0, 0) is the centre of the upper left pixel; x right, y down"},
                 {"poses", Json::array()}};
        for (const Instant& i : instants) {
            const Quat q = i.camera.orientation;
            Json pose{{"time_s", i.time_s},
                      {"position_m", vector(i.camera.position_m)},
                      {"orientation", {q.w, q.x, q.y, q.z}},
                      {"boresight", vector(i.boresight())},
                      {"bodies", Json::array()}};
            for (const NamedView& v : i.views) {
                Json body{{"name", v.name},
                          {"range_m", v.view.range_m},
                          {"off_axis_deg", v.view.off_axis_rad / degree}};
                if (!v.is_sun) body["phase_deg"] = v.view.phase_rad / degree;
                body["pixel"] = v.view.pixel ? Json{v.view.pixel->x, v.view.pixel->y} : Json();
                body["in_picture"] = v.in_picture;
                (v.is_sun ? pose["sun"] : pose["bodies"].emplace_back()) = std::move(body);
            }
            out["poses"].push_back(std::move(pose));
        }
        fmt::print("{}\n", out.dump(2));
    }

    static std::string components(std::initializer_list<double> values) {
        std::string text;
        for (const double v : values)
            text += fmt::format("{}{}", text.empty() ? "" : ", ", v);
        return text;
    }

    void print_text(const scene::Scene& scene, const std::vector<Instant>& instants) const {
        for (const Instant& i : instants) {
            const Vec3 p = i.camera.position_m;
            const Quat q = i.camera.orientation;
            const Vec3 b = i.boresight();
            const double right_ascension = std::atan2(b.y, b.x) / degree;
            fmt::print("scene \"{}\" at {} s\n", scene.name, i.time_s);
            fmt::print("  position_m   {}\n", components({p.x, p.y, p.z}));
            fmt::print("  orientation  {}\n", components({q.w, q.x, q.y, q.z}));
            fmt::print("               {}\n", convention);
            fmt::print("  boresight    {}  (right ascension {:.6f}, declination {:.6f} deg)\n",
                       components({b.x, b.y, b.z}),
                       right_ascension < 0 ? right_ascension + 360 : right_ascension,
                       std::atan2(b.z, std::hypot(b.x, b.y)) / degree);
            fmt::print("  {:<20} {:>16} {:>10} {:>10} {:>12} {:>12}\n", "", "range/m", "phase/deg", "off/deg",
                       "pixel x", "pixel y");
            for (const NamedView& v : i.views) {
                fmt::print("  {:<20} {:>16.9g} {:>10} {:>10.4f}", v.name, v.view.range_m,
                           v.is_sun ? "-" : fmt::format("{:.4f}", v.view.phase_rad / degree),
                           v.view.off_axis_rad / degree);
                if (v.view.pixel)
                    fmt::print(" {:>12.3f} {:>12.3f}{}\n", v.view.pixel->x, v.view.pixel->y,
                               v.in_picture ? "" : "  outside");
                else
                    fmt::print(" {:>12} {:>12}  outside\n", "-", "-");
            }
            if (!look_at_.empty()) print_snippet(i);
        }
    }

    /// What can stand in [camera] of the scene for this pose.
    void print_snippet(const Instant& i) const {
        const Vec3 p = i.camera.position_m;
        const Quat q = i.camera.orientation;
        const Vec3 up = up_.empty() ? Vec3{0, 0, 1} : parse_vector(up_, "--up");
        fmt::print("\n# for [camera] of the scene, in place of its position and attitude:\n");
        fmt::print("position_m = [{}]\n", components({p.x, p.y, p.z}));
        fmt::print("orientation = [{}]\n", components({q.w, q.x, q.y, q.z}));
        fmt::print("# or, aimed at every instant, in place of orientation:\n");
        fmt::print("# look_at = \"{}\"\n# up = [{}]\n", look_at_, components({up.x, up.y, up.z}));
    }

    std::string scene_file_, look_at_, up_, position_, intrinsics_;
    double time_s_ = not_given, from_s_ = not_given, to_s_ = not_given, step_s_ = not_given;
    double range_m_ = not_given, phase_deg_ = not_given, azimuth_deg_ = not_given;
    bool trajectory_ = false, csv_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_pose() {
    return std::make_unique<PoseVerb>();
}

} // namespace obscura::tools

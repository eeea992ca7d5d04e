// SPDX-License-Identifier: Apache-2.0
// State of one published client: its scene in the client's own terms, its settings and its last picture.
#pragma once

#include "core/camera/region.hpp"
#include "core/geometry.hpp"
#include "models/kinds/timing_program.hpp"
#include "serve/compatible/client_files.hpp"
#include "serve/compatible/notes.hpp"
#include "serve/compatible/picture.hpp"
#include "serve/compatible/session_folder.hpp"
#include "serve/compatible/textures.hpp"
#include "serve/render_call.hpp"
#include "serve/scene_calls.hpp"
#include "service/compatible/value.hpp"
#include "service/memory_account.hpp"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::serve::compatible {

/// Spectral channels of the published client.
constexpr std::size_t channels = 4;
using Channels = std::array<double, channels>;

/// Astronomical unit, IAU 2012 B2.
constexpr double au_m = 149'597'870'700.0;

/// Position, attitude and motion of an object. The attitude turns vectors of the object's frame into the
/// scene's; that of the camera and of lights is of the camera frame of scene files: x right, y down, z
/// forward.
struct Placement {
    Vec3 position_m;
    Quat attitude;
    Vec3 velocity_m_s, rate_rad_s; ///< scene axes
    /// Pose of the object's surface, or of the camera's or lamp's axes, in the frame that the attitude turns.
    Pose element{};
};

/// Whether quaternions come as x y z w or w x y z, and which axes a camera's quaternion turns.
struct Conventions {
    std::int32_t quaternion = 0; ///< 0: x y z w, 1: w x y z
    std::int32_t camera = 0;     ///< 0: looks along -z, y up, 1: along +z, y down
};

/// Object of the scene.
struct Object {
    enum class Kind : std::uint8_t { camera, sun, body, light };
    Kind kind = Kind::body;
    Placement placement{};
    nlohmann::json keys = nlohmann::json::object(); ///< of its table in scene files, without the placement
    std::map<std::string, double> properties{};
    std::map<int, std::string> worn_textures{}; ///< names of textures, by unit
};

/// Shape, or model of reflection, by the keys of scene files.
struct Model {
    nlohmann::json keys = nlohmann::json::object();
    double radius_m = 0; ///< of a sphere
};

/// Point spread function: weights over pixels, in rows from the top.
struct Psf {
    std::int32_t width = 0, height = 0; ///< 0: none
    std::vector<float> weights{};
    double support_w = 0, support_h = 0; ///< pixels that it covers
    std::string file{};                  ///< FITS, of the session's folder
};

/// A field of view as the client gave it.
struct GivenFov {
    double x = 30, y = 30;
    double unit_rad = std::numbers::pi / 180;
};

/// Wavelengths of a channel.
struct ChannelBand {
    double from_nm = 0, to_nm = 0;
};
constexpr std::array<ChannelBand, channels> usual_bands{{{600, 700}, {500, 600}, {400, 500}, {400, 700}}};

/// Size and optics of the picture.
struct CameraSettings {
    std::int32_t width = 512, height = 512;
    double fov_x_rad = std::numbers::pi / 6, fov_y_rad = std::numbers::pi / 6;
    GivenFov given_fov{}; ///< that of the two above, unless they were set otherwise since
    double integration_s = 0;
    Psf psf{};
    PictureLens lens{};
    double line_s = 0; ///< from the beginning of a row's exposure to that of the next
    /// Times in SuMoL in place of `line_s`, and the table of a scene file that names them; null: none.
    std::shared_ptr<const models::TimingProgram> timing{};
    nlohmann::json shutter{};
    /// Distance of the plane that is sharp, and radius of the pupil, m; 0: all is sharp.
    double focus_m = 0, pupil_radius_m = 0;
    std::array<double, 2> pupil_point_m{}; ///< through which the picture is rendered: right, down
    /// Motion beside that of the object `camera`: in its frame (x right, y down, z forward), since the
    /// exposure began.
    std::vector<scene::TimedPose> motion{};

    /// What `timing` is asked for; an instant lasts 1 ns.
    [[nodiscard]] models::TimedFrame timed_frame() const;
    /// Exposure of all rows together: to the end of the last.
    [[nodiscard]] double exposure_s() const;

private:
    /// exposure_s() of a model, and what it belongs to.
    struct Latest {
        std::shared_ptr<const models::TimingProgram> timing;
        models::TimedFrame frame;
        double read_s = 0;
    };
    mutable Latest latest_;
};

/// How pictures are rendered and sent.
struct RenderingSettings {
    std::uint32_t samples = 16;
    std::uint32_t secondary_rays = 4;
    bool path_tracing = false;
    bool irradiance = false; ///< pixels hold W/m2, not W m-2 sr-1
    bool los_mapping = false, time_mapping = false;
    /// The pixels of the picture are one detector of one pixel, each at its own time; without stars.
    bool scanning_device = false;
    std::int32_t compression = 0;
};

/// Stars of the background.
struct Background {
    std::string name{};
    std::vector<Vec3> directions{};
    std::vector<Channels> irradiance_w_m2{};
    double threshold_w_m2 = 0;
    std::string file{}; ///< table of those above the threshold, of the session's folder
};

/// What the sessions of a server have in common.
struct CompatibleSettings {
    std::string version;            ///< of the server
    std::filesystem::path root;     ///< absolute folder, below which clients may name files
    std::filesystem::path output{}; ///< absolute folder that they may write to; empty: none
    PictureLimits limits{};
    ResourceTable resources{};                        ///< files for names that are in neither folder
    std::uint64_t max_bytes = std::uint64_t{4} << 30; ///< that a client may write in all
    /// Size of the files that a client's scene is made of: textures, tables, meshes.
    std::uint64_t scene_bytes = std::uint64_t{1} << 30;
};

/// State of one client. Thread-bound.
class ClientState {
public:
    /// Both outlive this. `memory` counts pictures, their maps and answers.
    ClientState(const CompatibleSettings& settings, service::MemoryAccount& memory);
    ClientState(const ClientState&) = delete;
    ClientState& operator=(const ClientState&) = delete;

    /// Empties the scene and sets the settings back; conventions and folders stay.
    void reset();

    Conventions conventions{};
    CameraSettings camera{};
    RenderingSettings rendering{};
    Channels sun_power_w_sr{};
    std::array<ChannelBand, channels> bands = usual_bands;
    Background background{};
    std::map<std::string, Object> objects{};
    std::map<std::string, std::string> aliases{};
    std::map<std::string, Model> shapes{}, reflections{};
    std::map<std::string, NamedTexture> textures{};
    Notes metadata{};
    /// What calls without effect have set, by name of call and object.
    Notes remembered{};
    ClientFiles files;
    SessionFolder own;                ///< files that the scene is made of
    std::optional<Picture> picture{}; ///< the last one

    /// The object of that name or alias; null: none.
    [[nodiscard]] Object* find(std::string_view name);
    /// The same. Throws Failure (bad_argument) with the names that there are.
    [[nodiscard]] Object& object(std::string_view name, std::string_view call);
    /// Where a new object of that name begins: at the place of the old one, whose elements go with it; none:
    /// at the origin.
    [[nodiscard]] Placement inherited_placement(std::string_view name);
    /// Whether an element's name means all of the object: empty, or the object's own name or alias.
    [[nodiscard]] bool is_whole(const Object& object, std::string_view element_name) {
        return element_name.empty() || find(element_name) == &object;
    }
    /// The scene as tables of a scene file.
    [[nodiscard]] nlohmann::json scene();
    /// Renders the picture. Throws Failure.
    void render(service::Work& work);
    /// The same of some windows of it; the rest is 0.
    void render(const std::vector<Region>& windows, service::Work& work);
    /// Distances along rays in the scene as it is now.
    [[nodiscard]] std::vector<double> intersect(const std::vector<renderer::Ray>& rays, service::Work& work);
    /// Distances along the rays of the picture's pixels, and their normals in inertial axes, x, y, z each.
    void find_surfaces(service::Work& work);

    /// Takes so many bytes until they are given back. Throws Failure (too_large).
    [[nodiscard]] service::MemoryAccount::Share hold(std::uint64_t bytes) const {
        return memory_.take(bytes);
    }
    /// Rays of the scene's pictures so far.
    [[nodiscard]] std::uint64_t rays_traced() { return render_call_.current().rays_traced(); }
    [[nodiscard]] const PictureLimits& limits() const noexcept { return settings_.limits; }
    [[nodiscard]] const std::string& version() const noexcept { return settings_.version; }
    [[nodiscard]] scene::SceneDocument const& document() const noexcept { return scene_calls_.document(); }

private:
    void load_scene(service::Work& work);
    /// Light of a window of the picture, planes of the channels.
    [[nodiscard]] std::vector<float> light_of(const Region& window, std::uint32_t samples,
                                              std::uint64_t frame, service::Work& work);
    /// The same of a scanning device.
    [[nodiscard]] std::vector<float> scanned_light(const Picture& made, const Region& window,
                                                   std::uint32_t samples, std::uint64_t frame,
                                                   service::Work& work);
    /// Times of all pixels of the picture after its beginning, row by row. Throws Failure.
    [[nodiscard]] std::vector<RowTime> pixel_times() const;
    /// find_surfaces() of a scanning device: each pixel at its time.
    void find_scanned_surfaces(service::Work& work);

    const CompatibleSettings& settings_;
    service::MemoryAccount& memory_;
    SceneCalls scene_calls_;
    RenderCall render_call_;
    nlohmann::json loaded_; ///< the scene that scene_calls_ has
};

/// The attitude in the client's conventions.
[[nodiscard]] service::compatible::List quaternion_of(const Object& object, const Conventions& conventions);
/// The other way round. Throws Failure if `numbers` are no rotation.
[[nodiscard]] Quat attitude_of(const std::vector<double>& numbers, Object::Kind kind,
                               const Conventions& conventions);
/// A pose in the frame that the client's quaternions turn, in that which the attitude of a placement turns.
[[nodiscard]] Pose element_of(const Pose& given, Object::Kind kind, const Conventions& conventions);

[[nodiscard]] inline Vec3 vec3_of(const std::vector<double>& v) {
    return {v.at(0), v.at(1), v.at(2)};
}
[[nodiscard]] inline service::compatible::List list_of(const Vec3& v) {
    return {v.x, v.y, v.z};
}

} // namespace obscura::serve::compatible

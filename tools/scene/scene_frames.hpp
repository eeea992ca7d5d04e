// SPDX-License-Identifier: Apache-2.0
// Frames of a scene's camera without a detector: rendering, and EXR and FITS files of irradiance and AOVs.
#pragma once

#include "core/camera/frame.hpp"
#include "core/text/enum_names.hpp"
#include "images/writers/card.hpp"
#include "images/writers/fits.hpp"
#include "renderer/frame_times.hpp"
#include "renderer/renderer.hpp"
#include "renderer/world/scene_poses.hpp"
#include "tools/scene/render_options.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

/// File formats that hold numbers in physical units.
enum class SceneFileFormat : std::uint8_t { exr, fits };
constexpr auto enum_names(SceneFileFormat /*type*/) {
    return std::array{EnumName{SceneFileFormat::exr, "exr"}, EnumName{SceneFileFormat::fits, "fits"}};
}

/// Renders one frame after the other. The bytes of a frame's file depend on scene, options, its number and
/// its time only, whichever frames were rendered before. Thread-bound.
class SceneFrames {
public:
    /// Builds the renderer; `program` begins messages about the options. Throws Error.
    SceneFrames(scene::Scene scene, RenderOptions options, std::string_view program);

    [[nodiscard]] const renderer::Renderer& renderer() const noexcept { return renderer_; }
    [[nodiscard]] const scene::Camera& camera() const noexcept { return camera_; }
    [[nodiscard]] const std::vector<SpectralBand>& bands() const noexcept { return bands_; }
    /// Part of the sensor that is rendered.
    [[nodiscard]] const Region& region() const noexcept { return region_; }

    /// Makes frame `number` (from 1) at scene time `time_s` the current one and returns its poses.
    const GroundTruth& begin(std::uint64_t number, double time_s);
    /// Renders the current frame, again and again for about `budget_s`, of which it takes the mean (0: once);
    /// `rows_done` is told the rows of the current pass. Returns false when interrupted.
    bool render(double budget_s, const std::function<void(std::int32_t rows)>& rows_done);
    /// Renders its AOVs. Returns false when interrupted.
    bool trace_aovs();

    /// Irradiance of the current frame, one plane for each band.
    [[nodiscard]] std::span<const float> image() const noexcept { return image_; }
    /// Passes of render().
    [[nodiscard]] std::uint64_t passes() const noexcept { return passes_; }
    /// Estimated noise, rms over the rms of the lit pixels; 0: no body was sampled.
    [[nodiscard]] double noise_rms() const;
    /// A terrain of which one frame made more tiles than there is room for, with those of that frame, the
    /// most of all frames. None: no frame lost tiles that it may still have needed.
    [[nodiscard]] const std::optional<renderer::Renderer::TerrainTiles>& crowded_tiles() const noexcept {
        return crowded_;
    }
    /// AOVs, samples and variance with their units; empty without trace_aovs().
    [[nodiscard]] std::vector<images::FitsPlane> layers() const;

    /// Writes the current frame, with layers if they were traced. Throws OutputError.
    void write(const std::filesystem::path& file, SceneFileFormat format) const;

private:
    bool render_pass(std::uint64_t frame_id, const std::function<void(std::int32_t rows)>& rows_done);
    [[nodiscard]] images::Cards cards() const;
    [[nodiscard]] images::Cards velocity_cards() const;
    void sum_squares();
    void note_crowded_tiles(std::span<const renderer::Renderer::TerrainTiles> before);

    RenderOptions options_;
    std::optional<renderer::ScenePoses> poses_; ///< with aberration, for the camera's velocity
    scene::Camera camera_;
    std::optional<ephemeris::Epoch> epoch_; ///< of the scene
    std::vector<SpectralBand> bands_;
    Region region_;
    bool radiance_;
    renderer::Renderer renderer_;
    GroundTruth truth_;
    std::uint64_t number_ = 1, passes_ = 0;
    double time_s_ = 0;
    std::vector<float> image_;
    bool with_aovs_ = false;
    double noise2_ = 0, lit2_ = 0; ///< see sum_squares()
    std::optional<renderer::Renderer::TerrainTiles> crowded_;
    renderer::FrameTimes times_;
    std::vector<float> times_s_; ///< middle of the exposure of each pixel; empty: all have the same
    std::vector<float> aov_values_, samples_, variance_, band_, band_samples_, band_variance_;
};

} // namespace obscura::tools

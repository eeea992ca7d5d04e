// SPDX-License-Identifier: Apache-2.0
// Plausibility of a camera before its scene: figures that a user can check at a glance, and what is odd.
#pragma once

#include "renderer/renderer.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/world/view.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

class Report;

/// Something odd. `what` is a word for programs, `text` a line: what is odd, the figure, and what to try.
struct Oddity {
    std::string what, text;
};

/// Expected light of a frame, in the sensor's terms.
struct SignalFigures {
    double brightest_e = 0, full_well_e = 0;
    double brightest_dn = 0, black_dn = 0, max_dn = 0; ///< max_dn: of the ADC
    double saturated_share = 0;                        ///< of the pixels that were rendered
    double rows_share = 1;                             ///< part of the frame that was rendered, 0 to 1
    double exposure_us = 0;                            ///< of the first window, requested
    double obtained_us = 0;                            ///< its exposure as the sensor makes it
};

/// Durations of a frame.
struct TimeFigures {
    std::optional<double> period_ms; ///< between triggers, nominal; none: unknown
    double shortest_period_ms = 0;   ///< that the sensor allows
    double readout_ms = 0, exposure_ms = 0;
};

/// Estimated rendering time of a frame.
struct RenderFigures {
    double ms = 0;        ///< on the idle machine: CPU time over the number of threads
    double loaded_ms = 0; ///< as the machine is loaded now
    bool at_least = false;
};

/// Figures and oddities of one camera. Each add_...() adds what follows from its argument.
class Plausibility {
public:
    /// `camera`: "camera[1]" where there are several, else empty. `frames_s`: scene times of frames, at least
    /// one; the figures are those of the first. `posed`: the poses are the scene's, not a simulator's, so
    /// that odd ones are reported.
    Plausibility(std::string camera, const renderer::Renderer& renderer, std::span<const double> frames_s,
                 bool posed = true);

    void add_signal(const SignalFigures& signal);
    /// Brightest pixel of a render without a sensor; `rows_share`: part of the frame that was rendered.
    /// add_light() adds it to the figures, too.
    void judge_light(double brightest, double rows_share);
    void add_light(double brightest, std::string_view unit, double rows_share);
    /// A frame made `made` tiles of the terrain of `body` where there is room for `slots`.
    void judge_tiles(std::string_view body, std::uint64_t made, std::uint64_t slots);
    void add_times(const TimeFigures& times);
    /// What the author of a model beside the scene's should know.
    void add_model(std::string line) { add("model", std::move(line)); }
    void add_rendering(const RenderFigures& rendering);

    [[nodiscard]] const std::vector<Oddity>& oddities() const noexcept { return oddities_; }
    /// Adds the figures as lines of the table, or as the JSON object `plausibility` with the oddities in
    /// `warnings`.
    void add_to(Report& report) const;
    /// Lines of the figures: label and text.
    struct Line {
        std::string label, text;
    };
    [[nodiscard]] std::vector<Line> lines() const;
    /// The JSON object.
    [[nodiscard]] std::string json() const;
    /// Writes the oddities since the last call to standard error, one line each: "obscura VERB: warning:
    /// ...".
    void warn(std::string_view verb);

private:
    void judge_lens(const scene::Camera& camera);
    /// Reports what lies outside the times of its files at scene time `at_s`.
    void judge_ages(const scene::Scene& scene, double at_s);
    /// Reports presets of materials that are used beyond what they are known for.
    void judge_presets(const scene::Scene& scene);
    void judge_date(const scene::Scene& scene);
    /// Reports what is odd about the maps of bodies.
    void judge_maps();
    /// Reports a Sun that is improbably near, or that camera or bodies are in.
    void judge_sun(const scene::Scene& scene);
    void judge_bodies(const scene::Scene& scene, std::span<const renderer::View> views);
    void judge_field(const scene::Scene& scene, std::span<const renderer::View> views);
    /// Irradiance of the Sun at a distance from it, in the range of its table.
    [[nodiscard]] double sun_w_m2(double distance_m) const;
    void judge_dark(std::string text, double rows_share);
    void add(std::string_view what, std::string text);

    std::string camera_;
    renderer::View view_;
    bool posed_ = true;
    bool resolved_ = false; ///< a body of several pixels is in the field
    double sun_scale_ = 0;  ///< factor on the Sun's irradiance
    scene::StarTotals catalogue_;
    std::optional<SignalFigures> signal_;
    std::optional<double> light_;
    std::string light_unit_;
    double light_share_ = 1;
    std::optional<TimeFigures> times_;
    std::optional<RenderFigures> rendering_;
    std::vector<Oddity> oddities_;
    std::size_t warned_ = 0; ///< oddities that warn() has written
};

/// Scene times that a judgement should look at: `first_s` and instants of the scene's trajectories.
[[nodiscard]] std::vector<double> instants_of(const scene::Scene& scene, double first_s);

} // namespace obscura::tools

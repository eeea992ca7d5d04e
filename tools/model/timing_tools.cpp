// SPDX-License-Identifier: Apache-2.0
#include "tools/model/timing_tools.hpp"

#include "images/writers/raw.hpp"
#include "models/kinds/timing_program.hpp"
#include "sensors/sensor.hpp"
#include "tools/pictures/figure.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

namespace obscura::tools {
namespace {

constexpr std::string_view new_timing = R"(// {0}: times of a readout in SuMoL.
//
//   obscura model check {0}.tim            is it sound?
//   obscura model plot {0}.tim -o {0}.svg  when is each row exposed?
//
// In a sensor file, beside it:
//   [readout]
//   shutter = {{ model = "{0}.tim", line_us = 20 }}
// In a scene file, for obscura render:
//   [camera]
//   shutter = {{ model = "{0}.tim", line_us = 20 }}

// What the verbs show it with.
property width 1024;
property height 1024;
property exposure_ms 10;

// A parameter is a key of the sensor. Its comment gives unit, range and meaning.
parameter line_us 20;  //! us, 0..1e6, Time from a row to the next

// Begin of the exposure of a row, s after the trigger. row counts from 0 in what is read, a window or the whole sensor;
// exposure is what was asked for, s; rows and columns are the size of what is read.
// With (scalar row, scalar column, scalar exposure) each pixel has times of its own: a scanning sensor.
scalar reset(scalar row, scalar exposure)
{{
    return row * line_us * 1e-6;
}}

// End of it, later than its begin. A row leaves the sensor when it and all rows above it have been read.
scalar read(scalar row, scalar exposure)
{{
    return reset(row, exposure) + exposure;
}}
)";

constexpr double milli = 1e-3;

/// A readout by the model, of the window that its properties name.
struct ShownReadout {
    std::shared_ptr<const models::TimingProgram> timing;
    models::TimedFrame frame;
    ReadoutSettings settings;

    explicit ShownReadout(const models::ModelValues& p)
        : timing(std::make_shared<models::TimingProgram>(p.loaded->model, models::program_parameters(p))) {
        const models::Model& model = *p.loaded->model;
        frame.columns = static_cast<std::int32_t>(property_of(model, "width", 1024, 1, 65536));
        frame.rows = static_cast<std::int32_t>(property_of(model, "height", 1024, 1, 65536));
        frame.exposure_ns = std::llround(property_of(model, "exposure_ms", 10, 1e-6, 1e6) * milli * ns_per_s);
        settings.width = frame.columns;
        settings.height = frame.rows;
        settings.shutter = Shutter::model;
        settings.timing = timing;
    }

    /// Why it cannot be, or an empty string.
    [[nodiscard]] std::string plan(sensors::ReadoutPlan& plan) const {
        const sensors::WindowRequest whole{{0, 0, frame.columns, frame.rows}, frame.exposure_ns};
        return sensors::plan_readout(settings, {&whole, 1}, Time{}, plan);
    }
    [[nodiscard]] std::string text() const {
        return fmt::format("{} x {} px, {:g} ms", frame.columns, frame.rows,
                           static_cast<double>(frame.exposure_ns) * 1e-6);
    }
};

double after_trigger_ms(Time t) {
    return static_cast<double>(t.ns) * 1e-6;
}
double span_ms(std::int64_t span_ns) {
    return static_cast<double>(span_ns) * 1e-6;
}

ModelCost timing_cost(const models::ModelValues& p) {
    const ShownReadout shown(p);
    ModelCost cost = cost_of(shown.timing->program(), shown.timing->why_interpreted());
    const std::string_view of = shown.timing->by_pixel() ? "pixels" : "rows";
    cost.facts = {{"times of", std::string(of), "times_of", of},
                  {"shown with", shown.text(), "camera", shown.text()}};
    return cost;
}

ModelVerdict check_timing(const models::ModelValues& p) {
    const ShownReadout shown(p);
    sensors::ReadoutPlan plan;
    ModelVerdict found;
    found.at = shown.timing->place();
    if (std::string why = shown.plan(plan); !why.empty()) throw ConfigError(why);
    std::size_t waits = 0;
    for (std::size_t r = 1; r < plan.rows.size(); ++r)
        waits += plan.release[r] == plan.release[r - 1] ? 1 : 0;
    found.summary = fmt::format(
        "{} operations a {}, {} in {:.6g} ms, exposures of {:.6g} to {:.6g} ms, a frame every {:.6g} ms",
        shown.timing->program().cost(), shown.timing->by_pixel() ? "pixel" : "row", shown.text(),
        after_trigger_ms(plan.release.back()), span_ms(plan.windows[0].exposure_min_ns),
        span_ms(plan.windows[0].exposure_max_ns), span_ms(plan.frame_period_ns));
    if (waits > 0) found.summary += fmt::format(", {} rows wait for the ones above them", waits);
    // Other exposures that a client may ask for.
    for (const std::int64_t exposure_ns : {std::int64_t{1000}, shown.frame.exposure_ns * 10}) {
        models::TimedFrame other = shown.frame;
        other.exposure_ns = exposure_ns;
        if (const std::string why = shown.timing->explain(other); !why.empty())
            found.warnings.push_back(fmt::format("with an exposure of {:g} ms it is refused: {}",
                                                 span_ms(exposure_ns), why.substr(why.find(": ") + 2)));
    }
    return found;
}

ModelFacts eval_timing(const models::ModelValues& p, const ModelPoint& at) {
    ShownReadout shown(p);
    shown.frame.exposure_ns = std::llround(at.at("exposure") * ns_per_s);
    RowTime time;
    const auto row = static_cast<std::int32_t>(at.at("row"));
    if (const auto bad = shown.timing->fill_pixels(shown.frame, row,
                                                   static_cast<std::int32_t>(at.at("column")), {&time, 1}))
        throw ConfigError(shown.timing->explain(*bad));
    return {{"reset", fmt::format("{} ns", time.reset.ns), "reset_ns", time.reset.ns},
            {"read", fmt::format("{} ns", time.read.ns), "read_ns", time.read.ns},
            {"exposure", fmt::format("{} ns", time.exposure_ns()), "exposure_ns", time.exposure_ns()}};
}

/// At most so many rows or columns are drawn; an odd step shows those that alternate.
std::int32_t step_of(std::int32_t count, std::int32_t shown) {
    const std::int32_t step = std::max(1, count / shown);
    return step % 2 == 0 ? step + 1 : step;
}

std::string timing_svg(const ShownReadout& shown, const sensors::ReadoutPlan& plan, std::string_view title) {
    Plot plot;
    plot.title = std::string(title);
    plot.x_label = "time after the trigger, ms";
    plot.y_label = shown.timing->by_pixel() ? "row (its middle pixel)" : "row";
    plot.series = {{"reset", Drawn::points, {}}, {"read", Drawn::points, {}}, {"leaves", Drawn::line, {}}};
    for (std::int32_t r = 0; r < plan.height; r += step_of(plan.height, 300)) {
        const auto i = static_cast<std::size_t>(r);
        plot.series[0].points.emplace_back(after_trigger_ms(plan.rows[i].reset), r);
        plot.series[1].points.emplace_back(after_trigger_ms(plan.rows[i].read), r);
        plot.series[2].points.emplace_back(after_trigger_ms(plan.release[i]), r);
    }
    return svg(plot);
}

/// Middle of the exposure of each pixel, in false colour.
Canvas time_map(const ShownReadout& shown) {
    const std::int32_t columns = shown.frame.columns, rows = shown.frame.rows;
    const std::int32_t dx = step_of(columns, 512), dy = step_of(rows, 512);
    Panel panel;
    panel.title = "middle of the exposure";
    panel.width = (columns - 1) / dx + 1;
    panel.height = (rows - 1) / dy + 1;
    std::vector<RowTime> pixels(static_cast<std::size_t>(columns));
    std::vector<double> values;
    for (std::int32_t y = 0; y < rows; y += dy) {
        shown.timing->fill_pixels(shown.frame, y, 0, pixels);
        for (std::int32_t x = 0; x < columns; x += dx)
            values.push_back(after_trigger_ms(pixels[static_cast<std::size_t>(x)].mid()));
    }
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const ColourScale scale{ColourMap::viridis, *low, *high, "ms after the trigger", {}};
    std::transform(values.begin(), values.end(), std::back_inserter(panel.pixels),
                   [&](double value) { return scale.colour_of(value); });
    panel.scale = scale;
    return draw_panels({panel});
}

std::string timing_csv(const ShownReadout& shown, const sensors::ReadoutPlan& plan) {
    const bool by_pixel = shown.timing->by_pixel();
    std::string text =
        by_pixel ? "row,column,reset_ns,read_ns,release_ns\n" : "row,reset_ns,read_ns,release_ns\n";
    std::vector<RowTime> pixels(by_pixel ? static_cast<std::size_t>(shown.frame.columns) : 0);
    for (std::int32_t r = 0; r < plan.height; ++r) {
        const auto i = static_cast<std::size_t>(r);
        const std::int64_t release_ns = plan.release[i].ns;
        if (!by_pixel)
            fmt::format_to(std::back_inserter(text), "{},{},{},{}\n", r, plan.rows[i].reset.ns,
                           plan.rows[i].read.ns, release_ns);
        shown.timing->fill_pixels(shown.frame, r, 0, pixels);
        for (std::size_t x = 0; x < pixels.size(); ++x)
            fmt::format_to(std::back_inserter(text), "{},{},{},{},{}\n", r, x, pixels[x].reset.ns,
                           pixels[x].read.ns, release_ns);
    }
    return text;
}

void plot_timing(const models::ModelValues& p, std::string_view title, const std::filesystem::path& file) {
    const ShownReadout shown(p);
    sensors::ReadoutPlan plan;
    if (const std::string why = shown.plan(plan); !why.empty()) throw ConfigError(why);
    if (file.extension() == ".png")
        time_map(shown).write(file);
    else
        images::write_text(file, file.extension() == ".svg" ? timing_svg(shown, plan, title)
                                                            : timing_csv(shown, plan));
}

ModelFacts bench_timing(const models::ModelValues& p) {
    const auto fact = [](std::string label, std::string name, double ns) {
        return ModelFact{std::move(label), fmt::format("{:8.2f}", ns), std::move(name), ns};
    };
    const ShownReadout shown(p);
    std::vector<RowTime> times(1024);
    models::TimedFrame frame{1024, 1024, shown.frame.exposure_ns};
    ModelFacts facts{fact("", "model_ns", nanoseconds_a_sample(1024, [&] {
                              if (shown.timing->by_pixel())
                                  shown.timing->fill_pixels(frame, 512, 0, times);
                              else
                                  shown.timing->fill_rows(frame, 0, times);
                          }))};
    // Plans of frames, for each of their rows.
    sensors::ReadoutPlan plan;
    const sensors::WindowRequest whole{{0, 0, 1024, 1024}, shown.frame.exposure_ns};
    ReadoutSettings settings = shown.settings;
    settings.width = settings.height = 1024;
    const auto planned = [&] {
        return nanoseconds_a_sample(1024, [&] { (void)plan_readout(settings, {&whole, 1}, Time{}, plan); });
    };
    facts.push_back(fact("a row of a plan by it", "plan_ns", planned()));
    settings.shutter = Shutter::rolling;
    facts.push_back(fact("a row of a built-in rolling plan", "rolling_plan_ns", planned()));
    return facts;
}

} // namespace

const KindTools& timing_tools() {
    static const KindTools tools{"timing",
                                 new_timing,
                                 timing_cost,
                                 check_timing,
                                 {{"row", "", "Row of what is read", 0, 0, 65535},
                                  {"column", "", "Column of it, for times of pixels", 0, 0, 65535},
                                  {"exposure", "s", "Exposure that is asked for", 0.01, 1e-9, 1000}},
                                 eval_timing,
                                 {{".svg", "reset, read and release of the rows over time"},
                                  {".png", "the middle of the exposure of each pixel"},
                                  {".csv", "a table of all times"}},
                                 plot_timing,
                                 bench_timing};
    return tools;
}

} // namespace obscura::tools

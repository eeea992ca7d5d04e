// SPDX-License-Identifier: Apache-2.0
#include "core/camera/camera.hpp"

#include "core/camera/setting_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

namespace obscura {
namespace {

using Finding = std::optional<InvalidSetting>;

/// What is wrong with `value`, unless it is in the range of the setting.
Finding check_range(const Setting& setting, double value, const CameraLimits& limits) {
    const std::optional<SettingRange> range = setting.range_of(limits);
    if (!range || range->contains(value)) return {};
    return InvalidSetting{setting.name, fmt::format("{} {}{}{}: allowed {} to {}", setting.name, value,
                                                    setting.unit.empty() ? "" : " ", setting.unit,
                                                    range->minimum, range->maximum)};
}

Finding check_extents(const Region& r, const CameraLimits& limits) {
    const auto check = [](const char* name, std::int32_t value, std::int32_t minimum, std::int32_t maximum,
                          std::int32_t step) -> Finding {
        if (value < minimum || value > maximum || value % step != 0)
            return InvalidSetting{name, fmt::format("{} {}: allowed {} to {} in steps of {}", name, value,
                                                    minimum, maximum, step)};
        return {};
    };
    const std::int32_t x_max = limits.strict ? limits.sensor_width - r.width : limits.sensor_width - 1;
    const std::int32_t y_max = limits.strict ? limits.sensor_height - r.height : limits.sensor_height - 1;
    const Finding extents[] = {
        check("Width", r.width, limits.width_min, limits.sensor_width, limits.width_step),
        check("Height", r.height, limits.height_min, limits.sensor_height, limits.height_step),
        check("OffsetX", r.x, 0, x_max, limits.width_step),
        check("OffsetY", r.y, 0, y_max, limits.height_step),
    };
    for (const Finding& finding : extents)
        if (finding) return finding;
    return {};
}

Finding check_window(const CameraWindow& w, const CameraLimits& limits) {
    if (Finding finding = check_extents(w.region, limits)) return finding;
    const double exposure_us = static_cast<double>(w.exposure_ns) / 1e3;
    if (Finding finding = check_range(setting("ExposureTime"), exposure_us, limits)) return finding;
    if (const SettingRange range = reads_range(w.sampling); !range.contains(w.reads))
        return InvalidSetting{
            "reads", fmt::format("reads {}: allowed {} to {}", w.reads, range.minimum, range.maximum)};
    return {};
}

} // namespace

void CameraSettings::set_windows(std::span<const CameraWindow> windows) {
    assert(!windows.empty() && windows.size() <= max_windows);
    region = windows[0].region;
    exposure_ns = windows[0].exposure_ns;
    sampling = windows[0].sampling;
    reads = windows[0].reads;
    more_count = static_cast<std::uint32_t>(windows.size() - 1);
    more_windows = {};
    std::copy(windows.begin() + 1, windows.end(), more_windows.begin());
}

ImageSize composed_size(const CameraSettings& settings) {
    ImageSize size;
    for (std::size_t i = 0; i < settings.window_count(); ++i) {
        const CameraWindow w = settings.window(i);
        size.width = std::max(size.width, w.region.width);
        size.height += w.region.height * (w.sampling == Sampling::non_destructive ? w.reads : 1);
    }
    return size;
}

namespace {

Finding check_activation(const char* selector, const TriggerChoice& trigger, const CameraLimits& limits) {
    const TriggerActivation activation = trigger.activation;
    const bool for_level =
        selector == std::string_view("FrameStart") || selector == std::string_view("AcquisitionStart");
    if (is_level(activation) && !for_level)
        return InvalidSetting{
            "TriggerActivation",
            fmt::format("TriggerActivation[{}]: levels are for FrameStart and AcquisitionStart", selector)};
    const std::size_t line = line_of(trigger.source);
    const LineEdges reported = line < line_count ? limits.lines[line] : LineEdges{};
    // A line without a source reports no edges: any activation is allowed.
    if (line == line_count || (!reported.rising && !reported.falling)) return {};
    const bool needs_both = activation == TriggerActivation::any_edge || is_level(activation);
    if (reported.both() || (!needs_both && reported.falling == activates(activation, true))) return {};
    return InvalidSetting{"TriggerActivation",
                          fmt::format("TriggerActivation[{}]: Line{} reports {} edges only", selector, line,
                                      reported.rising ? "rising" : "falling")};
}

} // namespace

std::optional<InvalidSetting> find_invalid(const CameraSettings& s, const CameraLimits& limits) {
    const std::size_t windows_max = std::min<std::size_t>(limits.windows_max, max_windows);
    if (s.more_count >= windows_max)
        return InvalidSetting{"windows",
                              fmt::format("{} windows: allowed 1 to {}", s.window_count(), windows_max)};
    for (std::size_t i = 0; i < s.window_count(); ++i)
        if (Finding finding = check_window(s.window(i), limits)) {
            if (s.more_count != 0) finding->what = fmt::format("window {}: {}", i, finding->what);
            return finding;
        }
    const std::int32_t rows_max = limits.rows_max > 0 ? limits.rows_max : limits.sensor_height;
    if (const std::int32_t rows = composed_size(s).height; rows > rows_max)
        return InvalidSetting{
            "windows", fmt::format("the windows have {} rows together: allowed 1 to {}", rows, rows_max)};
    for (const Setting& row : camera_settings_table)
        if (!row.per_window)
            if (Finding finding = check_range(row, row.member.get(s), limits)) return finding;
    using Named = std::pair<const char*, TriggerChoice>;
    for (const auto& [name, trigger] :
         {Named{"FrameStart", s.frame_trigger}, Named{"AcquisitionStart", s.start_trigger},
          Named{"FrameBurstStart", s.burst_trigger}, Named{"ExposureStart", s.exposure_trigger}})
        if (Finding finding = check_activation(name, trigger, limits)) return finding;
    if (s.exposure_trigger.enabled && s.frame_trigger.enabled && is_level(s.frame_trigger.activation))
        return InvalidSetting{"TriggerActivation",
                              "TriggerActivation[FrameStart]: edges only with a trigger for ExposureStart"};
    if (s.exposure_mode == ExposureMode::trigger_width) {
        if (std::none_of(limits.lines.begin(), limits.lines.end(),
                         [](const LineEdges& line) { return line.both(); }))
            return InvalidSetting{"ExposureMode",
                                  "ExposureMode TriggerWidth: no line's source reports both edges"};
        if (s.exposure_auto != ExposureAuto::off)
            return InvalidSetting{"ExposureMode", "ExposureMode TriggerWidth: allowed with ExposureAuto Off"};
    }
    if (s.trigger_overlap == TriggerOverlap::readout && !limits.overlapped)
        return InvalidSetting{"TriggerOverlap",
                              "TriggerOverlap ReadOut: the sensor is not exposed while it is read out"};
    if (s.exposure_trigger.enabled && s.trigger_divider != 1)
        return InvalidSetting{"TriggerDivider", "TriggerDivider: allowed 1 with a trigger for ExposureStart"};
    return {};
}

std::string explain_invalid(const CameraSettings& settings, const CameraLimits& limits) {
    const Finding finding = find_invalid(settings, limits);
    return finding ? finding->what : std::string();
}

ReadoutAnswer CameraControl::readout(const CameraSettings& s) const {
    ReadoutAnswer answer;
    answer.window_count = static_cast<std::uint32_t>(s.window_count());
    for (std::size_t i = 0, y = 0; i < s.window_count(); ++i) {
        const CameraWindow wanted = s.window(i);
        FrameWindow& window = answer.windows[i];
        window.sensor = wanted.region;
        window.image_y = static_cast<std::int32_t>(y);
        window.exposure_requested_ns = window.exposure_min_ns = window.exposure_max_ns = wanted.exposure_ns;
        window.request = static_cast<std::uint32_t>(i);
        y += static_cast<std::size_t>(wanted.region.height);
    }
    return answer;
}

std::string explain_invalid(const Sequence& sequence, const CameraSettings& settings,
                            const CameraLimits& limits) {
    if (!sequence.enabled) return {};
    if (sequence.start >= Sequence::max_steps)
        return fmt::format("SequencerSetStart {}: allowed 0 to {}", sequence.start, Sequence::max_steps - 1);
    // Check only the sets that are reachable from `start`.
    std::array<bool, Sequence::max_steps> seen{};
    for (std::uint32_t step = sequence.start; !seen[step]; step = sequence.steps[step].next) {
        seen[step] = true;
        if (const std::string complaint = explain_invalid(with_step(settings, sequence, step), limits);
            !complaint.empty())
            return fmt::format("sequencer set {}: {}", step, complaint);
        if (const std::uint32_t next = sequence.steps[step].next; next >= Sequence::max_steps)
            return fmt::format("SequencerSetNext {} of set {}: allowed 0 to {}", next, step,
                               Sequence::max_steps - 1);
    }
    return {};
}

CameraSettings with_step(CameraSettings settings, const Sequence& sequence, std::uint32_t step) noexcept {
    const SequenceStep& s = sequence.steps[step % Sequence::max_steps];
    if ((sequence.features & sequenced_exposure) != 0) settings.exposure_ns = s.exposure_ns;
    if ((sequence.features & sequenced_gain) != 0) settings.gain_db = s.gain_db;
    if ((sequence.features & sequenced_black_level) != 0) settings.black_level_dn = s.black_level_dn;
    if ((sequence.features & sequenced_offset_x) != 0) settings.region.x = s.offset_x;
    if ((sequence.features & sequenced_offset_y) != 0) settings.region.y = s.offset_y;
    return settings;
}

} // namespace obscura

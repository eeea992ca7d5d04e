// SPDX-License-Identifier: Apache-2.0
#include "tools/timing/timing_quality.hpp"

#include "core/camera/frame_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>

namespace obscura::tools {
namespace {

constexpr std::array reasons{
    EnumName{quality_page_fault, "memory from disk"}, EnumName{quality_stall, "other programs"},
    EnumName{quality_unknown_scene, "cost not known"}, EnumName{quality_budget, "too little time"},
    EnumName{quality_predicted, "foreseen"}};

bool is_degraded(const TimingRow& row) {
    return row.quality.rows_degraded > 0;
}

std::string reason_names(const TimingRow& row) {
    std::string out;
    for (const auto& [bit, name] : reasons)
        if ((row.quality.reasons & bit) != 0) out += fmt::format("{}{}", out.empty() ? "" : ", ", name);
    return out.empty() ? "not stated" : out;
}

/// Groups of rows at each level.
using LevelCounts = std::array<std::size_t, quality_level_count>;

void count_levels(const TimingRow& row, LevelCounts& counts) {
    for (const char digit : row.levels)
        ++counts[static_cast<std::size_t>(digit - '0')];
}

std::string level_shares(const LevelCounts& counts, int decimals) {
    const auto all = static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::size_t{0}));
    std::string out;
    for (std::size_t l = 0; l < counts.size(); ++l)
        if (counts[l] > 0)
            out +=
                fmt::format("{}{} {:.{}f} %", out.empty() ? "" : ", ", name_of(static_cast<QualityLevel>(l)),
                            100 * static_cast<double>(counts[l]) / all, decimals);
    return out;
}

double percent(std::int64_t ppm) {
    return 1e-4 * static_cast<double>(ppm);
}
double ms(std::int64_t us) {
    return 1e-3 * static_cast<double>(us);
}

/// Frames that have the same reasons.
struct Kind {
    std::size_t frames = 0;
    LevelCounts levels{};
    std::vector<std::int64_t> errors_ppm;
    std::int64_t min_margin_us = INT64_MAX;

    void add(const TimingRow& row) {
        ++frames;
        count_levels(row, levels);
        errors_ppm.push_back(in_millionths(row.quality.error_rms));
        min_margin_us = std::min(min_margin_us, row.quality.margin_us);
    }
};

} // namespace

std::string degraded_because(const TimingRow& row) {
    if (!is_degraded(row)) return {};
    std::string out = reason_names(row);
    const auto add = [&out](const std::string& text) { out += "; " + text; };
    if ((row.quality.reasons & quality_page_fault) != 0)
        add(fmt::format("{} page faults: render threads waited for the disk", row.page_faults));
    if ((row.quality.reasons & quality_stall) != 0 && row.measured > 0)
        add(fmt::format(
            "while at work the render threads had {:.0f} % of a core each, by {} involuntary context switches",
            100 * static_cast<double>(row.measured_cpu) / static_cast<double>(row.measured),
            row.preemptions));
    if ((row.quality.reasons & quality_unknown_scene) != 0)
        add("the first frame, or the first of a new scene");
    if ((row.quality.reasons & (quality_budget | quality_predicted)) != 0)
        add(fmt::format("in full it would have taken longer than the {:.1f} ms that there were",
                        ms(row.quality.budget_us)));
    return out;
}

std::string quality_remark(std::span<const TimingRow> rows) {
    LevelCounts levels{};
    std::vector<std::int64_t> errors_ppm;
    for (const TimingRow& row : rows) {
        count_levels(row, levels);
        if (in_millionths(row.quality.error_rms) > 0)
            errors_ppm.push_back(in_millionths(row.quality.error_rms));
    }
    const auto degraded = std::count_if(rows.begin(), rows.end(), is_degraded);
    if (degraded == 0) return {};
    std::string text = fmt::format("quality: {} of {} frames below full, groups of rows: {}", degraded,
                                   rows.size(), level_shares(levels, 1));
    std::sort(errors_ppm.begin(), errors_ppm.end());
    if (!errors_ppm.empty())
        text += fmt::format("; estimated error {:.1f} % (median; worst {:.1f} %)",
                            percent(errors_ppm[errors_ppm.size() / 2]), percent(errors_ppm.back()));
    return text;
}

std::string degraded_text(std::span<const TimingRow> rows, bool each) {
    std::map<std::string, Kind> kinds;
    for (const TimingRow& row : rows)
        if (is_degraded(row)) kinds[reason_names(row)].add(row);
    if (kinds.empty()) return {};
    std::string out = fmt::format("\nDegraded frames, by reason\n{:>8} {:>9} {:>9} {:>11}  {:<40}  {}\n",
                                  "frames", "error, %", "worst", "margin, ms", "why", "groups of rows");
    for (auto& [why, kind] : kinds) {
        std::sort(kind.errors_ppm.begin(), kind.errors_ppm.end());
        out +=
            fmt::format("{:>8} {:>9.2f} {:>9.2f} {:>11.1f}  {:<40}  {}\n", kind.frames,
                        percent(kind.errors_ppm[kind.errors_ppm.size() / 2]), percent(kind.errors_ppm.back()),
                        ms(kind.min_margin_us), why, level_shares(kind.levels, 0));
    }
    if (!each) return out;
    out += fmt::format("\nEach degraded frame\n{:>8} {:>9} {:>9} {:>9} {:>10} {:>10} {:>10}  {}\n", "frame",
                       "error, %", "worst", "/ noise", "had, ms", "took, ms", "margin, ms", "why");
    for (const TimingRow& row : rows) {
        if (!is_degraded(row)) continue;
        LevelCounts levels{};
        count_levels(row, levels);
        out += fmt::format("{:>8} {:>9.2f} {:>9.2f} {:>9.2f} {:>10.1f} {:>10.1f} {:>10.1f}  {}; {}\n",
                           row.frame_id, percent(in_millionths(row.quality.error_rms)),
                           percent(in_millionths(row.quality.error_worst_group)),
                           1e-6 * static_cast<double>(in_millionths(row.quality.noise_ratio_p95)),
                           ms(row.quality.budget_us), ms(row.quality.spent_us), ms(row.quality.margin_us),
                           level_shares(levels, 0), degraded_because(row));
    }
    return out;
}

std::string degraded_csv(std::span<const TimingRow> rows) {
    std::string out =
        "acquisition,frame_id,level_max,rows_degraded,reasons,error_ppm,error_worst_ppm,noise_ratio_ppm,budget_us,spent_us,margin_us,levels,why\n";
    for (const TimingRow& row : rows)
        if (is_degraded(row))
            out += fmt::format(
                "{},{},{},{},{},{},{},{},{},{},{},{},\"{}\"\n", row.acquisition, row.frame_id,
                name_of(row.quality.level_max), row.quality.rows_degraded, row.quality.reasons,
                in_millionths(row.quality.error_rms), in_millionths(row.quality.error_worst_group),
                in_millionths(row.quality.noise_ratio_p95), row.quality.budget_us, row.quality.spent_us,
                row.quality.margin_us, row.levels, degraded_because(row));
    return out;
}

} // namespace obscura::tools

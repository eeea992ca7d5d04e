// SPDX-License-Identifier: Apache-2.0
#include "emulator/simulator/simulator_protocol.hpp"

#include "core/pose_range.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

namespace obscura::emulator {
namespace {

/// Removes the next word from the text; empty at the end. One or more blanks separate words.
std::string_view next_word(std::string_view& rest) {
    const std::size_t begin = rest.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return rest = {};
    const std::size_t end = std::min(rest.find_first_of(" \t", begin), rest.size());
    const std::string_view word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
}

bool parse_number(std::string_view text, double& value) {
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && rest == end && std::isfinite(value);
}

std::string check_place(Pose& pose) {
    if (const auto why = refusal_of(pose)) return "pose: " + *why;
    pose.orientation = normalized(pose.orientation);
    return {};
}

std::string check_rates(const PoseRates& rates) {
    auto why = refusal_of_velocity(rates.velocity_m_s);
    if (!why) why = refusal_of_rate(rates.rate_rad_s);
    return why ? "pose: " + *why : std::string();
}

SimulatorLine parse_pose(std::string_view rest) {
    PoseLine line;
    line.name = next_word(rest);
    if (line.name.empty()) return BadLine{"pose: a name is missing"};
    if (!parse_seconds(next_word(rest), line.time))
        return BadLine{"pose: TIME: seconds from 0 to 1e9 with up to nine decimals are wanted"};
    std::array<double, 7> values{};
    for (double& value : values)
        if (!parse_number(next_word(rest), value))
            return BadLine{"pose: X Y Z QW QX QY QZ: seven numbers are wanted"};
    line.pose.position_m = {values[0], values[1], values[2]};
    line.pose.orientation = {values[3], values[4], values[5], values[6]};
    if (std::string why = check_place(line.pose); !why.empty()) return BadLine{std::move(why)};
    std::string_view word = next_word(rest);
    if (word.empty()) return line;
    std::array<double, 6> rates{};
    for (double& rate : rates) {
        if (!parse_number(word, rate))
            return BadLine{"pose: VX VY VZ WX WY WZ: six numbers are wanted, or none"};
        word = next_word(rest);
    }
    if (!word.empty()) return BadLine{"pose: more words than NAME TIME X Y Z QW QX QY QZ VX VY VZ WX WY WZ"};
    line.rates = {{rates[0], rates[1], rates[2]}, {rates[3], rates[4], rates[5]}};
    if (std::string why = check_rates(*line.rates); !why.empty()) return BadLine{std::move(why)};
    return line;
}

} // namespace

std::string check_pose(PoseLine& pose) {
    std::string why = check_place(pose.pose);
    return why.empty() && pose.rates ? check_rates(*pose.rates) : why;
}

bool parse_seconds(std::string_view text, Time& time) noexcept {
    const std::size_t point = std::min(text.find('.'), text.size());
    const std::string_view whole = text.substr(0, point);
    const std::string_view fraction = point == text.size() ? std::string_view{} : text.substr(point + 1);
    if (whole.empty() || whole.size() > 9 || fraction.size() > 9) return false;
    std::int64_t ns = 0;
    for (const std::string_view part : {whole, fraction})
        for (const char c : part) {
            if (c < '0' || c > '9') return false;
            ns = 10 * ns + (c - '0');
        }
    for (std::size_t i = fraction.size(); i < 9; ++i)
        ns *= 10;
    time = Time{ns};
    return true;
}

std::string seconds_text(Time time) {
    return fmt::format("{}.{:09}", time.ns / ns_per_s, time.ns % ns_per_s);
}

SimulatorLine parse_simulator_line(std::string_view line) {
    if (line.size() > simulator_line_bytes)
        return BadLine{fmt::format("a line has at most {} bytes", simulator_line_bytes)};
    std::string_view rest = line;
    const std::string_view command = next_word(rest);
    if (command == "pose") return parse_pose(rest);
    if (command == "step") {
        StepLine step;
        if (!parse_seconds(next_word(rest), step.time) || !next_word(rest).empty())
            return BadLine{"step: TIME: seconds from 0 to 1e9 with up to nine decimals are wanted"};
        return step;
    }
    if (command == "state" && next_word(rest).empty()) return StateLine{};
    if (command == "token") return TokenLine{next_word(rest)};
    return BadLine{
        fmt::format("unknown command, {}", allowed_words(command, {"pose", "step", "state", "token"}))};
}

} // namespace obscura::emulator

// SPDX-License-Identifier: Apache-2.0
// SPK types 8, 9, 12, 13, 18 and 19: states at times, interpolated.
#include "core/error.hpp"
#include "ephemeris/segments/packet_segments.hpp"
#include "ephemeris/segments/segment_data.hpp"
#include "ephemeris/segments/spk_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::ephemeris {
namespace {

constexpr std::size_t state_packet_words = 6;

/// What the six components of a state are made of.
enum class StateMethod : std::uint8_t {
    lagrange,        ///< position and velocity each by Lagrange
    hermite,         ///< both from positions and their derivatives
    hermite_of_each, ///< from positions, derivatives, velocities and derivatives (packets of 12)
};

/// Subtypes of types 18 and 19.
constexpr std::array state_subtypes{PacketSubtype{12, true}, PacketSubtype{6, false}, PacketSubtype{6, true}};
constexpr std::array subtype_methods{StateMethod::hermite_of_each, StateMethod::lagrange,
                                     StateMethod::hermite};

StateKm state_from(const SampledPackets& samples, SampleWindow window, TdbTime time, StateMethod method) {
    std::array<double, max_samples> x;
    for (std::size_t i = 0; i < window.count; ++i)
        x[i] = -since(time, samples.time(window.first + i));
    const auto nodes = std::span<const double>(x).first(window.count);
    std::array<double, 3> place{}, speed{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        switch (method) {
        case StateMethod::lagrange:
            place[axis] = lagrange_of(samples, window, nodes, axis).value;
            speed[axis] = lagrange_of(samples, window, nodes, axis + 3).value;
            break;
        case StateMethod::hermite: {
            const ValueAndRate both = hermite_of(samples, window, nodes, axis, axis + 3);
            place[axis] = both.value;
            speed[axis] = both.rate;
            break;
        }
        case StateMethod::hermite_of_each:
            place[axis] = hermite_of(samples, window, nodes, axis, axis + 3).value;
            speed[axis] = hermite_of(samples, window, nodes, axis + 6, axis + 9).value;
            break;
        }
    }
    return {{place[0], place[1], place[2]}, {speed[0], speed[1], speed[2]}};
}

Interval reach_of(const SampledPackets& samples) noexcept {
    return {samples.time(0), samples.time(samples.count - 1)};
}

/// Types 8, 9, 12 and 13.
class States final : public SpkData {
public:
    States(const std::string& place, std::int32_t type, std::span<const double> words)
        : method_(type == 8 || type == 9 ? StateMethod::lagrange : StateMethod::hermite) {
        const bool equal_steps = type == 8 || type == 12;
        const std::size_t tail = equal_steps ? 4 : 2;
        if (words.size() <= tail) throw InputError(fmt::format("{}: {} values", place, words.size()));
        const std::size_t count = count_in(place, words.back(), words.size(), "states");
        samples_.count = count;
        samples_.packet_words = state_packet_words;
        // Lagrange has the degree of the polynomial, Hermite the number of states less one: the same here.
        samples_.window = std::min(
            count_in(place, words[words.size() - 2], max_samples - 1, "as degree of interpolation") + 1,
            count);
        const std::size_t times = equal_steps ? 0 : count + directory_size(count);
        if (count * state_packet_words + times + tail != words.size())
            throw InputError(
                fmt::format("{}: {} states do not fit into {} values", place, count, words.size()));
        samples_.values = words.first(count * state_packet_words);
        if (equal_steps) {
            samples_.first = words[words.size() - 4];
            samples_.step = words[words.size() - 3];
            if (!std::isfinite(samples_.first) || !(samples_.step > 0) || !std::isfinite(samples_.step))
                throw InputError(fmt::format("{}: states from {} s in steps of {} s", place, samples_.first,
                                             samples_.step));
        } else {
            samples_.times = words.subspan(count * state_packet_words, count);
            require_increasing(place, samples_.times, true, "time");
        }
    }

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        state = state_from(samples_, shifted_window(samples_, time.seconds()), time, method_);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override { return reach_of(samples_); }

private:
    SampledPackets samples_;
    StateMethod method_;
};

/// State by the packets of type 18 or of a mini-segment of type 19.
StateKm state_of_packets(const TypedPackets& packets, TdbTime time) noexcept {
    const SampledPackets& samples = packets.samples;
    const std::size_t before = samples.samples_up_to(time.seconds(), true);
    const std::size_t low = std::min(before == 0 ? 0 : before - 1, samples.count - 1);
    return state_from(samples, shrunk_window(samples, low, 0, samples.count), time,
                      subtype_methods[packets.subtype]);
}

/// Type 18.
class PacketStates final : public SpkData {
public:
    PacketStates(const std::string& place, std::span<const double> words)
        // Subtype 2 came with type 19.
        : packets_(typed_packets(place, words, std::span(state_subtypes).first(2), false)) {}

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        state = state_of_packets(packets_, time);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override { return reach_of(packets_.samples); }

private:
    TypedPackets packets_;
};

/// Type 19.
class PiecewiseStates final : public SpkData {
public:
    PiecewiseStates(const std::string& place, std::span<const double> words)
        : pieces_(place, words, state_subtypes, false) {}

    [[nodiscard]] bool evaluate(TdbTime time, StateKm& state) const noexcept override {
        state = state_of_packets(pieces_[pieces_.index(time.seconds())], time);
        return true;
    }
    [[nodiscard]] Interval reach() const noexcept override { return {pieces_.begin(), pieces_.end()}; }

private:
    MiniSegments pieces_;
};

} // namespace

std::shared_ptr<const SpkData> make_spk_samples(const std::string& place, std::int32_t type,
                                                std::span<const double> words) {
    switch (type) {
    case 18:
        return std::make_shared<PacketStates>(place, words);
    case 19:
        return std::make_shared<PiecewiseStates>(place, words);
    default:
        return std::make_shared<States>(place, type, words);
    }
}

} // namespace obscura::ephemeris

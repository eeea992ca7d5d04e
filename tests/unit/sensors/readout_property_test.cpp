// SPDX-License-Identifier: Apache-2.0
// The plan against a simulation of the chip that shares no code and no closed form with it: the row slots are
// laid out one by one, the reset pointer is placed by searching them, and the charge clock of every row is
// started by whatever event comes along.
#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <map>
#include <random>
#include <tuple>
#include <vector>

namespace readout_property_test {

using namespace obscura;
using namespace obscura::sensors;

namespace {

struct Slot {
    std::int64_t start;
    int window, row; // window -1: idle
    int cycle;
};

struct Setup {
    ReadoutSettings settings;
    std::vector<WindowRequest> windows;
};

struct Observed {
    std::int64_t reset, read; // reset: the one that the read's integration started with
};
using Key = std::tuple<int, int, int>; // window, row of the window, cycle of the frame

std::int64_t slot_length(const ReadoutSettings& s, int width) {
    std::int64_t clocks = 0;
    for (int column = 0; column < width; column += s.outputs)
        ++clocks;
    return s.row_overhead_ns + clocks * (1'000'000'000 / static_cast<std::int64_t>(s.pixel_clock_hz));
}

struct Simulation {
    std::map<Key, Observed> reads;
    std::int64_t cycle_ns = 0;
    int cycles = 1; // of a frame
    int blanking = 0;
};

// Runs frames of the set-up until they have settled; the reads of one of them are reported.
Simulation simulate(const Setup& setup, bool steady) {
    const ReadoutSettings& s = setup.settings;
    const std::int64_t dead = s.reset_instant_ns - s.sample_instant_ns;
    Simulation out;
    for (const WindowRequest& w : setup.windows)
        out.cycles = std::max(out.cycles, w.reads);

    std::int64_t reads_ns = 0;
    for (const WindowRequest& w : setup.windows)
        reads_ns += w.region.height * slot_length(s, w.region.width) + s.window_overhead_ns;
    const std::int64_t idle = slot_length(s, setup.windows.back().region.width);
    const auto room = [&](const WindowRequest& w, std::int64_t cycle) -> std::int64_t {
        if (w.reads > 1) return (w.reads - 1) * cycle;
        if (!steady && (w.sampling != Sampling::destructive || out.cycles == 1)) return std::int64_t{1} << 60;
        return (w.sampling == Sampling::destructive ? 1 : out.cycles) * cycle - dead;
    };
    for (out.blanking = s.blanking_rows; s.stretch_blanking; ++out.blanking) {
        bool enough = true;
        for (const WindowRequest& w : setup.windows)
            enough = enough && w.exposure_ns <= room(w, reads_ns + out.blanking * idle);
        if (enough) break;
    }
    out.cycle_ns = reads_ns + out.blanking * idle;

    // Steady: four frames, the third of which counts: resets for the one after it are fired meanwhile.
    // Otherwise one frame, after idle cycles in which the reset pointer may already work.
    std::int64_t longest = 0;
    for (const WindowRequest& w : setup.windows)
        longest = std::max(longest, w.exposure_ns);
    const int frames = steady ? 4 : 1;
    const int reported = steady ? 2 : 0;
    const int before = (steady ? out.cycles : static_cast<int>(longest / out.cycle_ns)) + 2;
    std::vector<Slot> slots;
    for (int c = -before; c < frames * out.cycles; ++c) {
        std::int64_t t = c * out.cycle_ns;
        for (std::size_t w = 0; w < setup.windows.size(); ++w) {
            for (int r = 0; r < setup.windows[w].region.height; ++r) {
                slots.push_back({t, static_cast<int>(w), r, c});
                t += slot_length(s, setup.windows[w].region.width);
            }
            t += s.window_overhead_ns;
        }
        for (int b = 0; b < out.blanking; ++b, t += idle)
            slots.push_back({t, -1, 0, c});
    }

    struct Event {
        std::int64_t t;
        int row;
        bool is_reset;
        Key key;
    };
    std::vector<Event> events;
    const auto fire_reset = [&](int row, std::int64_t read, std::int64_t lead, std::size_t read_slot) {
        for (std::size_t j = read_slot + 1; j-- > 0;)
            if (slots[j].start + s.reset_instant_ns <= read - lead) {
                events.push_back({slots[j].start + s.reset_instant_ns, row, true, {}});
                return;
            }
    };
    for (std::size_t i = 0; i < slots.size(); ++i) {
        const Slot& slot = slots[i];
        if (slot.window < 0 || slot.cycle < 0) continue;
        const WindowRequest& w = setup.windows[static_cast<std::size_t>(slot.window)];
        const int row = w.region.y + slot.row;
        const int frame = slot.cycle / out.cycles;
        const int cycle = slot.cycle % out.cycles;
        const std::int64_t read = slot.start + s.sample_instant_ns;
        const std::int64_t wanted = std::min(w.exposure_ns, room(w, out.cycle_ns));
        if (w.sampling == Sampling::destructive) {
            const bool whole_cycle = wanted >= out.cycle_ns - dead;
            if (!whole_cycle || (!steady && slot.cycle == 0)) fire_reset(row, read, wanted, i);
            events.push_back({slot.start + s.reset_instant_ns, row, true, {}});
        } else {
            if (cycle < out.cycles - w.reads) continue;
            if (cycle == out.cycles - w.reads) fire_reset(row, read, w.reads > 1 ? 1 : wanted, i);
        }
        if (frame == reported) events.push_back({read, row, false, {slot.window, slot.row, cycle}});
    }
    std::sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.t < b.t; });
    std::vector<std::int64_t> started(static_cast<std::size_t>(s.height), INT64_MIN);
    for (const Event& e : events) {
        if (e.is_reset)
            started[static_cast<std::size_t>(e.row)] = e.t;
        else
            out.reads[e.key] = {started[static_cast<std::size_t>(e.row)], e.t};
    }
    return out;
}

Setup random_setup(std::mt19937_64& random) {
    const auto draw = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>(low, high)(random);
    };
    Setup setup;
    ReadoutSettings& s = setup.settings;
    s.width = 40;
    s.height = 24;
    s.window_mode = WindowMode::interleaved;
    s.pixel_clock_hz = 1e9 / static_cast<double>(draw(1, 8)); // whole nanoseconds, so that both agree exactly
    s.pixel_clock_hz =
        static_cast<double>(1'000'000'000 / (1'000'000'000 / static_cast<std::int64_t>(s.pixel_clock_hz)));
    s.outputs = static_cast<std::int32_t>(draw(1, 4));
    s.row_overhead_ns = draw(3, 60);
    s.reset_instant_ns = draw(1, s.row_overhead_ns - 1);
    s.sample_instant_ns = draw(0, s.reset_instant_ns - 1);
    s.window_overhead_ns = draw(0, 3) == 0 ? draw(0, 100) : 0;
    s.blanking_rows = draw(0, 2) == 0 ? static_cast<std::int32_t>(draw(0, 6)) : 0;
    s.stretch_blanking = draw(0, 1) == 1;
    s.overlapped = draw(0, 3) != 0;
    const auto count = draw(1, 5);
    std::int64_t cycle = 0;
    for (std::int64_t i = 0; i < count; ++i) {
        WindowRequest w;
        w.region.width = static_cast<std::int32_t>(draw(1, s.width));
        w.region.height = static_cast<std::int32_t>(draw(1, 5));
        w.region.x = static_cast<std::int32_t>(draw(0, s.width - w.region.width));
        w.region.y = static_cast<std::int32_t>(draw(0, draw(0, 1) == 0 ? 6 : s.height - w.region.height));
        if (draw(0, 3) == 0) {
            const auto kind = draw(0, 2);
            w.sampling = kind == 0 ? Sampling::non_destructive : kind == 1 ? Sampling::cds : Sampling::ramp;
            w.reads = static_cast<std::int32_t>(draw(kind == 0 ? 1 : 2, 4));
        }
        cycle += w.region.height * slot_length(s, w.region.width) + s.window_overhead_ns;
        setup.windows.push_back(w);
    }
    for (WindowRequest& w : setup.windows)
        w.exposure_ns = draw(0, 1) == 0 ? draw(1, cycle) : draw(1, 4 * cycle);
    return setup;
}

} // namespace

TEST_CASE("100,000 random set-ups agree with the simulated chip to the nanosecond") {
    std::mt19937_64 random(20240607);
    ReadoutPlan plan;
    int setups = 0, rows = 0, shared = 0, clamped = 0;
    for (; setups < 110'000; ++setups) {
        Setup setup = random_setup(random);
        // One after the other is the same engine, window by window: give it a share of the runs.
        const bool sequential = setups % 10 == 0 && setup.windows.size() > 1;
        if (sequential) setup.settings.window_mode = WindowMode::sequential;
        const Time trigger{std::uniform_int_distribution<std::int64_t>(-1'000'000, 1'000'000)(random)};
        REQUIRE(plan_readout(setup.settings, setup.windows, trigger, plan) == "");

        std::vector<Simulation> simulations;
        ReadoutSettings alone = setup.settings;
        alone.window_overhead_ns = alone.blanking_rows = 0;
        if (sequential)
            for (const WindowRequest& w : setup.windows)
                simulations.push_back(simulate({alone, {w}}, false));
        else
            simulations.push_back(simulate(setup, setup.settings.overlapped));

        // The simulation's clock starts with its last frame's first cycle, the plan's with the trigger.
        std::vector<std::int64_t> shift(setup.windows.size());
        std::int64_t next = trigger.ns;
        for (std::size_t i = 0; i < simulations.size(); ++i) {
            const Simulation& sim = simulations[i];
            std::int64_t earliest = INT64_MAX, last_read = INT64_MIN;
            for (const auto& [key, seen] : sim.reads) {
                const auto window = sequential ? i : static_cast<std::size_t>(std::get<0>(key));
                const WindowRequest& w = setup.windows[window];
                if (w.sampling != Sampling::non_destructive && std::get<2>(key) != sim.cycles - 1) continue;
                std::int64_t begin = seen.reset;
                if (w.sampling == Sampling::cds || w.sampling == Sampling::ramp)
                    begin = std::max(
                        begin, sim.reads.at({std::get<0>(key), std::get<1>(key), sim.cycles - w.reads}).read);
                earliest = std::min(earliest, begin);
                last_read = std::max(last_read, seen.read);
            }
            for (std::size_t w = 0; w < setup.windows.size(); ++w)
                if (!sequential || w == i) shift[w] = next - earliest;
            if (sequential) {
                const ReadoutSettings& s = setup.settings;
                const std::int64_t end = last_read - s.sample_instant_ns +
                                         slot_length(s, setup.windows[i].region.width) + s.window_overhead_ns;
                next += end - earliest + s.reset_instant_ns;
            }
        }
        bool agree = true;
        std::size_t row = 0;
        for (const FrameWindow& window : plan.windows) {
            const WindowRequest& w = setup.windows[window.request];
            const Simulation& sim = simulations[sequential ? window.request : 0];
            const int id = sequential ? 0 : static_cast<int>(window.request);
            const int first_cycle = sim.cycles - w.reads;
            std::int64_t shortest = INT64_MAX, longest = INT64_MIN;
            for (int r = 0; r < w.region.height; ++r, ++row, ++rows) {
                const Observed& seen = sim.reads.at({id, r, first_cycle + window.read_index});
                std::int64_t begin = seen.reset;
                if (w.sampling == Sampling::cds || w.sampling == Sampling::ramp)
                    begin = std::max(begin, sim.reads.at({id, r, first_cycle}).read);
                const std::int64_t by = shift[window.request];
                agree = agree && plan.rows[row].reset.ns == begin + by &&
                        plan.rows[row].read.ns == seen.read + by && plan.sensor_row[row] == w.region.y + r;
                shortest = std::min(shortest, seen.read - begin);
                longest = std::max(longest, seen.read - begin);
            }
            agree = agree && window.exposure_min_ns == shortest && window.exposure_max_ns == longest;
            // T_w <= T_int < T_w + max(T_row) unless a flag says otherwise.
            if ((window.flags & (row_shared | exposure_clamped_down)) == 0 && w.reads == 1)
                agree = agree && shortest >= w.exposure_ns;
            shared += (window.flags & row_shared) != 0 ? 1 : 0;
            clamped += (window.flags & exposure_clamped_down) != 0 ? 1 : 0;
        }
        agree = agree && row == plan.rows.size();
        if (!sequential) agree = agree && plan.cycle_ns == simulations[0].cycle_ns;
        INFO("set-up " << setups << (sequential ? ", sequential" : "")
                       << (setup.settings.overlapped ? ", overlapped" : ""));
        REQUIRE(agree);
    }
    CHECK(setups >= 100'000);
    // The interesting cases did occur.
    CHECK(rows > 1'000'000);
    CHECK(shared > 10'000);
    CHECK(clamped > 10'000);
}

} // namespace readout_property_test

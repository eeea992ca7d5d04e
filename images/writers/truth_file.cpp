// SPDX-License-Identifier: Apache-2.0
#include "images/writers/truth_file.hpp"

#include "images/writers/card.hpp"
#include "images/writers/fits_writer.hpp"

#include <fmt/format.h>

#include <cassert>

namespace obscura::images {
namespace {

template<class Items, class Value>
auto column(const Items& items, Value value) {
    std::vector<decltype(value(*items.begin()))> values;
    for (const auto& item : items)
        values.push_back(value(item));
    return values;
}

void write_windows(FitsWriter& writer, const Frame& frame) {
    const FrameInfo& info = frame.info;
    const std::span windows(info.windows.data(), info.window_count);
    writer.create_table("WINDOWS", windows.size(),
                        {{"X", "1J", "px"},
                         {"Y", "1J", "px"},
                         {"WIDTH", "1J", "px"},
                         {"HEIGHT", "1J", "px"},
                         {"IMAGE_Y", "1J", "px"},
                         {"REQUEST", "1J", ""},
                         {"READ", "1J", ""},
                         {"READS", "1J", ""},
                         {"T_ASKED", "1K", "ns"},
                         {"T_MIN", "1K", "ns"},
                         {"T_MAX", "1K", "ns"},
                         {"FLAGS", "1J", ""}});
    int i = 0;
    const auto add = [&](auto value) {
        writer.write_column(
            ++i, column(windows, [&](const FrameWindow& w) { return static_cast<std::int64_t>(value(w)); }));
    };
    add([](const FrameWindow& w) { return w.sensor.x; });
    add([](const FrameWindow& w) { return w.sensor.y; });
    add([](const FrameWindow& w) { return w.sensor.width; });
    add([](const FrameWindow& w) { return w.sensor.height; });
    add([](const FrameWindow& w) { return w.image_y; });
    add([](const FrameWindow& w) { return w.request; });
    add([](const FrameWindow& w) { return w.read_index; });
    add([](const FrameWindow& w) { return w.reads; });
    add([](const FrameWindow& w) { return w.exposure_requested_ns; });
    add([](const FrameWindow& w) { return w.exposure_min_ns; });
    add([](const FrameWindow& w) { return w.exposure_max_ns; });
    add([&](const FrameWindow& w) {
        return frame.window_flags(static_cast<std::size_t>(&w - info.windows.data()));
    });
}

void write_rows(FitsWriter& writer, const Frame& frame) {
    const auto rows = frame.row_times();
    writer.create_table("ROWS", rows.size(), {{"RESET", "1K", "ns"}, {"READ", "1K", "ns"}});
    writer.write_column(1, column(rows, [](const RowTime& t) { return t.reset.ns; }));
    writer.write_column(2, column(rows, [](const RowTime& t) { return t.read.ns; }));
}

void write_hits(FitsWriter& writer, const PixelTruth& truth) {
    writer.create_table("HITS", truth.hits.size(),
                        {{"TIME", "1K", "ns"},
                         {"X", "1D", "px"},
                         {"Y", "1D", "px"},
                         {"DX", "1D", "px"},
                         {"DY", "1D", "px"},
                         {"CHARGE", "1D", "electron"}});
    writer.write_column(1, column(truth.hits, [](const ParticleHit& h) { return h.time.ns; }));
    writer.write_column(2, column(truth.hits, [](const ParticleHit& h) { return h.x_px; }));
    writer.write_column(3, column(truth.hits, [](const ParticleHit& h) { return h.y_px; }));
    writer.write_column(4, column(truth.hits, [](const ParticleHit& h) { return h.dx_px; }));
    writer.write_column(5, column(truth.hits, [](const ParticleHit& h) { return h.dy_px; }));
    writer.write_column(6, column(truth.hits, [](const ParticleHit& h) { return h.charge_e; }));
}

} // namespace

std::string truth_file_name(std::uint64_t number) {
    return fmt::format("truth_{:06}.fits", number);
}

void write_truth(const std::filesystem::path& file, const Frame& frame, const Cards& more,
                 std::span<const std::int64_t> pixel_middles_ns) {
    assert(frame.pixel_truth() != nullptr);
    const PixelTruth& truth = *frame.pixel_truth();
    const FrameInfo& info = frame.info;
    const std::size_t pixels = frame.pixels().size();
    FitsWriter writer(file);
    writer.create_image(FLOAT_IMG, info.width, info.height, 1);
    writer.write({"BUNIT", std::string("electron"), "expected before any noise"});
    writer.write({"ROWORDER", std::string("TOP-DOWN"), "first row is the top of the image"});
    writer.write({"NHITS", static_cast<std::int64_t>(truth.hits.size() + truth.hits_left_out),
                  "particles while any row integrated"});
    for (const Card& card : frame_cards(frame))
        writer.write(card);
    for (const Card& card : more)
        writer.write(card);
    writer.write_pixels(TFLOAT, pixels, truth.mean_e.data());
    writer.create_image(BYTE_IMG, info.width, info.height, 1);
    writer.write({"EXTNAME", std::string("SATURATED"), "1: the charge reached full well"});
    writer.write_pixels(TBYTE, pixels, truth.saturated.data());
    if (!pixel_middles_ns.empty()) {
        writer.create_image(LONGLONG_IMG, info.width, info.height, 1);
        writer.write({"EXTNAME", std::string("TIME"), "middle of the exposure of each pixel"});
        writer.write({"BUNIT", std::string("ns"), "clock of the table ROWS"});
        writer.write_pixels(TLONGLONG, pixels, pixel_middles_ns.data());
    }
    write_windows(writer, frame);
    write_rows(writer, frame);
    write_hits(writer, truth);
    writer.commit();
}

} // namespace obscura::images

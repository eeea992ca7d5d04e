// SPDX-License-Identifier: Apache-2.0
#include "transports/file/file_sink.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/row_file.hpp"
#include "images/writers/truth_file.hpp"
#include "images/writers/truth_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <utility>

namespace obscura::transports {
namespace {

constexpr std::int64_t max_write_ns = 60 * ns_per_s;

} // namespace

FileSink::FileSink(FileSinkSettings settings)
    : settings_(std::move(settings)), queue_(settings_.queue_frames) {
    if (settings_.format == images::FrameFormat::fits || settings_.truth) images::load_fits_writer();
}

FileSink::~FileSink() {
    stop();
}

void FileSink::start() {
    if (thread_.joinable()) return;
    images::require_writable(settings_.directory);
    stopping_ = false;
    last_id_ = 0, run_ = 1, truth_run_ = 0;
    thread_ = std::thread([this] { work(); });
}

void FileSink::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wake_.notify();
    thread_.join();
    heartbeat_.rest();
}

bool FileSink::submit(const FrameRef& frame) noexcept {
    submitted_.fetch_add(1, std::memory_order_relaxed);
    if (stopping_.load(std::memory_order_relaxed) || !queue_.push(frame)) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    wake_.notify();
    return true;
}

void FileSink::work() {
    name_this_thread("file-sink");
    std::chrono::steady_clock::time_point give_up{};
    for (;;) {
        heartbeat_.beat();
        const std::uint32_t seen = wake_.value();
        const FrameRef frame = queue_.front();
        if (!frame) {
            if (stopping_) return;
            wake_.wait(seen, MonotonicClock().now() + Heartbeat::max_wait_ns);
            continue;
        }
        if (stopping_) {
            const auto now = std::chrono::steady_clock::now();
            if (give_up == std::chrono::steady_clock::time_point{})
                give_up = now + std::chrono::milliseconds(300);
            if (now > give_up)
                dropped_.fetch_add(1, std::memory_order_relaxed);
            else
                write(*frame);
        } else {
            write(*frame);
        }
        queue_.pop();
    }
}

void FileSink::write(const Frame& frame) {
    const FrameInfo& info = frame.info;
    const std::int32_t rows = frame.wait_rows(info.height, &heartbeat_);
    if (rows == 0 && info.height > 0) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return;
    }
    if (info.frame_id <= last_id_) ++run_;
    last_id_ = info.frame_id;
    images::Picture picture{info.width, info.height, info.bits_per_pixel, frame.pixels()};
    if (rows < info.height) {
        // Clear the missing rows: their part of the buffer holds an earlier frame.
        const auto valid = static_cast<std::ptrdiff_t>(rows) * info.width;
        partial_.assign(frame.pixels().begin(), frame.pixels().begin() + valid);
        partial_.resize(frame.pixels().size(), 0);
        picture.pixels = partial_;
    }
    const std::string run = run_ > 1 ? fmt::format("run{}_", run_) : std::string();
    const std::string file_name = run + images::frame_file_name(info.frame_id, settings_.format);
    // Announce the blocking write: a slow or remote disk is not a hung thread.
    heartbeat_.allow_silence_until(MonotonicClock().now() + max_write_ns);
    info.note_transmit(transmit_slot(), MonotonicClock().now());
    try {
        const std::filesystem::path directory = settings_.directory;
        const images::Cards of_camera =
            settings_.camera_cards ? settings_.camera_cards->get() : images::Cards{};
        images::Cards cards = images::frame_cards(frame);
        cards.insert(cards.end(), of_camera.begin(), of_camera.end());
        images::write_picture(directory / file_name, settings_.format, picture, cards);
        if (settings_.truth && frame.pixel_truth() != nullptr && rows == info.height)
            images::write_truth(directory / (run + images::truth_file_name(info.frame_id)), frame, of_camera);
        if (settings_.truth_table && rows == info.height)
            append_truth(directory / (run + "truth.csv"), frame);
        info.note_transmit(transmit_slot(), MonotonicClock().now());
        delivered_.fetch_add(1, std::memory_order_relaxed);
        bytes_.fetch_add(picture.pixels.size_bytes(), std::memory_order_relaxed);
        failing_ = false;
        // Here, as a remote disk may take its time.
        std::error_code unknown;
        const auto room = std::filesystem::space(directory, unknown);
        free_bytes_.store(unknown ? std::uint64_t{0} : std::uint64_t{room.available},
                          std::memory_order_relaxed);
    } catch (const std::exception& error) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        if (!failing_) log_line(LogLevel::error, error.what(), "PLACE: WHY");
        failing_ = true;
    }
}

void FileSink::append_truth(const std::filesystem::path& file, const Frame& frame) {
    const SceneTruth* const truth = frame.final_scene_truth();
    if (truth == nullptr) return;
    if (std::exchange(truth_run_, run_) != run_ || !truth_table_) {
        truth_table_ = std::make_unique<images::RowFile>(file);
        truth_table_->add(images::truth_csv_header());
    }
    truth_table_->add(images::truth_csv_lines(*truth, frame.row_times()));
    truth_table_->flush();
}

TransportStatistics FileSink::statistics() const {
    TransportStatistics s = Transport::statistics();
    if (const std::uint64_t room = free_bytes_.load(std::memory_order_relaxed); room > 0)
        s.values.push_back({"disk_free_bytes", room});
    s.texts = {{"directory", settings_.directory},
               {"trouble", failing_ ? "the latest frame could not be written: see the log" : ""}};
    return s;
}

TransportCounters FileSink::counters() const noexcept {
    return {submitted_.load(std::memory_order_relaxed), delivered_.load(std::memory_order_relaxed),
            dropped_.load(std::memory_order_relaxed), bytes_.load(std::memory_order_relaxed)};
}

} // namespace obscura::transports

// SPDX-License-Identifier: Apache-2.0
// Verb `obscura grab`: GigE Vision client that receives, measures and saves frames.
#include "core/camera/camera.hpp"
#include "core/text/printable.hpp"
#include "emulator/config/daemon_config.hpp"
#include "host/interrupt.hpp"
#include "images/writers/pending_file.hpp"
#include "images/writers/row_file.hpp"
#include "tools/check/report.hpp"
#include "tools/receive/frame_chunks.hpp"
#include "tools/receive/frame_files.hpp"
#include "tools/receive/received_camera.hpp"
#include "tools/receive/receiver.hpp"
#include "tools/scene/progress.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <thread>

namespace obscura::tools {
namespace {

/// Thread that executes TriggerSoftware at a constant rate for its lifetime. libaravis serialises register
/// accesses.
class SoftwareTrigger {
public:
    SoftwareTrigger(Receiver& receiver, double rate_hz)
        : thread_([this, &receiver, rate_hz] {
              const auto start = std::chrono::steady_clock::now();
              for (std::uint64_t k = 1; !stop_; ++k) {
                  std::this_thread::sleep_until(start + std::chrono::nanoseconds(static_cast<std::int64_t>(
                                                            1e9 * static_cast<double>(k) / rate_hz)));
                  if (stop_) return;
                  try {
                      receiver.execute("TriggerSoftware");
                  } catch (const Error& error) {
                      print_message(error.what());
                      return;
                  }
              }
          }) {}
    ~SoftwareTrigger() {
        stop_ = true;
        thread_.join();
    }
    SoftwareTrigger(const SoftwareTrigger&) = delete;
    SoftwareTrigger& operator=(const SoftwareTrigger&) = delete;

private:
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// Time stamp by the camera's clock, and arrival times in CLOCK_REALTIME, of one frame.
struct Stamps {
    std::int64_t device_ns = 0, first_packet_ns = 0, complete_ns = 0;
};

/// Count of frames lost between two received block ids. Ids count from 1 and wrap at 65535 (16-bit ids) or
/// not at all (64-bit ids).
std::uint64_t skipped(std::uint64_t previous, std::uint64_t next) {
    if (next > previous) return next - previous - 1;
    if (previous <= 0xffff && next >= 1) return 0xffff - previous + next - 1;
    return 0;
}

/// Cameras of a daemon configuration, whose lenses received frames may be of. Throws ConfigError.
std::vector<scene::Camera> lenses_of(const std::filesystem::path& configuration) {
    const emulator::DaemonConfig config = emulator::load_config(configuration);
    std::vector<scene::Camera> out;
    for (const emulator::DaemonConfig* const camera : config.cameras())
        out.push_back(camera->scene.camera);
    return out;
}

class Grab final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "receives frames from a GigE Vision camera and saves them";
        line.description =
            "Takes control of the camera, starts the acquisition, receives frames with libaravis (which requests lost packets again), and prints the counts of frames and packets, the frame rate and the latencies. "
            "A packet asked for again is lost only if the camera sent it before: of an Obscura camera, grab also prints how many it resent, how many were asked for before they were sent (rows that were late), and how many it refused. "
            "Latencies count from the camera's time stamp of the frame (with Obscura: the trigger edge). "
            "The camera's clock is compared with the client's through the time-stamp latch, so latencies are valid for a camera on another machine too. "
            "Works with any GigE Vision camera. "
            "The exit status is 1 when a frame is missing or incomplete.";
        line.option("-a,--address", &address_, "HOST", "IPv4 address or host name of the camera");
        line.number("-n,--frames", &frames_, "N", "Number of frames to receive", 1, 1e9);
        line.option("-o,--output", &output_, "DIR",
                    "Folder for the frames; created when it is missing (default: frames are not saved)");
        files_.declare(line, "With --output: also ");
        line.flag(
            "--chunks", chunks_,
            "With --output: switch the camera's chunk data on for this run (Obscura's chunks) and save the ground truth of each frame: as cards of FITS, PNG and raw files, and with windows and row times as a line of JSON in chunks.jsonl");
        line.option(
            "--intrinsics", &intrinsics_, "FILE",
            "Write camera matrix and the poses of each frame as JSON that OpenCV's FileStorage reads; "
            "switches the camera's chunk data on for this run");
        line.option(
            "--lens", &lens_, "FILE",
            "With --intrinsics: daemon configuration of the camera, whose projection and distortion the JSON file then has; "
            "frames do not carry them");
        line.number("--timeout", &timeout_s_, "S",
                    "Give up when no frame arrives for this many seconds beside its exposure", 0.01, 3600);
        line.number("--rate", &rate_hz_, "HZ",
                    "Set TriggerMode Off and AcquisitionFrameRate to this rate (0: leave as set)", 0, 10000);
        line.number("--software-trigger-rate", &software_rate_hz_, "HZ",
                    "Set TriggerSource Software and execute TriggerSoftware at this rate (0: leave as set)",
                    0, 10000);
        line.number("--exposure-us", &exposure_us_, "US",
                    "Set ExposureTime to this many microseconds (0: leave as set)", 0,
                    static_cast<double>(max_exposure_ns) / ns_per_us);
        line.number("--gain-db", &gain_db_, "DB", "Set Gain to this many decibels (-1: leave as set)", -1,
                    100);
        line.option("--pixel-format", &pixel_format_, "FORMAT",
                    "Set PixelFormat, for example Mono8 (default: leave as set)");
        line.number("--packet-size", &packet_size_, "BYTES",
                    "Set GevSCPSPacketSize (0: negotiate the largest that arrives)", 0, 65532);
        line.number("--packet-delay-ns", &packet_delay_ns_, "NS",
                    "Set the delay between packets, GevSCPD, in nanoseconds (-1: leave as set)", -1, 1e9);
        line.flag("--json", json_, "Print one JSON object instead of a table");
        line.examples = {
            "obscura grab --address 127.0.0.1 --frames 25 -o frames",
            "obscura grab -a 192.168.1.20 -n 100 --software-trigger-rate 10 --json",
            "obscura grab -a 127.0.0.1 -n 25 -o frames --format fits --chunks",
            "obscura grab -a 127.0.0.1 -n 25 -o frames --intrinsics camera.json --lens config/demo.toml",
            "obscura grab -a 127.0.0.1 -n 1 --rate 5 -o . --format fits --exposure-us 2000",
        };
    }

    int run() override {
        files_.prepare("grab");
        if (rate_hz_ > 0 && software_rate_hz_ > 0)
            throw host::UsageError("obscura grab: --rate and --software-trigger-rate exclude each other");
        if (chunks_ && output_.empty())
            throw host::UsageError("obscura grab: --chunks needs --output, the folder for chunks.jsonl");
        if (!lens_.empty() && intrinsics_.empty())
            throw host::UsageError("obscura grab: --lens needs --intrinsics");
        if (!output_.empty()) {
            images::make_writable(output_);
        }
        if (!intrinsics_.empty()) {
            const std::filesystem::path folder = std::filesystem::path(intrinsics_).parent_path();
            images::require_writable(folder.empty() ? "." : folder);
            if (!lens_.empty()) lenses_ = lenses_of(lens_);
        }
        Receiver receiver({address_, packet_size_, packet_delay_ns_, 16});
        configure(receiver);
        if (!output_.empty()) windows_ = windows_of(receiver);
        if (with_chunks()) enable_chunks(receiver);
        full_scale_ = receiver.find_integer("PixelDynamicRangeMax");
        const std::optional<ClockReading> clock_before = receiver.read_clock();
        receiver.start();
        {
            std::unique_ptr<SoftwareTrigger> trigger;
            if (software_rate_hz_ > 0)
                trigger = std::make_unique<SoftwareTrigger>(receiver, software_rate_hz_);
            receive_all(receiver);
        }
        try {
            receiver.end_stream();
            if (with_chunks()) receiver.set_flag("ChunkModeActive", false);
        } catch (const HardwareError& error) {
            print_message(error.what());
        }
        if (!camera_.frames().empty()) write_intrinsics(receiver);
        const StreamStatistics statistics = receiver.statistics();
        const std::optional<ClockReading> clock_after = receiver.read_clock();
        report(statistics, receiver.camera_statistics(statistics.asked_packets), clock_before, clock_after);
        return received_ == frames_ && incomplete_ == 0 && missing_ == 0 ? exit_ok : exit_failure;
    }

private:
    void configure(Receiver& receiver) const {
        if (!pixel_format_.empty()) receiver.set("PixelFormat", pixel_format_);
        if (exposure_us_ > 0) receiver.set("ExposureTime", exposure_us_);
        if (gain_db_ >= 0) receiver.set("Gain", gain_db_);
        if (rate_hz_ > 0) {
            receiver.set("TriggerMode", "Off");
            receiver.set("AcquisitionFrameRate", rate_hz_);
        }
        if (software_rate_hz_ > 0) {
            receiver.set("TriggerMode", "On");
            receiver.set("TriggerSource", "Software");
        }
    }

    [[nodiscard]] bool with_chunks() const { return chunks_ || !intrinsics_.empty(); }

    /// Switches all of Obscura's chunks on and opens the file for them.
    void enable_chunks(Receiver& receiver) {
        receiver.set_flag("ChunkModeActive", true);
        for (const std::string_view name : names_of_enum<Chunk>()) {
            receiver.set("ChunkSelector", name);
            receiver.set_flag("ChunkEnable", true);
        }
        // The leader of this payload type states size and pixel format of the image.
        receiver.set_flag("GevSCCFGExtendedChunkData", true);
        camera_.set_binning(
            {integer(receiver, "BinningHorizontal", 1), integer(receiver, "BinningVertical", 1)});
        if (!chunks_) return;
        const std::filesystem::path file = std::filesystem::path(output_) / "chunks.jsonl";
        truth_file_.emplace(file);
    }

    static std::int32_t integer(const Receiver& receiver, const char* feature, std::int32_t otherwise) {
        return static_cast<std::int32_t>(receiver.find_integer(feature).value_or(otherwise));
    }

    void add_to_camera(const FrameChunks& chunks, const std::string& file) {
        camera_.add(chunks, file);
        // Refuses the wrong lens at once, not after the last frame.
        if (camera_.frames().size() == 1) (void)camera_.camera(lenses_, 0, 0);
    }

    void write_intrinsics(const Receiver& receiver) const {
        write_camera_file(intrinsics_,
                          camera_.camera(lenses_, integer(receiver, "SensorWidth", 0),
                                         integer(receiver, "SensorHeight", 0)),
                          camera_.frames());
    }

    /// Windows that the camera puts one below the other into a frame; empty for a camera that does not state
    /// them.
    static std::vector<Region> windows_of(Receiver& receiver) {
        std::vector<Region> out;
        const std::optional<std::int64_t> count = receiver.find_integer("RegionsMax");
        if (!count || *count < 2) return out;
        const std::string selected = receiver.get_text("RegionSelector");
        for (std::int64_t i = 0; i < *count; ++i) {
            receiver.set("RegionSelector", fmt::format("Region{}", i));
            if (receiver.get_text("RegionMode") != "On") continue;
            out.push_back({0, integer(receiver, "RegionImageY", 0),
                           integer(receiver, "RegionObtainedWidth", 0),
                           integer(receiver, "RegionObtainedHeight", 0)});
        }
        receiver.set("RegionSelector", selected);
        return out;
    }

    void receive_all(Receiver& receiver) {
        Progress progress("grab", frames_);
        exposure_s_ = 1e-6 * receiver.find_real("ExposureTime").value_or(0);
        std::uint64_t previous = 0;
        while (received_ < frames_ && !host::interrupted()) {
            const std::optional<ReceivedFrame> frame = receive_one(receiver);
            if (!frame) {
                if (!host::interrupted())
                    print_message(fmt::format("obscura grab: no frame for {} s, {} of {} received",
                                              timeout_s_ + exposure_s_, received_, frames_));
                return;
            }
            ++received_;
            if (received_ == 1)
                // The standard numbers blocks from 1 at acquisition start; a larger first id that exceeds
                // the count of frames is taken for a camera that does not restart its ids.
                missing_ += frame->block_id > 1 && frame->block_id <= frames_ ? frame->block_id - 1 : 0;
            else
                missing_ += skipped(previous, frame->block_id);
            previous = frame->block_id;
            if (!frame->complete) {
                ++incomplete_;
            } else {
                stamps_.push_back({static_cast<std::int64_t>(frame->device_ns), frame->first_packet_ns,
                                   frame->complete_ns});
                std::optional<FrameChunks> chunks;
                if (with_chunks())
                    chunks = parse_chunks([&](std::uint32_t id) { return receiver.chunk(id); });
                const Picture picture = picture_of(*frame);
                count_saturated(picture);
                if (!output_.empty()) save(*frame, picture, chunks);
                if (!intrinsics_.empty())
                    add_to_camera(*chunks, output_.empty() ? "" : files_.name(frame->block_id));
            }
            progress.done(received_);
        }
    }

    /// Waits in short steps, so that an interrupt ends the wait.
    std::optional<ReceivedFrame> receive_one(Receiver& receiver) const {
        const auto give_up =
            std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s_ + exposure_s_);
        while (std::chrono::steady_clock::now() < give_up && !host::interrupted())
            if (auto frame = receiver.receive(std::min(0.1, timeout_s_))) return frame;
        return std::nullopt;
    }

    struct Picture {
        std::vector<std::uint16_t> values; ///< empty: the format is not known
        int bits = 16;
    };
    static Picture picture_of(const ReceivedFrame& frame) {
        Picture out;
        const std::size_t pixels =
            static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
        out.values = unpack_pixels(frame.pixel_format, pixels, frame.data, out.bits);
        return out;
    }

    void count_saturated(const Picture& picture) {
        const std::int64_t top = full_scale_.value_or((std::int64_t{1} << picture.bits) - 1);
        const auto saturated =
            static_cast<std::uint64_t>(std::count_if(picture.values.begin(), picture.values.end(),
                                                     [top](std::uint16_t value) { return value >= top; }));
        saturated_ += saturated;
        most_saturated_ = std::max(most_saturated_, saturated);
        pixels_ += picture.values.size();
    }

    /// `chunks`: those of the frame, with --chunks and --intrinsics.
    void save(const ReceivedFrame& frame, const Picture& picture, const std::optional<FrameChunks>& chunks) {
        const auto& [values, bits] = picture;
        if (values.empty())
            throw OutputError(fmt::format(
                "{}: pixel format {:#010x} cannot be saved, allowed are Mono8 to Mono16, Mono10p and Mono12p",
                output_, frame.pixel_format));
        images::Cards cards{
            {"FRAMEID", static_cast<std::int64_t>(frame.block_id), "block id"},
            {"T_DEV", static_cast<std::int64_t>(frame.device_ns), "[ns] time stamp of the camera"}};
        if (chunks_ && chunks) {
            const images::Cards more = chunk_cards(*chunks);
            cards.insert(cards.end(), more.begin(), more.end());
            truth_file_->write(chunk_json(*chunks, files_.name(frame.block_id)) + "\n");
        }
        // With binning or parts of their own the windows lie elsewhere.
        const Region image{0, 0, frame.width, frame.height};
        const bool fit =
            std::all_of(windows_.begin(), windows_.end(), [&](const Region& w) { return w.inside(image); });
        files_.save(output_, frame.block_id, {frame.width, frame.height, bits, values}, cards,
                    fit ? windows_ : std::vector<Region>{});
    }

    void report(const StreamStatistics& statistics, const std::optional<CameraStatistics>& camera,
                const std::optional<ClockReading>& before, const std::optional<ClockReading>& after) const {
        std::vector<double> to_first, to_complete;
        for (const Stamps& s : stamps_) {
            if (!before || !after) break;
            // Interpolate the clock offset linearly between the two readings, because the clocks drift.
            const double span = static_cast<double>(after->client_ns - before->client_ns);
            const double part = span > 0 ? static_cast<double>(s.complete_ns - before->client_ns) / span : 0;
            const auto offset =
                static_cast<std::int64_t>(static_cast<double>(after->offset_ns - before->offset_ns) * part) +
                before->offset_ns;
            to_first.push_back(static_cast<double>(s.first_packet_ns - s.device_ns - offset) * 1e-6);
            to_complete.push_back(static_cast<double>(s.complete_ns - s.device_ns - offset) * 1e-6);
        }
        std::optional<double> rate;
        if (stamps_.size() > 1)
            rate = static_cast<double>(stamps_.size() - 1) * 1e9 /
                   static_cast<double>(stamps_.back().complete_ns - stamps_.front().complete_ns);
        Report report;
        report.add("address", "camera", address_);
        report.add("requested", "frames requested", static_cast<std::int64_t>(frames_));
        report.add("frames", "frames", static_cast<std::int64_t>(received_ - incomplete_));
        report.add("incomplete", "incomplete", static_cast<std::int64_t>(incomplete_));
        report.add("missing", "missing", static_cast<std::int64_t>(missing_));
        report.add("fps", "fps", rate, "", 3);
        if (pixels_ > 0) {
            const double share = static_cast<double>(saturated_) / static_cast<double>(pixels_);
            report.add("saturated_pixels", "saturated pixels",
                       fmt::format("{} ({:.3g} %)", saturated_, 100 * share),
                       static_cast<double>(saturated_));
            report.add("most_saturated_pixels", "  most in a frame",
                       static_cast<std::int64_t>(most_saturated_));
        }
        report.add("trigger_to_first_packet_ms_p50", "trigger to first packet, p50", percentile(to_first, 50),
                   "ms", 3);
        report.add("trigger_to_first_packet_ms_p99", "trigger to first packet, p99", percentile(to_first, 99),
                   "ms", 3);
        report.add("trigger_to_complete_ms_p50", "trigger to complete, p50", percentile(to_complete, 50),
                   "ms", 3);
        report.add("trigger_to_complete_ms_p99", "trigger to complete, p99", percentile(to_complete, 99),
                   "ms", 3);
        report.add("clock_uncertainty_ms", "clock uncertainty",
                   before ? std::optional(static_cast<double>(before->round_trip_ns) * 0.5e-6) : std::nullopt,
                   "ms", 3);
        const auto count = [&](const char* key, const char* label, std::uint64_t value) {
            report.add(key, label, static_cast<std::int64_t>(value));
        };
        const auto of_camera = [&](const char* key, const char* label,
                                   std::uint64_t CameraStatistics::*value) {
            if (camera)
                count(key, label, (*camera).*value);
            else
                report.add(key, label, std::nullopt, "", 0);
        };
        count("missing_packets", "packets missing", statistics.missing_packets);
        count("asked_packets", "packets asked for again", statistics.asked_packets);
        of_camera("resent_packets", "  resent by the camera", &CameraStatistics::resent_packets);
        of_camera("asked_before_sent", "  asked for before they were sent",
                  &CameraStatistics::asked_before_sent);
        of_camera("refused_packets", "  refused by the camera", &CameraStatistics::refused_packets);
        count("late_packets", "packets that came after asking", statistics.late_packets);
        count("duplicate_packets", "packets repeated in silence, or resent", statistics.duplicate_packets);
        count("refusals", "answers without a packet", statistics.refusals);
        count("underruns", "client underruns", statistics.underruns);
        if (!output_.empty()) report.add("output", "saved in", output_);
        report.print(json_);
    }

    std::string address_ = "127.0.0.1", output_, pixel_format_, intrinsics_, lens_;
    std::vector<scene::Camera> lenses_; ///< of --lens
    ReceivedCamera camera_;
    FrameFiles files_;
    std::vector<Region> windows_; ///< in pixels of the frames; empty: not known
    std::uint64_t frames_ = 10;
    double timeout_s_ = 5, exposure_s_ = 0, rate_hz_ = 0, software_rate_hz_ = 0, exposure_us_ = 0,
           gain_db_ = -1;
    std::int32_t packet_size_ = 0, packet_delay_ns_ = -1;
    bool json_ = false, chunks_ = false;
    std::optional<images::RowFile> truth_file_;

    std::optional<std::int64_t> full_scale_; ///< DN, as the camera states it
    std::uint64_t received_ = 0, incomplete_ = 0, missing_ = 0;
    std::uint64_t pixels_ = 0, saturated_ = 0, most_saturated_ = 0; ///< of complete frames
    std::vector<Stamps> stamps_;
};

} // namespace

std::unique_ptr<Verb> make_grab() {
    return std::make_unique<Grab>();
}

} // namespace obscura::tools

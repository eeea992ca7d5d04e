// SPDX-License-Identifier: Apache-2.0
// Verb `obscura frame`: saves frames of a running camera.
#include "core/camera/camera.hpp"
#include "host/answer_cards.hpp"
#include "host/interrupt.hpp"
#include "images/writers/raw.hpp"
#include "tools/control/saved_frame.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <charconv>
#include <string>

namespace obscura::tools {
namespace {

class FrameVerb final : public CallingVerb {
public:
    FrameVerb() : CallingVerb("frame", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "saves frames of a running camera, beside what else it sends";
        line.description =
            "Saves the newest frame as it left the detector, with its metadata: 16-bit PNG, FITS, or raw words with a TOML file beside them; "
            "or the metadata alone as JSON. "
            "Waits for a frame if none has come yet; looking triggers none. "
            "Frames go where they always go, and a slow disk here costs the camera nothing: with --count and --follow frames that came meanwhile are skipped, and counted. "
            "Numbers are those of the converter, nearly black in most viewers.";
        line.positional(
                "WHICH", &which_,
                "latest, or the number of a frame as --json prints it: one of the latest four that anyone has looked at (default: latest)")
            .required = false;
        line.option(
                "-o,--output", &output_, "FILE",
                "File ending in .png, .fits, .raw or .json; "
                "for several frames a folder, with a slash at its end if it is new, whose files are frame_NNNNNN")
            .required = true;
        line.option("--format", &format_, "FORMAT", "With a folder: format of the files (default: png)")
            .choices = {"png", "fits", "raw", "json"};
        line.number("-n,--count", &count_, "N", "Number of frames", 1, 1e9);
        line.flag("--follow", follow_, "Save every new frame until interrupted");
        line.number("--wait", &wait_s_, "S", "Give up when no frame comes for so many seconds", 0,
                    max_frame_wait_s);
        declare_daemon(line);
        line.flag("--json", json_, "Print the metadata of each frame as one JSON object a line");
        line.examples = {"obscura frame -o now.png",
                         "obscura frame latest -o now.fits --camera 1",
                         "obscura frame -o now.json    # what is known of it, and its number",
                         "obscura frame 812 -o the-same.fits",
                         "obscura frame --count 20 -o frames/ --format fits",
                         "obscura frame --follow -o frames/ --json | jq .skipped"};
    }

    [[nodiscard]] bool runs_until_told() const override { return follow_; }

protected:
    int work() override {
        if (follow_ && count_ != 1)
            throw host::UsageError("obscura frame: --count and --follow exclude each other");
        host::CallJson fields = daemon().fields();
        fields["wait_s"] = wait_s_;
        if (which_ != "latest") fields["number"] = number();
        FrameNames names("frame", output_, format_, follow_ || count_ > 1);
        // The daemon answers when the wait is over at the latest.
        const auto calls = connect(wait_s_ + 30);
        for (std::uint64_t saved = 0; (follow_ || saved < count_) && !host::interrupted(); ++saved) {
            host::CallAnswer frame;
            try {
                frame = calls->call("frame", fields);
            } catch (const host::Interrupted&) {
                break;
            }
            fields["after"] = frame.head.at("number");
            save(frame, names);
        }
        return host::interrupted() && !follow_ ? exit_failure : exit_ok;
    }

private:
    [[nodiscard]] std::uint64_t number() const {
        std::uint64_t number = 0;
        const auto [end, error] = std::from_chars(which_.data(), which_.data() + which_.size(), number);
        if (error != std::errc{} || end != which_.data() + which_.size() || number == 0)
            throw host::UsageError(fmt::format(
                "obscura frame: {}: allowed are latest and the number of a frame, from 1 on", which_));
        if (follow_ || count_ != 1)
            throw host::UsageError("obscura frame: a number excludes --count and --follow");
        return number;
    }

    void save(host::CallAnswer& frame, FrameNames& names) const {
        const auto id = frame.head.at("frame").get<std::uint64_t>();
        const int bits = frame.head.at("bits").get<int>();
        if (frame.pixels.empty() || bits < 1 || bits > 16)
            throw HardwareError("obscura frame: the daemon's answer has no pixels of up to 16 bits");
        const std::filesystem::path file = names.next(id);
        frame.head["width"] = frame.width;
        frame.head["height"] = frame.height;
        if (names.format())
            images::write_picture(file, *names.format(), {frame.width, frame.height, bits, frame.pixels},
                                  host::cards_of_answer(frame.head));
        else
            images::write_text(
                file, frame.head.dump(2, ' ', false, host::CallJson::error_handler_t::replace) + "\n");
        if (json_) {
            frame.head["file"] = file.string();
            fmt::print("{}\n", frame.head.dump(-1, ' ', false, host::CallJson::error_handler_t::replace));
        } else {
            const auto rows = frame.head.at("rows").get<std::int64_t>();
            const auto skipped = frame.head.at("skipped").get<std::uint64_t>();
            fmt::print("{}: frame {}, {} x {}, {} bits{}{}\n", file.string(), id, frame.width, frame.height,
                       bits, rows < frame.height ? fmt::format(", only {} rows", rows) : std::string(),
                       skipped > 0 ? fmt::format(", {} skipped before it", skipped) : std::string());
        }
        std::fflush(stdout);
    }

    std::string which_ = "latest", output_, format_;
    std::uint64_t count_ = 1;
    double wait_s_ = 10;
    bool follow_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_frame() {
    return std::make_unique<FrameVerb>();
}

} // namespace obscura::tools

// SPDX-License-Identifier: Apache-2.0
// Verb `obscura truth`: the ground truth that a frame file carries, joined to a truth table.
#include "core/io/path_state.hpp"
#include "images/readers/header_cards.hpp"
#include "images/readers/truth_table_reader.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {
namespace {

using images::HeaderCard;
using images::TruthLines;
using Json = nlohmann::ordered_json;

/// Keys of the truth in headers (docs/images.md); a name that ends in * begins with the rest.
constexpr std::array<std::string_view, 25> truth_keys{
    "FRAMEID", "TRIGID", "T_EDGE", "T_MID",   "TAIOFF",  "CLKSTATE", "EXPOSURE", "GAIN", "SEED",
    "RUN",     "LATE",   "NOLAG",  "PARTIAL", "FX",      "FY",       "CX",       "CY",   "OFFSETX",
    "OFFSETY", "SUN_*",  "CAM_*",  "BODY*",   "WINDOW*", "TIME",     "QUATCONV"};

bool is_truth(std::string_view key) {
    const auto named = [&](std::string_view name) {
        return name.back() == '*' ? key.starts_with(name.substr(0, name.size() - 1)) : key == name;
    };
    // Poses of bodies: B0_X, B12_QW.
    const std::size_t digits = key.find_first_not_of("0123456789", 1);
    const bool body = key.size() > 3 && key[0] == 'B' && digits != std::string_view::npos && digits > 1 &&
                      key[digits] == '_';
    return body || std::any_of(truth_keys.begin(), truth_keys.end(), named);
}

/// A value as JSON: a number or a flag where it is one.
Json value_of(const std::string& text) {
    if (text == "true" || text == "false") return text == "true";
    if (text.empty()) return nullptr;
    std::int64_t whole = 0;
    const char* const end = text.data() + text.size();
    if (const auto [at, error] = std::from_chars(text.data(), end, whole); error == std::errc{} && at == end)
        return whole;
    double real = 0;
    if (const auto [at, error] = std::from_chars(text.data(), end, real); error == std::errc{} && at == end)
        return std::isfinite(real) ? Json(real) : Json(text);
    return text;
}

/// Columns of the table for people, and their decimals; the others are in --csv and --json.
struct ShownColumn {
    std::string_view name, title;
    int decimals = -1; ///< -1: as it is; -2: 4 digits
};
constexpr std::array shown{ShownColumn{"kind", "kind"},           ShownColumn{"name", "name"},
                           ShownColumn{"object", "object"},       ShownColumn{"item", "item"},
                           ShownColumn{"x_px", "x px", 4},        ShownColumn{"y_px", "y px", 4},
                           ShownColumn{"visibility", "seen"},     ShownColumn{"magnitude_v", "V", 2},
                           ShownColumn{"range_m", "range m", -2}, ShownColumn{"signal_e", "signal e-", -2},
                           ShownColumn{"peak_e", "peak e-", -2},  ShownColumn{"snr", "SNR", -2}};

std::string shown_text(const ShownColumn& column, const std::string& text) {
    double value = 0;
    const char* const end = text.data() + text.size();
    if (column.decimals == -1 || text.empty()) return text;
    if (const auto [at, error] = std::from_chars(text.data(), end, value); error != std::errc{} || at != end)
        return text;
    return column.decimals >= 0 ? fmt::format("{:.{}f}", value, column.decimals)
                                : fmt::format("{:.5g}", value);
}

class Truth final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "prints the ground truth of a frame: its header, and where things are in its pixels";
        line.description =
            "Prints what the file of a frame says of the truth: ids, times, poses of camera and bodies, the Sun. "
            "If there is a truth table for it (obscura capture --truth-table, obscura render --truth-table), also where every star, body, landmark, limb, terminator, crater and boulder is in its pixels, with expected electrons and visibility: the lines of the frame's number. "
            "The table is that of --table, or truth.csv or truth.fits in the frame's folder (run2_truth.csv of run2_frame_000001.png). "
            "FRAME may be a truth table itself. Columns, units and conventions: docs/truth.md.";
        line.positional("FRAME", &frame_file_,
                        "Frame (FITS, OpenEXR, PNG, raw with its .toml), or a truth table (.csv, .fits)");
        line.option("-t,--table", &table_file_, "FILE", "Truth table that has the frame: .csv or .fits");
        line.number("--frame", &frame_, "N",
                    "Number of the frame in the table (default: the file's FRAMEID; of a table: all frames)",
                    1, 9e15);
        line.option("--kind", &kind_, "KIND", "Only entries of this kind").choices = {
            "star", "body", "landmark", "limb", "terminator", "galaxy"};
        line.flag("--all", all_, "Also list the points of limbs and terminators, and what is outside");
        line.flag("--csv", csv_, "Print the entries of the table, all columns, as CSV");
        line.flag("--json", json_, "Print one JSON object: header and entries");
        line.examples = {
            "obscura truth frames/frame_000001.fits",
            "obscura truth frames/frame_000003.png --table frames/truth.csv --kind star",
            "obscura truth frames/truth.fits --frame 3 --json",
        };
    }

    int run() override {
        if (csv_ && json_) throw host::UsageError("obscura truth: --csv and --json exclude each other");
        const std::filesystem::path file(frame_file_);
        std::string number = frame_ > 0 ? fmt::format("{}", frame_) : "";
        std::vector<HeaderCard> cards;
        TruthLines table;
        if (images::is_truth_table(file)) {
            if (!table_file_.empty())
                throw host::UsageError(
                    fmt::format("obscura truth: --table with {}, which is a table itself", frame_file_));
            table = images::read_truth_table(file, number);
        } else {
            cards = images::read_header_cards(file);
            if (number.empty())
                for (const HeaderCard& card : cards)
                    if (card.key == "FRAMEID") number = card.value;
            if (const std::filesystem::path of_frame = table_of(file); !of_frame.empty()) {
                if (number.empty())
                    throw host::UsageError(
                        fmt::format("obscura truth: {} has no FRAMEID: --frame N selects its entries in {}",
                                    frame_file_, of_frame.string()));
                table = images::read_truth_table(of_frame, number);
            }
        }
        choose(table);
        if (json_)
            print_json(cards, table);
        else if (csv_)
            print_csv(table);
        else
            print_text(cards, table);
        return exit_ok;
    }

private:
    [[nodiscard]] std::filesystem::path table_of(const std::filesystem::path& frame) const {
        if (!table_file_.empty()) return table_file_;
        // Frames of a daemon's later acquisitions begin with run2_ and so on.
        const std::string file = frame.filename().string();
        const std::size_t digits = file.starts_with("run") ? file.find_first_not_of("0123456789", 3) : 0;
        const std::string run = digits > 3 && digits < file.size() && file[digits] == '_'
                                    ? file.substr(0, digits + 1)
                                    : std::string();
        for (const char* name : {"truth.csv", "truth.fits"})
            if (const auto beside = frame.parent_path() / (run + name); path_exists(beside)) return beside;
        return {};
    }

    /// Keeps the entries that the options ask for.
    void choose(TruthLines& table) const {
        const std::size_t kind = table.column("kind"), visibility = table.column("visibility");
        const bool whole = csv_ || json_ || all_;
        std::erase_if(table.lines, [&](const std::vector<std::string>& line) {
            const auto is = [&](std::size_t column, std::string_view text) {
                return column < line.size() && line[column] == text;
            };
            if (!kind_.empty()) return !is(kind, kind_);
            return !whole && (is(kind, "limb") || is(kind, "terminator") || is(visibility, "outside"));
        });
    }

    static void print_text(const std::vector<HeaderCard>& cards, const TruthLines& table) {
        for (const HeaderCard& card : cards)
            if (is_truth(card.key)) fmt::print("{:<9} {:>24}  {}\n", card.key, card.value, card.comment);
        if (table.lines.empty()) return;
        if (!cards.empty()) fmt::print("\n");
        struct Cells {
            std::string title;
            std::vector<std::string> texts;
            std::size_t width = 0;
            bool left = false;
        };
        std::vector<Cells> columns;
        for (const ShownColumn& column : shown) {
            const std::size_t index = table.column(column.name);
            if (index == table.columns.size()) continue;
            Cells cells{std::string(column.title), {}, column.title.size(), column.decimals == -1};
            bool any = false;
            for (const std::vector<std::string>& line : table.lines) {
                cells.texts.push_back(shown_text(column, line[index]));
                cells.width = std::max(cells.width, cells.texts.back().size());
                any = any || !cells.texts.back().empty();
            }
            if (any) columns.push_back(std::move(cells));
        }
        const auto print = [&](const auto& text_of) {
            std::string line;
            for (const Cells& c : columns)
                line += c.left ? fmt::format("{:<{}}  ", text_of(c), c.width)
                               : fmt::format("{:>{}}  ", text_of(c), c.width);
            fmt::print("{}\n", line.substr(0, line.find_last_not_of(' ') + 1));
        };
        print([](const Cells& c) { return c.title; });
        for (std::size_t i = 0; i < table.lines.size(); ++i)
            print([i](const Cells& c) { return c.texts[i]; });
    }

    static void print_csv(const TruthLines& table) {
        fmt::print("{}\n", fmt::join(table.columns, ","));
        for (const std::vector<std::string>& line : table.lines)
            fmt::print("{}\n", fmt::join(line, ","));
    }

    static void print_json(const std::vector<HeaderCard>& cards, const TruthLines& table) {
        Json out{{"header", Json::object()}, {"entries", Json::array()}};
        for (const HeaderCard& card : cards)
            if (is_truth(card.key)) out["header"][card.key] = value_of(card.value);
        for (const std::vector<std::string>& line : table.lines) {
            Json entry = Json::object();
            for (std::size_t c = 0; c < line.size(); ++c)
                entry[table.columns[c]] = table.columns[c] == "name" ? Json(line[c]) : value_of(line[c]);
            out["entries"].push_back(std::move(entry));
        }
        fmt::print("{}\n", out.dump(-1, ' ', false, Json::error_handler_t::replace));
    }

    std::string frame_file_, table_file_, kind_;
    std::uint64_t frame_ = 0;
    bool all_ = false, csv_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_truth() {
    return std::make_unique<Truth>();
}

} // namespace obscura::tools

// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/trajectories/kvn.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/io/text_file.hpp"
#include "core/text/number.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace obscura::ephemeris {
namespace {

constexpr std::size_t max_message_bytes = std::size_t{512} << 20;

bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\r';
}

std::string_view trimmed_value(std::string_view text) {
    while (!text.empty() && is_space(text.front()))
        text.remove_prefix(1);
    while (!text.empty() && is_space(text.back()))
        text.remove_suffix(1);
    return text;
}

std::string capitals(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(),
                   [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
    return out;
}

/// Names of frames among them are the file's own.
std::string words(std::span<const std::string_view> all) {
    std::string out;
    for (const std::string_view word : all)
        out += (out.empty() ? "" : ", ") + shown(word);
    return out;
}

/// Reads a time of `scale`, without any other scale in it.
Epoch time_of(std::string_view text, TimeScale scale, const LeapSeconds& leap_seconds) {
    if (scale != TimeScale::utc && !text.empty() && (text.back() == 'Z' || text.back() == 'z'))
        throw TimeTextError(text, text.size() - 1,
                            fmt::format("Z is of UTC, TIME_SYSTEM is {}", name_of(scale)));
    return read_time(text, leap_seconds, scale);
}

} // namespace

std::string shown(std::string_view text) {
    return printable(text, 40);
}

KvnReader::KvnReader(const std::string& text, std::string name, std::string_view root)
    : name_(std::move(name)), text_(text) {
    if (!is_xml(text)) return;
    converted_ = kvn_of_xml(text, name_, root);
    text_ = converted_.text;
}

void KvnReader::fail(std::size_t line, std::string_view what) const {
    throw ConfigError(fmt::format("{}:{}: {}", name_, line, what));
}

bool KvnReader::next(KvnLine& line) {
    while (at_ < text_.size()) {
        const std::size_t end = std::min(text_.find('\n', at_), text_.size());
        const std::string_view text = trimmed_value(text_.substr(at_, end - at_));
        at_ = end + 1;
        number_ = index_ < converted_.lines.size() ? converted_.lines[index_] : index_ + 1;
        ++index_;
        if (text.empty() || text == "COMMENT" || text.starts_with("COMMENT ")) continue;
        line = {.number = number_, .value = text};
        if (const std::size_t equals = text.find('='); equals != std::string_view::npos) {
            line.keyword = trimmed_value(text.substr(0, equals));
            line.value = trimmed_value(text.substr(equals + 1));
            line.has_value = true;
        } else if (text.find_first_of(" \t") == std::string_view::npos && text.front() >= 'A' &&
                   text.front() <= 'Z') {
            line.keyword = text;
            line.value = {};
        }
        return true;
    }
    return false;
}

std::string read_message(const std::filesystem::path& file) {
    std::string text;
    if (const std::string why = read_plain_text(file, max_message_bytes, text); !why.empty())
        throw ConfigError(fmt::format("{}: cannot be read: {}", file.string(), why));
    return text;
}

KvnBlock::KvnBlock(KvnReader& reader, std::string_view end, std::span<const std::string_view> allowed)
    : reader_(reader) {
    KvnLine line;
    while (reader.next(line)) {
        if (!line.has_value) {
            if (line.keyword == end) {
                end_line_ = line.number;
                return;
            }
            reader.fail(line.number,
                        fmt::format("\"{}\" before {}, allowed is keyword = value",
                                    shown(line.keyword.empty() ? line.value : line.keyword), end));
        }
        if (std::find(allowed.begin(), allowed.end(), line.keyword) == allowed.end())
            reader.fail(line.number, fmt::format("keyword \"{}\", allowed before {} are {}",
                                                 shown(line.keyword), end, words(allowed)));
        if (!values_.emplace(line.keyword, Entry{std::string(line.value), line.number}).second)
            reader.fail(line.number, fmt::format("{} is given twice", line.keyword));
    }
    reader.fail(reader.line(), fmt::format("ends before {}", end));
}

const std::string& KvnBlock::required(std::string_view keyword) const {
    const auto at = values_.find(keyword);
    if (at == values_.end() || at->second.value.empty()) fail(keyword, "is missing");
    return at->second.value;
}

std::string KvnBlock::name(std::string_view keyword) const {
    return capitals(required(keyword));
}

namespace {

/// allowed_words() of words that may come from the file, too.
std::string shown_words(const std::string& word, std::span<const std::string_view> allowed) {
    std::vector<std::string> texts;
    for (const std::string_view one : allowed)
        texts.push_back(shown(one));
    return allowed_words(word, {texts.begin(), texts.end()});
}

} // namespace

std::string KvnBlock::choice(std::string_view keyword, std::span<const std::string_view> allowed) const {
    const std::string word = capitals(required(keyword));
    if (std::find(allowed.begin(), allowed.end(), word) == allowed.end())
        fail(keyword, fmt::format("\"{}\", {}", shown(word), shown_words(word, allowed)));
    return word;
}

void KvnBlock::fail(std::string_view keyword, std::string_view what) const {
    const auto at = values_.find(keyword);
    reader_.fail(at == values_.end() ? end_line_ : at->second.line, fmt::format("{}: {}", keyword, what));
}

Epoch KvnBlock::time(std::string_view keyword, TimeScale scale, const LeapSeconds& leap_seconds) const {
    try {
        return time_of(required(keyword), scale, leap_seconds);
    } catch (const TimeTextError& error) {
        fail(keyword, error.what());
    }
}

void read_header(KvnReader& reader, std::string_view keyword, std::span<const std::string_view> versions) {
    KvnLine line;
    if (!reader.next(line) || line.keyword != keyword)
        reader.fail(std::max<std::size_t>(reader.line(), 1),
                    fmt::format("the first line is not \"{} = ...\"", keyword));
    const std::string_view number = line.value.substr(0, line.value.find('.'));
    if (std::find(versions.begin(), versions.end(), number) == versions.end())
        reader.fail(line.number, fmt::format("{}: version \"{}\", allowed {}", keyword, shown(line.value),
                                             words(versions)));
    constexpr std::array<std::string_view, 4> allowed{"CLASSIFICATION", "CREATION_DATE", "ORIGINATOR",
                                                      "MESSAGE_ID"};
    (void)KvnBlock(reader, "META_START", allowed);
}

TimeScale time_scale_of(const KvnBlock& block) {
    constexpr std::array<std::string_view, 5> scales{"UTC", "TAI", "TT", "TDB", "GPS"};
    return *enum_named<TimeScale>(block.choice("TIME_SYSTEM", scales));
}

KvnSpan span_of(const KvnBlock& block, TimeScale scale, const LeapSeconds& leap_seconds) {
    KvnSpan span;
    span.start = span.useable_start = block.time("START_TIME", scale, leap_seconds);
    span.stop = span.useable_stop = block.time("STOP_TIME", scale, leap_seconds);
    if (span.stop < span.start) block.fail("STOP_TIME", "is before START_TIME");
    if (block.has("USEABLE_START_TIME"))
        span.useable_start = block.time("USEABLE_START_TIME", scale, leap_seconds);
    if (block.has("USEABLE_STOP_TIME"))
        span.useable_stop = block.time("USEABLE_STOP_TIME", scale, leap_seconds);
    if (span.useable_start < span.start || span.useable_start > span.stop)
        block.fail("USEABLE_START_TIME", "is not between START_TIME and STOP_TIME");
    if (span.useable_stop > span.stop || span.useable_stop < span.useable_start)
        block.fail("USEABLE_STOP_TIME", "is not between the useable start and STOP_TIME");
    return span;
}

KvnSample sample_of(const KvnReader& reader, const KvnLine& line, TimeScale scale,
                    const LeapSeconds& leap_seconds, const KvnSpan& span, const Epoch* last) {
    std::string_view rest = line.value;
    const auto word = [&] {
        rest = trimmed_value(rest);
        const std::size_t end = std::min(rest.find_first_of(" \t"), rest.size());
        const std::string_view found = rest.substr(0, end);
        rest.remove_prefix(end);
        return found;
    };
    KvnSample sample;
    const std::string_view time = word();
    try {
        sample.epoch = time_of(time, scale, leap_seconds);
    } catch (const TimeTextError& error) {
        reader.fail(line.number, error.what());
    }
    if (last != nullptr && sample.epoch <= *last)
        reader.fail(line.number, fmt::format("{} does not come after the sample before", shown(time)));
    if (sample.epoch < span.start || sample.epoch > span.stop)
        reader.fail(line.number, fmt::format("{} is not between START_TIME and STOP_TIME", shown(time)));
    for (std::string_view text = word(); !text.empty(); text = word()) {
        const std::optional<double> number = decimal_number(text);
        if (!number) reader.fail(line.number, fmt::format("\"{}\" is no finite number", shown(text)));
        sample.numbers.push_back(*number);
    }
    return sample;
}

void finish_segment(const KvnReader& reader, std::size_t line, const KvnSpan& span, PathSegment& segment) {
    if (segment.epochs.empty()) reader.fail(line, "the segment has no samples");
    // What is useable must lie between samples: beyond them nothing is interpolated.
    segment.start = std::max(span.useable_start, segment.epochs.front());
    segment.stop = std::min(span.useable_stop, segment.epochs.back());
    if (segment.stop < segment.start)
        reader.fail(line, "the segment has no samples within its useable times");
}

void append_segment(const KvnReader& reader, std::size_t line, PathFile& file, const PathFrames& frames,
                    PathSegment segment) {
    if (file.segments.empty())
        file.frames = frames;
    else if (frames.object != file.frames.object || frames.centre != file.frames.centre ||
             frames.frame != file.frames.frame || frames.of_frame != file.frames.of_frame)
        reader.fail(
            line,
            "the segment has another object, centre or frame than the first, allowed is one of each in a file");
    else if (segment.start < file.segments.back().stop)
        reader.fail(line, "the segment begins before the one before it ends");
    file.segments.push_back(std::move(segment));
}

std::uint32_t degree_of(const KvnBlock& block, std::string_view keyword, std::uint32_t otherwise) {
    if (!block.has(keyword)) return otherwise;
    const std::string& text = block.required(keyword);
    const std::int64_t degree = whole_number(text).value_or(0);
    if (degree < 1 || degree > std::int64_t{max_degree})
        block.fail(keyword, fmt::format("\"{}\", allowed 1 to {}", shown(text), max_degree));
    return static_cast<std::uint32_t>(degree);
}

} // namespace obscura::ephemeris

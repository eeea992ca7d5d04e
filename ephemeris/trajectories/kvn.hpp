// SPDX-License-Identifier: Apache-2.0
// CCSDS keyword = value notation (KVN): lines, metadata blocks and what navigation messages have in common.
#pragma once

#include "ephemeris/time/time_text.hpp"
#include "ephemeris/trajectories/ndm_xml.hpp"
#include "ephemeris/trajectories/path_segment.hpp"

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::ephemeris {

/// A line that is neither empty nor a comment.
struct KvnLine {
    std::size_t number = 0;     ///< from 1
    std::string_view keyword{}; ///< of `keyword = value`, or a word alone like META_START; empty: data
    std::string_view value{};   ///< after "="; of data the whole line
    bool has_value = false;     ///< there was "="
};

/// Lines of a message.
class KvnReader {
public:
    /// `text`, which must outlive the reader, is KVN or the XML of a `root` ("oem", "aem"). Throws
    /// ConfigError for XML that holds no such message.
    KvnReader(const std::string& text, std::string name, std::string_view root);

    /// The next line; false: the end.
    bool next(KvnLine& line);
    /// Throws ConfigError `name:line: what`.
    [[noreturn]] void fail(std::size_t line, std::string_view what) const;
    [[nodiscard]] std::size_t line() const noexcept { return number_; }

private:
    std::string name_;
    KvnText converted_; ///< of XML
    std::string_view text_;
    std::size_t at_ = 0, index_ = 0, number_ = 0;
};

/// `text` for messages: short, without control characters.
[[nodiscard]] std::string shown(std::string_view text);

/// Text of a file of at most 512 MiB. Throws ConfigError.
[[nodiscard]] std::string read_message(const std::filesystem::path& file);

/// Keywords of a metadata block with their lines.
class KvnBlock {
public:
    /// Reads up to `end`, which the reader has not passed. Keywords other than `allowed` are refused.
    KvnBlock(KvnReader& reader, std::string_view end, std::span<const std::string_view> allowed);

    [[nodiscard]] bool has(std::string_view keyword) const { return values_.contains(std::string(keyword)); }
    /// The value; refused if it is missing or empty.
    [[nodiscard]] const std::string& required(std::string_view keyword) const;
    /// As required(), in capitals: names of frames are written in either case.
    [[nodiscard]] std::string name(std::string_view keyword) const;
    /// The value in capitals, which must be one of `allowed`.
    [[nodiscard]] std::string choice(std::string_view keyword,
                                     std::span<const std::string_view> allowed) const;
    [[noreturn]] void fail(std::string_view keyword, std::string_view what) const;
    [[nodiscard]] Epoch time(std::string_view keyword, TimeScale scale,
                             const LeapSeconds& leap_seconds) const;

private:
    struct Entry {
        std::string value;
        std::size_t line = 0;
    };
    const KvnReader& reader_;
    std::size_t end_line_ = 0;
    std::map<std::string, Entry, std::less<>> values_;
};

/// Reads the version line `keyword = N.N`, whose N before the point must be one of `versions`, and the header
/// up to the first META_START.
void read_header(KvnReader& reader, std::string_view keyword, std::span<const std::string_view> versions);

/// TIME_SYSTEM of a block. Others than UTC, TAI, TT, TDB and GPS are refused by name.
[[nodiscard]] TimeScale time_scale_of(const KvnBlock& block);

/// The span in which a segment may be interpolated, and the one of its samples.
struct KvnSpan {
    Epoch start, stop, useable_start, useable_stop;
};
[[nodiscard]] KvnSpan span_of(const KvnBlock& block, TimeScale scale, const LeapSeconds& leap_seconds);

/// Epoch and numbers of a data line. The epoch must come after that of the sample before, `last`, if any, and
/// be within `span`. Throws ConfigError `name:line: what`.
struct KvnSample {
    Epoch epoch;
    std::vector<double> numbers{};
};
[[nodiscard]] KvnSample sample_of(const KvnReader& reader, const KvnLine& line, TimeScale scale,
                                  const LeapSeconds& leap_seconds, const KvnSpan& span, const Epoch* last);

/// Epoch of the sample read last; null: none.
[[nodiscard]] inline const Epoch* last_epoch(const PathSegment& segment) {
    return segment.epochs.empty() ? nullptr : &segment.epochs.back();
}

/// Checks that there are samples at both ends of the useable span and sets it; `line` is for messages.
void finish_segment(const KvnReader& reader, std::size_t line, const KvnSpan& span, PathSegment& segment);
/// Checks the order of the segments and that all are in the frames of the first.
void append_segment(const KvnReader& reader, std::size_t line, PathFile& file, const PathFrames& frames,
                    PathSegment segment);

/// Degree of the polynomials in `keyword`, or `otherwise` if there is none.
[[nodiscard]] std::uint32_t degree_of(const KvnBlock& block, std::string_view keyword,
                                      std::uint32_t otherwise);

} // namespace obscura::ephemeris

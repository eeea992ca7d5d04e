// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/obj.hpp"

#include "core/error.hpp"
#include "core/text/number.hpp"
#include "renderer/mesh_files/coordinate.hpp"
#include "renderer/mesh_files/text_lines.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::renderer {
namespace {

/// Splits a line into words, from the left.
class ObjWords {
public:
    explicit ObjWords(std::string_view line) : rest_(line) {}

    std::string_view next() {
        const auto begin = rest_.find_first_not_of(" \t\r");
        if (begin == std::string_view::npos) return rest_ = {};
        const auto end = std::min(rest_.find_first_of(" \t\r", begin), rest_.size());
        const std::string_view word = rest_.substr(begin, end - begin);
        rest_.remove_prefix(end);
        return word;
    }

private:
    std::string_view rest_;
};

class ObjParser {
public:
    ObjParser(const std::string& name, double metres_per_unit) : name_(name), scale_(metres_per_unit) {}

    void line(std::string_view text) {
        ++line_;
        // A backslash at the end continues the line.
        if (text.ends_with('\\')) {
            text.remove_suffix(1);
            (continued_ += text) += ' ';
            return;
        }
        if (continued_.empty()) {
            whole_line(text);
            return;
        }
        continued_ += text;
        whole_line(continued_);
        continued_.clear();
    }

    TriangleMesh finish() {
        if (!continued_.empty()) whole_line(continued_);
        validate(mesh_, name_);
        return std::move(mesh_);
    }

private:
    void whole_line(std::string_view text) {
        ObjWords words(text.substr(0, text.find('#')));
        const std::string_view keyword = words.next();
        if (keyword == "v")
            vertex(words);
        else if (keyword == "f")
            face(words);
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}:{}: {}", name_, line_, what));
    }

    void vertex(ObjWords& words) {
        float xyz[3];
        for (float& value : xyz) {
            const std::string_view word = words.next();
            if (word.empty()) fail("vertex with fewer than three coordinates");
            if (const std::string why = read_coordinate(word, scale_, value); !why.empty()) fail(why);
        }
        mesh_.vertices.push_back({xyz[0], xyz[1], xyz[2]});
    }

    void face(ObjWords& words) {
        corners_.clear();
        for (std::string_view word = words.next(); !word.empty(); word = words.next())
            corners_.push_back(corner(word));
        if (corners_.size() < 3) fail(fmt::format("face with {} vertices: at least 3", corners_.size()));
        for (std::size_t i = 2; i < corners_.size(); ++i)
            mesh_.triangles.push_back({corners_[0], corners_[i - 1], corners_[i]});
    }

    std::uint32_t corner(std::string_view word) {
        const std::string_view number = word.substr(0, word.find('/'));
        const std::optional<std::int64_t> given = whole_number(number);
        const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
        if (!given) fail(fmt::format("'{}' is not a vertex index", word));
        std::int64_t index = *given;
        if (index < 0) index += count + 1;
        // OBJ lets a face refer to a vertex of a later line, but no writer does so, and strictness finds
        // typing errors where they are.
        if (index < 1 || index > count)
            fail(fmt::format("vertex index {} out of range: allowed 1 to {}", number, count));
        return static_cast<std::uint32_t>(index - 1);
    }

    const std::string& name_;
    double scale_;
    std::size_t line_ = 0;
    std::string continued_; ///< lines so far that a backslash continues
    TriangleMesh mesh_;
    std::vector<std::uint32_t> corners_;
};

} // namespace

TriangleMesh parse_obj(std::string_view text, const std::string& name, double metres_per_unit) {
    ObjParser parser(name, metres_per_unit);
    while (!text.empty())
        parser.line(take_line(text));
    return parser.finish();
}

} // namespace obscura::renderer

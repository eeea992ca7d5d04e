// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/plate.hpp"

#include "core/error.hpp"
#include "core/text/number.hpp"
#include "renderer/mesh_files/coordinate.hpp"
#include "renderer/mesh_files/text_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace obscura::renderer {
namespace {

std::vector<std::string_view> words_of(std::string_view line) {
    std::vector<std::string_view> words;
    constexpr std::string_view blanks = " \t\r,";
    for (std::size_t at = line.find_first_not_of(blanks); at != std::string_view::npos;) {
        const std::size_t end = std::min(line.find_first_of(blanks, at), line.size());
        words.push_back(line.substr(at, end - at));
        at = line.find_first_not_of(blanks, end);
    }
    return words;
}

class PlateParser {
public:
    PlateParser(const std::string& name, double metres_per_unit) : name_(name), scale_(metres_per_unit) {}

    void line(std::string_view text) {
        ++line_;
        const std::vector<std::string_view> words = words_of(text);
        if (words.empty()) return;
        if (layout_ == Layout::unknown)
            layout_ = words[0] == "v" || words[0] == "f" ? Layout::letters : Layout::tables;
        if (layout_ == Layout::letters)
            letters(words);
        else
            tables(words);
    }

    TriangleMesh finish() {
        if (layout_ == Layout::tables && vertices_left_ + plates_left_ > 0)
            throw InputError(fmt::format("{}: ends with {} vertices and {} plates missing", name_,
                                         vertices_left_, plates_left_));
        const bool from_zero = std::any_of(plates_.begin(), plates_.end(), [](const Plate& p) {
            return *std::min_element(p.corners.begin(), p.corners.end()) == 0;
        });
        const std::int64_t first = from_zero ? 0 : 1;
        const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
        for (const Plate& plate : plates_) {
            std::array<std::uint32_t, 3> triangle{};
            for (std::size_t k = 0; k < 3; ++k) {
                const std::int64_t index = plate.corners[k] - first;
                if (index < 0 || index >= count) {
                    line_ = plate.line;
                    fail(fmt::format("vertex {} out of range: allowed {} to {}", plate.corners[k], first,
                                     count - 1 + first));
                }
                triangle[k] = static_cast<std::uint32_t>(index);
            }
            mesh_.triangles.push_back(triangle);
        }
        validate(mesh_, name_);
        return std::move(mesh_);
    }

private:
    enum class Layout { unknown, letters, tables };
    struct Plate {
        std::array<std::int64_t, 3> corners;
        std::size_t line;
    };

    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}:{}: {}", name_, line_, what));
    }

    void letters(const std::vector<std::string_view>& words) {
        if (words.size() != 4 || (words[0] != "v" && words[0] != "f"))
            fail("neither a vertex 'v x y z' nor a plate 'f a b c'");
        words[0] == "v" ? vertex(words) : plate(words);
    }

    void tables(const std::vector<std::string_view>& words) {
        if (vertices_left_ == 0 && plates_left_ == 0) {
            if (counts_ == 2) fail("text after the last plate");
            if (words.size() > 2)
                fail(fmt::format("the number of {} is wanted", counts_ == 0 ? "vertices" : "plates"));
            for (const std::string_view word : words) {
                const std::int64_t n = integer(word);
                // No model is larger: bound the memory that a hostile count can request.
                if (counts_ == 2 || n < 1 || n > 200'000'000)
                    fail(fmt::format("'{}' {}: allowed 1 to 200000000", word,
                                     counts_ == 0 ? "vertices" : "plates"));
                (counts_ == 0 ? vertices_left_ : plates_left_) = n;
                ++counts_;
            }
            return;
        }
        const bool vertices = vertices_left_ > 0;
        // Tables of DAMIT have no numbers of their own.
        if (words.size() != 3 && words.size() != 4)
            fail(fmt::format("{} numbers: a {} has three, or its own and three more", words.size(),
                             vertices ? "vertex" : "plate"));
        vertices ? vertex(words) : plate(words);
        --(vertices ? vertices_left_ : plates_left_);
    }

    void vertex(const std::vector<std::string_view>& words) {
        float xyz[3];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::string_view word = words[words.size() - 3 + k];
            if (const std::string why = read_coordinate(word, scale_, xyz[k]); !why.empty()) fail(why);
        }
        mesh_.vertices.push_back({xyz[0], xyz[1], xyz[2]});
    }

    void plate(const std::vector<std::string_view>& words) {
        const std::size_t first = words.size() - 3;
        plates_.push_back(
            {{vertex_number(words[first]), vertex_number(words[first + 1]), vertex_number(words[first + 2])},
             line_});
    }

    std::int64_t vertex_number(std::string_view word) const {
        const std::int64_t number = integer(word);
        if (number < 0) fail(fmt::format("vertex {} out of range: allowed are numbers from 0 up", number));
        return number;
    }

    std::int64_t integer(std::string_view word) const {
        const std::optional<std::int64_t> value = whole_number(word);
        if (!value) fail(fmt::format("'{}' is not a whole number", word.substr(0, 40)));
        return *value;
    }

    const std::string& name_;
    double scale_;
    Layout layout_ = Layout::unknown;
    std::size_t line_ = 0;
    int counts_ = 0;
    std::int64_t vertices_left_ = 0, plates_left_ = 0;
    std::vector<Plate> plates_;
    TriangleMesh mesh_;
};

} // namespace

TriangleMesh parse_plates(std::string_view text, const std::string& name, double metres_per_unit) {
    PlateParser parser(name, metres_per_unit);
    while (!text.empty())
        parser.line(take_line(text));
    return parser.finish();
}

} // namespace obscura::renderer

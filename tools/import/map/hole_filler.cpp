// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/hole_filler.hpp"

#include "core/error.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>

namespace obscura::tools {
namespace {

using Weighted = HoleFiller::Weighted;
constexpr std::array<double, 5> kernel{1. / 16, 4. / 16, 6. / 16, 4. / 16, 1. / 16};
constexpr std::size_t cached_rows = 6;
/// Numbers of the rows that are read at once.
constexpr std::int64_t strip_samples = std::int64_t{4} << 20;

std::int64_t halved_grid(std::int64_t size) {
    return (size + 1) / 2;
}

FileDescriptor scratch_file(const std::filesystem::path& folder) {
    FileDescriptor file(open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
    if (!file) {
        // File systems without O_TMPFILE.
        std::string name = (folder / ".obscura_import_XXXXXX").string();
        file = FileDescriptor(mkostemp(name.data(), O_CLOEXEC));
        if (file) unlink(name.c_str());
    }
    if (!file)
        throw OutputError(
            fmt::format("{}: no file can be made in it: {}", folder.string(), std::strerror(errno)), errno);
    return file;
}

} // namespace

/// Makes the rows of a level from those of the level below, which come from the first to the last.
class HoleFiller::Reducer {
public:
    Reducer(std::int64_t width, std::int64_t height, bool wraps)
        : width_(width), height_(height), wraps_(wraps) {}

    /// Takes the next row; calls `made(y, row)` for each row of this level that is complete.
    template<typename Made>
    void add(const std::vector<Weighted>& row, Made&& made) {
        rows_[static_cast<std::size_t>(taken_ % 5)] = across(row);
        ++taken_;
        // Row j needs rows 2 j - 2 to 2 j + 2.
        while (next_ < halved_grid(height_) && (2 * next_ + 2 < taken_ || taken_ == height_)) {
            made(next_, down(next_));
            ++next_;
        }
    }

private:
    struct Sum {
        double number = 0, weight = 0; ///< sum of weight * number, sum of weights
    };
    std::vector<Sum> across(const std::vector<Weighted>& row) const {
        std::vector<Sum> out(static_cast<std::size_t>(halved_grid(width_)));
        for (std::size_t i = 0; i < out.size(); ++i)
            for (std::int64_t k = 0; k < 5; ++k) {
                std::int64_t x = 2 * static_cast<std::int64_t>(i) + k - 2;
                if (x < 0 || x >= width_) {
                    if (!wraps_) continue;
                    x = (x + 2 * width_) % width_;
                }
                const Weighted& w = row[static_cast<std::size_t>(x)];
                const double weight = kernel[static_cast<std::size_t>(k)] * static_cast<double>(w.weight);
                out[i].number += weight * static_cast<double>(w.number);
                out[i].weight += weight;
            }
        return out;
    }
    std::vector<Weighted> down(std::int64_t j) const {
        std::vector<Weighted> out(static_cast<std::size_t>(halved_grid(width_)));
        for (std::size_t i = 0; i < out.size(); ++i) {
            Sum sum;
            for (std::int64_t k = 0; k < 5; ++k) {
                const std::int64_t y = 2 * j + k - 2;
                if (y < 0 || y >= height_) continue;
                const Sum& s = rows_[static_cast<std::size_t>(y % 5)][i];
                sum.number += kernel[static_cast<std::size_t>(k)] * s.number;
                sum.weight += kernel[static_cast<std::size_t>(k)] * s.weight;
            }
            if (sum.weight > 0)
                out[i] = {static_cast<float>(sum.number / sum.weight), static_cast<float>(sum.weight)};
        }
        return out;
    }

    std::int64_t width_, height_;
    bool wraps_;
    std::array<std::vector<Sum>, 5> rows_;
    std::int64_t taken_ = 0, next_ = 0;
};

HoleFiller::HoleFiller(RasterReader& inner, bool wraps, bool round, const std::filesystem::path& folder,
                       const std::function<void(std::uint64_t)>& progress)
    : inner_(inner), wraps_(wraps), round_(round), scratch_(scratch_file(folder)) {
    for (std::int64_t w = inner.width(), h = inner.height();; w = halved_grid(w), h = halved_grid(h)) {
        levels_.push_back({w, h, plane_bytes_});
        if (levels_.size() > 1) plane_bytes_ += static_cast<std::uint64_t>(w * h) * sizeof(Weighted);
        if (w == 1 && h == 1) break;
    }
    holes_ = {0, inner.width(), -1, inner.height(), -1};
    const std::int64_t strip = std::clamp<std::int64_t>(strip_samples / inner.width(), 1, inner.height());
    std::vector<float> numbers(static_cast<std::size_t>(strip * inner.width()));
    std::vector<Weighted> row(static_cast<std::size_t>(inner.width()));
    for (std::uint32_t plane = 0; plane < inner.planes(); ++plane) {
        std::vector<Reducer> reducers;
        for (std::size_t level = 1; level < levels_.size(); ++level)
            reducers.emplace_back(levels_[level - 1].width, levels_[level - 1].height, wraps);
        const std::function<void(std::size_t, const std::vector<Weighted>&)> push =
            [&](std::size_t level, const std::vector<Weighted>& below) {
                if (level >= levels_.size()) return;
                reducers[level - 1].add(below, [&](std::int64_t y, const std::vector<Weighted>& made) {
                    keep(plane, level, y, made);
                    push(level + 1, made);
                });
            };
        std::uint64_t missing = 0;
        for (std::int64_t y = 0; y < inner.height(); y += strip) {
            const std::int64_t rows = std::min(strip, inner.height() - y);
            inner.read(plane, 0, y, static_cast<int>(inner.width()), static_cast<int>(rows),
                       std::span(numbers).first(static_cast<std::size_t>(rows * inner.width())));
            for (std::int64_t r = 0; r < rows; ++r) {
                for (std::int64_t x = 0; x < inner.width(); ++x) {
                    const float number = numbers[static_cast<std::size_t>(r * inner.width() + x)];
                    const bool hole = std::isnan(number);
                    row[static_cast<std::size_t>(x)] = hole ? Weighted{} : Weighted{number, 1};
                    if (!hole) continue;
                    ++missing;
                    holes_.left = std::min(holes_.left, x);
                    holes_.right = std::max(holes_.right, x);
                    holes_.top = std::min(holes_.top, y + r);
                    holes_.bottom = std::max(holes_.bottom, y + r);
                }
                push(1, row);
            }
            progress(static_cast<std::uint64_t>(plane) * static_cast<std::uint64_t>(inner.height()) +
                     static_cast<std::uint64_t>(y + rows));
        }
        if (missing == static_cast<std::uint64_t>(inner.width()) * static_cast<std::uint64_t>(inner.height()))
            throw InputError("no sample has data: there is nothing to fill holes from");
        holes_.samples += missing;
    }
    cache_.resize(levels_.size(), std::vector<CachedRow>(cached_rows));
}

void HoleFiller::keep(std::uint32_t plane, std::size_t level, std::int64_t y,
                      const std::vector<Weighted>& row) {
    const std::size_t bytes = row.size() * sizeof(Weighted);
    const std::uint64_t place =
        plane * plane_bytes_ + levels_[level].place + static_cast<std::uint64_t>(y) * bytes;
    const char* at = reinterpret_cast<const char*>(row.data());
    for (std::size_t done = 0; done < bytes;) {
        const ssize_t n = pwrite(scratch_.get(), at + done, bytes - done, static_cast<off_t>(place + done));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0)
            throw OutputError(fmt::format("the file for filling holes cannot be written: {}",
                                          std::strerror(n < 0 ? errno : ENOSPC)));
        done += static_cast<std::size_t>(n);
    }
}

std::vector<Weighted> HoleFiller::kept(std::uint32_t plane, std::size_t level, std::int64_t y) const {
    std::vector<Weighted> row(static_cast<std::size_t>(levels_[level].width));
    const std::size_t bytes = row.size() * sizeof(Weighted);
    const std::uint64_t place =
        plane * plane_bytes_ + levels_[level].place + static_cast<std::uint64_t>(y) * bytes;
    char* at = reinterpret_cast<char*>(row.data());
    for (std::size_t done = 0; done < bytes;) {
        const ssize_t n = pread(scratch_.get(), at + done, bytes - done, static_cast<off_t>(place + done));
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) throw OutputError("the file for filling holes cannot be read again");
        done += static_cast<std::size_t>(n);
    }
    return row;
}

std::vector<float> HoleFiller::expanded(std::uint32_t plane, std::size_t level, std::int64_t y) {
    const Level& above = levels_[level + 1];
    // Even samples: weights 1 6 1, odd ones: 4 4; less what is beyond an edge.
    struct Tap {
        std::int64_t index;
        double weight;
    };
    const auto taps = [](std::int64_t at, std::int64_t size, bool wraps) {
        std::vector<Tap> out;
        const std::int64_t i = at / 2;
        const std::vector<Tap> wanted = at % 2 == 0 ? std::vector<Tap>{{i - 1, 1}, {i, 6}, {i + 1, 1}}
                                                    : std::vector<Tap>{{i, 4}, {i + 1, 4}};
        double sum = 0;
        for (const Tap& tap : wanted) {
            const bool inside = tap.index >= 0 && tap.index < size;
            if (!inside && !wraps) continue;
            out.push_back({(tap.index + size) % size, tap.weight});
            sum += tap.weight;
        }
        for (Tap& tap : out)
            tap.weight /= sum;
        return out;
    };
    std::vector<double> column(static_cast<std::size_t>(above.width), 0);
    for (const Tap& tap : taps(y, above.height, false)) {
        const std::vector<float>& row = filled(plane, level + 1, tap.index);
        for (std::size_t i = 0; i < column.size(); ++i)
            column[i] += tap.weight * static_cast<double>(row[i]);
    }
    std::vector<float> out(static_cast<std::size_t>(levels_[level].width));
    const auto size = static_cast<std::int64_t>(column.size());
    for (std::size_t x = 0; x < out.size(); ++x) {
        const auto i = static_cast<std::int64_t>(x) / 2;
        if (i > 0 && i + 1 < size) {
            const auto c = static_cast<std::size_t>(i);
            out[x] = static_cast<float>(x % 2 == 0 ? (column[c - 1] + 6 * column[c] + column[c + 1]) / 8
                                                   : (column[c] + column[c + 1]) / 2);
            continue;
        }
        double sum = 0;
        for (const Tap& tap : taps(static_cast<std::int64_t>(x), size, wraps_))
            sum += tap.weight * column[static_cast<std::size_t>(tap.index)];
        out[x] = static_cast<float>(sum);
    }
    return out;
}

const std::vector<float>& HoleFiller::filled(std::uint32_t plane, std::size_t level, std::int64_t y) {
    CachedRow& slot = cache_[level][static_cast<std::size_t>(y) % cached_rows];
    if (slot.y == y) return slot.numbers;
    const std::vector<Weighted> row = kept(plane, level, y);
    std::vector<float> numbers(row.size());
    const bool whole = std::all_of(row.begin(), row.end(), [](const Weighted& w) { return w.weight >= 1; });
    // The level of one sample has a weight, as some sample has data.
    if (!whole && level + 1 < levels_.size()) numbers = expanded(plane, level, y);
    for (std::size_t i = 0; i < row.size(); ++i) {
        const double w = level + 1 < levels_.size() ? std::min(1.0, static_cast<double>(row[i].weight)) : 1;
        numbers[i] = static_cast<float>(w * static_cast<double>(row[i].number) +
                                        (1 - w) * static_cast<double>(numbers[i]));
    }
    slot.y = y;
    slot.numbers = std::move(numbers);
    return slot.numbers;
}

void HoleFiller::read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                      std::span<float> out) {
    inner_.read(plane, x, y, columns, rows, out);
    if (plane != cached_plane_) {
        for (auto& level : cache_)
            for (CachedRow& row : level)
                row.y = -1;
        cached_plane_ = plane;
    }
    const auto stride = static_cast<std::size_t>(columns);
    for (int r = 0; r < rows; ++r) {
        const std::span<float> row = out.subspan(static_cast<std::size_t>(r) * stride, stride);
        if (std::none_of(row.begin(), row.end(), [](float v) { return std::isnan(v); })) continue;
        const std::vector<float> fill = expanded(plane, 0, y + r);
        for (std::size_t i = 0; i < stride; ++i)
            if (std::isnan(row[i])) {
                const float v = fill[static_cast<std::size_t>(x) + i];
                row[i] = round_ ? std::round(v) : v;
            }
    }
}

} // namespace obscura::tools

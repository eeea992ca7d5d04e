// SPDX-License-Identifier: Apache-2.0
// Rows of a raster read by a thread of their own while those before them are worked on.
#pragma once

#include "tools/import/map/raster_reader.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::tools {

/// For rasters that are read by whole rows, one after the other; other reads go to the raster itself. From
/// the first read of whole rows on, the raster is used by this object's thread alone.
class ReadAhead final : public RasterReader {
public:
    explicit ReadAhead(RasterReader& inner) : inner_(inner) {}
    ~ReadAhead() override;
    ReadAhead(const ReadAhead&) = delete;
    ReadAhead& operator=(const ReadAhead&) = delete;

    [[nodiscard]] std::uint32_t planes() const override { return inner_.planes(); }
    [[nodiscard]] std::int64_t width() const override { return inner_.width(); }
    [[nodiscard]] std::int64_t height() const override { return inner_.height(); }
    [[nodiscard]] bool by_rows() const override { return inner_.by_rows(); }
    /// What the raster throws is thrown here, when its rows are asked for.
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override;

private:
    /// Some rows, in the order of the raster.
    struct Strip {
        std::int64_t y = 0, rows = 0;
        std::vector<float> numbers;
    };
    void start(std::uint32_t plane, std::int64_t y);
    void stop();
    void run();

    RasterReader& inner_;
    std::thread thread_;
    std::mutex mutex_;
    std::condition_variable changed_;
    // Guarded by mutex_ while the thread runs.
    std::deque<Strip> strips_;
    std::vector<std::vector<float>> spare_; ///< memory of strips that were used
    std::exception_ptr failure_;
    bool end_ = false;
    std::uint32_t plane_ = 0;
    std::int64_t next_ = 0; ///< row that the thread reads next
};

} // namespace obscura::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/gdal/protocol.hpp"

#include <cmath>
#include <cstring>
#include <type_traits>

namespace obscura::tools {
namespace {

constexpr std::int64_t size_limit = std::int64_t{1} << 31; // GDAL counts columns and rows in int

class Encoder {
public:
    template<typename T>
    void put(const T& value) requires std::is_arithmetic_v<T> || std::is_enum_v<T> {
        out_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void put(std::string_view text) {
        put(std::uint64_t{text.size()});
        out_.append(text);
    }
    void put(const std::string& text) { put(std::string_view(text)); }
    void put(const std::optional<double>& value) {
        put(static_cast<std::uint8_t>(value.has_value()));
        put(value.value_or(0));
    }
    [[nodiscard]] std::string take() { return std::move(out_); }

private:
    std::string out_;
};

class Decoder {
public:
    explicit Decoder(std::span<const std::byte> body) : left_(body) {}

    template<typename T>
    void get(T& value) requires std::is_arithmetic_v<T> || std::is_enum_v<T> {
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
    }
    void get(bool& value) {
        std::uint8_t byte = 0;
        get(byte);
        value = byte != 0;
    }
    void get(std::string& text) {
        const auto bytes = take(count(1));
        text.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    }
    void get(std::optional<double>& value) {
        bool present = false;
        double number = 0;
        get(present);
        get(number);
        value = present ? std::optional(number) : std::nullopt;
    }
    /// A number of things that take at least `least` bytes each.
    [[nodiscard]] std::size_t count(std::size_t least) {
        std::uint64_t n = 0;
        get(n);
        if (n > left_.size() / least) throw GdalProtocolError("a message is cut off");
        return static_cast<std::size_t>(n);
    }
    void end() const {
        if (!left_.empty()) throw GdalProtocolError("a message is longer than its content");
    }

private:
    std::span<const std::byte> take(std::size_t bytes) {
        if (bytes > left_.size()) throw GdalProtocolError("a message is cut off");
        const auto taken = left_.first(bytes);
        left_ = left_.subspan(bytes);
        return taken;
    }
    std::span<const std::byte> left_;
};

void require(bool truth, const char* what) {
    if (!truth) throw GdalProtocolError(what);
}

void check_type(GdalType type) {
    require(!name_of(type).empty(), "samples of an unknown type");
}

void check_size(std::int64_t width, std::int64_t height) {
    require(width > 0 && height > 0 && width < size_limit && height < size_limit, "an impossible size");
}

} // namespace

std::string encoded(const GdalMap& map) {
    Encoder out;
    out.put(map.id);
    out.put(map.driver);
    out.put(map.width);
    out.put(map.height);
    out.put(std::uint64_t{map.bands.size()});
    for (const GdalBand& band : map.bands) {
        out.put(band.type);
        out.put(band.block_width);
        out.put(band.block_height);
        out.put(band.palette);
        out.put(band.masked);
        out.put(band.nodata);
        out.put(band.scale);
        out.put(band.offset);
        out.put(band.unit);
    }
    out.put(map.band_count);
    out.put(map.transform.has_value());
    for (const double t : map.transform.value_or(std::array<double, 6>{}))
        out.put(t);
    out.put(map.system);
    out.put(map.method);
    out.put(std::uint64_t{map.parameters.size()});
    for (const auto& [name, value] : map.parameters) {
        out.put(name);
        out.put(value);
    }
    for (const double v : {map.semi_major_m, map.semi_minor_m, map.metres_per_unit, map.degrees_per_unit,
                           map.prime_meridian_deg})
        out.put(v);
    out.put(std::uint64_t{map.texts.size()});
    for (const auto& [name, value] : map.texts) {
        out.put(name);
        out.put(value);
    }
    out.put(std::uint64_t{map.warnings.size()});
    for (const std::string& warning : map.warnings)
        out.put(warning);
    return out.take();
}

GdalMap decoded_map(std::span<const std::byte> body) {
    Decoder in(body);
    GdalMap map;
    in.get(map.id);
    in.get(map.driver);
    in.get(map.width);
    in.get(map.height);
    check_size(map.width, map.height);
    map.bands.resize(in.count(46));
    require(!map.bands.empty() && map.bands.size() <= gdal_band_limit, "an impossible number of bands");
    for (GdalBand& band : map.bands) {
        in.get(band.type);
        check_type(band.type);
        in.get(band.block_width);
        in.get(band.block_height);
        in.get(band.palette);
        in.get(band.masked);
        in.get(band.nodata);
        in.get(band.scale);
        in.get(band.offset);
        in.get(band.unit);
    }
    in.get(map.band_count);
    require(map.band_count >= map.bands.size(), "an impossible number of bands");
    bool placed = false;
    in.get(placed);
    std::array<double, 6> transform{};
    for (double& t : transform) {
        in.get(t);
        require(std::isfinite(t), "a transform that is not finite");
    }
    if (placed) map.transform = transform;
    in.get(map.system);
    require(map.system <= GdalSystem::local, "an unknown kind of coordinate system");
    in.get(map.method);
    map.parameters.resize(in.count(16));
    for (auto& [name, value] : map.parameters) {
        in.get(name);
        in.get(value);
    }
    for (double* v : {&map.semi_major_m, &map.semi_minor_m, &map.metres_per_unit, &map.degrees_per_unit,
                      &map.prime_meridian_deg}) {
        in.get(*v);
        require(std::isfinite(*v), "a coordinate system that is not finite");
    }
    require(map.semi_major_m >= 0 && map.semi_minor_m >= 0 && map.metres_per_unit > 0 &&
                map.degrees_per_unit > 0,
            "an impossible coordinate system");
    map.texts.resize(in.count(16));
    for (auto& [name, value] : map.texts) {
        in.get(name);
        in.get(value);
    }
    map.warnings.resize(in.count(8));
    for (std::string& warning : map.warnings)
        in.get(warning);
    in.end();
    return map;
}

std::string encoded(const GdalBlock& block) {
    Encoder out;
    out.put(block.id);
    out.put(block.band);
    out.put(block.mask);
    out.put(block.x);
    out.put(block.y);
    out.put(block.columns);
    out.put(block.rows);
    return out.take();
}

GdalBlock decoded_block(std::span<const std::byte> body) {
    Decoder in(body);
    GdalBlock block;
    in.get(block.id);
    in.get(block.band);
    in.get(block.mask);
    in.get(block.x);
    in.get(block.y);
    in.get(block.columns);
    in.get(block.rows);
    in.end();
    require(block.x >= 0 && block.y >= 0 && block.x < size_limit && block.y < size_limit &&
                block.columns > 0 && block.rows > 0 && block.columns < size_limit && block.rows < size_limit,
            "an impossible block");
    return block;
}

std::string encoded(const GdalTransform& transform) {
    Encoder out;
    out.put(transform.id);
    out.put(transform.inverse);
    out.put(std::uint64_t{transform.points.size()});
    for (const auto& [x, y] : transform.points) {
        out.put(x);
        out.put(y);
    }
    return out.take();
}

GdalTransform decoded_transform(std::span<const std::byte> body) {
    Decoder in(body);
    GdalTransform transform;
    in.get(transform.id);
    in.get(transform.inverse);
    transform.points.resize(in.count(16));
    for (auto& [x, y] : transform.points) {
        in.get(x);
        in.get(y);
    }
    in.end();
    return transform;
}

std::string one_line(std::string_view text) {
    std::string out;
    for (const char c : text.substr(0, 400)) {
        const bool control = static_cast<unsigned char>(c) < 32 || c == 127;
        if (control && (out.empty() || out.back() == ' ')) continue;
        out += control ? ' ' : c;
    }
    while (!out.empty() && (out.back() == ' ' || out.back() == '.'))
        out.pop_back();
    return out;
}

} // namespace obscura::tools

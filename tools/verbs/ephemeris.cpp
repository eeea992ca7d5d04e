// SPDX-License-Identifier: Apache-2.0
// Verb `obscura ephemeris`: content of SPICE kernels, and places and orientations of bodies over time.
#include "ephemeris/kernels/ephemeris.hpp"

#include "core/error.hpp"
#include "core/units.hpp"
#include "ephemeris/kernels/apparent_place.hpp"
#include "ephemeris/time/time_text.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace obscura::tools {
namespace {

using namespace ephemeris;
using Json = nlohmann::ordered_json;

constexpr double m_per_km = 1000;
/// More rows are a mistake in --step.
constexpr double max_table_rows = 1e6;

/// One row of the table of places.
struct Row {
    Epoch epoch;
    Place place;
    Vec3 position_m, velocity_m_s; ///< in the chosen frame
    std::optional<SurfacePoint> below_observer, below_sun;
};

Json intervals_json(const std::vector<Interval>& covered) {
    Json list = Json::array();
    for (const Interval& i : covered)
        list.push_back({tdb_text(i.begin_s), tdb_text(i.end_s)});
    return list;
}

class EphemerisVerb final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "lists what SPICE kernels cover, and where bodies are over time";
        line.description =
            "Reads SPICE kernels: "
            "SPK of all types, binary PCK of type 2, CK (either byte order, or transfer files), text kernels (LSK, PCK, FK, SCLK) and meta-kernels. "
            "Of several kernels the last that has something is used, as in SPICE. "
            "Without --target it lists bodies, frames and the times that are covered, with gaps. "
            "With --target it prints its place seen from --observer: position and velocity, distance, light time, right ascension and declination; "
            "and, where the rotation of the target is known, the planetocentric longitude (east) and latitude of the points below observer and Sun. "
            "Bodies are names or NAIF codes. --see names corrections: geometric (none), astrometric (light time), apparent (light time and aberration), deflected (apparent, and light is bent by the Sun). "
            "Debian packages an ephemeris of the planets: see obscura import ephemeris.";
        line.positional("KERNEL", &kernels_, "Kernels in order of rising priority");
        line.option("--target", &target_, "BODY", "Body to find");
        line.option("--observer", &observer_, "BODY", "Body from whose centre it is seen");
        line.option("--time", &time_, "TIME", "Instant, in any form that obscura time takes");
        line.option("--until", &until_, "TIME", "Last instant of a table that begins at --time");
        line.number("--step", &step_s_, "S", "Interval of the table", 1e-6, 1e12);
        line.option("--see", &see_, "AS", "Corrections for what the observer sees").choices = {
            "geometric", "astrometric", "apparent", "deflected"};
        line.option("--frame", &frame_, "FRAME", "Frame of positions and velocities");
        line.option("--leap-seconds", &leap_second_file_, "FILE",
                    "Leap seconds for UTC from this LSK or IERS list, instead of the system's");
        line.flag("--csv", csv_, "Print a CSV table");
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {
            "obscura ephemeris de405.bsp",
            "obscura ephemeris de405.bsp --target MOON --observer EARTH --time 2026-03-01T12:00:00Z",
            "obscura ephemeris mission.tm --target EUROPA --observer JUICE --see apparent \\",
            "    --time \"2032 JUL 02 16:00\" --until \"2032 JUL 02 17:00\" --step 60 --csv",
        };
    }

    int run() override {
        if (csv_ && json_) throw host::UsageError("obscura ephemeris: --csv and --json exclude each other");
        const Ephemeris kernels({kernels_.begin(), kernels_.end()});
        if (target_.empty()) {
            if (!time_.empty()) throw host::UsageError("obscura ephemeris: --time needs --target");
            json_ ? list_json(kernels) : list(kernels);
            return exit_ok;
        }
        if (time_.empty()) throw host::UsageError("obscura ephemeris: --target needs --time");
        if (until_.empty() != std::isnan(step_s_))
            throw host::UsageError("obscura ephemeris: --until and --step are given together or not at all");
        try {
            leap_seconds_ =
                leap_second_file_.empty() ? system_leap_seconds() : read_leap_seconds(leap_second_file_);
        } catch (const ConfigError& error) {
            throw InputError(error.what());
        }
        print(rows(kernels));
        return exit_ok;
    }

private:
    [[nodiscard]] Epoch read(const std::string& text) const {
        try {
            return read_time(text, leap_seconds_);
        } catch (const TimeTextError& error) {
            throw host::UsageError(fmt::format("obscura ephemeris: {}", error.what()));
        }
    }

    [[nodiscard]] std::vector<Row> rows(const Ephemeris& kernels) {
        const int target = kernels.body(target_), observer = kernels.body(observer_);
        const Epoch first = read(time_);
        const Epoch last = until_.empty() ? first : read(until_);
        if (last < first) throw host::UsageError("obscura ephemeris: --until is before --time");
        const double step_ns = std::isnan(step_s_) ? 1e9 : step_s_ * 1e9;
        const double steps = std::floor(static_cast<double>(last.tai_ns - first.tai_ns) / step_ns);
        if (steps >= max_table_rows)
            throw host::UsageError(
                fmt::format("obscura ephemeris: {:.0f} rows, allowed are {:.0f}: choose a longer --step",
                            steps + 1, max_table_rows));
        const bool light = see_ != "geometric", apparent = see_ == "apparent" || see_ == "deflected";
        const Corrections corrections{light, apparent, see_ == "deflected"};
        std::vector<Row> out;
        for (double i = 0; i <= steps; ++i) {
            const Epoch epoch{first.tai_ns + static_cast<std::int64_t>(std::llround(i * step_ns))};
            const TdbTime time = to_tdb(epoch);
            Row row{epoch, apparent_place(kernels, target, observer, time, corrections), {}, {}, {}, {}};
            const Quat to_frame = conjugate(kernels.orientation(frame_, time));
            row.position_m = rotate(to_frame, row.place.position_m);
            row.velocity_m_s = rotate(to_frame, row.place.velocity_m_s);
            add_points(kernels, target, row);
            out.push_back(row);
        }
        return out;
    }

    /// Points below observer and Sun, if the kernels have what they need.
    static void add_points(const Ephemeris& kernels, int target, Row& row) {
        constexpr int sun = 10;
        Quat to_icrf;
        try {
            const auto frame = kernels.frame(kernels.body_frame_name(target));
            if (frame->orientation(row.place.seen_at, to_icrf) != Evaluation::ok) return;
        } catch (const InputError&) {
            return; // no rotation of this body
        }
        const Quat to_body = conjugate(to_icrf);
        // Aberration does not move the point that is seen in the middle of the disc.
        if (length(row.place.position_m) > 0)
            row.below_observer = surface_point(rotate(to_body, -1.0 * row.place.straight_m));
        State to_sun;
        if (target != sun && kernels.state(sun, target, row.place.seen_at, to_sun) == Evaluation::ok)
            row.below_sun = surface_point(rotate(to_body, to_sun.position_m));
    }

    void print(const std::vector<Row>& table) const {
        if (json_)
            print_json(table);
        else if (csv_)
            print_csv(table);
        else
            print_text(table);
    }

    [[nodiscard]] std::string utc(Epoch epoch) const {
        return write_time(epoch, TimeScale::utc, TimeForm::iso, leap_seconds_);
    }
    /// TDB s since J2000, to the nanosecond.
    [[nodiscard]] std::string tdb(Epoch epoch) const {
        return write_time(epoch, TimeScale::tdb, TimeForm::count, leap_seconds_).substr(3); // "ET ..."
    }
    /// Right ascension and declination of the place, ICRF.
    [[nodiscard]] static SurfacePoint on_sky(const Row& row) { return surface_point(row.place.position_m); }

    void print_json(const std::vector<Row>& table) const {
        const auto vector = [](Vec3 v) { return Json{v.x / m_per_km, v.y / m_per_km, v.z / m_per_km}; };
        const auto point = [](const std::optional<SurfacePoint>& p) {
            return p ? Json{p->longitude_rad / degree, p->latitude_rad / degree} : Json(nullptr);
        };
        Json list = Json::array();
        for (const Row& row : table) {
            const SurfacePoint sky = on_sky(row);
            list.push_back({{"utc", utc(row.epoch)},
                            {"tdb_s", to_tdb(row.epoch).seconds()},
                            {"position_km", vector(row.position_m)},
                            {"velocity_km_s", vector(row.velocity_m_s)},
                            {"distance_km", length(row.position_m) / m_per_km},
                            {"light_time_s", row.place.light_time_s},
                            {"ra_deg", sky.longitude_rad / degree},
                            {"dec_deg", sky.latitude_rad / degree},
                            {"below_observer_deg", point(row.below_observer)},
                            {"below_sun_deg", point(row.below_sun)}});
        }
        fmt::print("{}\n", Json{{"target", target_},
                                {"observer", observer_},
                                {"see", see_},
                                {"frame", frame_},
                                {"places", list}}
                               .dump(2));
    }

    void print_csv(const std::vector<Row>& table) const {
        fmt::print(
            "utc,tdb_s,x_km,y_km,z_km,vx_km_s,vy_km_s,vz_km_s,distance_km,light_time_s,ra_deg,dec_deg,observer_lon_deg,observer_lat_deg,sun_lon_deg,sun_lat_deg\n");
        const auto point = [](const std::optional<SurfacePoint>& p) {
            return p ? fmt::format("{:.9f},{:.9f}", p->longitude_rad / degree, p->latitude_rad / degree)
                     : std::string(",");
        };
        for (const Row& row : table) {
            const Vec3 p = row.position_m / m_per_km, v = row.velocity_m_s / m_per_km;
            const SurfacePoint sky = on_sky(row);
            fmt::print(
                "{},{},{:.6f},{:.6f},{:.6f},{:.9f},{:.9f},{:.9f},{:.6f},{:.9f},{:.10f},{:.10f},{},{}\n",
                utc(row.epoch), tdb(row.epoch), p.x, p.y, p.z, v.x, v.y, v.z, length(p),
                row.place.light_time_s, sky.longitude_rad / degree, sky.latitude_rad / degree,
                point(row.below_observer), point(row.below_sun));
        }
    }

    void print_text(const std::vector<Row>& table) const {
        for (const Row& row : table) {
            const Vec3 p = row.position_m / m_per_km, v = row.velocity_m_s / m_per_km;
            const SurfacePoint sky = on_sky(row);
            fmt::print("{} seen from {}, {}, {}\n", target_, observer_, see_, utc(row.epoch));
            fmt::print("  TDB since J2000  {} s\n", tdb(row.epoch));
            fmt::print("  position         {:.6f} {:.6f} {:.6f} km ({})\n", p.x, p.y, p.z, frame_);
            fmt::print("  velocity         {:.9f} {:.9f} {:.9f} km/s\n", v.x, v.y, v.z);
            fmt::print("  distance         {:.6f} km, light time {:.9f} s\n", length(p),
                       row.place.light_time_s);
            fmt::print("  RA, Dec (J2000)  {:.8f} {:+.8f} deg\n", sky.longitude_rad / degree,
                       sky.latitude_rad / degree);
            const auto point = [](const char* label, const std::optional<SurfacePoint>& at) {
                if (at)
                    fmt::print("  {}  {:.6f} E {:+.6f} deg\n", label, at->longitude_rad / degree,
                               at->latitude_rad / degree);
            };
            point("below observer ", row.below_observer);
            point("below the Sun  ", row.below_sun);
        }
    }

    static std::string name_with_code(const Ephemeris& kernels, int id) {
        const std::string name = kernels.body_name(id), code = std::to_string(id);
        return name == code ? code : fmt::format("{} ({})", name, code);
    }

    static void list(const Ephemeris& kernels) {
        const auto part = [](const char* title,
                             const std::vector<std::pair<std::string, std::string>>& lines) {
            std::size_t width = 0;
            for (const auto& [name, text] : lines)
                width = std::max(width, name.size());
            fmt::print("{}{}\n", title, lines.empty() ? ": none" : "");
            for (const auto& [name, text] : lines)
                fmt::print("  {:<{}}  {}\n", name, width, text);
        };
        std::vector<std::pair<std::string, std::string>> lines;
        for (const int id : kernels.bodies())
            lines.emplace_back(name_with_code(kernels, id), coverage_text(kernels.coverage(id)));
        part("Positions", lines);
        lines.clear();
        for (const Ephemeris::FrameCoverage& f : kernels.frame_coverage())
            lines.emplace_back(f.name.empty() ? std::to_string(f.id) : f.name, coverage_text(f.covered));
        part("Orientations over time", lines);
        lines.clear();
        for (const int id : kernels.modelled_bodies())
            lines.emplace_back(name_with_code(kernels, id), kernels.body_frame_name(id));
        part("Rotation models", lines);
        lines.clear();
        for (const int id : kernels.bodies_with_radii()) {
            const Vec3 r = kernels.radii_m(id).value_or(Vec3{}) / m_per_km;
            lines.emplace_back(name_with_code(kernels, id), fmt::format("{} x {} x {} km", r.x, r.y, r.z));
        }
        part("Radii", lines);
        if (kernels.unusable().empty()) return;
        fmt::print("Cannot be used\n");
        for (const std::string& problem : kernels.unusable())
            fmt::print("  {}\n", problem);
    }

    static void list_json(const Ephemeris& kernels) {
        Json bodies = Json::array(), frames = Json::array(), models = Json::array(), radii = Json::array();
        for (const int id : kernels.bodies())
            bodies.push_back({{"id", id},
                              {"name", kernels.body_name(id)},
                              {"covered", intervals_json(kernels.coverage(id))}});
        for (const Ephemeris::FrameCoverage& f : kernels.frame_coverage())
            frames.push_back({{"id", f.id}, {"name", f.name}, {"covered", intervals_json(f.covered)}});
        for (const int id : kernels.modelled_bodies())
            models.push_back(
                {{"id", id}, {"name", kernels.body_name(id)}, {"frame", kernels.body_frame_name(id)}});
        for (const int id : kernels.bodies_with_radii()) {
            const Vec3 r = kernels.radii_m(id).value_or(Vec3{}) / m_per_km;
            radii.push_back({{"id", id}, {"name", kernels.body_name(id)}, {"radii_km", {r.x, r.y, r.z}}});
        }
        fmt::print("{}\n", Json{{"positions", bodies},
                                {"orientations", frames},
                                {"rotation_models", models},
                                {"radii", radii},
                                {"unusable", kernels.unusable()}}
                               .dump(2));
    }

    std::vector<std::string> kernels_;
    std::string target_, observer_ = "SOLAR SYSTEM BARYCENTER", time_, until_, see_ = "geometric",
                         frame_ = "J2000", leap_second_file_;
    double step_s_ = std::nan("");
    bool csv_ = false, json_ = false;
    LeapSeconds leap_seconds_;
};

} // namespace

std::unique_ptr<Verb> make_ephemeris() {
    return std::make_unique<EphemerisVerb>();
}

} // namespace obscura::tools

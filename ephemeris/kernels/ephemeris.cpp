// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/ephemeris.hpp"

#include "core/error.hpp"
#include "ephemeris/kernels/body_names.hpp"
#include "ephemeris/kernels/ck_segment.hpp"
#include "ephemeris/kernels/frame_names.hpp"
#include "ephemeris/kernels/kernel_files.hpp"
#include "ephemeris/segments/segment_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace obscura::ephemeris {
namespace {

/// Most centres between a body and the barycentre.
constexpr std::size_t max_links = 16;
/// Most frames between one and ICRF.
constexpr int max_frames = 10;
/// NAIF code of the solar system barycentre, and id of the frame J2000.
constexpr int j2000 = 1;

State operator+(const State& a, const State& b) {
    return {a.position_m + b.position_m, a.velocity_m_s + b.velocity_m_s};
}
State operator-(const State& a, const State& b) {
    return {a.position_m - b.position_m, a.velocity_m_s - b.velocity_m_s};
}

/// Turns a state in a frame to ICRF axes. The frame's rate is by differences: within 1e-9 of the velocity of
/// a point at rest in a frame that turns once in a day.
Evaluation turn(const FrameModel& frame, TdbTime time, State& state) noexcept {
    constexpr double half_s = 0.5;
    Quat now, before, after;
    for (const auto& [at, q] : {std::pair{0.0, &now}, {-half_s, &before}, {half_s, &after}}) {
        const Evaluation status = frame.orientation(time + at, *q);
        if (status != Evaluation::ok) return status;
    }
    const Vec3 p = state.position_m;
    state.velocity_m_s =
        rotate(now, state.velocity_m_s) + (rotate(after, p) - rotate(before, p)) / (2 * half_s);
    state.position_m = rotate(now, p);
    return Evaluation::ok;
}

/// Bodies that have the variable BODY<code><what>, ascending.
std::vector<int> bodies_with(const KernelPool& pool, std::string_view what) {
    constexpr std::string_view start = "BODY";
    std::vector<int> ids;
    for (const auto& [name, variable] : pool.variables()) {
        if (!name.starts_with(start) || !name.ends_with(what) || name.size() <= start.size() + what.size())
            continue;
        const char* const first = name.data() + start.size();
        const char* const last = name.data() + name.size() - what.size();
        int id = 0;
        if (const auto [end, error] = std::from_chars(first, last, id); error == std::errc() && end == last)
            ids.push_back(id);
    }
    std::sort(ids.begin(), ids.end());
    return ids;
}

/// Keeps what a frame refers to alive.
struct OwnedFrame {
    std::shared_ptr<const void> owner;
    std::shared_ptr<const FrameModel> model;
};

} // namespace

struct Ephemeris::Impl {
    /// A segment and the frame of its states: null for ICRF.
    struct PlacedSegment {
        std::optional<SpkSegment> segment;
        std::shared_ptr<const FrameModel> frame;
        std::string problem; ///< why it cannot be used; empty: it can
    };
    /// Segment of a CK; empty: `problem` says why it cannot be used.
    struct Attitudes {
        std::int32_t instrument;
        Interval ticks; ///< of the descriptor
        std::optional<CkSegment> segment;
        std::string problem;
    };
    struct Body {
        int id;
        SegmentTimeline timeline;
    };

    KernelFiles files;
    BodyNames names;
    std::vector<PlacedSegment> states;
    std::vector<Body> bodies; ///< ordered by id
    std::vector<PckSegment> rotations;
    std::vector<Attitudes> attitudes;
    std::vector<std::pair<std::int32_t, std::string>> unusable_rotations; ///< by frame class
    std::vector<std::string> unusable;

    explicit Impl(const std::vector<std::filesystem::path>& kernels)
        : files(read_kernels(kernels)), names(files.pool) {
        std::map<int, SegmentTimeline> timelines;
        for (const Daf& daf : files.dafs)
            for (const Daf::Array& array : daf.arrays()) {
                const Interval covered{array.doubles.at(0), array.doubles.at(1)};
                if (!std::isfinite(covered.begin_s) || !std::isfinite(covered.end_s) ||
                    covered.begin_s > covered.end_s)
                    throw InputError(
                        fmt::format("{}: covers {} to {}", array.place, covered.begin_s, covered.end_s));
                if (daf.kind() == "SPK")
                    add_states(array, covered, timelines);
                else if (daf.kind() == "PCK")
                    add_rotation(array);
                else
                    add_attitudes(array, covered);
            }
        for (auto& [id, timeline] : timelines)
            bodies.push_back({id, std::move(timeline)});
        for (PlacedSegment& s : states)
            if (s.segment)
                s.problem =
                    problem_of([&] { s.frame = base_frame(s.segment->frame(), s.segment->place(), 0); });
        for (const PlacedSegment& s : states)
            if (!s.problem.empty()) unusable.push_back(s.problem);
        for (const Attitudes& a : attitudes)
            if (!a.problem.empty()) unusable.push_back(a.problem);
        for (const auto& [id, problem] : unusable_rotations)
            unusable.push_back(problem);
        if (!names.problem().empty()) unusable.push_back(names.problem());
    }

    /// Message of the InputError that `make` throws; empty: none.
    template<typename Make>
    static std::string problem_of(const Make& make) {
        try {
            make();
            return {};
        } catch (const InputError& error) {
            return error.what();
        }
    }

    void add_states(const Daf::Array& array, Interval covered, std::map<int, SegmentTimeline>& timelines) {
        PlacedSegment& placed = states.emplace_back();
        placed.problem = problem_of([&] { placed.segment.emplace(array); });
        const int target = array.integers.at(0);
        if (placed.segment) covered = {placed.segment->begin_s(), placed.segment->end_s()};
        timelines[target].add(covered, static_cast<std::int32_t>(states.size() - 1));
    }

    void add_rotation(const Daf::Array& array) {
        const std::string problem = problem_of([&] { rotations.emplace_back(array); });
        if (!problem.empty()) unusable_rotations.emplace_back(array.integers.at(0), problem);
    }

    void add_attitudes(const Daf::Array& array, Interval ticks) {
        Attitudes& a = attitudes.emplace_back(Attitudes{array.integers.at(0), ticks, std::nullopt, {}});
        a.problem = problem_of([&] { a.segment.emplace(array); });
    }

    [[nodiscard]] const Body* find(int id) const noexcept {
        const auto found = std::lower_bound(bodies.begin(), bodies.end(), id,
                                            [](const Body& b, int wanted) { return b.id < wanted; });
        return found == bodies.end() || found->id != id ? nullptr : &*found;
    }

    /// Adds to `state` that of `id` relative to its centre, and sets `id` to the centre.
    [[nodiscard]] Evaluation step(int& id, State& state, TdbTime time) const noexcept {
        const Body* const body = find(id);
        if (body == nullptr) return Evaluation::no_data;
        const std::int32_t index = body->timeline.at(time.seconds());
        if (index < 0) return Evaluation::no_coverage;
        const PlacedSegment& placed = states[static_cast<std::size_t>(index)];
        if (!placed.problem.empty()) return Evaluation::unusable;
        State relative;
        if (!placed.segment->evaluate(time, relative)) return Evaluation::damaged;
        if (placed.frame)
            if (const Evaluation status = turn(*placed.frame, time, relative); status != Evaluation::ok)
                return status;
        state = state + relative;
        id = placed.segment->center();
        return Evaluation::ok;
    }

    [[nodiscard]] Evaluation state(int target, int observer, TdbTime time, State& state) const noexcept {
        // Centres of the target, and its state relative to each.
        std::array<std::pair<int, State>, max_links> links;
        std::size_t count = 1;
        links[0] = {target, {}};
        Evaluation end = Evaluation::ok;
        while (links[count - 1].first != observer && links[count - 1].first != solar_system_barycenter &&
               count < max_links) {
            links[count] = links[count - 1];
            end = step(links[count].first, links[count].second, time);
            if (end != Evaluation::ok) break;
            ++count;
        }
        // From the observer up to the first common centre.
        State own;
        int center = observer;
        for (std::size_t i = 0; i < max_links; ++i) {
            for (std::size_t k = 0; k < count; ++k)
                if (links[k].first == center) {
                    state = links[k].second - own;
                    return Evaluation::ok;
                }
            if (const Evaluation status = step(center, own, time); status != Evaluation::ok) {
                // What stopped the target says more.
                if (end != Evaluation::ok) return end;
                return center == solar_system_barycenter ? Evaluation::no_common : status;
            }
        }
        return Evaluation::no_common;
    }

    /// Frame by id that a segment refers to; null: ICRF.
    [[nodiscard]] std::shared_ptr<const FrameModel> base_frame(int id, const std::string& place,
                                                               int depth) const {
        if (id == j2000) return nullptr;
        const std::string name = frame_name(files.pool, id);
        if (name.empty())
            throw InputError(fmt::format(
                "{}: refers to frame {}, which no kernel defines: load its frame kernel", place, id));
        return frame(name, depth + 1);
    }

    [[nodiscard]] std::shared_ptr<const FrameModel> frame(std::string_view name, int depth) const {
        if (depth > max_frames)
            throw InputError(
                fmt::format("frame {}: is relative to itself, or too many others", kernel_name(name)));
        const FrameDefinition definition = find_frame(files.pool, names, name);
        switch (definition.kind) {
        case FrameDefinition::Class::inertial:
        case FrameDefinition::Class::fixed:
            return make_fixed_frame(definition.base.empty() ? nullptr : frame(definition.base, depth + 1),
                                    definition.to_base);
        case FrameDefinition::Class::body:
            return body_frame(definition, depth);
        case FrameDefinition::Class::attitude:
            break;
        }
        return attitude_frame(definition, depth);
    }

    [[nodiscard]] std::shared_ptr<const FrameModel> body_frame(const FrameDefinition& definition,
                                                               int depth) const {
        std::vector<BasedPckSegment> segments;
        for (std::size_t i = rotations.size(); i-- > 0;)
            if (rotations[i].frame_class() == definition.class_id)
                segments.push_back(
                    {&rotations[i], base_frame(rotations[i].base(), rotations[i].place(), depth)});
        for (const auto& [id, problem] : unusable_rotations)
            if (id == definition.class_id)
                throw InputError(fmt::format("frame {}: {}", definition.name, problem));
        std::optional<RotationModel> model = rotation_model(files.pool, definition.class_id);
        if (segments.empty() && !model)
            throw InputError(
                fmt::format("frame {}: no rotation is loaded for class id {}: a PCK kernel is needed",
                            definition.name, definition.class_id));
        const auto base = files.pool.integer(fmt::format("BODY{}_CONSTANTS_REF_FRAME", definition.class_id));
        return make_body_frame(std::move(segments), std::move(model),
                               base_frame(base.value_or(j2000), definition.name, depth));
    }

    [[nodiscard]] std::shared_ptr<const FrameModel> attitude_frame(const FrameDefinition& definition,
                                                                   int depth) const {
        std::vector<BasedCkSegment> segments;
        std::string problem;
        bool any = false;
        for (std::size_t i = attitudes.size(); i-- > 0;) {
            const Attitudes& a = attitudes[i];
            if (a.instrument != definition.class_id) continue;
            BasedCkSegment based{nullptr, nullptr, a.ticks};
            std::string own = a.problem;
            if (a.segment)
                own = problem_of([&] {
                    based.base = base_frame(a.segment->base(), a.segment->place(), depth);
                    based.segment = &*a.segment;
                });
            if (problem.empty()) problem = own;
            any = any || based.segment != nullptr;
            segments.push_back(std::move(based));
        }
        if (!any && !problem.empty()) throw InputError(fmt::format("frame {}: {}", definition.name, problem));
        if (segments.empty())
            throw InputError(fmt::format("frame {}: no attitudes of {} are loaded: a CK kernel is needed",
                                         definition.name, definition.class_id));
        return make_ck_frame(std::move(segments), clock_of(definition.class_id));
    }

    [[nodiscard]] SpacecraftClock clock_of(int instrument) const {
        const int clock =
            files.pool.integer(fmt::format("CK_{}_SCLK", instrument)).value_or(instrument / 1000);
        return {files.pool, clock};
    }
};

Ephemeris::Ephemeris(const std::vector<std::filesystem::path>& kernels)
    : impl_(std::make_shared<const Impl>(kernels)) {}

int Ephemeris::body(std::string_view name) const {
    if (const auto id = impl_->names.id(name)) return *id;
    throw InputError(fmt::format("body {}: unknown, {}", kernel_name(name), impl_->names.suggestion(name)));
}

std::string Ephemeris::body_name(int id) const {
    return impl_->names.name(id);
}

Evaluation Ephemeris::state(int target, int observer, TdbTime time, State& state) const noexcept {
    return impl_->state(target, observer, time, state);
}

State Ephemeris::state(int target, int observer, TdbTime time) const {
    State result;
    const Evaluation status = state(target, observer, time, result);
    if (status != Evaluation::ok) throw InputError(reason(target, observer, time, status));
    return result;
}

std::string Ephemeris::reason(int target, int observer, TdbTime time, Evaluation status) const {
    const auto named = [&](int id) {
        const std::string name = body_name(id);
        return name == std::to_string(id) ? name : fmt::format("{} ({})", name, id);
    };
    const std::string what =
        fmt::format("{} relative to {} at {}", named(target), named(observer), tdb_text(time.seconds()));
    if (status == Evaluation::ok) return what;
    if (status == Evaluation::damaged)
        return fmt::format("{}: a kernel holds values that are no numbers", what);
    // The first body on either way that has no segment now.
    for (int id : {target, observer}) {
        State ignored;
        for (std::size_t i = 0; i < max_links && id != solar_system_barycenter; ++i) {
            const Impl::Body* const body = impl_->find(id);
            if (body == nullptr) return fmt::format("{}: no kernel has positions of {}", what, named(id));
            const std::int32_t index = body->timeline.at(time.seconds());
            if (index < 0)
                return fmt::format("{}: {} is covered {}", what, named(id), coverage_text(coverage(id)));
            if (const std::string& problem = impl_->states[static_cast<std::size_t>(index)].problem;
                !problem.empty())
                return fmt::format("{}: {}", what, problem);
            if (impl_->step(id, ignored, time) != Evaluation::ok) break;
        }
    }
    return fmt::format(
        "{}: they have no common centre in the loaded kernels, or a frame of a segment is not known at that time",
        what);
}

std::shared_ptr<const FrameModel> Ephemeris::frame(std::string_view name) const {
    auto owned = std::make_shared<const OwnedFrame>(OwnedFrame{impl_, impl_->frame(name, 0)});
    const FrameModel* const model = owned->model.get();
    return {std::move(owned), model};
}

std::string Ephemeris::body_frame_name(int id) const {
    for (const std::string& key : {std::to_string(id), body_name(id)})
        if (const KernelPool::Variable* const given = pool().find(fmt::format("OBJECT_{}_FRAME", key))) {
            if (given->strings.size() == 1) return kernel_name(given->strings.front());
            if (given->numbers.size() == 1 && std::abs(given->numbers.front()) < 2e9)
                if (const std::string name = frame_name(pool(), static_cast<int>(given->numbers.front()));
                    !name.empty())
                    return name;
            throw InputError(fmt::format("{}: one name of a known frame is expected", given->place));
        }
    return "IAU_" + body_name(id);
}

Quat Ephemeris::orientation(std::string_view frame, TdbTime time) const {
    Quat q;
    const Evaluation status = impl_->frame(frame, 0)->orientation(time, q);
    if (status == Evaluation::ok) return q;
    std::string covered;
    if (status == Evaluation::no_coverage) {
        for (const FrameCoverage& f : frame_coverage())
            covered += fmt::format("; {} is covered {}", f.name.empty() ? std::to_string(f.id) : f.name,
                                   coverage_text(f.covered));
    }
    const char* const why = status == Evaluation::damaged    ? "a kernel holds values that are no numbers"
                            : status == Evaluation::unusable ? "held by a segment that cannot be used"
                                                             : "not covered by the loaded kernels";
    if (status == Evaluation::unusable)
        for (const Impl::Attitudes& a : impl_->attitudes)
            if (!a.problem.empty()) covered += "; " + a.problem;
    throw InputError(
        fmt::format("frame {} at {}: {}{}", kernel_name(frame), tdb_text(time.seconds()), why, covered));
}

std::optional<Vec3> Ephemeris::radii_m(int id) const {
    const auto km = pool().numbers(fmt::format("BODY{}_RADII", id), 3, 3);
    if (km.empty()) return std::nullopt;
    const Vec3 m{km[0] * 1000, km[1] * 1000, km[2] * 1000};
    if (!(m.x > 0 && m.y > 0 && m.z > 0))
        throw InputError(
            fmt::format("{}: radii must be above 0", pool().find(fmt::format("BODY{}_RADII", id))->place));
    return m;
}

std::vector<int> Ephemeris::bodies_with_radii() const {
    std::vector<int> ids = bodies_with(pool(), "_RADII");
    std::erase_if(ids, [&](int id) {
        const auto* const radii = pool().find(fmt::format("BODY{}_RADII", id));
        return radii->numbers.size() != 3;
    });
    return ids;
}

std::vector<int> Ephemeris::modelled_bodies() const {
    return bodies_with(pool(), "_POLE_RA");
}

std::vector<int> Ephemeris::bodies() const {
    std::vector<int> ids;
    for (const Impl::Body& body : impl_->bodies)
        ids.push_back(body.id);
    return ids;
}

std::vector<Interval> Ephemeris::coverage(int id) const {
    const Impl::Body* const body = impl_->find(id);
    return body == nullptr ? std::vector<Interval>{} : body->timeline.coverage();
}

std::vector<Interval> Ephemeris::coverage(int target, int observer) const {
    std::vector<double> edges;
    for (const Impl::Body& body : impl_->bodies) {
        const std::vector<double> own = body.timeline.edges();
        edges.insert(edges.end(), own.begin(), own.end());
    }
    for (const FrameCoverage& f : frame_coverage())
        for (const Interval& i : f.covered)
            edges.insert(edges.end(), {i.begin_s, i.end_s});
    return where_known(std::move(edges), [&](TdbTime time) {
        State ignored;
        return state(target, observer, time, ignored) == Evaluation::ok;
    });
}

std::vector<Interval> Ephemeris::orientation_coverage(std::string_view name) const {
    const auto model = frame(name);
    std::vector<double> edges;
    for (const FrameCoverage& f : frame_coverage())
        for (const Interval& i : f.covered)
            edges.insert(edges.end(), {i.begin_s, i.end_s});
    return where_known(std::move(edges), [&](TdbTime time) {
        Quat ignored;
        return model->orientation(time, ignored) == Evaluation::ok;
    });
}

std::vector<Ephemeris::FrameCoverage> Ephemeris::frame_coverage() const {
    std::map<int, FrameCoverage> frames;
    const auto of = [&](int id) -> FrameCoverage& {
        FrameCoverage& f = frames[id];
        f.id = id;
        f.name = frame_name(pool(), id);
        return f;
    };
    for (const PckSegment& s : impl_->rotations)
        of(s.frame_class()).covered.push_back(s.coverage());
    for (const Impl::Attitudes& a : impl_->attitudes) {
        // Without its clock an attitude has no times, which frame() says to who asks for it.
        std::optional<SpacecraftClock> clock;
        if (!a.segment || !Impl::problem_of([&] { clock = impl_->clock_of(a.instrument); }).empty()) continue;
        for (const Interval& ticks : a.segment->coverage())
            of(a.instrument).covered.push_back({clock->tdb_s(ticks.begin_s), clock->tdb_s(ticks.end_s)});
    }
    std::vector<FrameCoverage> list;
    for (auto& [id, f] : frames) {
        f.covered = merged(std::move(f.covered));
        list.push_back(std::move(f));
    }
    return list;
}

const std::vector<std::string>& Ephemeris::unusable() const {
    return impl_->unusable;
}

const KernelPool& Ephemeris::pool() const {
    return impl_->files.pool;
}

} // namespace obscura::ephemeris

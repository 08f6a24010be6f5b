#include "engine/simulate/gouge.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kTogether = 1024;  // steps

void add_lines(std::vector<std::uint32_t>& lines, std::span<const std::uint32_t> more) {
    for (const std::uint32_t line : more)
        if (lines.empty() || lines.back() != line) lines.push_back(line);
}

std::vector<std::uint32_t> lines_of(std::span<const std::uint32_t> lines,
                                    std::span<const std::uint32_t> motions) {
    std::vector<std::uint32_t> of;
    for (const std::uint32_t motion : motions) of.push_back(lines[motion]);
    return of;
}

GougeReport join(GougeReport a, const GougeReport& b) {
    auto deeper = [](GougePlace& x, const GougePlace& y) {
        if (y.depth > x.depth) x = y;  // of equals the first, in the order of the program
    };
    deeper(a.cutter, b.cutter);
    deeper(a.shank, b.shank);
    deeper(a.holder, b.holder);
    a.gouges += b.gouges;
    a.contacts += b.contacts;
    a.motions += b.motions;
    a.length_mm += b.length_mm;
    add_lines(a.gouge_lines, b.gouge_lines);
    add_lines(a.contact_lines, b.contact_lines);
    return a;
}

// Of a part above the cutter, from its lower end up.
Envelope under_side(const ToolSection& section) {
    Envelope under;
    under.radius = section.radius;
    under.core = section.height > 0 ? section.lower : section.radius;
    if (section.height > 0) {
        const double taper = std::atan2(section.radius - section.lower, section.height);
        under.sin_taper = std::sin(taper), under.cos_taper = std::cos(taper);
    }
    return under;
}

// As StandingPart::deepest() for a cutter with a point. @return the motions beyond the tolerance
std::vector<std::uint32_t> check_pointed(const StandingPart& part, double z_top, const CutterShape& cutter,
                                         std::span<const StandingPart::Motion> motions,
                                         std::span<const std::uint32_t> lines, const GougeOptions& options,
                                         GougePlace& place) {
    std::vector<std::uint32_t> beyond;
    double most = options.ignore;
    for (std::size_t i = 0; i < motions.size(); ++i) {
        const Point3 &from = motions[i].from, &to = motions[i].to;
        const bool is_upright = from[0] == to[0] && from[1] == to[1];
        const Point3& lower = from[2] < to[2] ? from : to;
        const double at_least = std::min(most, options.tolerance);
        const Penetration p = is_upright
                                  ? part.pointed(z_top, lower, cutter.radius, cutter.taper_rad, at_least)
                                  : part.cylinder(z_top, from, to, cutter.radius, at_least);
        if (!p.found) continue;
        if (p.depth > options.tolerance) beyond.push_back(static_cast<std::uint32_t>(i));
        if (p.depth > most) {
            most = p.depth;
            place = {p.depth, lines[i], p.tip};
        }
    }
    return beyond;
}

}  // namespace

Tool wider(const Tool& tool, double by) {
    Tool wide = tool;
    for (double* const diameter : {&wide.diameter, &wide.shank_diameter, &wide.holder_diameter})
        if (*diameter > 0) *diameter += 2 * by;
    for (std::size_t k = 0; k < wide.holder_profile.size(); ++k)
        if (k % 3 != 0) wide.holder_profile[k] += 2 * by;
    // A point and a flank are wider too: upright sides hold them.
    if (has_point(wide.kind)) wide.kind = ToolKind::flat;
    if (has_taper(wide.kind)) wide.kind = ToolKind::bull_nose;
    return wide;
}

GougeReport check_gouge(Context& context, const StandingPart& part, double z_top, const Tool& tool,
                        const Program& program, const GougeOptions& options) {
    const std::size_t n = program.steps.size();
    if (n < 2) return {};
    const CutterShape cutter = cutter_shape(tool);
    const std::vector<ToolSection> sections = sections_of(tool);
    std::atomic<double> deepest = 0;  // of the whole program, so far
    return parallel_reduce(
        context, n - 1, kTogether, GougeReport{},
        [&](std::size_t begin, std::size_t end) {
            GougeReport r;
            std::vector<StandingPart::Motion> motions;
            std::vector<std::uint32_t> lines;
            std::vector<StandingPart::Chords> chords;
            auto arc = std::partition_point(program.arcs.begin(), program.arcs.end(),
                                            [&](const ProgramArc& a) { return a.end <= begin + 1; });
            bool in_arc = false;
            for (std::size_t i = begin; i < end; ++i) {
                const ProgramStep &from = program.steps[i], &to = program.steps[i + 1];
                if (!from.known() || !to.known()) continue;
                for (; arc != program.arcs.end() && arc->end <= i + 1; ++arc) in_arc = false;
                // Of an arc the close chords that begin on this step's share of it.
                const bool of_arc = arc != program.arcs.end() && arc->begin <= i + 1;
                const std::size_t steps = of_arc ? arc->end - arc->begin : 1,
                                  close = of_arc ? arc->close_chords() : 1,
                                  step = of_arc ? i + 1 - arc->begin : 0, first = step * close / steps,
                                  last = (step + 1) * close / steps;
                const auto end_of = [&](std::size_t k) -> Point3 {
                    if (k == close) return {to.x, to.y, to.z};
                    const auto [x, y] = arc->at(static_cast<double>(k) / static_cast<double>(close));
                    return {x, y, to.z};
                };
                Point3 a = first == 0 ? Point3{from.x, from.y, from.z} : end_of(first);
                for (std::size_t k = first; k < last; ++k) {
                    const Point3 b = end_of(k + 1);
                    ++r.motions;
                    r.length_mm += std::sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]) +
                                             (b[2] - a[2]) * (b[2] - a[2]));
                    if (std::min(a[2], b[2]) < z_top) {
                        if (of_arc) {
                            if (!in_arc)
                                chords.push_back({motions.size(), motions.size(), arc->arc.x, arc->arc.y,
                                                  arc->arc.radius});
                            chords.back().last = motions.size() + 1;
                            in_arc = true;
                        }
                        motions.push_back({a, b});
                        lines.push_back(to.line);
                    }
                    a = b;
                }
            }
            auto check = [&](const Envelope& under, GougePlace& place, std::atomic<double>* known) {
                StandingPart::Found found = part.deepest_under(under, z_top, motions, options.ignore,
                                                               options.tolerance, known, chords);
                if (found.most.found) place = {found.most.depth, lines[found.motion], found.most.tip};
                return std::move(found.beyond);
            };
            const bool ball = cutter.form() == CutterForm::ball;
            const std::vector<std::uint32_t> gouges =
                mills(tool.kind) ? check(under_side(cutter), r.cutter, ball ? &deepest : nullptr)
                                 : check_pointed(part, z_top, cutter, motions, lines, options, r.cutter);
            r.gouges = gouges.size();
            add_lines(r.gouge_lines, lines_of(lines, gouges));
            std::vector<std::uint32_t> touched;
            double raised = 0;
            for (const ToolSection& section : sections) {
                for (StandingPart::Motion& m : motions)
                    m.from[2] += section.above - raised, m.to[2] += section.above - raised;
                raised = section.above;
                GougePlace place;
                const auto beyond = check(under_side(section), place, nullptr);
                touched.insert(touched.end(), beyond.begin(), beyond.end());
                GougePlace& of = section.above < tool.stickout ? r.shank : r.holder;
                if (place.depth > of.depth) of = place;
            }
            std::sort(touched.begin(), touched.end());
            touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
            r.contacts = touched.size();
            add_lines(r.contact_lines, lines_of(lines, touched));
            return r;
        },
        join);
}

}  // namespace slabwright

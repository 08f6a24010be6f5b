#include "engine/simulate/simulation_memory.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <tuple>
#include <unordered_map>

namespace slabwright {

namespace {

constexpr std::size_t kWindow = 4;     // steps that must be the same for two programs to meet again
constexpr std::size_t kBoxSteps = 16;  // of what is other, under one box

std::uint64_t mixed(std::uint64_t h, std::uint64_t v) {
    h = (h ^ v) * 0x9E3779B97F4A7C15U;
    return h ^ (h >> 29U);
}
std::uint64_t bits(double v) { return std::isfinite(v) ? std::bit_cast<std::uint64_t>(v + 0.0) : 1; }

// What of every step the stock depends on: where it goes, whether by rapid, and along which arc.
std::vector<std::array<std::uint64_t, 2>> marks(const Program& program) {
    std::vector<std::array<std::uint64_t, 2>> result;
    result.reserve(program.steps.size());
    auto arc = program.arcs.begin();
    for (std::size_t i = 0; i < program.steps.size(); ++i) {
        const ProgramStep& s = program.steps[i];
        while (arc != program.arcs.end() && arc->end <= i) ++arc;
        std::array<std::uint64_t, 2> h{1, 2};
        for (std::uint64_t& half : h) {
            for (const double v : {s.x, s.y, s.z}) half = mixed(half, bits(v));
            half = mixed(half, s.rapid() ? 1 : 0);
            if (arc != program.arcs.end() && arc->begin <= i)
                for (const double v :
                     {arc->arc.x, arc->arc.y, arc->arc.radius, arc->arc.start, arc->arc.turn})
                    half = mixed(half, bits(v));
        }
        result.push_back(h);
    }
    return result;
}

std::uint64_t window(const std::vector<std::array<std::uint64_t, 2>>& marks, std::size_t at) {
    std::uint64_t h = 7;
    for (std::size_t k = at; k < at + kWindow; ++k) h = mixed(h, marks[k][0]);
    return h;
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool same_steps(const Program& a, const Program& b) {
    return std::equal(a.steps.begin(), a.steps.end(), b.steps.begin(), b.steps.end(),
                      [](const ProgramStep& s, const ProgramStep& t) {
                          return same(s.x, t.x) && same(s.y, t.y) && same(s.z, t.z) && s.feed == t.feed &&
                                 s.line == t.line && s.spindle == t.spindle;
                      }) &&
           std::equal(a.arcs.begin(), a.arcs.end(), b.arcs.begin(), b.arcs.end(),
                      [](const ProgramArc& s, const ProgramArc& t) {
                          return s.begin == t.begin && s.end == t.end && s.close == t.close &&
                                 s.arc.x == t.arc.x && s.arc.y == t.arc.y && s.arc.z == t.arc.z &&
                                 s.arc.radius == t.arc.radius && s.arc.start == t.arc.start &&
                                 s.arc.turn == t.arc.turn;
                      });
}

// What programs say of themselves that any finding depends on.
auto sayings(const Program& p) {
    return std::tie(p.layer, p.kind, p.tool, p.planned_tool, p.planned_stepdown, p.blend, p.strays,
                    p.chord_error, p.arc_error, p.dwell_s);
}

auto words(const Tool& t) {
    return std::tie(t.number, t.kind, t.diameter, t.flute_length, t.shank_diameter, t.holder_diameter,
                    t.stickout, t.plunges, t.core_diameter, t.ramp_deg, t.corner_radius, t.taper_deg,
                    t.point_deg, t.holder_profile);
}

}  // namespace

void StepBox::add(const ProgramArc& a) {
    constexpr double quarter = std::numbers::pi / 2;
    const double low = std::min(a.arc.start, a.arc.start + a.arc.turn),
                 high = std::max(a.arc.start, a.arc.start + a.arc.turn);
    for (double k = std::ceil(low / quarter); k * quarter <= high; ++k) {
        const double x = a.arc.x + a.arc.radius * std::cos(k * quarter),
                     y = a.arc.y + a.arc.radius * std::sin(k * quarter);
        x0 = std::min(x0, x), x1 = std::max(x1, x);
        y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
}

ProgramChanges::ProgramChanges(const std::vector<Program>& before, const std::vector<Program>& now)
    : was_(now.size()), same_(now.size()), lines_(now.size()), programs_before_(before.size()) {
    const auto is_same = [&](std::size_t old, std::size_t i) {
        return sayings(before[old]) == sayings(now[i]) && same_steps(before[old], now[i]);
    };
    std::vector<char> taken(before.size());
    // Those that are the same first, in their order; then, between them, those of one tool and kind.
    std::size_t next = 0;
    for (std::size_t i = 0; i < now.size(); ++i)
        for (std::size_t old = next; old < before.size() && before[old].layer <= now[i].layer; ++old)
            if (before[old].layer == now[i].layer && is_same(old, i)) {
                was_[i] = old, same_[i] = taken[old] = 1;
                next = old + 1;
                break;
            }
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (was_[i]) continue;
        std::size_t low = 0;  // after the program that the one before it was
        for (std::size_t k = i; k-- > 0 && low == 0;)
            if (was_[k]) low = *was_[k] + 1;
        for (std::size_t old = low; old < before.size() && !taken[old] && before[old].layer <= now[i].layer;
             ++old)
            if (sayings(before[old]) == sayings(now[i])) {
                was_[i] = old, taken[old] = 1;
                break;
            }
    }
    const auto whole = [&](const Program& p) {
        StepBox box;
        for (const ProgramStep& s : p.steps)
            if (s.known()) box.add(s);
        for (const ProgramArc& a : p.arcs) box.add(a);
        return box;
    };
    for (std::size_t old = 0; old < before.size(); ++old)
        if (!taken[old]) gone_.emplace_back(old, whole(before[old]));
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (!was_[i]) add_range(now[i], 0, now[i].steps.size());
        else if (!same_[i]) compare(before[*was_[i]], now[i], lines_[i]);
    }
}

// The motion to a step begins at the step before it, and the one after a range begins at its last.
void ProgramChanges::add_range(const Program& p, std::size_t first, std::size_t last) {
    const std::size_t end = std::min(last + 1, p.steps.size());
    auto arc = std::partition_point(p.arcs.begin(), p.arcs.end(),
                                    [&](const ProgramArc& a) { return a.end < first; });
    for (std::size_t i = first; i < end; i += kBoxSteps) {
        StepBox box;
        for (std::size_t k = i > 0 ? i - 1 : 0; k < std::min(i + kBoxSteps, end); ++k)
            if (p.steps[k].known()) box.add(p.steps[k]);
        for (; arc != p.arcs.end() && arc->begin < i + kBoxSteps; ++arc) {
            box.add(*arc);
            if (arc->end > i + kBoxSteps) break;
        }
        if (box.x0 <= box.x1) changed_.push_back(box);
    }
}

void ProgramChanges::compare(const Program& before, const Program& now, Lines& lines) {
    const auto a = marks(before), b = marks(now);
    std::unordered_map<std::uint64_t, std::vector<std::size_t>> windows;  // of the program before
    for (std::size_t i = 0; i + kWindow <= a.size(); ++i) windows[window(a, i)].push_back(i);
    for (std::size_t i = 0, j = 0; i < a.size() || j < b.size();) {
        if (i < a.size() && j < b.size() && a[i] == b[j]) {
            if (lines.empty() || lines.back().first != before.steps[i].line)
                lines.emplace_back(before.steps[i].line, now.steps[j].line);
            ++i, ++j;
            continue;
        }
        std::size_t old = a.size(), next = b.size();  // where they are the same again
        for (std::size_t k = j; k + kWindow <= b.size() && next == b.size(); ++k)
            if (const auto found = windows.find(window(b, k)); found != windows.end())
                if (const auto at = std::lower_bound(found->second.begin(), found->second.end(), i);
                    at != found->second.end())
                    old = *at, next = k;
        if (old == i && next == j) ++old, ++next;  // windows of one hash
        add_range(before, i, old);
        add_range(now, j, next);
        i = old, j = next;
    }
}

bool ProgramChanges::touch(const CellGrid& grid, double margin, const TileResult& tile) const {
    return std::any_of(gone_.begin(), gone_.end(),
                       [&](const auto& gone) {
                           return tile.programs[gone.first].removed > 0 &&
                                  gone.second.meets(grid, margin, kUnbounded);
                       }) ||
           std::any_of(changed_.begin(), changed_.end(),
                       [&](const StepBox& box) { return box.meets(grid, margin, kUnbounded); });
}

std::optional<TileResult> ProgramChanges::translated(const TileResult& tile) const {
    if (tile.programs.size() != programs_before_) return std::nullopt;
    TileResult result = tile;
    result.programs.assign(was_.size(), {});
    for (std::size_t i = 0; i < was_.size(); ++i) {
        if (!was_[i]) continue;
        TileProgram& to = result.programs[i];
        to = tile.programs[*was_[i]];
        if (same_[i]) continue;
        bool known = true;
        const auto translate = [&](std::uint32_t& line) {
            if (line == 0) return;
            const auto found = std::lower_bound(lines_[i].begin(), lines_[i].end(), std::pair{line, 0U});
            if (found == lines_[i].end() || found->first != line) known = false;
            else line = found->second;
        };
        for (std::uint32_t* line : {&to.rapid_line, &to.over_flute_line, &to.deepest_line, &to.shank_line,
                                    &to.holder_line, &to.core.line})
            translate(*line);
        for (auto& [line, size] : to.core.lines) translate(line);
        for (FaultyMotion& f : to.faults) translate(f.line);
        if (!known) return std::nullopt;
    }
    return result;
}

bool is_of(const SimulationMemory& memory, const SimulationInput& input, const SimulationOptions& options,
           double cell) {
    const SimulationInput& was = memory.stage;
    const SimulationOptions& o = memory.options;
    const auto same_layer = [](const SimulatedLayer& a, const SimulatedLayer& b) {
        return std::tie(a.z_bottom, a.z_top, a.slab_thickness) ==
                   std::tie(b.z_bottom, b.z_top, b.slab_thickness) &&
               a.flask.points == b.flask.points && a.blank == b.blank && a.dowels == b.dowels;
    };
    const auto judged = [](const SimulationOptions& s) {
        return std::tie(s.gouge, s.cusp, s.slack, s.leftover_limit, s.leftover_share, s.board_cut, s.faults,
                        s.maps);
    };
    return !memory.programs.empty() && memory.programs.size() == memory.checked.size() &&
           memory.cell == cell && was.stock_min == input.stock_min && was.stock_max == input.stock_max &&
           judged(o) == judged(options) && !options.maps &&
           std::equal(was.layers.begin(), was.layers.end(), input.layers.begin(), input.layers.end(),
                      same_layer) &&
           std::equal(was.tools.begin(), was.tools.end(), input.tools.begin(), input.tools.end(),
                      [](const Tool& a, const Tool& b) { return words(a) == words(b); });
}

}  // namespace slabwright

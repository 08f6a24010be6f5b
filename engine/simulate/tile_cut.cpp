#include "engine/simulate/tile_cut.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "engine/simulate/core_contact.h"

namespace slabwright {

namespace {

constexpr double kAbreast = 3;       // fewer cells than this side by side do not tell how wide a cut is
constexpr double kArcError = 0.001;  // mm: more than rounding may add to Program::chord_error

StepBox box_of(const ProgramStep& a, const ProgramStep& b) {
    StepBox box;
    box.add(a);
    box.add(b);
    return box;
}

Point3 place(const ProgramStep& s) { return {s.x, s.y, s.z}; }

/// An arc of one radius ends up to a rounding of the text beside where the text ends it. What a rapid
/// starts from has been cut there.
CutEffect cut_arc_end(const PreparedProgram& p, const ProgramArc& arc, Stock& stock, double deep) {
    const std::vector<ProgramStep>& steps = p.program->steps;
    if (arc.end >= steps.size() || !steps[arc.end].rapid()) return {};
    const Point3 there = place(steps[arc.end - 1]);
    return stock.cut(p.end, there, there, deep);
}

class ProgramOverTile {
public:
    ProgramOverTile(const SimulationStage& stage, const PreparedProgram& p, Stock& stock, double top,
                    LevelMotions& level, TileProgram& out)
        : stage_(stage),
          p_(p),
          tool_(*p.tool),
          steps_(p.program->steps),
          arcs_(p.program->arcs),
          stock_(stock),
          top_(top),
          level_(level),
          out_(out),
          core_(*p.tool, stock.grid()) {}

    bool run() {
        for (std::size_t block = 0; block < p_.blocks.size(); ++block) {
            if (!meets(p_.blocks[block])) continue;
            constexpr std::size_t parts = kBlockSteps / kPartSteps;
            for (std::size_t part = block * parts; part < std::min(p_.parts.size(), (block + 1) * parts);
                 ++part) {
                if (!meets(p_.parts[part])) continue;
                const std::size_t begin = 1 + part * kPartSteps;
                for (std::size_t i = begin; i < std::min(steps_.size(), begin + kPartSteps); ++i) run_step(i);
            }
        }
        cut_level();
        out_.core = core_.findings();
        if (stage_.options.faults)
            for (const auto& [line, over] : out_.core.lines)
                out_.faults.push_back({FaultyMotion::Fault::crush, line, over});
        return any_;
    }

private:
    /// Whether cutter, shank or holder may come near the tile on motions within a box. Shank and holder are
    /// wider, but mostly stay above all that stands.
    [[nodiscard]] bool meets(const StepBox& box) const {
        double margin = aside_;
        for (const ToolSection& s : sections_)
            if (box.z0 + s.above < top_) margin = std::max(margin, s.radius);
        return box.meets(stock_.grid(), margin, top_);
    }

    void fault(FaultyMotion::Fault what, std::size_t step, double size) {
        if (stage_.options.faults) out_.faults.push_back({what, steps_[step].line, size});
    }

    /// Adds what motion `i` took to the findings.
    void tell(std::size_t i, const CutEffect& e) {
        if (!(e.removed > 0)) return;
        const ProgramStep &a = steps_[i - 1], &b = steps_[i];
        const double low = std::min(a.z, b.z);
        any_ = true;
        out_.removed += e.removed;
        out_.lowest = std::min(out_.lowest, e.lowest);
        out_.most = std::max(out_.most, e.deepest);
        const Point3 where{e.where[0], e.where[1], low};
        if (b.rapid() && e.deepest > kTaken) {
            fault(FaultyMotion::Fault::rapid, i, e.deepest);
            raise(out_.rapid, out_.rapid_line, {e.deepest, where}, b.line);
        }
        const bool is_deep = static_cast<double>(e.deep_cells) * stage_.cell * stage_.cell > wide_ &&
                             e.deep_across >= kAbreast;
        if (is_deep) {
            if (e.deepest > deep_) fault(FaultyMotion::Fault::too_deep, i, e.deepest);
            raise(out_.deepest, out_.deepest_line, {e.deepest, where}, b.line);
        }
        const double over = e.highest - low - tool_.flute_length;
        if (tool_.flute_length > 0 && over > kStanding) {
            fault(FaultyMotion::Fault::too_deep, i, e.highest - low);
            raise(out_.over_flute, out_.over_flute_line, {over, where}, b.line);
        }
    }

    /// Takes what the level motions at hand cover.
    void cut_level() {
        if (level_.motions.empty()) return;
        if (const auto e = stock_.cut(level_.region, level_.z, shallow_)) {
            if (e->removed > 0) any_ = true;
            out_.removed += e->removed;
            out_.lowest = std::min(out_.lowest, e->lowest);
            out_.most = std::max(out_.most, e->deepest);
        } else {
            for (const LevelMotions::Motion& m : level_.motions) {
                ChainedSweep chain;
                chain.been = m.been;
                tell(m.step,
                     stock_.cut(p_.end, place(steps_[m.step - 1]), place(steps_[m.step]), deep_, chain));
            }
        }
        level_.motions.clear();
    }

    /// Whether motion k, next to this feed motion, is a straight feed motion too: it shares its end with
    /// that. What a rapid takes is all told of the rapid.
    [[nodiscard]] bool chained(std::size_t k) const {
        if (k == 0 || k >= steps_.size() || !steps_[k - 1].known() || !steps_[k].known() || steps_[k].rapid())
            return false;
        const bool last_arc = arc_ > 0 && arcs_[arc_ - 1].end > k,
                   next_arc = arc_ < arcs_.size() && arcs_[arc_].begin <= k;
        return !last_arc && !next_arc;
    }

    void run_step(std::size_t i) {
        const ProgramStep &a = steps_[i - 1], &b = steps_[i];
        if (!a.known() || !b.known()) return;
        const StepBox box = box_of(a, b);
        if (!meets(box)) return;
        if (core_.watches() && core_.concerns(stock_, a, b)) {
            cut_level();
            core_.follow(stock_, a, b);
        }
        const double low = std::min(a.z, b.z);
        if (arc_ < arcs_.size() && arcs_[arc_].end <= i)
            arc_ = static_cast<std::size_t>(
                std::partition_point(arcs_.begin() + static_cast<std::ptrdiff_t>(arc_), arcs_.end(),
                                     [&](const ProgramArc& each) { return each.end <= i; }) -
                arcs_.begin());
        // An arc is cut whole at the first of its chords that comes near; the others then have nothing to do.
        const bool in_arc = arc_ < arcs_.size() && arcs_[arc_].begin <= i,
                   cut_before = in_arc && arc_ < cut_arcs_;
        const bool follows = std::any_of(sections_.begin(), sections_.end(),
                                         [&](const ToolSection& s) { return low + s.above < top_; });
        const bool near = box.meets(stock_.grid(), aside_, top_) && !cut_before;
        if (!near && !follows) return;
        const bool disc = p_.end.form == CutterEnd::Form::flat && !b.rapid() && !in_arc &&
                          (a.z == b.z || (a.x == b.x && a.y == b.y));
        if (disc && !follows) {
            if (low != level_.z) cut_level();
            level_.z = low;
            level_.region.add({a.x, a.y}, {b.x, b.y}, radius_);
            level_.motions.push_back({i, chained(i - 1)});
            return;
        }
        // Nothing to take, as most of the ways between cuts; what is still to be cut only adds to that.
        if (!in_arc && !follows &&
            stock_.clear(box.x0 - aside_, box.x1 + aside_, box.y0 - aside_, box.y1 + aside_, low))
            return;
        cut_level();
        if (near && in_arc) cut_arc(i);
        else if (near) cut_line(i);
        for (const ToolSection& s : sections_) {
            const bool shank = s.above < tool_.stickout;
            follow(i, s.radius, s.above, shank ? out_.shank : out_.holder,
                   shank ? out_.shank_line : out_.holder_line);
        }
    }

    void cut_arc(std::size_t i) {
        tell(i, stock_.cut(p_.end, arcs_[arc_].arc, deep_));
        cut_arcs_ = arc_ + 1;
        tell(i, cut_arc_end(p_, arcs_[arc_], stock_, deep_));
    }

    void cut_line(std::size_t i) {
        Point3 before{}, after{};
        ChainedSweep chain;
        const bool feeds = !steps_[i].rapid();
        if (feeds && chained(i - 1)) before = place(steps_[i - 2]), chain.before = &before;
        if (feeds && chained(i + 1)) after = place(steps_[i + 1]), chain.after = &after;
        tell(i, stock_.cut(p_.end, place(steps_[i - 1]), place(steps_[i]), deep_, chain));
    }

    /// Whether what follows the cutter, `thick` mm in radius and `above` mm over the tip, runs into stock.
    void follow(std::size_t i, double thick, double above, Extreme& extreme, std::uint32_t& line) {
        const ProgramStep &a = steps_[i - 1], &b = steps_[i];
        const double low = std::min(a.z, b.z);
        if (low + above >= top_) return;
        std::array<double, 2> where{};
        const double reach = stock_.reach(thick, {a.x, a.y, a.z + above}, {b.x, b.y, b.z + above}, where);
        if (!(reach > kStanding)) return;
        fault(FaultyMotion::Fault::in_standing, i, reach);
        raise(extreme, line, {reach, {where[0], where[1], low + above}}, b.line);
    }

    const SimulationStage& stage_;
    const PreparedProgram& p_;
    const Tool& tool_;
    const std::vector<ProgramStep>& steps_;
    const std::vector<ProgramArc>& arcs_;
    Stock& stock_;
    double top_;
    LevelMotions& level_;
    TileProgram& out_;
    CoreContact core_;
    std::size_t arc_ = 0, cut_arcs_ = 0;  // the arc at hand or next; how many have been cut
    bool any_ = false;                    // whether anything has been taken

    double radius_ = tool_.diameter / 2;
    std::vector<ToolSection> sections_ = cylinders_of(tool_);
    // What an arc covers goes no farther beyond its chords.
    double aside_ = radius_ + p_.program->chord_error + kArcError;
    // A sliver that stood between passes overloads nobody; a tenth of the cutter's disc does. Where cells lie
    // one or two abreast, along a wall, they do not tell how wide what stood there was: a micrometre at the
    // cutter's rim may hold the centres of a whole row.
    double deep_ = p_.program->planned_stepdown > 0 ? p_.program->planned_stepdown + kDeeper : kUnbounded;
    double wide_ = 0.1 * std::numbers::pi * radius_ * radius_;
    double shallow_ =
        std::min(deep_, tool_.flute_length > 0 ? tool_.flute_length + kStanding : kUnbounded) - kTaken;
};

}  // namespace

bool run_program(const SimulationStage& stage, const PreparedProgram& program, Stock& stock, double top,
                 LevelMotions& level, TileProgram& out) {
    return ProgramOverTile(stage, program, stock, top, level, out).run();
}

}  // namespace slabwright

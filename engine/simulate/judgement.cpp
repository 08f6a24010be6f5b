#include "engine/simulate/judgement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

/// Until x and y are known only rapids above everything that stands are safe.
void unknown_start(SimulationReport& report, const Program& p, const ProgramFindings& f) {
    for (std::size_t i = 0; i < p.steps.size(); ++i) {
        const ProgramStep& s = p.steps[i];
        if (i > 0 && p.steps[i - 1].known()) return;
        // The very first rise in z passes over heights that nobody knows; after it the height counts.
        const double low = i > 0 && std::isfinite(p.steps[i - 1].z) ? std::min(p.steps[i - 1].z, s.z) : s.z;
        if (std::isfinite(low) && low >= f.stock_top) continue;
        violate(report, "rapid.unknown_start",
                std::isfinite(low) ? fmt::format("moves from a place that no line has set at z {:.3f}, "
                                                 "while stock stands up to {:.3f}",
                                                 low, f.stock_top)
                                   : std::string("moves in x or y from a height that no line has set"),
                &p, s.line, {}, std::isfinite(low) ? f.stock_top - low : 0);
        return;
    }
}

template <class Fn>
void each_program(const SimulationStage& stage, const SimulationReport& report, Fn&& fn) {
    for (std::size_t i = 0; i < report.programs.size(); ++i)
        fn(stage.input.programs[i], report.programs[i], i);
}

/// What cutter, shank or holder touch.
void judge_contacts(const SimulationStage& stage, SimulationReport& report) {
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (f.gouge.cutter.depth > stage.options.gouge)
            violate(report, "gouge.cutter",
                    fmt::format("the cutter goes {:.4f} mm into the part ({} motions over {:.4f} mm)",
                                f.gouge.cutter.depth, f.gouge.gouges, stage.options.gouge),
                    &p, f.gouge.cutter.line, f.gouge.cutter.tip, f.gouge.cutter.depth);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (f.flask.depth > stage.options.gouge)
            violate(report, "gouge.flask",
                    fmt::format("the cutter goes {:.4f} mm into the flask", f.flask.depth), &p, f.flask.line,
                    f.flask.tip, f.flask.depth);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (f.gouge.shank.depth > stage.options.gouge)
            violate(report, "contact.shank",
                    fmt::format("the shank goes {:.4f} mm into the part", f.gouge.shank.depth), &p,
                    f.gouge.shank.line, f.gouge.shank.tip, f.gouge.shank.depth);
        if (f.gouge.holder.depth > stage.options.gouge)
            violate(report, "contact.holder",
                    fmt::format("the holder goes {:.4f} mm into the part", f.gouge.holder.depth), &p,
                    f.gouge.holder.line, f.gouge.holder.tip, f.gouge.holder.depth);
        if (f.shank.size > 0)
            violate(report, "contact.shank",
                    fmt::format("the shank runs into stock, {:.3f} mm deep", f.shank.size), &p, f.shank_line,
                    f.shank.where, f.shank.size);
        if (f.holder.size > 0)
            violate(report, "contact.holder",
                    fmt::format("the holder runs into stock, {:.3f} mm deep", f.holder.size), &p,
                    f.holder_line, f.holder.where, f.holder.size);
    });
}

/// What the cutter takes, and how.
void judge_cuts(const SimulationStage& stage, const std::vector<double>& taken, SimulationReport& report) {
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (f.crushed.size > 0)
            violate(report, "plunge.not_center_cutting",
                    fmt::format("goes down on {:.3f} mm of stock under its middle, where it has no edge "
                                "({:.1f} mm2 in all)",
                                f.crushed.size, f.crushed_mm2),
                    &p, f.crushed_line, f.crushed.where, f.crushed.size);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (f.rapid.size > 0)
            violate(report, "rapid.through_stock",
                    fmt::format("a rapid takes {:.3f} mm of stock", f.rapid.size), &p, f.rapid_line,
                    f.rapid.where, f.rapid.size);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        unknown_start(report, p, f);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (f.over_flute.size > 0)
            violate(report, "flute.too_deep",
                    fmt::format("cuts {:.3f} mm deeper than the flutes are long", f.over_flute.size), &p,
                    f.over_flute_line, f.over_flute.where, f.over_flute.size);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings& f, std::size_t) {
        if (p.kind == OperationKind::rough && p.planned_stepdown > 0 &&
            f.deepest.size > p.planned_stepdown + kDeeper)
            violate(report, "cut.too_deep",
                    fmt::format("cuts {:.3f} mm at once, {:.3f} mm are planned", f.deepest.size,
                                p.planned_stepdown),
                    &p, f.deepest_line, f.deepest.where, f.deepest.size - p.planned_stepdown);
    });
    each_program(stage, report, [&](const Program& p, const ProgramFindings&, std::size_t i) {
        // Coarser points than the tolerance asks for may miss all that an operation takes.
        const bool seen = stage.cell <= 1.25 * simulation_cell(stage.input.tools, stage.options.cusp) ||
                          std::none_of(p.steps.begin(), p.steps.end(),
                                       [](const ProgramStep& step) { return !step.rapid(); });
        if (stage.programs[i].tool && taken[i] <= 1e-3 && seen)
            violate(report, "operation.empty", "removes nothing", &p, 0, {}, 0);
    });
}

/// What is gone that should stand, and what stands that should be gone.
void judge_wood(const SimulationStage& stage, const Extreme& flask_cut, SimulationReport& report) {
    if (stage.options.board_cut >= 0 && report.board_cut > stage.options.board_cut + kStanding)
        violate(report, "board.too_deep",
                fmt::format("the base board is cut {:.3f} mm deep, {:.3f} mm are allowed", report.board_cut,
                            stage.options.board_cut),
                nullptr, 0, {}, report.board_cut);
    if (flask_cut.size > stage.options.gouge)
        violate(report, "gouge.flask", fmt::format("the flask is cut {:.3f} mm deep", flask_cut.size),
                nullptr, 0, flask_cut.where, flask_cut.size);
    for (std::size_t l = 0; l < report.layers.size(); ++l) {
        const LayerFindings& f = report.layers[l];
        if (f.gouge_cells > 0)
            violate(
                report, "gouge.stock",
                fmt::format("layer {}: the stock is cut {:.4f} mm into the part, {:.2f} mm2 are "
                            "deeper than {:.4f} mm",
                            l + 1, f.gouge.size, static_cast<double>(f.gouge_cells) * stage.cell * stage.cell,
                            stage.options.gouge),
                nullptr, 0, f.gouge.where, f.gouge.size, l);
    }
    for (std::size_t l = 0; l < report.layers.size(); ++l) {
        const LayerFindings& f = report.layers[l];
        if (f.missed_left.size > stage.options.leftover_limit)
            violate(report, "left.too_much",
                    fmt::format("layer {}: {:.3f} mm are left that a tool could take ({:.1f} mm2, {:.0f} "
                                "mm3 of it waste beside the pattern)",
                                l + 1, f.missed_left.size,
                                static_cast<double>(f.missed) * stage.cell * stage.cell, f.waste_mm3),
                    nullptr, 0, f.missed_left.where, f.missed_left.size, l);
        if (f.within_share < stage.options.leftover_share)
            violate(report, "left.missed",
                    fmt::format("layer {}: only {:.3f} % of what tools reach is within {:.3f} mm", l + 1,
                                100 * f.within_share, stage.options.cusp + stage.options.slack),
                    nullptr, 0, f.missed_left.where, f.missed_left.size, l);
    }
}

}  // namespace

void judge(const SimulationStage& stage, const std::vector<double>& taken, const Extreme& flask_cut,
           SimulationReport& report) {
    judge_contacts(stage, report);
    judge_cuts(stage, taken, report);
    judge_wood(stage, flask_cut, report);
}

}  // namespace slabwright

#include "engine/simulate/simulate.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/simulate/dowel_proof.h"
#include "engine/simulate/judgement.h"
#include "engine/simulate/laid_slabs.h"
#include "engine/simulate/motion_check.h"
#include "engine/simulate/simulation_memory.h"
#include "engine/simulate/stage.h"
#include "engine/simulate/tile_cut.h"
#include "engine/simulate/tile_measure.h"
#include "engine/simulate/work.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr int kTileCells = 128;  // a side; a tile of 20 layers is 1.4 MB

SimulationSize size_of(const SimulationStage& stage) {
    SimulationSize size;
    for (const PreparedProgram& p : stage.programs) {
        size.steps += p.program->close_steps();
        if (p.tool) size.swept_mm2 += p.cut_mm * p.tool->diameter;
    }
    size.stock_mm2 = static_cast<double>(stage.nx) * stage.ny * stage.cell * stage.cell;
    size.cell_mm = stage.cell;
    size.layers = stage.input.layers.size();
    size.facets = stage.input.mesh.facets.size();
    return size;
}

/// Sorts by fault and line; of a line that has a fault in several tiles the most stays.
void keep_worst(std::vector<FaultyMotion>& faults) {
    std::sort(faults.begin(), faults.end());
    std::vector<FaultyMotion> worst;
    for (const FaultyMotion& f : faults)
        if (!worst.empty() && worst.back().fault == f.fault && worst.back().line == f.line) worst.back() = f;
        else worst.push_back(f);
    faults = std::move(worst);
}

/// Adds what a tile found of a program. @param cell mm
void add(ProgramFindings& f, const TileProgram& p, double cell) {
    f.removed_mm3 += p.removed * cell * cell;
    f.lowest = std::min(f.lowest, p.lowest);
    f.stock_top = std::max(f.stock_top, p.stock_top);
    raise(f.rapid, f.rapid_line, p.rapid, p.rapid_line);
    raise(f.over_flute, f.over_flute_line, p.over_flute, p.over_flute_line);
    raise(f.deepest, f.deepest_line, p.deepest, p.deepest_line);
    raise(f.shank, f.shank_line, p.shank, p.shank_line);
    raise(f.holder, f.holder_line, p.holder, p.holder_line);
    raise(f.crushed, f.crushed_line, {p.core.deepest, {p.core.where[0], p.core.where[1], p.core.z}},
          p.core.line);
    f.crushed_mm2 += static_cast<double>(p.core.cells) * cell * cell;
    f.faults.insert(f.faults.end(), p.faults.begin(), p.faults.end());
}

/// Adds what a tile found of a layer.
void add(LayerFindings& f, const LayerFindings& l) {
    f.cells += l.cells, f.gouge_cells += l.gouge_cells, f.over += l.over, f.unreachable += l.unreachable,
        f.missed += l.missed, f.waste += l.waste;
    f.unreached.insert(f.unreached.end(), l.unreached.begin(), l.unreached.end());
    f.waste_mm3 += l.waste_mm3;
    f.unmade_mm3 += l.unmade_mm3;
    raise(f.unmade, l.unmade.size, l.unmade.where);
    raise(f.gouge, l.gouge.size, l.gouge.where);
    raise(f.left, l.left.size, l.left.where);
    raise(f.unreachable_left, l.unreachable_left.size, l.unreachable_left.where);
    raise(f.missed_left, l.missed_left.size, l.missed_left.where);
    f.missed_places.insert(f.missed_places.end(), l.missed_places.begin(), l.missed_places.end());
}

class Simulation {
public:
    Simulation(Context& context, const SimulationInput& input, const StandingPart& part,
               const SimulationOptions& options, SimulationMemory* memory)
        : context_(context), memory_(memory), stage_(set_stage(context, input, part, options, report_)) {
        if (memory_ != nullptr && is_of(*memory_, input, options, stage_.cell))
            changes_.emplace(memory_->programs, input.programs);
    }

    SimulationReport run() {
        constexpr double kReading =
            0.02;  // of the whole verification: plan.json and the programs, before this
        const SimulationWork work = simulation_work(size_of(stage_));
        const double checked = kReading + (1 - kReading) * work.checking / (work.checking + work.cutting);
        std::uint64_t steps = 0;
        for (const Program& program : stage_.input.programs) steps += program.steps.size();
        context_.begin_phase("checking moves", kReading, checked, steps);
        checked_programs_ = check_motions(stage_, changes_ ? &*changes_ : nullptr, memory_, report_);
        cut(report_, checked);
        judge(stage_, taken_, flask_cut_, report_);
        return std::move(report_);
    }

private:
    /// For the simulation after this one.
    void remember(std::vector<TileResult> tiles) {
        if (memory_ == nullptr) return;
        memory_->programs.clear();
        memory_->stage.layers = stage_.input.layers, memory_->stage.tools = stage_.input.tools;
        memory_->stage.stock_min = stage_.input.stock_min, memory_->stage.stock_max = stage_.input.stock_max;
        memory_->options = stage_.options;
        memory_->cell = stage_.cell;
        memory_->checked = std::move(checked_programs_);
        memory_->tiles = std::move(tiles);
    }

    /// A tile's findings where no program has changed near it; none where it has to be run.
    [[nodiscard]] std::optional<TileResult> known_tile(std::size_t tile, const CellGrid& grid) const {
        if (!changes_ || tile >= memory_->tiles.size()) return std::nullopt;
        double widest = 0;
        for (const Tool& t : stage_.input.tools) {
            widest = std::max({widest, t.diameter, t.shank_diameter, t.holder_diameter});
            for (const ToolSection& section : sections_of(t)) widest = std::max(widest, 2 * section.radius);
        }
        const TileResult& before = memory_->tiles[tile];
        if (changes_->touch(grid, widest / 2 + stage_.cell, before)) return std::nullopt;
        std::optional<TileResult> known = changes_->translated(before);
        for (std::size_t i = 0; known && i < stage_.programs.size(); ++i) {
            if (changes_->before(i)) continue;
            const int layer = stage_.input.programs[i].layer;  // it meets nothing here
            const SimulatedLayer& of = stage_.input.layers[static_cast<std::size_t>(layer)];
            TileProgram& p = known->programs[i];
            p.stock_top = p.top_after = i > 0 && stage_.input.programs[i - 1].layer == layer
                                            ? known->programs[i - 1].top_after
                                            : laid_top(of, grid);
        }
        return known;
    }

    /// Tiles are independent: each builds its own stock from the first slab to the last and runs every
    /// program over it.
    void cut(SimulationReport& report, double checked) {
        const int tx = (stage_.nx + kTileCells - 1) / kTileCells,
                  ty = (stage_.ny + kTileCells - 1) / kTileCells;
        const std::size_t tiles = static_cast<std::size_t>(tx) * static_cast<std::size_t>(ty);
        const std::uint64_t tile_bytes =
            static_cast<std::uint64_t>(kTileCells) * kTileCells * 4 * (stage_.input.layers.size() + 4);
        const std::uint64_t map_bytes = stage_.options.maps ? static_cast<std::uint64_t>(stage_.nx) *
                                                                  static_cast<std::uint64_t>(stage_.ny) * 5 *
                                                                  stage_.input.layers.size()
                                                            : 0;
        const MemoryCharge charge(stage_.context,
                                  tile_bytes * static_cast<std::uint64_t>(stage_.context.threads()) +
                                      map_bytes +
                                      tiles * (stage_.input.programs.size() * sizeof(TileProgram) +
                                               stage_.input.layers.size() * sizeof(TileLayer)),
                                  "the simulated stock");
        report.layers.resize(stage_.input.layers.size());
        if (stage_.options.maps)
            for (LayerFindings& l : report.layers) {
                l.map.assign(static_cast<std::size_t>(stage_.nx) * static_cast<std::size_t>(stage_.ny), 0.0f);
                l.kinds.assign(l.map.size(), CellKind::beside);
            }
        std::vector<TileResult> results(tiles);
        stage_.context.begin_phase("cutting stock", checked, 1.0, tiles);
        parallel_each(stage_.context, tiles, [&](std::size_t t) {
            const int i0 = static_cast<int>(t % static_cast<std::size_t>(tx)) * kTileCells,
                      j0 = static_cast<int>(t / static_cast<std::size_t>(tx)) * kTileCells;
            const CellGrid grid{stage_.input.stock_min[0] + (i0 + 0.5) * stage_.cell,
                                stage_.input.stock_min[1] + (j0 + 0.5) * stage_.cell, stage_.cell,
                                std::min(kTileCells, stage_.nx - i0), std::min(kTileCells, stage_.ny - j0)};
            if (std::optional<TileResult> known = known_tile(t, grid)) results[t] = std::move(*known);
            else results[t] = run_tile(i0, j0, grid, report);
            stage_.context.advance();
        });
        merge(results, report);
        remember(std::move(results));
    }

    TileResult run_tile(int i0, int j0, const CellGrid& grid, SimulationReport& report) const {
        TileResult result;
        result.programs.resize(stage_.programs.size());
        result.layers.resize(stage_.input.layers.size());
        Stock stock(grid);
        LevelMotions level(grid);
        std::size_t next = 0;
        for (std::size_t l = 0; l < stage_.input.layers.size(); ++l) {
            const SimulatedLayer& layer = stage_.input.layers[l];
            lay_slab(stock, layer);
            double top = laid_top(layer, grid);
            for (; next < stage_.programs.size() &&
                   static_cast<std::size_t>(stage_.programs[next].program->layer) == l;
                 ++next) {
                result.programs[next].stock_top = top;
                if (stage_.programs[next].tool &&
                    run_program(stage_, stage_.programs[next], stock, top, level, result.programs[next]))
                    top = stock.highest();
                result.programs[next].top_after = top;
            }
            fill_dowels(stock, layer);
        }
        for (std::size_t c = 0; c < grid.count(); ++c)
            result.board_cut = std::max(result.board_cut, stock.board_cut(c));
        measure_tile(stage_, stock, i0, j0, result, report);
        return result;
    }

    /// Sums what the tiles found, in their order.
    void merge(const std::vector<TileResult>& results, SimulationReport& report) {
        taken_.assign(stage_.programs.size(), 0);
        std::vector<double> squares(stage_.input.layers.size(), 0);
        for (const TileResult& r : results) {
            for (std::size_t i = 0; i < r.programs.size(); ++i) {
                add(report.programs[i], r.programs[i], stage_.cell);
                taken_[i] = std::max(taken_[i], r.programs[i].most);
            }
            for (std::size_t i = 0; i < r.layers.size(); ++i) {
                add(report.layers[i], r.layers[i].findings);
                squares[i] += r.layers[i].squares;
            }
            report.board_cut = std::max(report.board_cut, r.board_cut);
            report.pattern_mm2 += static_cast<double>(r.pattern_cells) * stage_.cell * stage_.cell;
            raise(flask_cut_, r.flask.size, r.flask.where);
        }
        for (std::size_t i = 0; i < report.layers.size(); ++i) {
            LayerFindings& f = report.layers[i];
            f.lowest_tip = stage_.lowest_tip(i);
            f.left_rms = f.cells > 0 ? std::sqrt(squares[i] / static_cast<double>(f.cells)) : 0;
            const std::uint64_t reachable = f.cells - f.unreachable;
            f.within_share =
                reachable > 0 ? 1 - static_cast<double>(f.missed) / static_cast<double>(reachable) : 1;
        }
        for (ProgramFindings& f : report.programs) {
            report.removed_mm3 += f.removed_mm3;
            keep_worst(f.faults);
        }
    }

    Context& context_;
    SimulationMemory* memory_;  // may be null
    SimulationReport report_;
    SimulationStage stage_;
    std::optional<ProgramChanges> changes_;         // against the memory, where that is of this stage
    std::vector<CheckedProgram> checked_programs_;  // for the memory
    std::vector<double> taken_;                     // mm, the most that any cell lost, by program
    Extreme flask_cut_;
};

}  // namespace

SimulationReport simulate(Context& context, const SimulationInput& input, const StandingPart& part,
                          const SimulationOptions& options, SimulationMemory* memory) {
    return Simulation(context, input, part, options, memory).run();
}

}  // namespace slabwright

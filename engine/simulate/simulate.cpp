#include "engine/simulate/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "engine/simulate/core_contact.h"
#include "engine/simulate/dowel_proof.h"
#include "engine/simulate/laid_slabs.h"
#include "engine/simulate/reach.h"
#include "engine/simulate/simulation_memory.h"
#include "engine/simulate/work.h"
#include "kernels/errors.h"
#include "kernels/geometry/vectors.h"
#include "kernels/geometry/wide.h"
#include "kernels/parallel/parallel.h"
#include "kernels/stock/stock.h"

namespace slabwright {

namespace {

constexpr int kTileCells = 128;           // a side; a tile of 20 layers is 1.4 MB
constexpr std::size_t kBlockSteps = 128;  // of a program under one box
constexpr std::size_t kPartSteps = 16;    // of a block
constexpr double kTaken = 0.002;          // mm: less is rounding of the text and of the stock's float
constexpr double kDeeper = 0.05;          // mm by which a roughing cut may pass its planned step
constexpr double kAbreast = 3;            // fewer cells than this side by side do not tell how wide a cut is
constexpr double kStanding = 0.01;        // mm by which shank or holder must reach into stock to be reported

constexpr std::size_t kTileUnreached =
    256;  // places of a tile and layer that are kept of what is out of reach

constexpr double kArcError = 0.001;  // mm: more than rounding may add to Program::chord_error

StepBox box_of(const ProgramStep& a, const ProgramStep& b) {
    StepBox box;
    box.add(a);
    box.add(b);
    return box;
}

/// A program with what a tile needs to skip most of it.
struct PreparedProgram {
    const Program* program = nullptr;
    const Tool* tool = nullptr;
    CutterEnd end;
    double cut_mm = 0;  // of feed motions, seen from above
    std::vector<StepBox> blocks, parts;
};

void raise(Extreme& a, double size, const Point3& where) {
    if (size > a.size) a = {size, where};
}
/// Of two equal sizes the first stays, so the result depends on the order of tiles alone.
void raise(Extreme& a, std::uint32_t& line, const Extreme& b, std::uint32_t b_line) {
    if (b.size > a.size) a = b, line = b_line;
}

class Simulation {
public:
    Simulation(Context& context, const SimulationInput& input, const StandingPart& part,
               const SimulationOptions& options, SimulationMemory* memory)
        : context_(context), input_(input), options_(options), part_(part), memory_(memory) {}

    SimulationReport run() {
        check();
        SimulationReport report;
        report.cell = options_.cell > 0 ? options_.cell : simulation_cell(input_.tools, options_.cusp);
        cell_ = report.cell;
        const double width = input_.stock_max[0] - input_.stock_min[0],
                     depth = input_.stock_max[1] - input_.stock_min[1];
        report.nx = nx_ = std::max(1, static_cast<int>(std::ceil(width / cell_ - 1e-9)));
        report.ny = ny_ = std::max(1, static_cast<int>(std::ceil(depth / cell_ - 1e-9)));
        place_flasks();
        if (memory_ != nullptr && is_of(*memory_, input_, options_, cell_))
            changes_.emplace(memory_->programs, input_.programs);
        check_stack(report);
        prepare(report);
        constexpr double kReading =
            0.02;  // of the whole verification: plan.json and the programs, before this
        const SimulationWork work = simulation_work(size());
        checked_ = kReading + (1 - kReading) * work.checking / (work.checking + work.cutting);
        std::uint64_t steps = 0;
        for (const Program& program : input_.programs) steps += program.steps.size();
        context_.begin_phase("checking moves", kReading, checked_, steps);
        check_motions(report);
        cut(report);
        judge(report);
        return report;
    }

private:
    /// For the simulation after this one.
    void remember(std::vector<TileResult> tiles) {
        if (memory_ == nullptr) return;
        memory_->programs.clear();
        memory_->stage.layers = input_.layers, memory_->stage.tools = input_.tools;
        memory_->stage.stock_min = input_.stock_min, memory_->stage.stock_max = input_.stock_max;
        memory_->options = options_;
        memory_->cell = cell_;
        memory_->checked = std::move(checked_programs_);
        memory_->tiles = std::move(tiles);
    }

    /// A tile's findings where no program has changed near it; none where it has to be run.
    [[nodiscard]] std::optional<TileResult> known_tile(std::size_t tile, const CellGrid& grid) const {
        if (!changes_ || tile >= memory_->tiles.size()) return std::nullopt;
        double widest = 0;
        for (const Tool& t : input_.tools)
            widest = std::max({widest, t.diameter, t.shank_diameter, t.holder_diameter});
        const TileResult& before = memory_->tiles[tile];
        if (changes_->touch(grid, widest / 2 + cell_, before)) return std::nullopt;
        std::optional<TileResult> known = changes_->translated(before);
        for (std::size_t i = 0; known && i < prepared_.size(); ++i) {
            if (changes_->before(i)) continue;
            const int layer = input_.programs[i].layer;  // it meets nothing here
            const SimulatedLayer& of = input_.layers[static_cast<std::size_t>(layer)];
            TileProgram& p = known->programs[i];
            p.stock_top = p.top_after = i > 0 && input_.programs[i - 1].layer == layer
                                            ? known->programs[i - 1].top_after
                                            : laid_top(of, grid);
        }
        return known;
    }

    void check() const {
        auto bad = [](const std::string& what) {
            throw Error(ErrorKind::usage, "simulate.input", what, {}, "plan again");
        };
        if (input_.layers.empty()) bad("no layers");
        for (int k = 0; k < 2; ++k)
            if (!(input_.stock_max[k] > input_.stock_min[k]) || !std::isfinite(input_.stock_min[k]) ||
                !std::isfinite(input_.stock_max[k]))
                bad("the stock has no extent");
        double below = -1e-6;
        for (const SimulatedLayer& layer : input_.layers) {
            if (!(layer.z_top > layer.z_bottom) || !(layer.slab_thickness > 0) ||
                !(layer.z_bottom >= below) || !std::isfinite(layer.z_top))
                bad("a layer that lies not on the one before, or has no height");
            below = layer.z_top - 1e-6;
        }
        int layer = 0;
        for (const Program& program : input_.programs) {
            if (program.layer < layer || static_cast<std::size_t>(program.layer) >= input_.layers.size())
                bad("programs that are not in the order of the layers");
            layer = program.layer;
        }
    }

    /// The flasks of the layers with the tolerances of their walls. The grid's last cells may lie past the
    /// stock's edge, where no cutter has to go because of them: they count as border too.
    void place_flasks() {
        Loops slab;
        const Point2 low{to_units(input_.stock_min[0]), to_units(input_.stock_min[1])},
            high{to_units(input_.stock_max[0]), to_units(input_.stock_max[1])};
        slab.points = {low, {high.x, low.y}, high, {low.x, high.y}};
        slab.close_loop();
        for (const SimulatedLayer& layer : input_.layers) {
            flasks_.emplace_back();
            if (layer.flask.empty()) continue;
            flasks_.back().core = offset(layer.flask, -options_.gouge, 1e-3);
            flasks_.back().border = unite(offset(layer.flask, options_.cusp + options_.slack, 1e-2),
                                          subtract(offset(slab, 2 * cell_, 1e-2), slab));
        }
    }

    /// Whether slabs and layers can hold the part at all: what no slab covers cannot be missed by any cut.
    void check_stack(SimulationReport& report) const {
        const Box3 box = part_.box();
        const double tolerance = 10 * StandingPart::kSheet;
        const double over = box.max.z - input_.layers.back().z_top;
        if (over > tolerance && options_.whole)
            violate(report, "stack.short",
                    fmt::format("the layers end {:.3f} mm below the pattern's top", over), nullptr, 0,
                    Point3{box.max.x, box.max.y, box.max.z}, over);
        const double beyond = std::max({input_.stock_min[0] - box.min.x, input_.stock_min[1] - box.min.y,
                                        box.max.x - input_.stock_max[0], box.max.y - input_.stock_max[1]});
        if (beyond > tolerance && options_.whole)
            violate(report, "stack.narrow",
                    fmt::format("the pattern reaches {:.3f} mm past the slabs", beyond), nullptr, 0, {},
                    beyond);
        double below = 0;
        for (std::size_t l = 0; l < input_.layers.size(); ++l) {
            const SimulatedLayer& layer = input_.layers[l];
            if (std::abs(layer.z_bottom - below) > 1e-3)
                violate(report, "stack.gap",
                        fmt::format("layer {} begins at z {:.4f}, where the one below ends at {:.4f}", l + 1,
                                    layer.z_bottom, below),
                        nullptr, 0, {}, layer.z_bottom - below);
            const double lacking = layer.z_top - layer.z_bottom - layer.slab_thickness;
            if (lacking > 1e-6)
                violate(report, "stack.thin",
                        fmt::format("layer {} is {:.4f} mm taller than its slab", l + 1, lacking), nullptr, 0,
                        {}, lacking);
            below = layer.z_top;
        }
        for (Violation& v : blanks_too_small(context_, input_)) report.violations.push_back(std::move(v));
    }

    /// Once the cells are known.
    SimulationSize size() const {
        SimulationSize size;
        for (const PreparedProgram& p : prepared_) {
            size.steps += p.program->close_steps();
            if (p.tool) size.swept_mm2 += p.cut_mm * p.tool->diameter;
        }
        size.stock_mm2 = static_cast<double>(nx_) * ny_ * cell_ * cell_;
        size.cell_mm = cell_;
        size.layers = input_.layers.size();
        size.facets = input_.mesh.facets.size();
        return size;
    }

    const Tool* tool(int number) const {
        for (const Tool& t : input_.tools)
            if (t.number == number) return &t;
        return nullptr;
    }

    void violate(SimulationReport& report, const std::string& code, const std::string& message,
                 const Program* program, std::uint32_t line, std::optional<Point3> where, double size,
                 std::optional<std::size_t> layer = {}) const {
        report.violations.push_back({code, message, program ? program->file : "", line, where, size, layer});
    }

    void prepare(SimulationReport& report) {
        for (const Program& program : input_.programs) {
            PreparedProgram p;
            p.program = &program;
            p.tool = tool(program.tool);
            if (!p.tool)
                violate(report, "tool.unknown",
                        fmt::format("loads tool {}, which the plan's library does not hold", program.tool),
                        &program, 0, {}, 0);
            else if (program.tool != program.planned_tool)
                violate(report, "tool.wrong",
                        fmt::format("loads tool {} where the plan names tool {}", program.tool,
                                    program.planned_tool),
                        &program, 0, {}, 0);
            if (p.tool) p.end = cutter_end(cutter_shape(*p.tool));
            prepared_.push_back(std::move(p));
        }
        parallel_each(context_, prepared_.size(), [&](std::size_t i) {
            PreparedProgram& p = prepared_[i];
            const auto& steps = p.program->steps;
            p.blocks.reserve(steps.size() / kBlockSteps + 1);
            p.parts.reserve(p.blocks.capacity() * (kBlockSteps / kPartSteps));
            for (std::size_t first = 1; first < steps.size(); first += kPartSteps) {
                StepBox box;
                for (std::size_t k = first; k < std::min(steps.size(), first + kPartSteps); ++k) {
                    const ProgramStep &a = steps[k - 1], &b = steps[k];
                    if (!a.known() || !b.known()) continue;
                    box.add(a), box.add(b);
                    if (!b.rapid()) p.cut_mm += std::hypot(b.x - a.x, b.y - a.y);
                }
                if (p.parts.size() % (kBlockSteps / kPartSteps) == 0) p.blocks.emplace_back();
                p.parts.push_back(box);
                p.blocks.back().add(box);
            }
        });
    }

    /// All that needs no stock: the exact check, the spindle, the machine's travel, the time. Programs are
    /// independent.
    void check_motions(SimulationReport& report) {
        report.programs.resize(input_.programs.size());
        std::vector<std::optional<StandingPart>> walls(input_.layers.size());  // of the flasks
        for (const Program& program : input_.programs) {
            const auto l = static_cast<std::size_t>(program.layer);
            if (!walls[l] && !input_.layers[l].flask.empty())
                walls[l].emplace(context_, flask_walls(input_.layers, l).view());
        }
        std::vector<StepBox> boxes(input_.programs.size());
        parallel_each(context_, input_.programs.size(), [&](std::size_t i) {
            ProgramFindings& f = report.programs[i];
            if (changes_ && changes_->is_same(i)) {
                const CheckedProgram& known = memory_->checked[*changes_->before(i)];
                f = known.findings, boxes[i] = known.box;
                f.seconds = seconds_of(i);
            } else {
                boxes[i] = check_program(i, walls[static_cast<std::size_t>(input_.programs[i].layer)], f);
            }
            context_.advance(input_.programs[i].steps.size());
        });
        if (memory_ != nullptr)
            for (std::size_t i = 0; i < input_.programs.size(); ++i)
                checked_programs_.push_back({report.programs[i], boxes[i]});
        for (std::size_t i = 0; i < input_.programs.size(); ++i) {
            const Program& program = input_.programs[i];
            const ProgramFindings& f = report.programs[i];
            if (f.spindle_off_line != 0)
                violate(report, "spindle.off", "feeds while the spindle does not turn", &program,
                        f.spindle_off_line, {}, 0);
            const Machine& m = input_.machine;
            auto travel = [&](const char* axis, double span, double limit) {
                if (span > limit + 1e-6)
                    violate(report, "travel.exceeded",
                            fmt::format("moves over {:.3f} mm in {}; the machine travels {:.3f} mm", span,
                                        axis, limit),
                            &program, 0, {}, span - limit);
            };
            const StepBox& box = boxes[i];
            if (box.x1 >= box.x0) {
                travel("x", box.x1 - box.x0, m.travel_x);
                travel("y", box.y1 - box.y0, m.travel_y);
            }
            if (box.z1 >= box.z0) travel("z", box.z1 - box.z0, m.travel_z);
            report.gouge_max = std::max(report.gouge_max, f.gouge.cutter.depth);
            report.seconds += f.seconds;
            report.cutting_mm += f.cutting_mm;
            report.rapid_mm += f.rapid_mm;
        }
    }

    [[nodiscard]] double seconds_of(std::size_t i) const {
        return program_seconds(input_.programs[i], input_.machine, i > 0 ? &input_.programs[i - 1] : nullptr);
    }

    /// One program's findings. @return what its steps reach over, as far as known
    StepBox check_program(std::size_t i, const std::optional<StandingPart>& walls, ProgramFindings& f) const {
        const Program& program = input_.programs[i];
        const SimulatedLayer& layer = input_.layers[static_cast<std::size_t>(program.layer)];
        f.lowest = layer.z_top;
        f.stock_top = -kUnbounded;
        f.seconds = seconds_of(i);
        StepBox box;
        for (const ProgramArc& a : program.arcs) {
            box.add(a);
            f.cutting_mm += a.arc.length();
        }
        auto arc = program.arcs.begin();
        for (std::size_t k = 0; k < program.steps.size(); ++k) {
            const ProgramStep& s = program.steps[k];
            if (s.known()) box.add(s);
            if (std::isfinite(s.z)) box.z1 = std::max(box.z1, s.z), box.z0 = std::min(box.z0, s.z);
            if (!s.rapid() && !s.spindle && f.spindle_off_line == 0) f.spindle_off_line = s.line;
            if (k == 0 || !program.steps[k - 1].known() || !s.known()) continue;
            while (arc != program.arcs.end() && arc->end <= k) ++arc;
            if (arc != program.arcs.end() && arc->begin <= k) continue;
            const ProgramStep& b = program.steps[k - 1];
            (s.rapid() ? f.rapid_mm : f.cutting_mm) +=
                std::sqrt((s.x - b.x) * (s.x - b.x) + (s.y - b.y) * (s.y - b.y) + (s.z - b.z) * (s.z - b.z));
        }
        if (const Tool* const tool = prepared_[i].tool) {
            // A path whose corners the machine may round farther than a finish pass's is safe as far as it
            // may leave it.
            const Tool wide = program.strays > kJunction ? wider(*tool, program.strays) : *tool;
            const std::optional<Program> above = above_dowels(program, layer, *tool);
            f.gouge = check_gouge(context_, part_, layer.z_top, wide, above ? *above : program,
                                  {options_.gouge, 1e-5});
            if (walls)
                f.flask =
                    check_gouge(context_, *walls, layer.z_top, *tool, program, {options_.gouge, 1e-5}).cutter;
        }
        return box;
    }

    /// Tiles are independent: each builds its own stock from the first slab to the last and runs every
    /// program over it.
    void cut(SimulationReport& report) {
        const int tx = (nx_ + kTileCells - 1) / kTileCells, ty = (ny_ + kTileCells - 1) / kTileCells;
        const std::size_t tiles = static_cast<std::size_t>(tx) * static_cast<std::size_t>(ty);
        const std::uint64_t tile_bytes =
            static_cast<std::uint64_t>(kTileCells) * kTileCells * 4 * (input_.layers.size() + 4);
        const std::uint64_t map_bytes =
            options_.maps
                ? static_cast<std::uint64_t>(nx_) * static_cast<std::uint64_t>(ny_) * 5 * input_.layers.size()
                : 0;
        const MemoryCharge charge(context_,
                                  tile_bytes * static_cast<std::uint64_t>(context_.threads()) + map_bytes +
                                      tiles * (input_.programs.size() * sizeof(TileProgram) +
                                               input_.layers.size() * sizeof(TileLayer)),
                                  "the simulated stock");
        report.layers.resize(input_.layers.size());
        if (options_.maps)
            for (LayerFindings& l : report.layers) {
                l.map.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), 0.0f);
                l.kinds.assign(l.map.size(), CellKind::beside);
            }
        std::vector<TileResult> results(tiles);
        context_.begin_phase("cutting stock", checked_, 1.0, tiles);
        parallel_each(context_, tiles, [&](std::size_t t) {
            const int i0 = static_cast<int>(t % static_cast<std::size_t>(tx)) * kTileCells,
                      j0 = static_cast<int>(t / static_cast<std::size_t>(tx)) * kTileCells;
            const CellGrid grid{input_.stock_min[0] + (i0 + 0.5) * cell_,
                                input_.stock_min[1] + (j0 + 0.5) * cell_, cell_,
                                std::min(kTileCells, nx_ - i0), std::min(kTileCells, ny_ - j0)};
            if (std::optional<TileResult> known = known_tile(t, grid)) results[t] = std::move(*known);
            else results[t] = run_tile(i0, j0, grid, report);
            context_.advance();
        });
        taken_.assign(prepared_.size(), 0);
        std::vector<double> squares(input_.layers.size(), 0);
        for (const TileResult& r : results) {
            for (std::size_t i = 0; i < r.programs.size(); ++i) {
                const TileProgram& p = r.programs[i];
                ProgramFindings& f = report.programs[i];
                f.removed_mm3 += p.removed * cell_ * cell_;
                f.lowest = std::min(f.lowest, p.lowest);
                f.stock_top = std::max(f.stock_top, p.stock_top);
                taken_[i] = std::max(taken_[i], p.most);
                raise(f.rapid, f.rapid_line, p.rapid, p.rapid_line);
                raise(f.over_flute, f.over_flute_line, p.over_flute, p.over_flute_line);
                raise(f.deepest, f.deepest_line, p.deepest, p.deepest_line);
                raise(f.shank, f.shank_line, p.shank, p.shank_line);
                raise(f.holder, f.holder_line, p.holder, p.holder_line);
                raise(f.crushed, f.crushed_line,
                      {p.core.deepest, {p.core.where[0], p.core.where[1], p.core.z}}, p.core.line);
                f.crushed_mm2 += static_cast<double>(p.core.cells) * cell_ * cell_;
                f.faults.insert(f.faults.end(), p.faults.begin(), p.faults.end());
            }
            for (std::size_t i = 0; i < r.layers.size(); ++i) {
                const LayerFindings& l = r.layers[i].findings;
                LayerFindings& f = report.layers[i];
                f.cells += l.cells, f.gouge_cells += l.gouge_cells, f.over += l.over,
                    f.unreachable += l.unreachable, f.missed += l.missed, f.waste += l.waste;
                f.unreached.insert(f.unreached.end(), l.unreached.begin(), l.unreached.end());
                f.waste_mm3 += l.waste_mm3;
                f.unmade_mm3 += l.unmade_mm3;
                raise(f.unmade, l.unmade.size, l.unmade.where);
                raise(f.gouge, l.gouge.size, l.gouge.where);
                raise(f.left, l.left.size, l.left.where);
                raise(f.unreachable_left, l.unreachable_left.size, l.unreachable_left.where);
                raise(f.missed_left, l.missed_left.size, l.missed_left.where);
                f.missed_places.insert(f.missed_places.end(), l.missed_places.begin(), l.missed_places.end());
                squares[i] += r.layers[i].squares;
            }
            report.board_cut = std::max(report.board_cut, r.board_cut);
            report.pattern_mm2 += static_cast<double>(r.pattern_cells) * cell_ * cell_;
            raise(flask_cut_, r.flask.size, r.flask.where);
        }
        for (std::size_t i = 0; i < report.layers.size(); ++i) {
            LayerFindings& f = report.layers[i];
            f.lowest_tip = lowest_tip(i);
            f.left_rms = f.cells > 0 ? std::sqrt(squares[i] / static_cast<double>(f.cells)) : 0;
            const std::uint64_t reachable = f.cells - f.unreachable;
            f.within_share =
                reachable > 0 ? 1 - static_cast<double>(f.missed) / static_cast<double>(reachable) : 1;
        }
        for (ProgramFindings& f : report.programs) {
            report.removed_mm3 += f.removed_mm3;
            keep_worst(f.faults);
        }
        remember(std::move(results));
    }

    /// Sorts by fault and line; of a line that has a fault in several tiles the most stays.
    static void keep_worst(std::vector<FaultyMotion>& faults) {
        std::sort(faults.begin(), faults.end());
        std::vector<FaultyMotion> worst;
        for (const FaultyMotion& f : faults)
            if (!worst.empty() && worst.back().fault == f.fault && worst.back().line == f.line)
                worst.back() = f;
            else worst.push_back(f);
        faults = std::move(worst);
    }

    TileResult run_tile(int i0, int j0, const CellGrid& grid, SimulationReport& report) const {
        TileResult result;
        result.programs.resize(prepared_.size());
        result.layers.resize(input_.layers.size());
        Stock stock(grid);
        LevelMotions level(grid);
        std::size_t next = 0;
        for (std::size_t l = 0; l < input_.layers.size(); ++l) {
            const SimulatedLayer& layer = input_.layers[l];
            lay_slab(stock, layer);
            double top = laid_top(layer, grid);
            for (; next < prepared_.size() && static_cast<std::size_t>(prepared_[next].program->layer) == l;
                 ++next) {
                result.programs[next].stock_top = top;
                if (prepared_[next].tool &&
                    run_program(prepared_[next], stock, top, level, result.programs[next]))
                    top = stock.highest();
                result.programs[next].top_after = top;
            }
            fill_dowels(stock, layer);
        }
        for (std::size_t c = 0; c < grid.count(); ++c)
            result.board_cut = std::max(result.board_cut, stock.board_cut(c));
        constexpr float nothing = std::numeric_limits<float>::lowest();
        std::vector<float> heights(grid.count()), air(grid.count());
        RisingEnvelope envelope(part_, grid.x0, grid.y0, grid.cell, grid.nx, grid.ny);
        for (std::size_t l = 0; l < input_.layers.size(); ++l) {
            context_.throw_if_cancelled();
            envelope.at(input_.layers[l].z_top, nothing, heights.data());
            measure_layer(l, stock, heights, result, i0, j0, report);
            thin(result.layers[l].findings.unreached);
            envelope.covered_air(input_.layers[l].z_bottom, air.data());
            measure_unmade(grid, air, input_.layers[l].z_bottom, result.layers[l].findings);
        }
        result.pattern_cells = static_cast<std::uint64_t>(
            std::count_if(heights.begin(), heights.end(), [](float z) { return z != nothing; }));
        return result;
    }

    /// Keeps one of each equal share, which stands for all of it.
    static void thin(std::vector<UnreachedCell>& cells) {
        if (cells.size() <= kTileUnreached) return;
        const double share = static_cast<double>(cells.size()) / kTileUnreached;
        for (std::size_t k = 0; k < kTileUnreached; ++k) {
            cells[k] = cells[static_cast<std::size_t>((static_cast<double>(k) + jitter(k)) * share)];
            cells[k].cells = static_cast<float>(share);
        }
        cells.resize(kTileUnreached);
        cells.shrink_to_fit();
    }

    /// Sums the air that stays filled in one layer. A column at the rim of it does not count: a wall that
    /// leans inwards by a hair leaves tall air as thin as that hair.
    void measure_unmade(const CellGrid& grid, const std::vector<float>& air, double z_bottom,
                        LayerFindings& f) const {
        const auto has_air = [&](int i, int j) {
            if (i < 0 || j < 0 || i >= grid.nx || j >= grid.ny) return true;
            return air[static_cast<std::size_t>(j) * static_cast<std::size_t>(grid.nx) +
                       static_cast<std::size_t>(i)] > StandingPart::kSheet;
        };
        std::size_t c = 0;
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i, ++c) {
                if (!has_air(i, j) || !has_air(i - 1, j) || !has_air(i + 1, j) || !has_air(i, j - 1) ||
                    !has_air(i, j + 1))
                    continue;
                f.unmade_mm3 += air[c] * cell_ * cell_;
                raise(f.unmade, air[c], {grid.x0 + i * cell_, grid.y0 + j * cell_, z_bottom});
            }
    }

    /// Straight level motions of a flat cutter at one height that follow one another in a tile. What they
    /// take together does not depend on their order, so it is taken once for all, unless it is so deep that
    /// it must be told of which motion.
    struct LevelMotions {
        explicit LevelMotions(const CellGrid& grid) : region(grid) {}
        struct Motion {
            std::size_t step;
            bool been;  // whether the motion before has taken what the cutter covers at the begin
        };
        LevelRegion region;
        std::vector<Motion> motions;
        double z = 0;
    };

    /// An arc of one radius ends up to a rounding of the text beside where the text ends it. What a rapid
    /// starts from has been cut there.
    static CutEffect cut_arc_end(const PreparedProgram& p, const ProgramArc& arc, Stock& stock, double deep) {
        const std::vector<ProgramStep>& steps = p.program->steps;
        if (arc.end >= steps.size() || !steps[arc.end].rapid()) return {};
        const ProgramStep& last = steps[arc.end - 1];
        const Point3 there{last.x, last.y, last.z};
        return stock.cut(p.end, there, there, deep);
    }

    /// Runs a program over a tile whose highest stock stands at `top`; whether it took anything.
    bool run_program(const PreparedProgram& p, Stock& stock, double top, LevelMotions& level,
                     TileProgram& out) const {
        const auto& steps = p.program->steps;
        const CellGrid& grid = stock.grid();
        const Tool& tool = *p.tool;
        const double radius = tool.diameter / 2, shank = tool.shank_diameter / 2,
                     nose = tool.holder_diameter / 2;
        // A sliver that stood between passes overloads nobody; a tenth of the cutter's disc does. Where cells
        // lie one or two abreast, along a wall, they do not tell how wide what stood there was: a micrometre
        // at the cutter's rim may hold the centres of a whole row.
        const double deep =
            p.program->planned_stepdown > 0 ? p.program->planned_stepdown + kDeeper : kUnbounded;
        const double wide = 0.1 * std::numbers::pi * radius * radius;
        const double shallow =
            std::min(deep, tool.flute_length > 0 ? tool.flute_length + kStanding : kUnbounded) - kTaken;
        const bool thick_shank = shank > radius && tool.flute_length > 0,
                   thick_nose = nose > radius && tool.stickout > 0;
        // Shank and holder are wider, but mostly stay above all that stands.
        const double aside = radius + p.program->chord_error +
                             kArcError;  // what an arc covers goes no farther beyond its chords
        const auto meets = [&](const StepBox& box) {
            double margin = aside;
            if (thick_shank && box.z0 + tool.flute_length < top) margin = std::max(margin, shank);
            if (thick_nose && box.z0 + tool.stickout < top) margin = std::max(margin, nose);
            return box.meets(grid, margin, top);
        };
        const auto& arcs = p.program->arcs;
        CoreContact core(tool, grid);
        std::size_t arc = 0, cut_arcs = 0;  // the arc at hand or next; how many have been cut
        bool any = false;
        const auto tell = [&](std::size_t i, const CutEffect& e) {
            if (!(e.removed > 0)) return;
            const ProgramStep &a = steps[i - 1], &b = steps[i];
            const double low = std::min(a.z, b.z);
            any = true;
            out.removed += e.removed;
            out.lowest = std::min(out.lowest, e.lowest);
            out.most = std::max(out.most, e.deepest);
            const Point3 where{e.where[0], e.where[1], low};
            const auto fault = [&](FaultyMotion::Fault what, double size) {
                if (options_.faults) out.faults.push_back({what, b.line, size});
            };
            if (b.rapid() && e.deepest > kTaken) fault(FaultyMotion::Fault::rapid, e.deepest);
            if (b.rapid() && e.deepest > kTaken && e.deepest > out.rapid.size)
                out.rapid = {e.deepest, where}, out.rapid_line = b.line;
            const bool is_deep =
                static_cast<double>(e.deep_cells) * cell_ * cell_ > wide && e.deep_across >= kAbreast;
            if (is_deep && e.deepest > deep) fault(FaultyMotion::Fault::too_deep, e.deepest);
            if (is_deep && e.deepest > out.deepest.size)
                out.deepest = {e.deepest, where}, out.deepest_line = b.line;
            const double over = e.highest - low - tool.flute_length;
            if (tool.flute_length > 0 && over > kStanding)
                fault(FaultyMotion::Fault::too_deep, e.highest - low);
            if (tool.flute_length > 0 && over > kStanding && over > out.over_flute.size)
                out.over_flute = {over, where}, out.over_flute_line = b.line;
        };
        const auto cut_level = [&] {
            if (level.motions.empty()) return;
            if (const auto e = stock.cut(level.region, level.z, shallow)) {
                if (e->removed > 0) any = true;
                out.removed += e->removed;
                out.lowest = std::min(out.lowest, e->lowest);
                out.most = std::max(out.most, e->deepest);
            } else {
                for (const LevelMotions::Motion& m : level.motions) {
                    const ProgramStep &a = steps[m.step - 1], &b = steps[m.step];
                    ChainedSweep chain;
                    chain.been = m.been;
                    tell(m.step, stock.cut(p.end, {a.x, a.y, a.z}, {b.x, b.y, b.z}, deep, chain));
                }
            }
            level.motions.clear();
        };
        const auto run_step = [&](std::size_t i) {
            const ProgramStep &a = steps[i - 1], &b = steps[i];
            if (!a.known() || !b.known()) return;
            const StepBox box = box_of(a, b);
            if (!meets(box)) return;
            if (core.watches() && core.concerns(stock, a, b)) {
                cut_level();
                core.follow(stock, a, b);
            }
            const Point3 from{a.x, a.y, a.z}, to{b.x, b.y, b.z};
            const double low = std::min(a.z, b.z);
            // An arc is cut whole at the first of its chords that comes near; the others then have nothing to
            // do.
            if (arc < arcs.size() && arcs[arc].end <= i)
                arc = static_cast<std::size_t>(
                    std::partition_point(arcs.begin() + static_cast<std::ptrdiff_t>(arc), arcs.end(),
                                         [&](const ProgramArc& each) { return each.end <= i; }) -
                    arcs.begin());
            const bool in_arc = arc < arcs.size() && arcs[arc].begin <= i,
                       cut_before = in_arc && arc < cut_arcs;
            const bool follows =
                (thick_shank && low + tool.flute_length < top) || (thick_nose && low + tool.stickout < top);
            const bool near = box.meets(grid, aside, top) && !cut_before;
            if (!near && !follows) return;
            // A straight feed motion shares its ends with those beside it; what a rapid takes is all told of
            // the rapid.
            const auto chained =
                [&](std::size_t k) {  // whether motion k, next to this one, is a straight feed motion too
                    if (b.rapid() || k == 0 || k >= steps.size() || !steps[k - 1].known() ||
                        !steps[k].known() || steps[k].rapid())
                        return false;
                    const bool last_arc = arc > 0 && arcs[arc - 1].end > k,
                               next_arc = arc < arcs.size() && arcs[arc].begin <= k;
                    return !last_arc && !next_arc;
                };
            const bool disc = p.end.form == CutterEnd::Form::flat && !b.rapid() && !in_arc &&
                              (a.z == b.z || (a.x == b.x && a.y == b.y));
            if (disc && !follows) {
                if (low != level.z) cut_level();
                level.z = low;
                level.region.add({a.x, a.y}, {b.x, b.y}, radius);
                level.motions.push_back({i, chained(i - 1)});
                return;
            }
            // Nothing to take, as most of the ways between cuts; what is still to be cut only adds to that.
            if (!in_arc && !follows &&
                stock.clear(box.x0 - aside, box.x1 + aside, box.y0 - aside, box.y1 + aside, low))
                return;
            cut_level();
            if (near) {
                Point3 before{}, after{};
                ChainedSweep chain;
                if (!in_arc && chained(i - 1))
                    before = {steps[i - 2].x, steps[i - 2].y, steps[i - 2].z}, chain.before = &before;
                if (!in_arc && chained(i + 1))
                    after = {steps[i + 1].x, steps[i + 1].y, steps[i + 1].z}, chain.after = &after;
                tell(i, in_arc ? stock.cut(p.end, arcs[arc].arc, deep)
                               : stock.cut(p.end, from, to, deep, chain));
                if (in_arc) {
                    cut_arcs = arc + 1;
                    tell(i, cut_arc_end(p, arcs[arc], stock, deep));
                }
            }
            auto follow = [&](double thick, double above, Extreme& extreme, std::uint32_t& line) {
                if (low + above >= top) return;
                std::array<double, 2> where{};
                const double reach =
                    stock.reach(thick, {a.x, a.y, a.z + above}, {b.x, b.y, b.z + above}, where);
                if (options_.faults && reach > kStanding)
                    out.faults.push_back({FaultyMotion::Fault::in_standing, b.line, reach});
                if (reach > kStanding && reach > extreme.size)
                    extreme = {reach, {where[0], where[1], low + above}}, line = b.line;
            };
            if (thick_shank) follow(shank, tool.flute_length, out.shank, out.shank_line);
            if (thick_nose) follow(nose, tool.stickout, out.holder, out.holder_line);
        };
        for (std::size_t block = 0; block < p.blocks.size(); ++block) {
            if (!meets(p.blocks[block])) continue;
            constexpr std::size_t parts = kBlockSteps / kPartSteps;
            for (std::size_t part = block * parts; part < std::min(p.parts.size(), (block + 1) * parts);
                 ++part) {
                if (!meets(p.parts[part])) continue;
                const std::size_t begin = 1 + part * kPartSteps;
                for (std::size_t i = begin; i < std::min(steps.size(), begin + kPartSteps); ++i) run_step(i);
            }
        }
        cut_level();
        out.core = core.findings();
        if (options_.faults)
            for (const auto& [line, over] : out.core.lines)
                out.faults.push_back({FaultyMotion::Fault::crush, line, over});
        return any;
    }

    /// A layer's flask with the tolerances of its walls: nothing of the core may be lost, nothing need be
    /// gone within the border.
    struct Kept {
        Loops core, border;
    };
    enum class FlaskCell : char { none, border, core };

    /// Which cells belong to a layer's flask, row by row.
    std::vector<FlaskCell> flask_cells(const Kept& kept, const CellGrid& grid) const {
        std::vector<FlaskCell> cells(kept.border.empty() ? 0 : grid.count(), FlaskCell::none);
        if (cells.empty()) return cells;
        std::vector<double> rows;
        for (int j = 0; j < grid.ny; ++j) rows.push_back(grid.y(j) * kUnitsPerMm);
        for (const auto& [region, what] :
             {std::pair{&kept.border, FlaskCell::border}, {&kept.core, FlaskCell::core}}) {
            const std::vector<std::vector<Span>> spans = line_spans(*region, rows);
            for (int j = 0; j < grid.ny; ++j)
                for (const Span& span : spans[static_cast<std::size_t>(j)])
                    for (int i = 0; i < grid.nx; ++i)
                        if (const double x = grid.x(i) * kUnitsPerMm; x >= span.low && x < span.high)
                            cells[grid.index(i, j)] = what;
        }
        return cells;
    }

    [[nodiscard]] std::size_t map_cell(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(i);
    }

    /// Below which no tool goes in a layer, mm.
    [[nodiscard]] double lowest_tip(std::size_t l) const {
        return l == 0 && options_.board_cut >= 0 ? input_.layers[l].z_bottom - options_.board_cut
                                                 : -std::numeric_limits<double>::infinity();
    }

    /// Compares one layer's stock with the part's envelope, when all programs of all layers have run.
    void measure_layer(std::size_t l, const Stock& stock, const std::vector<float>& envelope,
                       TileResult& result, int i0, int j0, SimulationReport& report) const {
        const SimulatedLayer& layer = input_.layers[l];
        const CellGrid& grid = stock.grid();
        const std::vector<FlaskCell> flask = flask_cells(flasks_[l], grid);
        TileLayer& out = result.layers[l];
        LayerFindings& f = out.findings;
        const double limit = options_.cusp + options_.slack;
        const double lowest = lowest_tip(l);
        Reach reach(part_, input_.tools, layer.z_bottom, layer.z_top, lowest);
        const StandingHeights surface = stock.standing(l);
        const auto covered =
            static_cast<float>(layer.z_top);  // what the envelope is where the part goes on above
        const double part_from = layer.z_bottom + StandingPart::kSheet;
        std::size_t c = 0;
        const auto measure = [&](int i, int j) {
            const double x = grid.x(i), y = grid.y(j), z = surface(c);
            if (!flask.empty() && flask[c] != FlaskCell::none) {
                if (flask[c] == FlaskCell::core) raise(result.flask, layer.z_top - z, {x, y, z});
                if (options_.maps) report.layers[l].kinds[map_cell(i0 + i, j0 + j)] = CellKind::flask;
                return;
            }
            ++f.cells;
            const bool beside = envelope[c] < part_from;
            const double keep = beside ? layer.z_bottom : static_cast<double>(envelope[c]);
            double over = z - keep;
            CellKind kind = beside ? CellKind::beside : CellKind::pattern;
            if (over < 0) {
                const double depth = depth_of_lost(
                    {x, y, z}, keep, options_.maps ? 0 : std::min(options_.gouge, f.gouge.size));
                raise(f.gouge, depth, {x, y, z});
                f.gouge_cells += depth > options_.gouge;
                if (depth > options_.gouge) kind = CellKind::gouge;
                over = -depth;
            } else if (over > 0) {
                // Vertical height overstates what is left on a slope. Along the normal it is the distance
                // from the finished surface, which beside the pattern is the layer's bottom.
                if (over > options_.cusp) {
                    const auto near = part_.from_shadow({x, y, z}, layer.z_top, over, envelope[c] == covered);
                    over = std::min(over, near.distance);
                    if (over > options_.cusp) kind = CellKind::left;
                    if (over > limit)
                        kind = judge_leftover(layer, reach, {x, y, z}, over, near, beside, z - keep, f);
                }
                raise(f.left, over, {x, y, z});
                out.squares += over * over;
            }
            if (options_.maps) {
                report.layers[l].map[map_cell(i0 + i, j0 + j)] = static_cast<float>(over);
                report.layers[l].kinds[map_cell(i0 + i, j0 + j)] = kind;
            }
        };
        // Most cells have nothing to tell but the square of what little is left: eight are asked at once
        // whether it is so.
        Doubles8 squares{};
        const auto plain = [&] {
            Floats8 height, upper;
            std::memcpy(&height, surface.height + c, sizeof height);
            std::memcpy(&upper, envelope.data() + c, sizeof upper);
            const Doubles8 z = surface.bottom + __builtin_convertvector(height, Doubles8),
                           part = __builtin_convertvector(upper, Doubles8);
            const Doubles8 over = z - (part < part_from ? Doubles8{} + layer.z_bottom : part);
            const auto more = (over < 0.0) | (over > std::min(options_.cusp, f.left.size));
            std::int64_t any = 0;
            for (int k = 0; k < 8; ++k) any |= more[k];
            if (any != 0) return false;
            squares += over * over;
            f.cells += 8;
            return true;
        };
        const bool plainly = flask.empty() && !options_.maps;
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx;) {
                if (plainly && i + 8 <= grid.nx && plain()) {
                    i += 8, c += 8;
                    continue;
                }
                for (const int end = std::min(i + 8, grid.nx); i < end; ++i, ++c) measure(i, j);
            }
        for (int k = 0; k < 8; ++k) out.squares += squares[k];
    }

    /// How deep in the part the material was that a column has lost between the stock's surface and the
    /// part's: the greatest distance from the part's surface of those of its points that are within the part.
    /// (The lowest point alone will not do: it may lie on the part's own bottom. Points under an overhang are
    /// in the part's shadow, but no part was lost there.)
    /// @param enough what is no deeper need not be told from 0, mm
    double depth_of_lost(const Point3& surface, double keep, double enough) const {
        const double height = keep - surface[2];
        if (height <= options_.gouge / 5) return height;
        constexpr int kPoints = 8;
        double depth = 0, from = surface[2],
               distance = height;  // that a point below is from a facet at most, and it
        for (int k = 0; k < kPoints; ++k) {
            const double z = surface[2] + height * k / kPoints, cap = std::min(height, keep - z),
                         known = std::max(depth, enough);
            if (cap <= known) break;
            if (k > 0 && distance + (z - from) <= known) continue;
            const Point3 lost{surface[0], surface[1], z};
            from = z, distance = part_.from_facets(lost, cap, known);
            if (distance > known && part_.covered(lost[0], lost[1], lost[2]))
                depth = distance;  // else it is outside of the part
        }
        return depth;
    }

    /// Stock that stands `over` above the finished surface is excused as far as no tool reaches into it. What
    /// could have been taken at a point of its surface is the greatest d for which tools reach the points d
    /// away from it towards the part, straight down and down at 45° to four sides: a lump of that size, not
    /// the sliver beside what is out of reach. Found by halving.
    CellKind judge_leftover(const SimulatedLayer& layer, Reach& reach, const Point3& s, double over,
                            const StandingPart::Clearance& near, bool beside, double height,
                            LayerFindings& f) const {
        const double limit = options_.cusp + options_.slack;
        Point3 n{0, 0, 1};
        if (near.distance < height && near.distance > 0)
            for (int k = 0; k < 3; ++k) n[k] = near.away[k] / near.distance;
        const double h = std::sqrt(0.5);
        const std::array<Point3, 6> ways{Point3{0, 0, 1}, n, {h, 0, h}, {-h, 0, h}, {0, h, h}, {0, -h, h}};
        auto could_take = [&](double d) {
            for (const Point3& w : ways)
                if (!reach.reachable(
                        {s[0] - w[0] * d, s[1] - w[1] * d, std::max(layer.z_bottom, s[2] - w[2] * d)}))
                    return false;
            return true;
        };
        ++f.over;
        if (!could_take(limit)) {
            ++f.unreachable;
            f.unreached.push_back({s, over, 1});
            raise(f.unreachable_left, over, s);
            return CellKind::unreachable;
        }
        ++f.missed;
        if (options_.faults) f.missed_places.push_back({s, over, height});
        // Only the most matters, so a cell that cannot exceed it is not asked.
        if (over > f.missed_left.size) {
            double low = limit, high = over;
            for (int i = 0; i < 5 && high - low > 0.02; ++i) {
                const double mid = (low + high) / 2;
                (could_take(mid) ? low : high) = mid;
            }
            raise(f.missed_left, low, s);
        }
        if (beside) {
            ++f.waste;
            f.waste_mm3 += height * cell_ * cell_;
        }
        return CellKind::missed;
    }

    /// Turns findings into violations, kind by kind.
    void judge(SimulationReport& report) const {
        auto each = [&](auto&& fn) {
            for (std::size_t i = 0; i < report.programs.size(); ++i)
                fn(input_.programs[i], report.programs[i], i);
        };
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (f.gouge.cutter.depth > options_.gouge)
                violate(report, "gouge.cutter",
                        fmt::format("the cutter goes {:.4f} mm into the part ({} motions over {:.4f} mm)",
                                    f.gouge.cutter.depth, f.gouge.gouges, options_.gouge),
                        &p, f.gouge.cutter.line, f.gouge.cutter.tip, f.gouge.cutter.depth);
        });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (f.flask.depth > options_.gouge)
                violate(report, "gouge.flask",
                        fmt::format("the cutter goes {:.4f} mm into the flask", f.flask.depth), &p,
                        f.flask.line, f.flask.tip, f.flask.depth);
        });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (f.gouge.shank.depth > options_.gouge)
                violate(report, "contact.shank",
                        fmt::format("the shank goes {:.4f} mm into the part", f.gouge.shank.depth), &p,
                        f.gouge.shank.line, f.gouge.shank.tip, f.gouge.shank.depth);
            if (f.gouge.holder.depth > options_.gouge)
                violate(report, "contact.holder",
                        fmt::format("the holder goes {:.4f} mm into the part", f.gouge.holder.depth), &p,
                        f.gouge.holder.line, f.gouge.holder.tip, f.gouge.holder.depth);
            if (f.shank.size > 0)
                violate(report, "contact.shank",
                        fmt::format("the shank runs into stock, {:.3f} mm deep", f.shank.size), &p,
                        f.shank_line, f.shank.where, f.shank.size);
            if (f.holder.size > 0)
                violate(report, "contact.holder",
                        fmt::format("the holder runs into stock, {:.3f} mm deep", f.holder.size), &p,
                        f.holder_line, f.holder.where, f.holder.size);
        });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (f.crushed.size > 0)
                violate(report, "plunge.not_center_cutting",
                        fmt::format("goes down on {:.3f} mm of stock under its middle, where it has no edge "
                                    "({:.1f} mm2 in all)",
                                    f.crushed.size, f.crushed_mm2),
                        &p, f.crushed_line, f.crushed.where, f.crushed.size);
        });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (f.rapid.size > 0)
                violate(report, "rapid.through_stock",
                        fmt::format("a rapid takes {:.3f} mm of stock", f.rapid.size), &p, f.rapid_line,
                        f.rapid.where, f.rapid.size);
        });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) { unknown_start(report, p, f); });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (f.over_flute.size > 0)
                violate(report, "flute.too_deep",
                        fmt::format("cuts {:.3f} mm deeper than the flutes are long", f.over_flute.size), &p,
                        f.over_flute_line, f.over_flute.where, f.over_flute.size);
        });
        each([&](const Program& p, const ProgramFindings& f, std::size_t) {
            if (p.kind == OperationKind::rough && p.planned_stepdown > 0 &&
                f.deepest.size > p.planned_stepdown + kDeeper)
                violate(report, "cut.too_deep",
                        fmt::format("cuts {:.3f} mm at once, {:.3f} mm are planned", f.deepest.size,
                                    p.planned_stepdown),
                        &p, f.deepest_line, f.deepest.where, f.deepest.size - p.planned_stepdown);
        });
        each([&](const Program& p, const ProgramFindings&, std::size_t i) {
            // Coarser points than the tolerance asks for may miss all that an operation takes.
            const bool seen = cell_ <= 1.25 * simulation_cell(input_.tools, options_.cusp) ||
                              std::none_of(p.steps.begin(), p.steps.end(),
                                           [](const ProgramStep& step) { return !step.rapid(); });
            if (prepared_[i].tool && taken_[i] <= 1e-3 && seen)
                violate(report, "operation.empty", "removes nothing", &p, 0, {}, 0);
        });
        if (options_.board_cut >= 0 && report.board_cut > options_.board_cut + kStanding)
            violate(report, "board.too_deep",
                    fmt::format("the base board is cut {:.3f} mm deep, {:.3f} mm are allowed",
                                report.board_cut, options_.board_cut),
                    nullptr, 0, {}, report.board_cut);
        if (flask_cut_.size > options_.gouge)
            violate(report, "gouge.flask", fmt::format("the flask is cut {:.3f} mm deep", flask_cut_.size),
                    nullptr, 0, flask_cut_.where, flask_cut_.size);
        for (std::size_t l = 0; l < report.layers.size(); ++l) {
            const LayerFindings& f = report.layers[l];
            if (f.gouge_cells > 0)
                violate(report, "gouge.stock",
                        fmt::format("layer {}: the stock is cut {:.4f} mm into the part, {:.2f} mm2 are "
                                    "deeper than {:.4f} mm",
                                    l + 1, f.gouge.size, static_cast<double>(f.gouge_cells) * cell_ * cell_,
                                    options_.gouge),
                        nullptr, 0, f.gouge.where, f.gouge.size, l);
        }
        for (std::size_t l = 0; l < report.layers.size(); ++l) {
            const LayerFindings& f = report.layers[l];
            if (f.missed_left.size > options_.leftover_limit)
                violate(report, "left.too_much",
                        fmt::format("layer {}: {:.3f} mm are left that a tool could take ({:.1f} mm2, {:.0f} "
                                    "mm3 of it waste beside the pattern)",
                                    l + 1, f.missed_left.size, static_cast<double>(f.missed) * cell_ * cell_,
                                    f.waste_mm3),
                        nullptr, 0, f.missed_left.where, f.missed_left.size, l);
            if (f.within_share < options_.leftover_share)
                violate(report, "left.missed",
                        fmt::format("layer {}: only {:.3f} % of what tools reach is within {:.3f} mm", l + 1,
                                    100 * f.within_share, options_.cusp + options_.slack),
                        nullptr, 0, f.missed_left.where, f.missed_left.size, l);
        }
    }

    /// Until x and y are known only rapids above everything that stands are safe.
    void unknown_start(SimulationReport& report, const Program& p, const ProgramFindings& f) const {
        for (std::size_t i = 0; i < p.steps.size(); ++i) {
            const ProgramStep& s = p.steps[i];
            if (i > 0 && p.steps[i - 1].known()) return;
            // The very first rise in z passes over heights that nobody knows; after it the height counts.
            const double low =
                i > 0 && std::isfinite(p.steps[i - 1].z) ? std::min(p.steps[i - 1].z, s.z) : s.z;
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

    Context& context_;
    const SimulationInput& input_;
    SimulationOptions options_;
    const StandingPart& part_;
    SimulationMemory* memory_;                      // may be null
    std::optional<ProgramChanges> changes_;         // against the memory, where that is of this stage
    std::vector<CheckedProgram> checked_programs_;  // for the memory
    double cell_ = 1;
    double checked_ = 0;  // of the progress, when all moves have been checked
    int nx_ = 0, ny_ = 0;
    std::vector<PreparedProgram> prepared_;
    std::vector<double> taken_;  // mm, the most that any cell lost, by program
    std::vector<Kept> flasks_;   // by layer
    Extreme flask_cut_;
};

}  // namespace

SimulationReport simulate(Context& context, const SimulationInput& input, const StandingPart& part,
                          const SimulationOptions& options, SimulationMemory* memory) {
    return Simulation(context, input, part, options, memory).run();
}

}  // namespace slabwright

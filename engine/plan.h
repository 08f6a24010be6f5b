// The plan: what the engine decided, ready to be written. Frame `pattern-base`, millimetres; paths in 0.1 µm.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/job.h"
#include "kernels/export.h"
#include "kernels/features/features.h"
#include "kernels/geometry/affine.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

enum class Severity : std::uint8_t { note, warning, error };
[[nodiscard]] SLABWRIGHT_API std::string_view name(Severity severity);

/// Something the user should know, with a place (mm) when it has one.
struct Diagnostic {
    Severity severity = Severity::note;
    std::string code;     ///< stable, e.g. "undercut.unmade"
    std::string message;  ///< one line, sizes with units
    std::optional<std::array<double, 3>> where;
    friend bool operator==(const Diagnostic&, const Diagnostic&) = default;
};

/// One move to (x, y, z) in 0.1 µm, frame pattern-base; feed in mm/min, 0 for a rapid. Straight where i = j =
/// 0; else, by feed and at one z only, along the arc of less than half a circle whose centre lies (i, j) from
/// where the move begins. That it is the shorter arc says which way it turns: against the clock where the
/// centre lies left of the way from begin to end.
struct Move {
    std::int32_t x = 0, y = 0, z = 0;
    std::uint32_t feed = 0;
    std::int32_t i = 0, j = 0;
    [[nodiscard]] bool is_arc() const { return i != 0 || j != 0; }
    friend bool operator==(const Move&, const Move&) = default;
};

/// An arc in the plane, mm and radians; the sweep is positive against the clock and less than π either way.
/// The end's radius differs from the begin's by what rounding to 0.1 µm does; `radius` is the begin's.
struct ArcShape {
    double x = 0, y = 0, radius = 0;  ///< the centre
    double start = 0, sweep = 0;
    [[nodiscard]] double length() const;
    /// Smallest x and y, then largest x and y, of all its points.
    [[nodiscard]] std::array<double, 4> box() const;
};

/// The arc of a move that is one, from where the move before it ended.
[[nodiscard]] ArcShape arc_shape(const Move& from, const Move& arc);

enum class OperationKind : std::uint8_t { face, rough, semi_rough, finish, corner, drill, edge };
[[nodiscard]] SLABWRIGHT_API std::string_view name(OperationKind kind);  ///< as plan.json spells it

/// Heights between which the surface is about as steep, and how far apart the level passes that cut it lie
/// (LUO 5.4).
struct StepBand {
    double z_low = 0, z_high = 0;  ///< mm
    double least_slope_deg = 90;   ///< from level, of what level passes finish there
    double stepdown = 0;           ///< mm, the largest
    friend bool operator==(const StepBand&, const StepBand&) = default;
};

/// One tool, one purpose; a program of its own, or one of several in a program (file). Moves begin and end
/// with a Z-only rapid at `clearance_z`.
struct Operation {
    OperationKind kind{};
    std::string purpose;          ///< in words: "level contours", "projected raster", "walls", "floors"…
    int tool = 0;                 ///< Tool::number
    double stepdown = 0;          ///< mm, the largest; 0 where it has none
    double stepover = 0;          ///< mm, the largest; 0 where it has none
    std::vector<StepBand> bands;  ///< of level contours, upwards: where they cut
    double spindle_rpm = 0;
    double clearance_z = 0;    ///< mm
    double spare = 0;          ///< mm that a semi-roughing leaves on the part for what follows
    double blend = kJunction;  ///< mm by which the machine may round the path's corners (G64 P)
    std::vector<Move> moves;
    std::string file;  ///< name under nc/, "" until named; "L003.ngc#2": the second operation in L003.ngc
    int number = 0;    ///< of the program, for controls that number them (O0302); 0 until named
    double cutting_mm = 0, rapid_mm = 0, minutes = 0;
    double peak_force_n = 0, deflection_mm = 0;  ///< the largest of all its cuts
    double wall_error_mm = 0;    ///< the most that the cutter, bending, leaves on a wall or takes from it
    double peak_torque_nmm = 0;  ///< over a turn, the largest of all its cuts
    double peak_power_w = 0;     ///< mean over a turn, the largest of all its cuts
    std::optional<std::array<double, 3>>
        peak_at;  ///< mm, where the cut of peak_force_n ends; none where it is the nominal cut's
    std::optional<std::uint32_t> peak_move;  ///< and by which move it is made
};

/// A tool that was looked at for one purpose of a layer (LUO 5.5.3).
struct ToolCandidate {
    std::string purpose;  ///< "finish", "rough" or "semi_rough"
    int tool = 0;         ///< Tool::number
    bool chosen = false;
    std::optional<double> accessibility;   ///< AR, 0 … 1; none where it was not asked for
    std::optional<double> semi_rough_mm2;  ///< AS
    std::optional<double> stepdown;        ///< mm
    /// By LUO's formulas, of all operations that this choice changes; of a finish tool what finishing is
    /// foreseen to take, where sets were compared by that.
    std::optional<double> minutes;
    std::string reason;  ///< why it was chosen or not, in words
};

/// A set of tools that a layer was planned with.
struct ToolSet {
    /// "selected" (LUO's choice), "fixed", "foreseen" (the fixed set with the ball that is foreseen to be the
    /// fastest), "wider" or "narrower" (another finish tool), "wider rough", "gentlest" or "stiffer".
    std::string name;
    std::vector<int> tools;  ///< numbers, in the order of their first cut
    double minutes = 0;  ///< of its programs, tool changes within the layer included; of the first of them
                         ///< where it was given up
    std::optional<double> left_mm2;  ///< of the layer's plan view, where more than the cusp's limit is left;
                                     ///< none where it was given up
    bool chosen = false;
    std::string reason;  ///< why it was kept or not, in words
};

/// How the tools of a layer were chosen.
struct LayerSelection {
    double least_slope_deg = 90;  ///< smallest α of its steep facets
    bool vertical = false;        ///< every wall is upright: one flat end mill cuts all
    double finish_stepdown =
        0;  ///< mm, of the finish tool at the least slope and the cusp; 0 where it has no slopes to finish
    double finish_stepdown_printed = 0;  ///< by print's rule (LUO table 5.1)
    double rough_stepdown =
        0;  ///< mm, LUO eq. 6 at the least slope, before any tool's range; 0: without limit
    std::vector<ToolCandidate> candidates;
    std::vector<ToolSet> sets;
};

/// A bead of the glue head, along x.
struct GlueRun {
    std::int32_t y = 0, from = 0, to = 0;  ///< 0.1 µm; laid from `from` to `to`
    friend bool operator==(const GlueRun&, const GlueRun&) = default;
};

/// A joint under or within a layer. Glue under a layer goes where wood stands on both sides, held back from
/// finished edges; between slabs that are bonded into one before any is cut it goes everywhere.
struct Joint {
    double z = 0;                          ///< mm
    double standing_mm2 = 0;               ///< where wood stands on both sides of it once the layer is milled
    double area_mm2 = 0;                   ///< glued
    std::array<double, 2> centroid{0, 0};  ///< of the glue, mm
    double force_n = 0;                    ///< of the press
    double pressure_mpa = 0;               ///< of that force on the glued area, its mean
    Loops glue;                            ///< where glue goes
    std::vector<GlueRun> beads;            ///< of the machine's glue head, in their order; none: by hand
};

/// The corners of a slab as it is sawn and laid, mm, pattern-base.
struct Blank {
    std::array<double, 2> min{}, max{};
    [[nodiscard]] double length() const { return max[0] - min[0]; }  ///< in x
    [[nodiscard]] double width() const { return max[1] - min[1]; }   ///< in y
    [[nodiscard]] double mm2() const { return length() * width(); }
    friend bool operator==(const Blank&, const Blank&) = default;
};

/// By how much a dowel is shorter than its two holes together, at least, mm.
inline constexpr double kDowelRoom = 1;

/// A dowel in the joint on a layer's top, upright, mm, pattern-base.
struct JointDowel {
    double x = 0, y = 0;          ///< its middle
    double diameter = 0;          ///< of the dowel and its holes
    double below = 0, above = 0;  ///< how deep its holes are, full diameter: in this layer's top, and in the
                                  ///< underside of the layer above
    /// Of the dowel itself: whole mm, with room for glue and chips at its ends.
    [[nodiscard]] double length() const { return std::floor(below + above - kDowelRoom + 1e-6); }
    friend bool operator==(const JointDowel&, const JointDowel&) = default;
};

struct Layer {
    int index = 0;
    double z_bottom = 0, z_top = 0, slab_thickness = 0;
    int slabs = 1;       ///< bonded into one, slab_thickness in all
    std::string reason;  ///< why z_top lies where it lies, in words
    std::vector<Operation> operations;
    std::optional<LayerSelection> selection;  ///< none where there was nothing to select
    int rounds = 0;              ///< how often a proof had it planned again (engine/planner/replan.h)
    std::vector<Joint> joints;   ///< upwards: under its lowest slab, on the board or the layer below; then
                                 ///< between its slabs
    std::optional<Blank> blank;  ///< of each of its slabs (slabs.blanks = "layer"); none: the plan's stock
    std::vector<JointDowel> dowels{};  ///< in the joint on its top, which its programs drill the holes for
};

/// The file that holds a program: "L003.ngc" of "L003.ngc#2", and of itself.
[[nodiscard]] std::string_view file_of(std::string_view program);
/// Which of a file's operations it is, from 1; 0 where the file holds no other, -1 where what follows # is
/// no such number.
[[nodiscard]] int part_of(std::string_view program);
/// Past the last of the layer's operations that share a file with the one at place `begin`.
[[nodiscard]] std::size_t file_end(const Layer& layer, std::size_t begin);

/// A step of the machine's sequence (METHOD.md section 12); `needs` are ids of the steps that must be done
/// before.
struct SequenceStep {
    int id = 0;
    int layer = 0;
    std::string action;  ///< "mount_board", "load_feed", "take_slab", "clamp", "glue", "set_dowels", "place",
                         ///< "press", "table", "touch_off", "probe", "load_tool", "tool_change", "face",
                         ///< "mill", "unload", "mould_box"
    std::vector<int> needs;
    std::vector<std::pair<std::string, double>> numbers;     ///< named quantities, names end in their unit
    std::vector<std::pair<std::string, std::string>> words;  ///< programs, materials
    double seconds = 0;
};

/// What stays around the pattern (engine/flask). Millimetres.
struct Flask {
    Loops outer;               ///< one loop: the stock's rectangle
    std::vector<Loops> inner;  ///< one loop for each layer, ascending: the opening, wider from layer to layer
                               ///< where there is draft
    double wall_mm = 0;        ///< where it is thinnest
    double volume_mm3 = 0;     ///< of the frame
    double opening_mm3 = 0;    ///< of what it encloses, the pattern's volume included
};

/// A square column of stock, left standing under what nothing of the pattern carries, to be sawn off by hand
/// (engine/schedule/supports). Millimetres.
struct Support {
    int layer = 0;                 ///< the first layer that it carries
    double x = 0, y = 0;           ///< its middle
    double width = 0;              ///< its side, along x and y
    double z_low = 0, z_high = 0;  ///< with what reaches into the wood under and over it
    friend bool operator==(const Support&, const Support&) = default;
};

/// A slab whose underside is milled before it is laid, upside down on a spoil board. It has been turned about
/// y: there x counts from its edge of greatest x, y from its front edge and z from the board, so that a point
/// of the pattern lies at (blank.max[0] − x, y − blank.min[1], z_bottom + slab_thickness − z). Millimetres.
struct TurnedSlab {
    int layer = 0;                                       ///< Layer::index
    double z_bottom = 0, z_top = 0, slab_thickness = 0;  ///< of the layer, pattern-base
    Blank blank;                                         ///< of the slab, pattern-base
    double web = 0;   ///< that stays under the layer's top, so that all hangs together until it is laid
    double room = 0;  ///< around what is milled away, for cutters
    friend bool operator==(const TurnedSlab&, const TurnedSlab&) = default;
};

struct Totals {
    int layers = 0, operations = 0, tool_changes = 0;
    int magazine_swaps = 0;  ///< a tool of the magazine taken out for another
    double cutting_mm = 0, rapid_mm = 0;
    double cutting_minutes = 0, bonding_minutes = 0, tool_change_minutes = 0, table_minutes = 0,
           magazine_minutes = 0, build_minutes = 0;
    double underside_minutes = 0;  ///< of build_minutes, what is done to slabs before the build
    double stock_volume_mm3 = 0, part_volume_mm3 = 0, stack_mass_kg = 0;
};

/// Defects of one kind that a repair took away.
struct RepairedDefect {
    std::string kind;  ///< "crack", "hole" …: the last part of its diagnostic's code
    std::uint64_t count = 0;
    double size = 0;                ///< of the largest, in `unit`; 0 where the kind has none
    std::string unit;               ///< "mm", "mm^2" or ""
    std::array<double, 3> where{};  ///< of the largest, or of the first, pattern-base, mm
};

/// What a repair did to a mesh. Nothing where the mesh needed none.
struct InputRepair {
    std::string how;                      ///< "none", "mend" or "rebuild"
    std::vector<RepairedDefect> defects;  ///< mended, by kind
    double moved_mm = 0;  ///< the farthest that a vertex moved, or an edge was bent, to meet another
    /// Of a rebuilt surface: its cell; how far it lies from the mesh, and the mesh from it, mm. 0: not
    /// rebuilt.
    double cell_mm = 0, deviation_mm = 0, missed_mm = 0;
    std::uint64_t triangles = 0;  ///< after it
};

/// What was done to the model before it was planned.
struct InputPreparation {
    AffineMap map;             ///< from the file, in mm, to the pattern before it is set on z = 0
    double skin_mm = 0;        ///< of machining stock
    std::string skin_how;      ///< "vertices" or "level set"; "": no skin
    double skin_least_mm = 0;  ///< the least and the greatest distance measured between skin and model
    double skin_most_mm = 0;
};

struct InputInfo {
    std::string file, sha256;
    std::uint64_t triangles = 0;
    std::array<double, 3> min{}, max{};  ///< mm, as in the STL (before the pattern is set on z = 0)
    double volume_mm3 = 0;  ///< of the solid, each place once; an opening in the base plane counts as filled
    std::optional<InputRepair> repair;         ///< where one was asked for
    std::optional<InputPreparation> prepared;  ///< where anything was done
};

/// A program that finds z = 0 (machine.probe).
struct ProbeProgram {
    int layer = 0;     ///< Layer::index
    int tool = 0;      ///< in the spindle
    std::string file;  ///< name under nc/
    /// x and y of what is touched and z that the tip then has, mm, as the programs count.
    std::array<double, 3> touches{};
};

struct Plan {
    InputInfo input;
    Job job;
    std::array<double, 2> stock_min{}, stock_max{};
    std::optional<Flask> flask;
    std::vector<Support> supports;
    std::vector<Feature> features;
    std::vector<Layer> layers;
    std::vector<SequenceStep> sequence;
    std::vector<ProbeProgram> probes;  ///< in the order of execution
    Totals totals;
    std::vector<Diagnostic> diagnostics;
    std::optional<TurnedSlab> turned;  ///< of a plan for a slab's underside, in the turned slab's frame
    std::vector<Plan> undersides;      ///< of its layers' slabs, ascending; each with `turned`
};

/// The folder of an underside's plan within that of the plan: "undersides/L003".
[[nodiscard]] std::string underside_folder(int layer);

/// x 0, y 0 of the programs, 0.1 µm, pattern-base: machine.zero. The base board is as large as the stock.
[[nodiscard]] inline Point2 work_zero(const Plan& plan) {
    const auto at = [&](std::size_t k) {
        switch (plan.job.machine.zero) {
            case WorkZero::corner:
                return to_units(plan.stock_min[k]);
            case WorkZero::centre:
                return to_units((plan.stock_min[k] + plan.stock_max[k]) / 2);
            case WorkZero::pin:
                return to_units(plan.stock_min[k] + plan.job.machine.pin.at(k));
            case WorkZero::model:
                break;
        }
        return to_units(0.0);
    };
    return {at(0), at(1)};
}

/// What a layer's slabs cover: its own blank, or the plan's stock.
[[nodiscard]] inline Blank slab_of(const Plan& plan, const Layer& layer) {
    return layer.blank.value_or(Blank{plan.stock_min, plan.stock_max});
}

}  // namespace slabwright

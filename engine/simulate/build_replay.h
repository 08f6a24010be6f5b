// The machine's sequence, replayed: a machine of states does what each step says, with the bodies that it
// moves (slabs, glue, stack, tool), and says where a step cannot, must not, or does not do what the plan
// asks. Nothing of how sequences are made is used here; steps come as they were read from text.
//
// Two things are asked of every step: that in the order of the list the machine is in a state for it, and
// that its `needs` say so too, directly or by way of others, since a machine may begin a step as soon as
// these are done.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "engine/simulate/build_state.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// A joint under a slab, as the plan states it.
struct PlannedJoint {
    std::optional<double> glue_area_mm2, press_force_n;
};

/// A layer as the plan states it.
struct LayerToBuild {
    int index = 0;
    double z_bottom = 0, z_top = 0, slab_thickness = 0;  ///< mm, pattern-base; of all its slabs together
    int slabs = 1;
    std::optional<Blank> blank{};  ///< what each of its slabs covers; none: the whole stock
    /// Of the joint under each of its slabs, upwards; what is not stated is not checked.
    std::vector<PlannedJoint> joints;
    std::vector<JointDowel> dowels{};  ///< in the joint on its top
};

/// A program as the plan states it, in the order of execution, and how far it goes down and up.
struct PlannedProgram {
    std::string file;       ///< "nc/…"; with "#2" after it where its file holds several (file_of)
    std::size_t layer = 0;  ///< index into the layers
    OperationKind kind{};
    int tool = 0;
    std::string purpose;              ///< "": not stated
    std::optional<double> minutes;    ///< none: not stated
    std::optional<double> low, high;  ///< mm, pattern-base, of its text; none where it could not be read
};

/// A program that finds z = 0, as the plan states it.
struct PlannedProbe {
    std::string file;       ///< "nc/…"
    std::size_t layer = 0;  ///< index into the layers
    int tool = 0;
};

/// A slab's underside that is milled before the build, as the plan states it.
struct UndersideToMill {
    int layer = 0;                  ///< LayerToBuild::index
    std::string folder;             ///< of its own plan and sequence, from the plan's
    std::optional<double> minutes;  ///< none: not stated
};

/// What a sequence has to build.
struct BuildPlan {
    Job job;                  ///< of it machine, material and bonding
    bool job_stated = false;  ///< false: what the job would say is not checked
    Frame frame = Frame::pattern_base;
    std::string pattern, sha256;
    std::array<double, 2> stock_min{}, stock_max{};
    std::array<double, 2> zero{};  ///< mm, pattern-base: x 0, y 0 of the programs
    std::vector<LayerToBuild> layers;
    std::vector<PlannedProgram> programs;
    /// Programs that face spoilt layers off (engine/planner/remake.h); of the plan's own sequence none.
    std::vector<PlannedProgram> face_offs{};
    std::vector<PlannedProbe> probes{};
    std::vector<Tool> tools;
    bool flask = false;
    std::optional<double> flask_mass_kg, sand_litres;
    std::vector<UndersideToMill> undersides{};  ///< ascending by layer
    bool turned = false;  ///< it is a slab's underside: the slab is held on the board, not bonded
};

/// Whether the underside of a layer's slab is milled, its dowel holes with it. @param layer index as the plan
/// states it
[[nodiscard]] bool mills_underside(const BuildPlan& plan, int layer);

/// Where glue goes on one joint, as the sequence states it: under each layer first, in their order.
struct StatedGlue {
    int layer = 0;
    double area_mm2 = 0;                                  ///< of its loops, holes taken off
    std::array<double, 2> min{0, 0}, max{0, 0};           ///< of its points, mm
    double z = std::numeric_limits<double>::quiet_NaN();  ///< of the joint, mm, pattern-base; NaN: not stated
    std::vector<std::vector<std::array<double, 2>>> loops{};  ///< mm
    /// Of the machine's glue head, in the order in which they are laid: y, then x from and to, mm.
    std::vector<std::array<double, 3>> beads{};
};

/// A sequence as it was read.
struct BuildSequence {
    Frame frame = Frame::pattern_base;
    std::string pattern, sha256;
    std::vector<SequenceStep> steps;
    std::vector<StatedGlue> glue;
};

/// Replays a sequence. Each violation's message begins with the step it is about; its file is
/// "sequence.json".
/// Of very many only the first are listed (kMostSequenceViolations).
///
/// Codes: sequence.pattern, sequence.frame (another plan's), sequence.length (far too many steps),
/// sequence.id, sequence.needs, sequence.action (unknown), sequence.order (the machine is not in a state for
/// the step), sequence.layer, sequence.feed, sequence.stack (a slab from another pile), sequence.handler (its
/// place), sequence.slab, sequence.glue, sequence.glue_side, sequence.glue_path, sequence.glue_mass,
/// sequence.pump, sequence.dowels, sequence.place, sequence.press,
/// sequence.table, sequence.touch_off, sequence.probe (another place or height), sequence.tool,
/// sequence.magazine (a tool that does not stand where it is wanted, a place that is none or holds another),
/// sequence.program, sequence.height (of a program), sequence.mass, sequence.travel, sequence.time,
/// sequence.value (a quantity that is missing or not what the plan says), sequence.missing (what was not done
/// in the end).
[[nodiscard]] std::vector<Violation> replay_build(const BuildPlan& plan, const BuildSequence& sequence);

/// What some steps bring about.
struct ReplayedBuild {
    BuildState state;
    std::vector<Violation> violations;  ///< as replay_build's, of these steps
};

/// The same from a state on, which the steps before it brought about: those from place `from.done` up to
/// place `until`. What must be done in the end is asked for where `until` is the end of the list.
/// @param plan has a layer
/// @param from a state of this plan and sequence, or a fresh one
/// @param until from.done to the count of the steps
[[nodiscard]] ReplayedBuild replay_steps(const BuildPlan& plan, const BuildSequence& sequence,
                                         const BuildState& from, std::size_t until);

}  // namespace slabwright

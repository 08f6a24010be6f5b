// What a folder OUT says of its plan, read once for whoever judges or shows it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/simulate/build_replay.h"
#include "engine/simulate/simulate.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/program_check.h"
#include "io/read/pattern.h"
#include "kernels/errors.h"

namespace slabwright {

/// How what lies in OUT is refused.
struct FolderRefusal {
    ErrorKind kind = ErrorKind::verification;
    std::string plan = "verify.plan", program = "verify.program";  ///< codes
    std::string post = "verify.post";                              ///< of the post of the user's own
};

/// plan.json as far as figures are made from it. A job that it does not state is the default one.
struct PlannedFolder {
    std::filesystem::path path;
    std::string document;  ///< the text of plan.json
    PlannedPattern pattern;
    BuildPlan build;             ///< its job, layers and programs; of these low and high are not set
    SimulationInput simulation;  ///< stock, layers with what of the flask stands in them, tools, machine;
                                 ///< neither mesh nor programs
    std::optional<TurnedSlab> turned;              ///< of a slab's underside
    bool states_wood = false;                      ///< whether a cut list goes with it
    std::vector<ProgramPlan> sayings;              ///< what the plan says of each of build.programs
    std::vector<std::optional<double>> stepdowns;  ///< mm, of each of build.programs

    /// Reads the program of build.programs[i]: file (without nc/), layer, kind, planned tool and stepdown
    /// set, heights from the pattern's bottom. @throws Error as `refusal` says, and as read_gcode()
    [[nodiscard]] Program read_program(std::size_t i, const FolderRefusal& refusal) const;
    /// Past the last of build.programs that lie in the file of the one at place `begin`.
    [[nodiscard]] std::size_t file_end(std::size_t begin) const;
    /// The same of all programs of the file that begins with build.programs[begin].
    [[nodiscard]] std::vector<Program> read_file(std::size_t begin, const FolderRefusal& refusal) const;
};

/// Reads OUT/plan.json. @throws Error as `refusal` says, with the first key that is missing or wrong: no
/// file, no JSON, another schema than slabwright.plan/1, a value that no plan can have, a post file other
/// than the one planned with
[[nodiscard]] PlannedFolder read_planned_folder(const std::filesystem::path& out,
                                                const FolderRefusal& refusal);

/// The code of a program of another control's dialect.
inline constexpr const char* kForeignProgram = "program.dialect";

/// Reads a program of a plan in the dialect of its job's machine. @throws Error as read_program_text(), or
/// kForeignProgram, which names both, where it is a whole program of another dialect
[[nodiscard]] Program read_planned_program(const std::string& text, const std::string& file, const Job& job);

/// The same of a file that holds `count` operations, one after another (read_operations).
/// @throws as read_planned_program(); Error(verification, "gcode.operations") where it holds another number
[[nodiscard]] std::vector<Program> read_planned_operations(const std::string& text, const std::string& file,
                                                           const Job& job, std::size_t count);

/// Moves a program from where its coordinates count from to the pattern's base: BuildPlan::zero in x and y,
/// the layer's top or 0 in z. @param layer index
void place_program(Program& program, const BuildPlan& build, std::size_t layer);

/// How a plan's programs are read: chords that stand for an arc take next to nothing of the gouge tolerance
/// that the paths were made for.
[[nodiscard]] GcodeLimits gcode_limits(const Tolerances& tolerances);

}  // namespace slabwright

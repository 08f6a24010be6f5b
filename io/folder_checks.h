// What can be said of one folder of programs by itself, a plan's or an underside's: its programs, its
// sequence, its probing programs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/simulate/simulate.h"
#include "io/read/planned_folder.h"
#include "io/verify.h"

namespace slabwright {

/// A file of the folder. @throws Error(verification, code) where it cannot be read
[[nodiscard]] std::string read_file(const std::filesystem::path& path, const char* code,
                                    std::uint64_t most_bytes);

/// Of each program of the build that was read, how far it goes down and up.
void set_heights(BuildPlan& build, const std::vector<Program>& programs);

/// sequence.json, replayed. That there is none, or none that can be read, is a violation too.
void check_sequence(const std::filesystem::path& path, const BuildPlan& build,
                    std::vector<Violation>& violations);

/// Reads the programs that the folder holds of those that plan.json names, in its order, and checks each
/// against what the plan says of it. Those of another control are told and left out, as if they were missing.
void read_programs(Context& context, const PlannedFolder& folder, const FolderRefusal& refusal,
                   std::vector<Program>& programs, std::vector<Violation>& violations);

/// The programs that find z = 0, read back; and what of `keep_outs` the tip runs into there.
void check_probes(Context& context, const PlannedFolder& folder, const std::vector<KeepOut>& keep_outs,
                  std::vector<Violation>& violations);

/// What nc/ holds beside the planned programs.
void find_strangers(const PlannedFolder& folder, std::vector<Violation>& violations);

/// What a proof goes by, of all programs of a folder.
[[nodiscard]] SimulationOptions simulation_options(const Job& job, const VerifyOptions& options,
                                                   const std::vector<Tool>& tools);

}  // namespace slabwright

#include "tools/inspect_command.h"

namespace slabwright {

void add_inspection_options(CLI::App& command, InspectionOptions& options) {
    DrawLimits& limits = options.draw;
    command.add_option("--draft", limits.draft_deg, "degrees: walls with less draft are listed (1)")
        ->check(CLI::Range(0.0, 45.0));
    command.add_option("--thin", limits.thin_mm, "mm: thinner walls are listed (4; 0: none)")
        ->check(CLI::Range(0.0, 1e6));
    command
        .add_option("--corner", limits.corner_deg,
                    "degrees: inner corners are listed whose faces turn by more (30)")
        ->check(CLI::Range(1.0, 179.0));
    command
        .add_option("--edges", options.edge_deg, "degrees: edges are sharp at which faces turn by more (30)")
        ->check(CLI::Range(1.0, 179.0));
    CavityOptions& cavities = options.cavities;
    command
        .add_option("--narrow", cavities.most_width_mm,
                    "mm: cavities are listed that are no wider (12.7, at least 0.3)")
        ->check(CLI::Range(0.3, 1e3));
    command
        .add_option("--slender", cavities.least_ratio,
                    "cavities are listed that are as many times as deep as wide, at least (1)")
        ->check(CLI::Range(0.0, 1e3));
    command.add_option("--map", options.map,
                       "file for the pattern coloured by draft, undercuts to the draw and thin walls, PLY");
}

}  // namespace slabwright

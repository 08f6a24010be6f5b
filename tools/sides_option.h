// The option --sides of `plan` and `quote`.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace slabwright {

inline void add_sides_option(CLI::App& command, std::string& sides) {
    command
        .add_option("--sides", sides,
                    "of slabs that are milled: one, the top; two, the underside too where there are "
                    "overhangs; or auto, two where that makes more. Not one: two dowels in a joint where the "
                    "job gives none")
        ->check(CLI::IsMember({"one", "two", "auto"}));
}

}  // namespace slabwright

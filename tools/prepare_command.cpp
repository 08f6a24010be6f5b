#include "tools/prepare_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace slabwright {

void add_prepare_options(CLI::App& command, PrepareOptions& options) {
    const std::string group = "Preparing the model, in this order";
    command.add_option("--turn", options.turn, "x,y,z: degrees about x, then y, then z")
        ->delimiter(',')
        ->expected(3)
        ->group(group);
    command.add_option("--scale", options.scale, "one factor, or x,y,z")
        ->delimiter(',')
        ->expected(1, 3)
        ->group(group);
    command
        .add_option("--shrink", options.shrink,
                    "contraction of the metal that is cast: 1.3%, or grey_iron, malleable_iron, steel, "
                    "aluminium, magnesium, copper, brass, bronze")
        ->group(group);
    command.add_option("--mirror", options.mirror, "x, y or z: the coordinate that changes its sign")
        ->check(CLI::IsMember({"none", "x", "y", "z"}))
        ->group(group);
    command.add_option("--skin", options.skin, "mm of machining stock")
        ->check(CLI::Range(0.0, 100.0))
        ->group(group);
    command
        .add_option("--skin-normal", options.skin_normal, "x,y,z: only on facets whose normal lies this way")
        ->delimiter(',')
        ->expected(3)
        ->group(group);
    command
        .add_option("--skin-box", options.skin_box, "x,y,z,x,y,z in mm: only on facets between these corners")
        ->delimiter(',')
        ->expected(6)
        ->group(group);
    command.add_option("--shift", options.shift, "x,y,z in mm")->delimiter(',')->expected(3)->group(group);
}

std::string prepare_keys(const PrepareOptions& options) {
    std::string keys;
    const auto list = [&](const char* key, const std::vector<double>& values) {
        if (!values.empty()) keys += fmt::format("prepare.{} = [{}]\n", key, fmt::join(values, ", "));
    };
    list("turn", options.turn);
    list("scale", options.scale.size() == 1 ? std::vector<double>(3, options.scale[0]) : options.scale);
    list("skin_normal", options.skin_normal);
    list("skin_box", options.skin_box);
    list("shift", options.shift);
    if (options.skin >= 0) keys += fmt::format("prepare.skin = {}\n", options.skin);
    if (!options.mirror.empty()) keys += fmt::format("prepare.mirror = \"{}\"\n", options.mirror);
    if (options.shrink.empty()) return keys;
    std::string quoted;
    for (const char c : options.shrink) quoted += c == '"' || c == '\\' || c < ' ' ? '?' : c;
    return keys + fmt::format("prepare.shrink = \"{}\"\n", quoted);
}

}  // namespace slabwright

#include "tools/split_command.h"

#include <cmath>

#include "kernels/errors.h"

namespace slabwright {

void add_split_options(CLI::App& command, SplitOptions& options) {
    command.add_option("--z", options.z, "mm above the model's bottom, where it is cut")->expected(1);
    command
        .add_option("--plane", options.plane, "a,b,c,d: where a x + b y + c z = d, in mm; z from the bottom")
        ->delimiter(',')
        ->expected(4);
    command
        .add_option("-o,--out", options.out,
                    "two files, .stl or .3mf: the half above the plane, then the one below; cut face down")
        ->expected(2)
        ->required();
    command.add_option("--dowel", options.dowels.diameter_mm, "mm, of the first dowel; 0: none")
        ->check(CLI::Range(0.0, 100.0));
    command.add_option("--dowel-depth", options.dowels.depth_mm, "mm, of the holes in each half")
        ->check(CLI::Range(1.0, 200.0));
    command.add_flag("--mirror-below", options.mirror_below, "mirror the half below in x as well");
}

SplitRequest split_request(const SplitOptions& options) {
    if (options.z.empty() == options.plane.empty())
        throw Error(ErrorKind::usage, "split.plane", "one plane is needed", "--z, --plane",
                    "give --z 40, or --plane 0,0,1,40");
    SplitRequest request;
    request.dowels = options.dowels;
    request.mirror_below = options.mirror_below;
    request.out = {options.out[0], options.out[1]};
    if (!options.z.empty()) {
        request.plane.offset_mm = options.z[0];
        return request;
    }
    const std::vector<double>& p = options.plane;
    request.plane.normal = {p[0], p[1], p[2]};
    request.plane.offset_mm = p[3] / std::hypot(p[0], p[1], p[2]);
    return request;
}

}  // namespace slabwright

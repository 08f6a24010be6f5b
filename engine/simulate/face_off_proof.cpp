#include "engine/simulate/face_off_proof.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kernels/stock/stock.h"

namespace slabwright {

namespace {

constexpr double kSame = 1e-3;  // mm: heights are rounded to 0.1 µm, those of the stock to some more
constexpr double kFinestCell = 0.5, kMostCells = 1e6;

CellGrid cells_of(const BlockToFaceOff& block) {
    const double x = block.stock_max[0] - block.stock_min[0], y = block.stock_max[1] - block.stock_min[1];
    const double cell = std::max(kFinestCell, std::sqrt(x * y / kMostCells));
    const int nx = std::max(1, static_cast<int>(std::ceil(x / cell))),
              ny = std::max(1, static_cast<int>(std::ceil(y / cell)));
    // Centres spread over the whole stock, the last as near to its edge as the first.
    const double left = (x - (nx - 1) * cell) / 2, low = (y - (ny - 1) * cell) / 2;
    return {block.stock_min[0] + left, block.stock_min[1] + low, cell, nx, ny};
}

}  // namespace

std::vector<Violation> check_face_off(const Program& program, const Tool& tool, const BlockToFaceOff& block) {
    std::vector<Violation> found;
    const auto complain = [&](const char* code, std::uint32_t line, const std::string& message, double size) {
        for (const Violation& v : found)
            if (v.code == code) return;  // the first of each says enough
        found.push_back({code, message, program.file, line, {}, size});
    };
    Stock stock(cells_of(block));
    stock.add_slab(block.joint, block.top - block.joint);
    const CutterEnd end = cutter_end(cutter_shape(tool));
    for (std::size_t i = 0; i < program.steps.size(); ++i) {
        const ProgramStep& to = program.steps[i];
        if (to.z < block.joint - kSame)
            complain("face_off.joint", to.line,
                     fmt::format("goes down to {:.3f} mm, below the joint at {:.3f} mm", to.z, block.joint),
                     block.joint - to.z);
        if (i == 0 || !to.known() || !program.steps[i - 1].known()) continue;
        const ProgramStep& at = program.steps[i - 1];
        const std::array<double, 3> a{at.x, at.y, at.z}, b{to.x, to.y, to.z};
        if (to.rapid() || !to.spindle) {
            std::array<double, 2> where{};
            const double deep = stock.reach(tool.diameter / 2, a, b, where);
            if (deep > kSame)
                complain("face_off.rapid", to.line,
                         fmt::format("meets {:.2f} mm of wood in a rapid or with the spindle at rest", deep),
                         deep);
            continue;
        }
        const CutEffect effect = stock.cut(end, a, b);
        if (effect.deepest > block.most_mm + kSame)
            complain("face_off.depth", to.line,
                     fmt::format("takes {:.2f} mm at once, where {:.2f} mm is the most", effect.deepest,
                                 block.most_mm),
                     effect.deepest - block.most_mm);
    }
    if (const double left = stock.highest() - block.joint; left > kSame)
        complain("face_off.left", 0, fmt::format("leaves {:.2f} mm of wood above the joint", left), left);
    return found;
}

}  // namespace slabwright

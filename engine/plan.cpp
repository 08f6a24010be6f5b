#include "engine/plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <system_error>

#include <fmt/format.h>

#include "kernels/geometry/vectors.h"

namespace slabwright {

std::string_view name(Severity severity) {
    switch (severity) {
        case Severity::note:
            return "note";
        case Severity::warning:
            return "warning";
        case Severity::error:
            return "error";
    }
    return "";
}

std::string_view name(OperationKind kind) {
    switch (kind) {
        case OperationKind::face:
            return "face";
        case OperationKind::rough:
            return "rough";
        case OperationKind::semi_rough:
            return "semi_rough";
        case OperationKind::finish:
            return "finish";
        case OperationKind::corner:
            return "corner";
        case OperationKind::drill:
            return "drill";
        case OperationKind::edge:
            return "edge";
    }
    return "";
}

std::string underside_folder(int layer) { return fmt::format("undersides/L{:03}", layer); }

std::string_view file_of(std::string_view program) { return program.substr(0, program.find('#')); }

int part_of(std::string_view program) {
    const std::size_t mark = program.find('#');
    if (mark == std::string_view::npos) return 0;
    int part = 0;
    const auto [stop, status] =
        std::from_chars(program.data() + mark + 1, program.data() + program.size(), part);
    return status == std::errc{} && stop == program.data() + program.size() && part > 0 ? part : -1;
}

std::size_t file_end(const Layer& layer, std::size_t begin) {
    const std::vector<Operation>& all = layer.operations;
    std::size_t end = begin + 1;
    while (end < all.size() && part_of(all[end].file) > 1 &&
           file_of(all[end].file) == file_of(all[begin].file))
        ++end;
    return end;
}

double ArcShape::length() const { return radius * std::abs(sweep); }

std::array<double, 4> ArcShape::box() const {
    std::array<double, 4> box{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded};
    auto take = [&](double angle) {
        const double px = x + radius * std::cos(angle), py = y + radius * std::sin(angle);
        box = {std::min(box[0], px), std::min(box[1], py), std::max(box[2], px), std::max(box[3], py)};
    };
    take(start);
    take(start + sweep);
    // Between its ends an arc turns back only where it crosses an axis through its centre.
    constexpr double quarter = std::numbers::pi / 2;
    const double low = std::min(start, start + sweep), high = std::max(start, start + sweep);
    for (double k = std::ceil(low / quarter); k * quarter <= high; ++k) take(k * quarter);
    return box;
}

ArcShape arc_shape(const Move& from, const Move& arc) {
    const std::int64_t ax = -std::int64_t{arc.i}, ay = -std::int64_t{arc.j};
    const std::int64_t bx = std::int64_t{arc.x} - from.x + ax, by = std::int64_t{arc.y} - from.y + ay;
    ArcShape shape;
    shape.x = to_mm(std::int64_t{from.x} + arc.i);
    shape.y = to_mm(std::int64_t{from.y} + arc.j);
    const double u = static_cast<double>(ax), v = static_cast<double>(ay), p = static_cast<double>(bx),
                 q = static_cast<double>(by);
    shape.radius = std::hypot(u, v) / kUnitsPerMm;
    shape.start = std::atan2(v, u);
    shape.sweep = std::atan2(u * q - v * p, u * p + v * q);
    return shape;
}

}  // namespace slabwright

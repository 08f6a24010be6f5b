#include "io/write/report_as_built.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "io/text/base64.h"
#include "kernels/access/standing_part.h"
#include "kernels/features/filled_columns.h"

namespace slabwright {

namespace {

constexpr double kStands = 1e-3;            // mm: less is none
constexpr std::size_t kMostBoxes = 40'000;  // half a megabyte in the page
constexpr double kFirstTolerance = 0.05;    // mm

void append(std::string& bytes, std::uint16_t value) {
    bytes += static_cast<char>(value & 0xff);
    bytes += static_cast<char>(value >> 8);
}

struct FilledBox {
    std::uint32_t layer, row, column, count;
    double low, high;
};

/// Gaps of one layer that follow one another in a row become one box as long as they differ by less than the
/// tolerance from its first.
std::vector<FilledBox> boxes_of(const std::vector<std::vector<FilledGap>>& rows, std::uint32_t layer,
                                double tolerance) {
    std::vector<FilledBox> boxes;
    std::vector<FilledBox> open;  // that ended in the column before or this one
    for (std::uint32_t row = 0; row < rows.size(); ++row) {
        open.clear();
        for (const FilledGap& gap : rows[row]) {
            if (gap.layer != layer) continue;
            std::erase_if(open, [&](const FilledBox& b) {
                if (b.column + b.count >= gap.column) return false;
                boxes.push_back(b);
                return true;
            });
            const auto same = std::find_if(open.begin(), open.end(), [&](const FilledBox& b) {
                return b.column + b.count == gap.column && std::abs(b.low - gap.low) < tolerance &&
                       std::abs(b.high - gap.high) < tolerance;
            });
            if (same != open.end()) ++same->count;
            else open.push_back({layer, row, gap.column, 1, gap.low, gap.high});
        }
        boxes.insert(boxes.end(), open.begin(), open.end());
    }
    return boxes;
}

}  // namespace

PackedHeights packed_wood(const SimulatedLayer& layer, const std::vector<float>& surface) {
    std::string bytes, runs;
    bytes.reserve(surface.size());
    const double height = layer.z_top - layer.z_bottom;
    for (const float z : surface) {
        const double share = height > 0 ? (z - layer.z_bottom) / height : 0;
        bytes += static_cast<char>(static_cast<std::uint8_t>(
            z - layer.z_bottom <= kStands ? 0 : std::clamp(1 + std::round(share * 254), 1.0, 255.0)));
    }
    for (std::size_t begin = 0; begin < bytes.size();) {
        std::size_t end = begin + 1;
        while (end < bytes.size() && bytes[end] == bytes[begin] && end - begin < 255) ++end;
        runs += static_cast<char>(static_cast<std::uint8_t>(end - begin));
        runs += bytes[begin];
        begin = end;
    }
    const bool rle = runs.size() < bytes.size();
    return {rle, base64(rle ? runs : bytes)};
}

PackedFilling packed_filling(Context& context, MeshView mesh, std::span<const SimulatedLayer> layers,
                             const std::vector<bool>& both_sides, const std::array<double, 2>& first,
                             double cell, int nx, int ny) {
    const Box3 box = bounds(context, mesh);
    const double z0 = box.min.z, height = std::max(1e-9, double{box.max.z} - z0);
    std::vector<double> borders{z0};
    for (const SimulatedLayer& layer : layers) borders.push_back(std::max(layer.z_top, borders.back()));
    borders.back() = HUGE_VAL;  // as measure_undercuts() has it
    auto rows =
        filled_gaps(context, mesh, borders,
                    {first[0], first[1], cell, static_cast<std::size_t>(ny), static_cast<std::size_t>(nx)});
    std::vector<std::vector<FilledGap>> milled(rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r)
        std::erase_if(rows[r], [&](const FilledGap& gap) {
            const bool below = both_sides[gap.layer] && gap.low <= borders[gap.layer] + StandingPart::kSheet;
            if (below) milled[r].push_back(gap);
            return below;
        });
    double tolerance = kFirstTolerance;
    std::vector<std::vector<FilledBox>> boxes(layers.size()), below(layers.size());
    for (;; tolerance *= 2) {
        std::size_t count = 0;
        for (std::uint32_t l = 0; l < layers.size(); ++l) {
            boxes[l] = boxes_of(rows, l, tolerance);
            below[l] = boxes_of(milled, l, tolerance);
            count += boxes[l].size() + below[l].size();
        }
        if (count <= kMostBoxes || tolerance > height) break;
    }
    std::vector<PackedFilling::Layer> list;
    const auto share = [&](double z) {
        return static_cast<std::uint16_t>(std::clamp(std::round((z - z0) / height * 65535), 0.0, 65535.0));
    };
    for (std::uint32_t l = 0; l < layers.size(); ++l) {
        double volume = 0;
        for (const auto& row : rows)
            for (const FilledGap& gap : row)
                if (gap.layer == l) volume += (gap.high - gap.low) * cell * cell;
        const auto packed = [&](const std::vector<FilledBox>& list_of) {
            std::string bytes;
            for (const FilledBox& b : list_of)
                for (const std::uint16_t value :
                     {static_cast<std::uint16_t>(b.row), static_cast<std::uint16_t>(b.column),
                      static_cast<std::uint16_t>(b.count), share(b.low), share(b.high)})
                    append(bytes, value);
            return base64(bytes);
        };
        list.push_back({packed(boxes[l]), std::round(volume), packed(below[l])});
    }
    return {z0, height, tolerance, std::move(list)};
}

}  // namespace slabwright

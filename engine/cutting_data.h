// Feeds and speeds by material and tool, as makers of cutters publish them (METHOD.md section 7).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace slabwright {

enum class ToolKind : std::uint8_t { flat, ball, face, drill, bull_nose, tapered_ball, cone };

/// Which tools a line of cutting data is for.
enum class CuttingScope : std::uint8_t {
    any,
    end_mill,
    flat,
    ball,
    face,
    drill,
    bull_nose,
    tapered_ball,
    cone
};

/// Published charts that the house knows by name. Nobody publishes one for tooling boards that could be read
/// and cited, so there is none.
enum class CuttingChart : std::uint8_t { none, mdf, pine, plywood, foam };

/// What tools of some kind and width do in a material.
struct CuttingData {
    CuttingScope kind = CuttingScope::any;
    double diameter_min = 0, diameter_max = 0;  ///< mm, both included; a maximum of 0: any
    int flutes = 0;                             ///< 0: any number
    double chip_load = 0;                       ///< mm a tooth
    double surface_speed = 0;                   ///< m/min at the cutter's rim; 0: not stated
    double spindle_rpm = 0;                     ///< at which the chart is stated; 0: not stated
    std::string source;                         ///< whose figures these are
    friend bool operator==(const CuttingData&, const CuttingData&) = default;
};

/// Whether a line is for tools of this kind, diameter (mm) and number of flutes.
[[nodiscard]] bool covers(const CuttingData& data, ToolKind kind, double diameter, int flutes);

/// The lines of a chart, each the lower end of what its source states, with the source; none of `none`.
[[nodiscard]] std::span<const CuttingData> lines_of(CuttingChart chart);

/// @throws Error(usage, "job.range") whose place is the key, "material.cutting[1].chip_load", where a number
/// is out of range or a source is missing
void validate_cutting_data(const std::vector<CuttingData>& lines);

}  // namespace slabwright

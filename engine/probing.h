// How the programs' z = 0 is found on the machine by a probing cycle: what the job says of it, and where the
// tip is then, over a reference beside the stack whose height over the machine's table is known.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace slabwright {

/// Who finds z = 0: the operator, by the touch_off of the sequence, or a program in nc/.
enum class ProbeMode : std::uint8_t { none, cycle };

/// Keys of [probing]. Feeds in mm/min, lengths in mm.
struct Probing {
    int tool = 99;            ///< T number of the probe, or of a cutter of the library with a touch plate
    double tip_diameter = 3;  ///< of the probe
    double fast_feed = 200;   ///< until it touches for the first time
    double slow_feed = 50;    ///< the second time, which counts
    double plate = 0;         ///< thickness of the touch plate that lies on what is touched
    double search = 20;       ///< that it goes down at most; it begins half of that over what it touches
    double retract = 10;      ///< that it goes up when it is done
    /// x and y from the base board's left front corner, z from the machine table's top, of what is touched.
    std::vector<double> reference;
};

/// How far it goes back up between the two touches, mm; and then down at most twice as far.
inline constexpr double kProbeBack = 2;

/// @throws Error(usage, "job.range") that names a key out of its range
void validate_probing(const Probing& probing);

/// Checks Machine::pin. @param is_zero whether the programs count from it
/// @throws Error(usage, "job.range") where it is no place, or is none and has to be one
void validate_pin(const std::vector<double>& pin, bool is_zero);

}  // namespace slabwright

// A program as it is read, whatever its dialect: motions one after another, arcs as chords, and what it says
// of spindle, dwells and rounded corners.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "engine/simulate/program.h"
#include "io/posts/gcode_line.h"
#include "io/posts/gcode_reader.h"

namespace slabwright {

/// An arc's centre and the axes of its plane.
struct ReadArc {
    double ca = 0, cb = 0;              ///< mm, along the first and second axis
    bool clockwise = false;             ///< seen against the normal
    std::array<int, 3> plane{0, 1, 2};  ///< first, second, normal (0: x)
};

class ProgramBuilder {
public:
    /// @param text of which it is read: its length tells how much is to come. All must outlive it
    ProgramBuilder(std::string_view text, const Dialect& dialect, const GcodeLimits& limits,
                   const GcodePlace& place);

    Program program;  ///< that is being read

    /// An operation begins: what was read so far is a program of its own from here on, unless it has no
    /// motions. The new one begins anywhere, and rounds corners as the last one did until it says otherwise.
    /// @param tool in the spindle
    void begin_operation(int tool);
    /// All operations, in their order; the last is `program`.
    [[nodiscard]] std::vector<Program> take(int tool);

    /// How far the text has been read, bytes.
    void read_to(std::size_t bytes) { read_ = bytes; }
    [[nodiscard]] const std::array<double, 3>& at() const { return at_; }
    /// The spindle's speed from here on, rpm; 0: it does not turn.
    void turn(double rpm);
    /// The spindle is started or its speed changed: dwells count towards its start from here on.
    void spin_up();
    void dwell(double seconds);
    /// Of several in one program the widest counts where the cutter may get, the narrowest for its time.
    void blend(double rounds, double leaves_out);
    void rapid(const std::array<double, 3>& to);
    /// @throws Error(verification): gcode.unknown_place, gcode.number for a place beyond 214 m
    void line(const std::array<double, 3>& to, double feed);
    /// @throws as line(), for a radius beyond 214 m too; gcode.arc where begin and end lie at different radii
    void arc(const std::array<double, 3>& to, const ReadArc& arc, double feed);
    /// @throws Error(verification, "gcode.number")
    void check_place(const std::array<double, 3>& to) const;

private:
    /// How an arc goes.
    struct Sweep {
        double r0, r1, start, angle;
    };
    [[nodiscard]] Sweep sweep_of(const std::array<double, 3>& to, const ReadArc& arc) const;
    void require_known(const std::array<double, 3>& to) const;
    void note_spindle();
    void end_spin_up();
    void make_room();
    void step(const std::array<double, 3>& to, double feed);

    std::vector<Program> done_;
    std::string_view text_;
    GcodeLimits limits_;
    double level_radius_error_;  // mm by which the radii of a level arc may differ
    const GcodePlace& place_;
    std::size_t read_ = 0;
    double rpm_ = 0;
    double spin_up_s_ = 0;  // of dwell since the spindle was started or its speed changed
    bool spinning_up_ = false, blended_ = false;
    std::array<double, 3> at_{kUnknown, kUnknown, kUnknown};
};

}  // namespace slabwright

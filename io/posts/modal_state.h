// What of a control's state the words of a program have set. Nothing is known where it begins:
// whatever ran before may have left the machine in inches, in another plane or with another tool's length in
// force. A motion is refused while anything that decides where it goes has not been stated.
//
// What no program can state is the operator's: where G54 lies (with its G92 and its rotation), and the tools'
// lengths.
#pragma once

#include <array>
#include <optional>

#include "io/posts/gcode_line.h"

namespace slabwright {

class ModalState {
public:
    /// @param dialect must outlive it
    /// @param several the program may change tools
    explicit ModalState(const Dialect& dialect, bool several = false)
        : dialect_(dialect),
          several_(several && dialect.changes_tools),
          no_length_offset_(dialect.length == Dialect::Length::touch_off) {
        if (dialect.centres_incremental) absolute_centres_ = false;
    }

    enum class Motion { none, rapid, line, clockwise, counter_clockwise };
    enum class Spindle { unknown, off, clockwise };

    /// Takes all words of a line but its coordinates, its program number and its end, in LinuxCNC's order,
    /// whatever the order in the line: feed, speed, tool, change, spindle; then dwell, plane, units, offsets,
    /// path mode, distances.
    /// @throws Error(verification): gcode.twice for two words of one group, gcode.unknown_word for a G or M
    ///   number that is none of this project's, gcode.number, gcode.unused_word, gcode.unset for a length
    ///   before its unit, gcode.tool, gcode.offset, gcode.spindle, gcode.coolant, gcode.pause, gcode.switch,
    ///   gcode.dwell, gcode.path_mode
    void apply(const GcodeLine& line, const GcodePlace& place);

    /// @throws Error(verification): gcode.tool, gcode.offset or gcode.unset that name what the program has
    ///   not stated before this motion; gcode.feed for a feed motion before any F
    void require_for_motion(const GcodePlace& place) const;

    /// @throws Error(verification, "gcode.left_in_force") where the program ends in another unit than the
    ///   dialect's, or incremental
    void require_at_end(const GcodePlace& place) const;

    [[nodiscard]] Motion motion() const { return motion_; }
    /// A G0 to G3 stands in the line that was applied last.
    [[nodiscard]] bool motion_named() const { return motion_named_; }
    /// The axes of the plane's first and second coordinate and its normal (0: x).
    [[nodiscard]] std::array<int, 3> plane() const { return plane_; }
    [[nodiscard]] double unit() const { return unit_; }  ///< mm
    [[nodiscard]] bool incremental() const { return distance_ == Distance::incremental; }
    [[nodiscard]] std::optional<bool> absolute_centres() const { return absolute_centres_; }
    [[nodiscard]] double feed() const { return feed_; }  ///< mm/min; 0: none yet
    [[nodiscard]] int tool() const { return loaded_; }   ///< 0: none yet
    [[nodiscard]] double speed() const { return speed_; }
    [[nodiscard]] bool turning() const { return spindle_ == Spindle::clockwise && speed_ > 0; }

    /// How far the machine may round corners and leave its path (G61, G64), mm.
    struct PathMode {
        double rounds = 0, leaves_out = 0;
    };
    /// That of the line that was applied last, if it names one.
    [[nodiscard]] const std::optional<PathMode>& named_path_mode() const { return named_path_mode_; }
    /// Seconds of the G4 in the line that was applied last.
    [[nodiscard]] std::optional<double> dwell() const { return dwell_; }
    /// The line that was applied last starts the spindle or changes its speed.
    [[nodiscard]] bool spins_up() const { return spins_up_; }

private:
    enum class Distance { unknown, absolute, incremental };

    bool motion_word(int g);
    void g_word(int g, const GcodePlace& place);
    void m_word(int m, const GcodePlace& place);
    void change_tool(const GcodePlace& place);
    void length_offset(const GcodeLine& line, const GcodePlace& place);
    void path_mode(const GcodeLine& line, const GcodePlace& place);
    void speed_and_feed(const GcodeLine& line, const GcodePlace& place);
    void check_words(const GcodeLine& line, const GcodePlace& place) const;
    [[nodiscard]] bool is_switch(int m) const;
    void check_switch(const GcodeLine& line, const GcodePlace& place) const;
    void rounding_187(const GcodeLine& line, const GcodePlace& place);
    void rounding_adis(const GcodeLine& line, const GcodePlace& place);
    void dwell(const GcodeLine& line, const GcodePlace& place);
    void edge(const GcodeLine& line, const GcodePlace& place);
    double length(double value, const GcodePlace& place) const;
    double feed_of(double value, const GcodePlace& place) const;

    const Dialect& dialect_;
    bool several_;
    Motion motion_ = Motion::none;
    std::array<int, 3> plane_{-1, -1, -1};
    double unit_ = 0;  // unknown
    Distance distance_ = Distance::unknown;
    std::optional<bool> absolute_centres_;
    bool feed_per_minute_ = false, no_compensation_ = false, radius_mode_ = false, revolutions_ = false;
    bool work_offset_ = false, path_mode_ = false;
    int selected_ = 0, loaded_ = 0;
    bool length_offset_ = false;  // of the tool that is loaded
    bool no_length_offset_;       // the control knows of none
    double feed_ = 0, speed_ = 0;
    Spindle spindle_ = Spindle::unknown;

    bool motion_named_ = false, spins_up_ = false;
    std::optional<PathMode> named_path_mode_;
    std::optional<double> dwell_;
};

}  // namespace slabwright

// What a machine does, motion by motion, with all that is in force then, as LinuxCNC's interpreter says it:
// the judge of whether two programs are the same to a machine.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/rs274.h"

namespace slabwright::support {

/// A motion, a dwell, a tool change, a message or the end.
struct CanonAct {
    std::string call;             ///< "STRAIGHT_FEED" …
    std::vector<double> numbers;  ///< of a motion in mm, then its feed in mm/min where it is no rapid
    std::string in_force;         ///< spindle, path mode, offsets, units of feed, coolant

    [[nodiscard]] bool moves() const { return call == "STRAIGHT_TRAVERSE" || call == "STRAIGHT_FEED"; }
};

/// State that a machine was left in, foreign in every group that programs must state themselves: inches, XZ
/// plane, increments, absolute centres, inverse time, G55, diameters, no path tolerance, another tool and
/// length, constant surface speed, spindle backwards. It ends with the comment that canon_acts() begins at.
inline const std::string kLeftInForce =
    "G20 G18 G91 G90.1 G93 G55\nG7\nG64\nT1 M6\nG43.1 Z0.5\nG96 D3000 S77 M4\nF7 G1 X0.1 Y0.2 Z0.3\n"
    "(BEGINS)\n";

/// Whether a → b → c is one straight way.
inline bool goes_on(const std::array<double, 3>& a, const std::array<double, 3>& b,
                    const std::array<double, 3>& c) {
    return std::abs(std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) +
                    std::hypot(c[0] - b[0], c[1] - b[1], c[2] - b[2]) -
                    std::hypot(c[0] - a[0], c[1] - a[1], c[2] - a[2])) < 1e-9;
}

/// An arc by places on it, for a centre may move along a flat one without moving it: end, turns, middle.
inline std::vector<double> arc_places(const std::array<double, 3>& from, const std::array<double, 3>& to,
                                      const std::array<double, 2>& centre, double turns) {
    const double a = std::atan2(from[1] - centre[1], from[0] - centre[0]);
    double sweep = std::atan2(to[1] - centre[1], to[0] - centre[0]) - a;
    constexpr double full = 2 * std::numbers::pi;
    while (turns > 0 && sweep <= 1e-12) sweep += full;
    while (turns < 0 && sweep >= -1e-12) sweep -= full;
    const double radius = (std::hypot(from[0] - centre[0], from[1] - centre[1]) +
                           std::hypot(to[0] - centre[0], to[1] - centre[1])) /
                          2;
    return {to[0],
            to[1],
            to[2],
            turns,
            centre[0] + radius * std::cos(a + sweep / 2),
            centre[1] + radius * std::sin(a + sweep / 2)};
}

/// The acts of canonical text from the comment (BEGINS) on, if it has one. Motions that go nowhere are none,
/// and those that go straight on are one.
inline std::vector<CanonAct> canon_acts(std::string_view text) {
    std::vector<CanonAct> acts;
    std::map<std::string, std::string> in_force;
    double unit = 1, feed = 0;
    bool level = true, fed = false;  // the plane is XY; something was cut
    double start_up_s = 0;
    const auto begin_to_feed = [&] {
        if (!fed) acts.push_back({"DWELL", {start_up_s}, {}});
        fed = true;
    };
    std::array<double, 3> before{1e9, 1e9, 1e9}, at = before;  // where the last motion began and ended
    const auto force = [&] {
        std::string all;
        for (const auto& [name, value] : in_force) all += name + value + " ";
        return all;
    };
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        const std::string_view line = text.substr(begin, end - begin);
        begin = end + 1;
        const std::size_t dots = line.find("N..... "), open = line.find('(');
        if (dots == std::string_view::npos || open == std::string_view::npos) continue;
        const std::string call(line.substr(dots + 7, open - dots - 7)), arguments(line.substr(open));
        const std::vector<double> n = canon_numbers(arguments);
        if (call == "COMMENT") {
            if (arguments.find("BEGINS") != std::string::npos) {
                acts.clear();
                fed = false;
                start_up_s = 0;
            }
        } else if (call == "USE_LENGTH_UNITS") {
            unit = arguments.find("INCHES") != std::string::npos ? 25.4 : 1;
        } else if (call == "SET_FEED_RATE") {
            feed = n.at(0) * unit;
        } else if (call == "STRAIGHT_TRAVERSE" || call == "STRAIGHT_FEED") {
            const std::array<double, 3> to{n.at(0) * unit, n.at(1) * unit, n.at(2) * unit};
            if (to == at) continue;
            if (call == "STRAIGHT_FEED") begin_to_feed();
            CanonAct act{call, {to[0], to[1], to[2]}, force()};
            for (std::size_t k = 3; k < n.size(); ++k) act.numbers.push_back(n[k]);
            if (call == "STRAIGHT_FEED") act.numbers.push_back(feed);
            const bool on = !acts.empty() && goes_on(before, at, to) && acts.back().call == call &&
                            acts.back().in_force == act.in_force &&
                            std::equal(act.numbers.begin() + 3, act.numbers.end(),
                                       acts.back().numbers.begin() + 3, acts.back().numbers.end());
            if (on) acts.back() = act;
            else {
                acts.push_back(act);
                before = at;
            }
            at = to;
        } else if (call == "ARC_FEED") {
            begin_to_feed();
            const std::array<double, 3> to{n.at(0) * unit, n.at(1) * unit, n.at(5) * unit};
            CanonAct act{call, n, force()};
            if (level) act.numbers = arc_places(at, to, {n.at(2) * unit, n.at(3) * unit}, n.at(4));
            act.numbers.push_back(feed);
            acts.push_back(act);
            before = at;
            at = to;
        } else if (call.rfind("START_SPINDLE", 0) == 0 || call == "STOP_SPINDLE_TURNING") {
            in_force["SPINDLE"] = call;
        } else if (call.rfind("MIST", 0) == 0 || call.rfind("FLOOD", 0) == 0) {
            in_force[call.substr(0, 4)] = call;
        } else if (call == "SELECT_PLANE") {
            level = arguments.find("XY") != std::string::npos;
        } else if (call == "ON_RESET" || call == "START_CHANGE") {
            continue;
        } else if (call.rfind("ENABLE_", 0) == 0) {
            continue;  // that the operator may turn feed and speed down is no act
        } else if (call == "USE_TOOL_LENGTH_OFFSET" || call.rfind("SET_", 0) == 0) {
            in_force[call] = arguments;
        } else if (call == "DWELL" && !fed) {
            start_up_s += n.at(0);  // wherever it stands before the first cut, the spindle gets that time
        } else {
            acts.push_back({call, n, call == "MESSAGE" ? arguments : std::string()});
        }
    }
    return acts;
}

/// Where two lists of acts begin to differ, in words; "" where a machine does the same by both.
/// @param places_from the act from which x and y count: before it they are where the machine stood
inline std::string difference(const std::vector<CanonAct>& a, const std::vector<CanonAct>& b,
                              std::size_t places_from = 0) {
    constexpr double kSame = 2e-4;  // mm: four decimals are printed
    for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
        if (i >= a.size() || i >= b.size()) return "act " + std::to_string(i) + ": one has no more";
        bool same = a[i].call == b[i].call && a[i].numbers.size() == b[i].numbers.size() &&
                    a[i].in_force == b[i].in_force;
        for (std::size_t k = 0; same && k < a[i].numbers.size(); ++k)
            if (!(a[i].moves() && k < 2 && i < places_from))
                same = std::abs(a[i].numbers[k] - b[i].numbers[k]) <= kSame;
        if (same) continue;
        const auto words = [](const CanonAct& act) {
            std::string all = act.call;
            for (const double v : act.numbers) all += " " + std::to_string(v);
            return all + " | " + act.in_force;
        };
        return "act " + std::to_string(i) + ": " + words(a[i]) + " / " + words(b[i]);
    }
    return {};
}

}  // namespace slabwright::support

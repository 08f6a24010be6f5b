#include "io/posts/probe_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace slabwright {

namespace {

constexpr double kSame = 0.002;  // mm and mm/min: what rounding to a program's decimals leaves

/// The words of a line, in tenths of their numbers for G and M; none where it is no line of words.
struct Line {
    std::set<int> g, m;              // in tenths: G38.2 is 382
    std::map<char, double> numbers;  // of the other letters
};

std::optional<Line> read_line(std::string_view text) {
    Line line;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == ' ' || c == '\r') {
            ++i;
            continue;
        }
        if (c == '(') {
            const std::size_t end = text.find(')', i);
            if (end == std::string_view::npos ||
                text.substr(i + 1, end - i - 1).find('(') != std::string_view::npos)
                return std::nullopt;
            i = end + 1;
            continue;
        }
        if (c < 'A' || c > 'Z') return std::nullopt;
        double value = 0;
        const auto read =
            std::from_chars(text.data() + i + 1, text.data() + text.size(), value, std::chars_format::fixed);
        if (read.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
        i = static_cast<std::size_t>(read.ptr - text.data());
        if (c == 'G' || c == 'M') {
            const int tenths = static_cast<int>(std::lround(std::clamp(value, -1e6, 1e6) * 10));
            if (std::abs(tenths - value * 10) > 1e-6 || !(c == 'G' ? line.g : line.m).insert(tenths).second)
                return std::nullopt;
        } else if (!line.numbers.emplace(c, value).second) {
            return std::nullopt;
        }
    }
    return line;
}

/// Follows a program line by line. Heights count from where the tip begins, mm.
class ProbeReading {
public:
    ProbeReading(const std::string& file, const ProbeTask& task, const Job& job)
        : file_(file),
          task_(task),
          job_(job),
          unit_(job.machine.units == LengthUnit::inch ? kInch : 1),
          has_lengths_(knows_tool_lengths(job.machine.post)) {}

    std::vector<Violation> run(std::string_view text) {
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find('\n', at), text.size());
            ++line_;
            const std::optional<Line> line = read_line(text.substr(at, end - at));
            if (!line) complain("probe.word", "is no line of words");
            else follow(*line);
            at = end + 1;
        }
        finish();
        return std::move(found_);
    }

private:
    void complain(const char* code, std::string message, double size = 0) {
        found_.push_back({code, std::move(message), file_, line_, {}, size});
    }

    /// The words of a line that does one thing, and no others.
    bool has_only(const Line& line, const std::set<int>& g, std::string_view letters) {
        const bool words = std::all_of(line.numbers.begin(), line.numbers.end(), [&](const auto& n) {
            return letters.find(n.first) != std::string_view::npos;
        });
        if (words && line.g == g && line.m.empty() && line.numbers.size() == letters.size()) return true;
        complain("probe.word", "has words that a probing program does not have, or lacks one");
        return false;
    }

    void follow(const Line& line) {
        if (line.g.empty() && line.m.empty() && line.numbers.empty()) return;
        if (ended_) return complain("probe.word", "comes after the end");
        if (line.m.contains(30) || line.m.contains(40) || line.numbers.contains('S'))
            return complain("probe.spindle", "starts the spindle, or says how fast it turns");
        if (line.g.contains(382)) return touch(line);
        if (line.g.contains(0) || line.g.contains(10)) return move(line);
        if (line.g.contains(100)) return set_offset(line);
        if (line.g.contains(430)) return length(line);
        if (line.numbers.contains('T')) return tool(line);
        if (line.m == std::set<int>{20} && line.g.empty() && line.numbers.empty()) {
            ended_ = true;
            return;
        }
        if (line.m == std::set<int>{50} && line.g.empty() && line.numbers.empty()) {
            stopped_ = true;
            return;
        }
        if (line.m.empty() && line.numbers.empty()) return modes(line);
        complain("probe.word", "is no line of a probing program");
    }

    void modes(const Line& line) {
        const int units = job_.machine.units == LengthUnit::inch ? 200 : 210;
        const std::set<int> known{units, 170, 400, 490, 540, 800, 900, 910, 940};
        for (const int g : line.g) {
            if (!known.contains(g)) complain("probe.word", fmt::format("G{} has no place in it", g / 10.0));
            if (g == units) unit_said_ = true;
            if (g == 540) work_offset_ = true;
            if (g == 900 || g == 910) incremental_ = g == 910;
            if (g == 940) per_minute_ = true;
            if (g == 490 && length_) complain("probe.tool", "takes the tool's length back");
        }
    }

    void tool(const Line& line) {
        if (has_lengths_ ? line.m != std::set<int>{60} : !line.m.empty())
            complain("probe.tool", has_lengths_ ? "names a tool without M6" : "changes the tool");
        if (!line.g.empty() || line.numbers.size() != 1) complain("probe.word", "has other words beside T");
        if (line.numbers.at('T') != task_.tool)
            complain("probe.tool", fmt::format("is for tool {}, not {}", line.numbers.at('T'), task_.tool));
        tool_ = true;
    }

    void length(const Line& line) {
        if (!has_only(line, {430}, "H")) return;
        if (!has_lengths_ || !tool_ || line.numbers.at('H') != task_.tool)
            complain("probe.tool", "takes another tool's length");
        length_ = true;
    }

    /// Whether what must be said before the first move has been said.
    void require_ready() {
        if (asked_) return;
        asked_ = true;
        if (!unit_said_ || !per_minute_ || !work_offset_)
            complain("probe.word", "moves before unit, feed in a minute and work offset are said");
        if (!tool_ || (has_lengths_ && !length_)) complain("probe.tool", "moves before its tool is said");
        if (!incremental_) complain("probe.word", "moves without G91");
        if (!stopped_) complain("probe.spindle", "moves before M5 has stopped the spindle");
    }

    void touch(const Line& line) {
        require_ready();
        if (!has_only(line, {382}, "FZ")) return;
        const Probing& probing = job_.probing;
        const double down = -line.numbers.at('Z') * unit_, feed = line.numbers.at('F') * unit_;
        const double fastest = touches_ == 0 ? probing.fast_feed : probing.slow_feed;
        // Feeds in inch have three decimals: a fortieth of a millimetre a minute.
        if (!(feed > 0) || feed > fastest + (unit_ > 1 ? 0.02 : kSame))
            complain("probe.feed", fmt::format("touches at {:.1f} mm/min, {:.1f} at most", feed, fastest),
                     feed);
        if (!incremental_ || !(down > 0)) complain("probe.descent", "does not probe downwards");
        else if (touches_ == 0 && std::abs(down - probing.search) > kSame)
            complain("probe.search", fmt::format("seeks {:.3f} mm down, not {:.3f} mm", down, probing.search),
                     std::abs(down - probing.search));
        else if (touches_ > 0 && !(down <= 2 * kProbeBack + kSame && above_ > 0 && down > above_))
            complain("probe.search", fmt::format("seeks {:.3f} mm down from {:.3f} mm above", down, above_),
                     down);
        ++touches_;
        above_ = 0;
        touched_ = true;
        slow_ = feed <= probing.slow_feed + (unit_ > 1 ? 0.02 : kSame);
    }

    void move(const Line& line) {
        require_ready();
        if (!line.g.contains(0)) return complain("probe.descent", "moves by G1, which no touch stops");
        if (!has_only(line, {0}, "Z")) return;
        const double up = line.numbers.at('Z') * unit_;
        if (!incremental_ || !(up > 0))
            return complain("probe.descent", "goes down, or to a height that is not known, by a rapid");
        if (touches_ == 0) complain("probe.descent", "moves before it has touched");
        above_ += up;
        touched_ = false;
    }

    void set_offset(const Line& line) {
        if (!has_only(line, {100}, "LPZ")) return;
        if (line.numbers.at('L') != 20 || line.numbers.at('P') != 1)
            complain("probe.offset", "does not set G54 by where the tip is (G10 L20 P1)");
        if (!touched_ || touches_ < 2 || !slow_)
            complain("probe.offset", "sets z elsewhere than at the slow touch");
        if (set_) complain("probe.offset", "sets z again");
        const double z = line.numbers.at('Z') * unit_;
        if (!(std::abs(z - task_.touch_z) <= kSame))
            complain(
                "probe.offset",
                fmt::format("says z {:.4f} mm where it touches; the plan says {:.4f} mm", z, task_.touch_z),
                std::abs(z - task_.touch_z));
        set_ = true;
    }

    void finish() {
        if (!set_) complain("probe.offset", "never sets z");
        if (!(above_ >= job_.probing.retract - kSame))
            complain("probe.retract",
                     fmt::format("leaves the tip {:.3f} mm above what it touched, {:.3f} mm at "
                                 "least",
                                 above_, job_.probing.retract));
        if (incremental_) complain("probe.word", "leaves G91 in force");
        if (!ended_) complain("probe.word", "has no M2");
    }

    const std::string& file_;
    const ProbeTask& task_;
    const Job& job_;
    double unit_;
    bool has_lengths_;
    std::vector<Violation> found_;
    std::uint32_t line_ = 0;
    int touches_ = 0;
    double above_ = 0;  // of the last touch
    bool ended_ = false, set_ = false, touched_ = false, slow_ = false, asked_ = false;
    bool tool_ = false, length_ = false, unit_said_ = false, work_offset_ = false, per_minute_ = false;
    bool incremental_ = false, stopped_ = false;
};

}  // namespace

std::vector<Violation> check_probe(std::string_view text, const std::string& file, const ProbeTask& task,
                                   const Job& job) {
    return ProbeReading(file, task, job).run(text);
}

}  // namespace slabwright

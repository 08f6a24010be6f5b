#include "io/posts/post_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "io/posts/gcode_line.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

struct Placeholder {
    std::string_view name, sample;
};
// A unit's sample is nothing: a G20 or G21 that is found is then one that was written out.
constexpr std::array<Placeholder, 9> kPlaceholders{{{"unit", ""},
                                                    {"number", "201"},
                                                    {"tool", "2"},
                                                    {"speed", "9000"},
                                                    {"dwell", "3."},
                                                    {"dwell_ms", "3000"},
                                                    {"blend", "0.02"},
                                                    {"name", "L002_01_rough_T2"},
                                                    {"z", "10."}}};

struct NamedWord {
    int tenths;
    const char* what;
};
constexpr NamedWord kRefusedG[] = {{0, "a motion"},
                                   {10, "a motion"},
                                   {20, "a motion"},
                                   {30, "a motion"},
                                   {100, "writes offsets"},
                                   {200, "sets the unit: write {unit}"},
                                   {210, "sets the unit: write {unit}"},
                                   {280, "moves to the reference point"},
                                   {300, "moves to the reference point"},
                                   {431, "writes a length offset"},
                                   {520, "shifts the origin"},
                                   {530, "moves by the machine's own coordinates"},
                                   {550, "another work offset than G54"},
                                   {560, "another work offset than G54"},
                                   {570, "another work offset than G54"},
                                   {580, "another work offset than G54"},
                                   {590, "another work offset than G54"},
                                   {591, "another work offset than G54"},
                                   {592, "another work offset than G54"},
                                   {593, "another work offset than G54"},
                                   {7000, "sets the unit: write {unit}"},
                                   {7100, "sets the unit: write {unit}"},
                                   {901, "absolute centres of arcs"},
                                   {910, "incremental distances"},
                                   {920, "shifts the origin"}};
constexpr NamedWord kRefusedM[] = {
    {0, "a stop in the program"},
    {10, "a stop in the program"},
    {40, "a spindle turning backwards"},
    {70, "coolant on wood; what it switches instead goes into control.switches"},
    {80, "coolant on wood; what it switches instead goes into control.switches"},
    {600, "a stop in the program"},
    {980, "calls another program"},
    {990, "returns from a program"}};

class LineCheck {
public:
    LineCheck(std::string_view line, PostPart part, const Dialect& dialect, const std::string& place)
        : line_(line), part_(part), dialect_(dialect), place_(place) {}

    void run() {
        characters();
        const std::string sample = filled();
        if (part_ == PostPart::notes || sample.find_first_not_of(' ') == std::string::npos) return;
        GcodeLine words;
        try {
            read_gcode_line(sample, {"post", 0}, dialect_, words);
        } catch (const Error& error) {
            refuse("post.template", error.message(),
                   error.remedy() == "plan again" ? std::string("correct the line") : error.remedy());
        }
        if (part_ == PostPart::extra) only_switches(words);
        else state(words);
    }

private:
    [[noreturn]] void refuse(const char* code, const std::string& what, const std::string& remedy) const {
        throw Error(ErrorKind::usage, code,
                    quoting_line(fmt::format("the line \"{}\": {}", line_.substr(0, 60), what)), place_,
                    remedy);
    }

    void characters() const {
        for (const char c : line_)
            if (c < ' ' || c > '~')
                refuse("post.template",
                       fmt::format("the byte 0x{:02X}, which is no printing ASCII character",
                                   static_cast<unsigned char>(c)),
                       "give each line as a text of its own");
        if (line_.size() > dialect_.longest_line)
            refuse("post.template",
                   fmt::format("{} characters; text.longest_line is {}", line_.size(), dialect_.longest_line),
                   "shorten it");
        if (line_.find('%') != std::string_view::npos && line_ != "%")
            refuse("post.template", "a % mark among other characters", "give it a line of its own");
        if (line_ == "%" && part_ != PostPart::begin && part_ != PostPart::end)
            refuse("post.template", "a % mark within the program: the machine stops there",
                   "its place is in program.begin and program.end");
    }

    /// The line with samples for its placeholders; unit and tool stand for words that it may hold.
    std::string filled() {
        std::string sample;
        for (std::size_t at = 0; at < line_.size();) {
            if (line_[at] == '}') refuse("post.template", "a brace that nothing opens", "take it out");
            if (line_[at] != '{') {
                sample += line_[at++];
                continue;
            }
            const std::size_t close = line_.find('}', at);
            if (close == std::string_view::npos)
                refuse("post.template", "a brace that is not closed", "take it out");
            sample += sample_of(line_.substr(at + 1, close - at - 1));
            at = close + 1;
        }
        return sample;
    }

    std::string_view sample_of(std::string_view inside) {
        const std::size_t colon = inside.find(':');
        const std::string_view name = inside.substr(0, colon);
        const auto known = std::find_if(kPlaceholders.begin(), kPlaceholders.end(),
                                        [&](const Placeholder& p) { return p.name == name; });
        if (known == kPlaceholders.end()) {
            std::string names;
            for (const Placeholder& p : kPlaceholders) names += fmt::format(" {{{}}}", p.name);
            refuse("post.template", "a placeholder that is none", "the placeholders are" + names);
        }
        if (name == "z" && part_ != PostPart::first)
            refuse("post.template", "{z} outside of program.first", "the height is said by the first motion");
        if (part_ == PostPart::extra && name != "tool" && name != "number" && name != "name")
            refuse("post.template", "a placeholder that extra lines do not have",
                   "they have {tool}, {number} and {name}");
        if (colon == std::string_view::npos) return known->sample;
        const std::string_view width = inside.substr(colon + 1);
        const bool whole = name == "number" || name == "tool";
        if (!whole || width.size() != 2 || width[0] != '0' || width[1] < '1' || width[1] > '8')
            refuse("post.template", "a placeholder with another form than {tool:02} or {number:04}",
                   "give the digits of {tool} or {number} so, or none");
        return known->sample;
    }

    void only_switches(const GcodeLine& words) const {
        if (words.empty()) return;
        const bool one = words.g.count == 0 && words.m.count == 1 && !words.has_letter_beside('P') &&
                         is_switch(*words.m.begin());
        if (one) return;
        for (const int g : words.g) named(kRefusedG, 'G', g);
        for (const int m : words.m)
            if (!is_switch(m)) named(kRefusedM, 'M', m);
        refuse(
            "post.state", "an extra line may only comment, or switch by an M of control.switches",
            "list the number in control.switches where it switches dust, vacuum or air; all else goes into "
            "[program]");
    }

    void state(const GcodeLine& words) const {
        for (const int g : words.g) {
            if (part_ == PostPart::first && g == 0) continue;
            named(kRefusedG, 'G', g);
            if (std::find(dialect_.g.begin(), dialect_.g.end(), g) == dialect_.g.end())
                refuse("post.template",
                       fmt::format("G{}, which {} programs do not use", gcode_number(g),
                                   word_of(kPostWords, dialect_.post)),
                       "take it out: what the proof cannot read it cannot prove");
        }
        for (const int m : words.m) {
            if (is_switch(m)) continue;
            named(kRefusedM, 'M', m);
            if (std::find(dialect_.m.begin(), dialect_.m.end(), m) == dialect_.m.end())
                refuse("post.template",
                       fmt::format("M{}, which {} programs do not use", gcode_number(m),
                                   word_of(kPostWords, dialect_.post)),
                       "list it in control.switches where it switches dust, vacuum or air, and nothing else");
        }
        const bool times_x = words.g.has(40) && dialect_.dwell == Dialect::Dwell::x_seconds;
        for (const char letter : {'X', 'Y', 'Z', 'I', 'J', 'K', 'R'}) {
            if (!words.has(letter) || (letter == 'X' && times_x)) continue;
            if (letter == 'Z' && part_ == PostPart::first) continue;
            refuse("post.state", fmt::format("a coordinate ({}), and with it a motion", letter),
                   "programs move where the plan says only");
        }
    }

    template <std::size_t N>
    void named(const NamedWord (&refused)[N], char letter, int tenths) const {
        for (const NamedWord& word : refused)
            if (word.tenths == tenths)
                refuse("post.state", fmt::format("{}{} ({})", letter, gcode_number(tenths), word.what),
                       "take it out: the proof relies on its absence");
    }

    [[nodiscard]] bool is_switch(int m) const {
        const std::vector<int>& known = dialect_.switches;
        return m % 10 == 0 && std::find(known.begin(), known.end(), m / 10) != known.end();
    }

    std::string_view line_;
    PostPart part_;
    const Dialect& dialect_;
    const std::string& place_;
};

}  // namespace

void check_post_line(std::string_view line, PostPart part, const Dialect& dialect, const std::string& place) {
    LineCheck(line, part, dialect, place).run();
}

}  // namespace slabwright

#include "io/write/job_toml.h"

#include <fmt/format.h>

#include <array>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "io/text/decimal.h"
#include "io/text/job_keys.h"
#include "io/text/json_text.h"

namespace slabwright {

namespace {

/// Prints keys as lines of TOML with their comments in one column.
struct Printer {
    std::string text;
    void table(const char* name, const char* comment) {
        text += fmt::format("\n[{}]", name);
        if (*comment != '\0') text += fmt::format("  # {}", comment);
        text += '\n';
    }
    void required() {}
    void line(const char* name, const std::string& value, const char* comment) {
        std::string entry = fmt::format("{} = {}", name, value);
        if (*comment != '\0') entry = fmt::format("{:<36}  # {}", entry, comment);
        text += entry + '\n';
    }
    static std::string real(double value) {
        std::string digits;
        append_decimal(digits, value);
        if (digits.find('.') == std::string::npos) digits += ".0";
        return digits;
    }
    static std::string quoted(const std::string& value) {
        std::string out = "\"";
        for (const char c : value) {
            if (c == '"' || c == '\\') (out += '\\') += c;
            else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F)
                out += fmt::format("\\u{:04X}", static_cast<unsigned>(c));
            else out += c;
        }
        return out + '"';
    }
    void key(const char* name, double value, const char* comment) { line(name, real(value), comment); }
    void key(const char* name, int value, const char* comment) { line(name, std::to_string(value), comment); }
    void key(const char* name, bool value, const char* comment) {
        line(name, value ? "true" : "false", comment);
    }
    void key(const char* name, const std::string& value, const char* comment) {
        line(name, quoted(value), comment);
    }
    void key(const char* name, const std::vector<double>& values, const char* comment) {
        std::string list;
        for (const double value : values) list += (list.empty() ? "" : ", ") + real(value);
        line(name, "[" + list + "]", comment);
    }
    void key(const char* name, const std::vector<std::array<double, 2>>& points, const char* comment) {
        std::string list;
        for (const auto& [x, y] : points)
            list += fmt::format("{}[{}, {}]", list.empty() ? "" : ", ", real(x), real(y));
        line(name, "[" + list + "]", comment);
    }
    void degrees(const char* name, double radians, const char* comment) {
        // Degrees that come out of radians carry rounding in the last digits; nine decimals bring 30 back
        // as 30.
        std::string digits;
        append_rounded(digits, radians * 180 / std::numbers::pi, 9);
        if (digits.find('.') == std::string::npos) digits += ".0";
        line(name, digits, comment);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum value, const Word<Enum> (&words)[N], const char* comment) {
        line(name, quoted(word_of(words, value)), comment);
    }
};

}  // namespace

std::string job_toml(const Job& job) {
    Printer printer;
    printer.text =
        "# A job of Slabwright. Every key may be left out; lengths in mm, forces in N, angles in degrees.\n";
    visit_job_keys(job, printer);
    printer.text +=
        "\n# What no tool may run into, bolts and clamps: any number of [[machine.keep_out]], each with "
        "name,\n"
        "# height and one of rectangle, polygon and circle.\n";
    for (const KeepOut& keep_out : job.machine.keep_outs) {
        printer.text += "\n[[machine.keep_out]]\n";
        visit_keep_out_keys(keep_out, printer);
    }
    printer.text +=
        "\n# Feeds and speeds of tools in this material: any number of [[material.cutting]], each with "
        "chip_load\n# and source. Tools that leave out max_rpm and max_feed take them from here, or from "
        "material.chart.\n";
    for (const CuttingData& data : job.material.cutting) {
        printer.text += "\n[[material.cutting]]\n";
        visit_cutting_data_keys(data, printer);
    }
    printer.text += "\n# The tool library. Any [[tool]] replaces the whole default library.\n";
    for (const Tool& tool : job.tools) {
        printer.text += "\n[[tool]]\n";
        visit_tool_keys(tool, printer);
    }
    return std::move(printer.text);
}

}  // namespace slabwright

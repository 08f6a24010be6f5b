// Reads keys of a TOML document into a job, by the table of io/text/job_keys.h.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/text/job_keys.h"
#include "io/text/json_text.h"
#include "kernels/errors.h"

namespace slabwright {

inline constexpr std::size_t kShownLetters = 60;  ///< of what is wrong, that an error repeats

/// Levenshtein's distance, letters without case.
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word of the least distance, the first of several; "" where none is known.
[[nodiscard]] std::string nearest_word(std::string_view wanted, const std::vector<std::string>& known);

/// Fills a job from one parsed document, walking the table of keys; remembers the line of each key it meets.
class KeyReader {
public:
    KeyReader(const toml::table& root, const std::string& file) : file_(file), table_(&root) {}

    /// Goes on with a table of its own: one of the [[tool]] entries.
    void enter(const toml::table* values, std::string prefix) {
        table_ = values;
        prefix_ = std::move(prefix);
    }
    void enter_root_table(const toml::table& root, const char* name) {
        prefix_ = std::string(name) + ".";
        table_ = nullptr;
        const toml::node* node = root.get(name);
        if (node == nullptr) return;
        table_ = node->as_table();
        if (table_ == nullptr)
            fail(*node, "job.type", fmt::format("{} is {}, not a table", name, type_name(*node)),
                 fmt::format("write [{}] on a line of its own", name));
    }

    void required() { required_ = true; }
    void set_missing_remedy(const char* remedy) { missing_remedy_ = remedy; }

    void key(const char* name, double& value, const char*) {
        if (const toml::node* node = find(name)) value = number(*node, prefix_ + name);
    }
    void key(const char* name, int& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto integer = node->value_exact<std::int64_t>();
        if (!integer || *integer < -2147483647 || *integer > 2147483647)
            wrong_type(*node, prefix_ + name, "a whole number");
        value = static_cast<int>(*integer);
    }
    void key(const char* name, bool& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const auto truth = node->value_exact<bool>();
        if (!truth) wrong_type(*node, prefix_ + name, "true or false");
        value = *truth;
    }
    void key(const char* name, std::string& value, const char*) {
        if (const toml::node* node = find(name)) value = text(*node, prefix_ + name);
    }
    void key(const char* name, std::vector<double>& value, const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const toml::array* array = node->as_array();
        if (array == nullptr) wrong_type(*node, prefix_ + name, "a list of numbers");
        value.clear();
        for (const toml::node& element : *array) value.push_back(number(element, prefix_ + name));
    }
    void degrees(const char* name, double& radians, const char*) {
        if (const toml::node* node = find(name))
            radians = number(*node, prefix_ + name) * std::numbers::pi / 180;
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum& value, const Word<Enum> (&words)[N], const char*) {
        const toml::node* node = find(name);
        if (node == nullptr) return;
        const std::string given = text(*node, prefix_ + name).substr(0, kShownLetters);
        std::vector<std::string> known;
        for (const Word<Enum>& w : words) {
            if (given == w.text) {
                value = w.value;
                return;
            }
            known.emplace_back(w.text);
        }
        fail(*node, "job.word",
             fmt::format("{}{} is \"{}\", none of {}", prefix_, name, given, fmt::join(known, ", ")),
             fmt::format("did you mean \"{}\"?", nearest_word(given, known)));
    }

    [[nodiscard]] const std::map<std::string, std::string>& places() const { return places_; }
    void learn_places(const KeyReader& other) { places_.insert(other.places_.begin(), other.places_.end()); }
    [[nodiscard]] std::string place_of(const toml::node& node) const {
        return node.source().begin.line > 0 ? fmt::format("{}:{}", file_, node.source().begin.line) : file_;
    }
    [[noreturn]] void fail(const toml::node& node, const char* code, const std::string& message,
                           const std::string& remedy) const {
        throw Error(ErrorKind::usage, code, quoting_line(message), place_of(node), remedy);
    }
    static const char* type_name(const toml::node& node) {
        switch (node.type()) {
            case toml::node_type::string:
                return "a text";
            case toml::node_type::integer:
                return "a whole number";
            case toml::node_type::floating_point:
                return "a number";
            case toml::node_type::boolean:
                return "true or false";
            case toml::node_type::array:
                return "a list";
            case toml::node_type::table:
                return "a table";
            default:
                return "a date or time";
        }
    }

protected:
    const toml::node* find(const char* name) {
        const bool required = std::exchange(required_, false);
        const toml::node* node = table_ != nullptr ? table_->get(name) : nullptr;
        if (node != nullptr) places_[prefix_ + name] = place_of(*node);
        else if (required)
            fail(*table_, "job.missing_key", fmt::format("{}{} is missing", prefix_, name), missing_remedy_);
        return node;
    }
    double number(const toml::node& node, const std::string& key) const {
        if (const auto real = node.value_exact<double>()) {
            if (!std::isfinite(*real)) wrong_type(node, key, "a finite number");
            return *real;
        }
        if (const auto integer = node.value_exact<std::int64_t>()) return static_cast<double>(*integer);
        wrong_type(node, key, "a number");
    }
    std::string text(const toml::node& node, const std::string& key) const {
        const auto value = node.value_exact<std::string>();
        if (!value) wrong_type(node, key, "a text in quotes");
        return *value;
    }
    [[noreturn]] void wrong_type(const toml::node& node, const std::string& key, const char* wanted) const {
        fail(node, "job.type", fmt::format("{} is {}, not {}", key, type_name(node), wanted),
             fmt::format("give {}", wanted));
    }

private:
    std::string file_, prefix_;
    const toml::table* table_;
    bool required_ = false;
    const char* missing_remedy_ = "every [[tool]] needs it; see `slabwright job --defaults`";
    std::map<std::string, std::string> places_;
};

/// The walk over a tool whose every key has a value already.
class OverridingReader : public KeyReader {
public:
    using KeyReader::KeyReader;
    void required() {}
};

}  // namespace slabwright

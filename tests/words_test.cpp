// Words and numbers of text files, as their readers take them.
#include "io/read/words.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <string_view>

#include "io/text/nearest_word.h"

namespace slabwright {
namespace {

/// The number that a word is; NaN where it is none.
double number_of(std::string_view word) {
    double value = 0;
    return read_number(word, value) ? value : std::numeric_limits<double>::quiet_NaN();
}

TEST(Words, NumbersEndWhereTheirWordEnds) {
    // A word is a piece of a text that goes on behind it, with digits as often as not.
    constexpr std::string_view text = "12.5e3456 -70.25";
    EXPECT_EQ(number_of(text.substr(0, 1)), 1);
    EXPECT_EQ(number_of(text.substr(0, 2)), 12);
    EXPECT_EQ(number_of(text.substr(0, 4)), 12.5);
    EXPECT_EQ(number_of(text.substr(0, 6)), 12500);
    EXPECT_EQ(number_of(text.substr(10, 3)), -70);
    EXPECT_EQ(number_of(text.substr(10, 5)), -70.2);
    for (const std::string_view none : {"", "+", "-", "+-1", "++1", "1x", "x1", "1 ", " 1", "1e", "0x10"})
        EXPECT_NE(number_of(none), number_of(none)) << none;
    EXPECT_EQ(number_of("+.5"), 0.5);
    EXPECT_EQ(number_of("1e-999"), 0) << "too small to be told from zero";
    EXPECT_EQ(number_of("1e999"), std::numeric_limits<double>::infinity());
}

TEST(Words, AreQuotedPrintableAndShort) {
    EXPECT_EQ(quoted_word(""), "the end of the file");
    EXPECT_EQ(quoted_word("vn"), "'vn'");
    EXPECT_EQ(quoted_word("a\x01~\x7f"), "'a\\x01~\\x7f'");
    EXPECT_EQ(quoted_word(std::string(40, 'w')), "'" + std::string(40, 'w') + "'");
    EXPECT_EQ(quoted_word(std::string(41, 'w')), "'" + std::string(40, 'w') + "…'");
}

TEST(Words, LinesEndAsAnySystemEndsThem) {
    const std::string_view text = "a\nb\r\nc\rd";
    EXPECT_EQ(line_of(text, 0), 1u);
    EXPECT_EQ(line_of(text, 2), 2u);
    EXPECT_EQ(line_of(text, 5), 3u);
    EXPECT_EQ(line_of(text, 7), 4u);
    EXPECT_EQ(line_of("a\r", 2), 2u);
}

TEST(NearestWord, IsTheFirstOfThoseThatAreAsNear) {
    EXPECT_EQ(nearest_word("depth", {}), "");
    EXPECT_EQ(nearest_word("stepover", {"step_down", "step_over", "stepovers"}), "step_over");
    EXPECT_EQ(nearest_word("cats", {"cuts", "hats", "cat", "dog"}), "cuts");
    EXPECT_EQ(nearest_word("FANUC", {"haas", "fanuc"}), "fanuc");
}

}  // namespace
}  // namespace slabwright

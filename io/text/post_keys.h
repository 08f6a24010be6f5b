// The one table of a post's keys: their names, limits and places in io/posts/dialect.h. Reading a post,
// printing one and naming unknown keys all walk it, so they cannot disagree.
#pragma once

#include <string>
#include <type_traits>

#include "io/posts/dialect.h"
#include "io/text/job_keys.h"

namespace slabwright {

/// What a post calls comments.
enum class CommentMarks : std::uint8_t { none, parentheses, semicolon, both };
/// What a post says of arcs.
enum class ArcWords : std::uint8_t { centre, radius };

inline constexpr Word<CommentMarks> kCommentWords[] = {{"none", CommentMarks::none},
                                                       {"parentheses", CommentMarks::parentheses},
                                                       {"semicolon", CommentMarks::semicolon},
                                                       {"both", CommentMarks::both}};
inline constexpr Word<ArcWords> kArcWords[] = {{"centre", ArcWords::centre}, {"radius", ArcWords::radius}};
inline constexpr Word<Dialect::Percent> kPercentWords[] = {
    {"none", Dialect::Percent::none}, {"may", Dialect::Percent::may}, {"must", Dialect::Percent::must}};
inline constexpr Word<Dialect::Dwell> kDwellWords[] = {{"p_seconds", Dialect::Dwell::p_seconds},
                                                       {"p_milliseconds", Dialect::Dwell::p_milliseconds},
                                                       {"p_by_point", Dialect::Dwell::p_by_point},
                                                       {"x_seconds", Dialect::Dwell::x_seconds},
                                                       {"f_seconds", Dialect::Dwell::f_seconds}};

/// Which template of a dialect a line belongs to: they may say different things.
enum class PostPart : std::uint8_t { begin, head, change, again, next, first, end, notes, centres, extra };

/// Lines that a post adds to those of its base.
struct ExtraLines {
    std::string start, before_change, after_change, end;
};

/// Walks the keys of [numbers] that differ between millimetres and inches.
template <class DialectLike, class Visit>
void visit_decimals(DialectLike& d, Visit& visit) {
    const bool inch = d.inch();
    visit.key(inch ? "inch_decimals" : "decimals", d.decimals, 0, inch ? 6 : 4,
              inch ? "of a coordinate in inches" : "of a coordinate in millimetres");
    visit.key(inch ? "inch_feed_decimals" : "feed_decimals", d.feed_decimals, 0, 4,
              inch ? "of a feed in inches a minute" : "of a feed in millimetres a minute");
}

/// Walks [numbers] and [text].
template <class DialectLike, class Visit>
void visit_spelling_keys(DialectLike& d, Visit& visit) {
    visit.table("numbers");
    visit_decimals(d, visit);
    visit.key("point", d.point, "whole lengths and feeds are written with their point: X29.");
    visit.key("needs_point", d.needs_point, "the control counts lengths without a point in its least steps");
    visit.key("trailing_zeros", d.trailing_zeros, "coordinates have all decimals: X29.000");
    visit.table("text");
    CommentMarks marks = d.parentheses ? d.semicolon ? CommentMarks::both : CommentMarks::parentheses
                         : d.semicolon ? CommentMarks::semicolon
                                       : CommentMarks::none;
    visit.word("comments", marks, kCommentWords,
               "which the control knows: none, parentheses, semicolon, or both (parentheses are written)");
    if constexpr (!std::is_const_v<DialectLike>) {
        d.parentheses = marks == CommentMarks::parentheses || marks == CommentMarks::both;
        d.semicolon = marks == CommentMarks::semicolon || marks == CommentMarks::both;
    }
    visit.key("capitals", d.capitals, "comments in capitals, digits and plain signs only");
    visit.key("longest_comment", d.longest_comment, 10, 200, "characters of a comment");
    visit.key("longest_line", d.longest_line, 30, 252, "characters of a line");
    visit.key("forbidden", d.forbidden, "more characters that no line may hold");
    visit.key("line_numbers", d.line_numbers, 0, 1000, "from each line's N to the next one's; 0: none");
    visit.key("carriage_returns", d.carriage_returns, "lines end in CR LF");
}

/// Walks every key of a post but base, name, ending and the extra lines.
template <class DialectLike, class Visit>
void visit_post_keys(DialectLike& d, Visit& visit) {
    visit_spelling_keys(d, visit);
    visit.table("control");
    visit.word(
        "dwell", d.dwell, kDwellWords,
        "how G4 counts: p_seconds, p_milliseconds, p_by_point (P3. s, P3000 ms), x_seconds, f_seconds");
    visit.word("percent", d.percent, kPercentWords, "% before and after a program: none, may or must stand");
    visit.key("numbered", d.numbered, "a program has its number (O0201) before the first word");
    visit.key("switches", d.switches, "numbers of M that switch dust, vacuum or air, and nothing else");
    visit.table("program");
    ArcWords arcs = d.radius_arcs ? ArcWords::radius : ArcWords::centre;
    visit.word("arcs", arcs, kArcWords, "by their centre (I and J), or by their radius (R)");
    if constexpr (!std::is_const_v<DialectLike>) d.radius_arcs = arcs == ArcWords::radius;
    visit.key("repeat_motion", d.repeat_motion, "G0 to G3 in every line, not only where it changes");
    visit.lines("begin", d.begin, PostPart::begin, "before the comments");
    visit.lines("head", d.head, PostPart::head, "after them, before the first motion");
    visit.lines("change", d.change, PostPart::change, "another tool within a program");
    visit.lines("again", d.again, PostPart::again, "the same tool for the next operation");
    visit.lines("next", d.next, PostPart::next, "after either: the spindle, and how corners are rounded");
    visit.lines("first", d.first, PostPart::first, "the first motion, to the height {z}");
    visit.lines("end", d.end, PostPart::end, "after the last motion");
    visit.lines("notes", d.notes, PostPart::notes, "comments on what the operator sets");
    visit.lines("centres", d.centres, PostPart::centres,
                "before a program's first motion, where it has arcs");
}

/// Walks the keys of [extra].
template <class LinesLike, class Visit>
void visit_extra_keys(LinesLike& extra, Visit& visit) {
    visit.table("extra");
    visit.lines("start", extra.start, PostPart::extra, "after `head`: the spindle turns");
    visit.lines("before_change", extra.before_change, PostPart::extra, "before `change`");
    visit.lines("after_change", extra.after_change, PostPart::extra, "after `change`");
    visit.lines("end", extra.end, PostPart::extra, "before `end`, after the last motion");
}

}  // namespace slabwright

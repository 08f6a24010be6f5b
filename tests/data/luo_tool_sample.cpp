// The sample of LUO 5.6. Its drawing (figure 5.15) is lost in the scan, so this part is built from what the
// text says of it, so that LUO's finish tools follow from the geometry (inches; diameters):
//
//   layer 1, 0 to .75      a plate with vertical walls and no concave corner: every tool reaches everything,
//   the 1 in is chosen. layer 2, .75 to 1.50   an H drafted by 3°, an island drafted by 2°, a vertical boss.
//   The H has four concave corners of radius .15
//                          to .19: the .25 in tool fits them, the .50 in does not, and the notches are .60 to
//                          .68 wide: the .50 in tool can rough them, the .75 in cannot.
//   layer 3, 1.50 to 2.00  a C drafted by 3°, with two such corners, and a blind slot from 1.70 up, so that
//   .125 in is the largest finish tool at
//                          every height from there to the top, as LUO table 6.3 has it, and .25 in below. The
//                          slot is narrow at one end, .170 to .201 wide: no .25 in tool enters. At the other
//                          it is .238 to .269 wide: there its upper part is wider than two swaths of .125,
//                          and narrower than a .25 in flat with .3 mm kept off either wall, so only the .125
//                          in flat end mill roughs it with AS = 0. As a semi-roughing tool it keeps that
//                          allowance too, so its swaths do meet in the slot: then the .50 in may rough, and
//                          for it and no wider one the C is open (.72).
//
// LUO 5.6 says for layer 2 that no larger tool has AS = 0 with the .50 in after it. By the definition
// of 5.5.2 one has: what is farther than .50 from a wall lets a wider tool in. With the time of one more tool
// change LUO's own comparison of times (5.5.3.4) rejects it.
#include <array>

#include "tests/data/sweep.h"

namespace slabwright {

namespace {

constexpr double kInch = 25.4;
constexpr double kChord = 0.01;  // mm

Outline inches(std::vector<Corner> corners) {
    for (Corner& c : corners) c = {c.x * kInch, c.y * kInch, c.radius * kInch};
    return rounded_polygon(corners, kChord);
}

}  // namespace

std::vector<Facet> luo_tool_sample() {
    const double z1 = 0.75 * kInch, z2 = 1.5 * kInch, z3 = 2.0 * kInch, slot_floor = 1.7 * kInch;
    const Outline plate = inches({{0, 0, 0.5}, {8.75, 0, 0.5}, {8.75, 6.5, 0.5}, {0, 6.5, 0.5}});
    const Outline letter_h = inches({{0.3, 0.3, 0.5},
                                     {5.5, 0.3, 0.5},
                                     {5.5, 2.95, 0.5},
                                     {3.9, 2.95, 0.15},
                                     {3.9, 3.55, 0.15},
                                     {5.5, 3.55, 0.5},
                                     {5.5, 6.2, 0.5},
                                     {0.3, 6.2, 0.5},
                                     {0.3, 3.55, 0.5},
                                     {1.9, 3.55, 0.15},
                                     {1.9, 2.95, 0.15},
                                     {0.3, 2.95, 0.5}});
    const Outline letter_c = inches({{2.3, 0.9, 0.3},
                                     {5.1, 0.9, 0.3},
                                     {5.1, 2.89, 0.3},
                                     {3.4, 2.89, 0.15},
                                     {3.4, 3.61, 0.15},
                                     {5.1, 3.61, 0.3},
                                     {5.1, 5.6, 0.3},
                                     {2.3, 5.6, 0.3}});
    const Outline island = stadium(7.4 * kInch, 1.4 * kInch, 7.4 * kInch, 2.8 * kInch, 0.8 * kInch, kChord);
    const Outline boss = circle(7.4 * kInch, 5.0 * kInch, 0.8 * kInch, kChord);
    const double widened = drafted_pocket(z3, slot_floor, 3, 0, kChord).back().offset * -1 /
                           kInch;  // on either side, from floor to rim
    const double wide = 0.119 + widened, narrow = 0.085 + widened;
    const Outline slot = inches({{2.75, 4.6 - wide, wide},
                                 {3.85, 4.6 - wide, 0.15},
                                 {4.0, 4.6 - narrow, 0.15},
                                 {4.62, 4.6 - narrow, narrow},
                                 {4.62, 4.6 + narrow, narrow},
                                 {4.0, 4.6 + narrow, 0.15},
                                 {3.85, 4.6 + wide, 0.15},
                                 {2.75, 4.6 + wide, wide}});

    std::vector<Facet> facets;
    const Profile plate_wall{{0, 0}, {0, z1}};
    flat(facets, ring(plate, plate_wall.front()), {}, false);
    const Ring plate_top = sweep(facets, plate, plate_wall);

    const Profile h_wall = drafted_wall(z1, z2, 3, 0, 0, kChord),
                  island_wall = drafted_wall(z1, z3, 2, 0, 0, kChord);
    const Profile boss_wall{{0, z1}, {0, z2}};
    flat(facets, plate_top,
         {ring(letter_h, h_wall.front()), ring(island, island_wall.front()), ring(boss, boss_wall.front())},
         true);
    flat(facets, sweep(facets, island, island_wall), {}, true);
    flat(facets, sweep(facets, boss, boss_wall), {}, true);

    const Profile c_wall = drafted_wall(z2, z3, 3, 0, 0, kChord),
                  slot_wall = drafted_pocket(z3, slot_floor, 3, 0, kChord);
    flat(facets, sweep(facets, letter_h, h_wall), {ring(letter_c, c_wall.front())}, true);
    flat(facets, sweep(facets, letter_c, c_wall), {ring(slot, slot_wall.front())}, true);
    flat(facets, sweep(facets, slot, slot_wall), {}, true);
    return facets;
}

}  // namespace slabwright

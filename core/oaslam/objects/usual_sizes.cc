#include "oaslam/objects/usual_sizes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace oaslam {
namespace {

// Of a normal distribution nine of ten are within this many standard deviations of the mean.
constexpr double kNineOfTen = 1.645;

using enum Solid;

// Metres; the ranges are those of the sources beside them, with what a box shows besides (handles,
// tyres, what stands on a table).
//
// SUN RGB-D: mean sizes of its annotated furniture (Song et al., CVPR 2015), as in VoteNet's
//   sunrgbd/model_util_sunrgbd.py: chair .592 x .553 x .827, sofa 1.867 x .924 x .845, bed 2.114 x
//   1.620 x .927, table 1.280 x .791 x .718, toilet .699 x .454 x .756.
// nuScenes: mean sizes of its annotated vehicles (Caesar et al., CVPR 2020), as in the anchors of
//   CBGS and MMDetection3D: car 4.607 x 1.950 x 1.723, truck 6.738 x 2.456 x 2.730, bus 11.189 x
//   2.940 x 3.470, motorcycle 2.100 x .763 x 1.444, bicycle 1.685 x .601 x 1.272 (with riders).
// KITTI: mean car 3.9 x 1.6 x 1.56 (the anchor of VoxelNet, Zhou and Tuzel, CVPR 2018).
// YCB: the objects of Calli et al., "The YCB Object and Model Set", ICAR 2015: mug .082 high, with
//   handle .117; bowl .159 x .053; fork .198, spoon .195, knife .215; banana .190 x .036; apple
//   .075; orange .073; scissors .200 x .087; wine glass .137 x .089; bottles .19 to .25.
// Catalogues: what their makers and dealers state.
constexpr std::array kUsualSizes = std::to_array<UsualSize>({
    // Two wheels of ISO 5775 (622 mm rims, .69 with the tyre) 1.0 to 1.1 apart; handlebars .42 to
    // .70. nuScenes agrees in length and width.
    {"bicycle", {1.60, 1.85}, {.42, .70}, {.95, 1.15}},
    // KITTI to nuScenes; nuScenes' width has mirrors.
    {"car", {3.6, 5.0}, {1.6, 2.0}, {1.40, 1.85}},
    {"motorcycle", {1.85, 2.35}, {.68, .90}, {1.05, 1.45}},  // nuScenes, with riders to without
    // nuScenes; the EU's Directive 96/53/EC: at most 2.55 wide without mirrors, 18.75 long.
    {"bus", {8, 18}, {2.45, 2.95}, {2.9, 4.2}},
    {"truck", {4.5, 10}, {1.9, 2.6}, {1.9, 4.0}},  // nuScenes, from vans to the 4.0 of 96/53/EC
    // R1-1 of the US MUTCD: .762 and .914; Vienna Convention on Road Signs: .60 and .90.
    {"stop sign", {.60, .92}, {.01, .03}, {.60, .92}},
    // Catalogues: Fjallraven Kanken .38 x .27 x .13, Eastpak Padded Pak'r .40 x .30 x .18,
    // JanSport SuperBreak .42 x .33 x .22; to the .55 of cabin luggage.
    {"backpack", {.27, .36}, {.13, .26}, {.37, .55}},
    // IATA cabin luggage .56 x .45 x .25; airlines' cabin .55 x .40 x .20, and 1.58 as the sum of
    // the sides of what is checked in: .77 x .51 x .30.
    {"suitcase", {.35, .53}, {.20, .33}, {.53, .78}},
    // Half a litre of PET .20 to .23, longneck beer .23 x .061, wine (Bordeaux) .30 x .075,
    // 1.5 litres of PET .32 x .09: dealers' catalogues; YCB.
    {"bottle", {.060, .090}, {.060, .090}, {.18, .33}, kCylinder},
    // ISO 3591 (tasting glass) .155 x .065; YCB; red wine glasses to .25 in catalogues.
    {"wine glass", {.065, .10}, {.065, .10}, {.15, .25}, kCylinder},
    // YCB; mugs of 11 and 15 ounces: .095 x .082 and .115 x .085 without handles (catalogues).
    {"cup", {.100, .130}, {.070, .095}, {.075, .115}, kCylinder},
    {"fork", {.17, .21}, {.02, .03}, {.01, .025}, kBox, true},     // YCB; dessert to table forks
    {"knife", {.18, .32}, {.018, .035}, {.01, .025}, kBox, true},  // YCB; to the chef's of 8 inches
    {"spoon", {.13, .21}, {.03, .045}, {.01, .025}, kBox, true},   // YCB; tea to table spoons
    // YCB; dessert to soup bowls of 5 to 8 inches in catalogues.
    {"bowl", {.12, .20}, {.12, .20}, {.045, .085}, kCylinder},
    // YCB; the US Department of Agriculture's small (6 to 7 inches) to extra large (9 and more).
    {"banana", {.15, .22}, {.05, .08}, {.03, .04}, kBox, true},
    // YCB, and the sizes in which they are sold.
    {"apple", {.065, .085}, {.065, .085}, {.06, .08}, kBall},
    {"orange", {.06, .085}, {.06, .085}, {.06, .085}, kBall},
    // SUN RGB-D; seats of .42 to .51 (EN 1335-1) below backs that end at .75 to 1.05.
    {"chair", {.45, .70}, {.43, .68}, {.72, 1.05}, kCylinder},
    {"couch", {1.2, 2.6}, {.80, 1.05}, {.70, 1.0}},  // SUN RGB-D; for one person to three
    // SUN RGB-D; mattresses of .90 to 2.0 x 2.0 with the frame, low frames to high headboards.
    {"bed", {1.95, 2.2}, {.95, 2.0}, {.45, 1.2}},
    // SUN RGB-D; EN 527-1: .74; US 28 to 30 inches. Boxes have in them what stands on the table.
    {"dining table", {.8, 2.0}, {.7, 1.0}, {.70, .90}},
    {"toilet", {.62, .79}, {.37, .50}, {.68, .84}},  // SUN RGB-D, with cistern
    // From a screen of 19 inches, 5:4, to one of 55, 16:9 (1.22 x .69), with their feet.
    {"tv", {.37, 1.24}, {.05, .25}, {.33, .75}},
    {"monitor", {.37, .62}, {.10, .25}, {.33, .56}},  // 19 inches, 5:4, to 27, 16:9, with feet
    // Screens of 13 to 16 inches, open by 90 to 120 degrees: lids of .30 to .38 x .20 to .27.
    {"laptop", {.30, .38}, {.22, .33}, {.19, .27}},
    // Catalogues: Logitech M185 .099 x .060 x .039, M100 .113 x .062 x .038, MX Master 3 .125 x
    // .084 x .051; Apple Magic Mouse .114 x .057 x .022.
    {"mouse", {.10, .128}, {.057, .080}, {.03, .045}, kBall, true},
    {"remote", {.12, .24}, {.035, .055}, {.015, .03}, kBox, true},  // catalogues, Apple TV's: .136
    // Keys three quarters of an inch apart (ANSI-INCITS 154): .44 to .47 with a number pad, .36
    // without; compact ones .28 to .30 (Apple's Magic Keyboard .279 x .115, boards of 60 %).
    {"keyboard", {.28, .48}, {.10, .19}, {.011, .045}, kBox, true},
    // Apple's iPhone 5 .124 x .059 x .0076, 12 .147 x .072 x .0074, 15 Pro Max .160 x .077 x .0083.
    {"cell phone", {.124, .165}, {.059, .079}, {.007, .012}, kBox, true},
    // Catalogues: compact 18 x 11 x 13.5 inches, countertop 19 to 24 x 10 to 14 x 12 to 18.
    {"microwave", {.44, .60}, {.32, .47}, {.255, .355}},
    // Niche of EN 1116, front .595 x .595; ranges: Europe .60 x .85, US 30 x 36 inches.
    {"oven", {.595, .76}, {.55, .68}, {.595, .93}},
    // Europe .55 to .60 x 1.45 to 2.03 (EN 1116); US 28 to 36 x 61 to 72 inches, 28 to 35 deep.
    {"refrigerator", {.55, .92}, {.58, .88}, {1.50, 2.03}},
    // Mass market 4.25 x 6.87 inches to A4 (ISO 216), 6 x 9 inches in the middle.
    {"book", {.175, .297}, {.108, .216}, {.008, .05}, kBox, true},
    {"scissors", {.13, .25}, {.06, .10}, {.01, .02}, kBox, true},  // YCB; 5 to 10 inches in shops
    // Decks of 29 to 33 x 7.5 to 8.5 inches (catalogues).
    {"skateboard", {.74, .84}, {.19, .215}, {.10, .13}, kBox, true},
    // 27 inches; at most 29 x 12.5 by Appendix II of the ITF's rules.
    {"tennis racket", {.66, .70}, {.24, .29}, {.02, .03}, kBox, true},
    // 30 to 34 inches; at most 42 x 2.61 by rule 3.02 of baseball.
    {"baseball bat", {.76, .87}, {.06, .07}, {.06, .07}, kBox, true},
    // Leaves of DIN 18101: .735 to .985 x 1.985; UK .762 x 1.981; US 28 to 36 x 80 inches; frame.
    {"door", {.70, .99}, {.04, .12}, {1.98, 2.15}},
});

// Names that other detectors have for classes of the table.
constexpr std::array kSameThings = std::to_array<std::pair<std::string_view, std::string_view>>({
    {"sofa", "couch"},
    {"mug", "cup"},
    {"mobile phone", "cell phone"},
    {"computer keyboard", "keyboard"},
    {"computer mouse", "mouse"},
    {"computer monitor", "monitor"},
    {"television", "tv"},
    {"microwave oven", "microwave"},
});

}  // namespace

double UsualRange::Median() const { return std::sqrt(least * most); }

double UsualRange::LogSigma() const { return std::log(most / least) / (2 * kNineOfTen); }

const UsualSize* FindUsualSize(std::string_view class_name) {
  const auto same =
      std::ranges::find(kSameThings, class_name, [](const auto& p) { return p.first; });
  if (same != kSameThings.end()) class_name = same->second;
  const auto found = std::ranges::find(kUsualSizes, class_name, &UsualSize::name);
  return found == kUsualSizes.end() ? nullptr : &*found;
}

}  // namespace oaslam

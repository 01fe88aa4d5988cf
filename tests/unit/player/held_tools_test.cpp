// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/held_tools.h"

#include <atomic>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/script.h"
#include "organbake/player/skin_point.h"
#include "organbake/warp/draw_options.h"
#include "organs_to_play.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr int kSeenWidth = 320, kSeenHeight = 240;

// The organ of the tests as its formula has it, not as the player knows it.
bool inside(const Vector3d& at_mm) {
  const SyntheticOrgan& organ = organ_options().organ;
  const Vector3d from_center = at_mm - organ.center;
  constexpr double kLump_mm = 1;  // the skin that the player knows is smooth
  return from_center.norm() < organ.radius(from_center.normalized()) - kLump_mm;
}
bool inside_between(const Vector3d& a, const Vector3d& b, double from = 0) {
  constexpr int kTried = 60;
  for (int i = 0; i <= kTried; ++i) {
    const double share = from + (1 - from) * i / kTried;
    if (inside(a + share * (b - a))) return true;
  }
  return false;
}

Vector3d any_direction(RandomStream& random) {
  const double z = random.uniform(-1, 1), turn = random.uniform(0, 2 * std::numbers::pi);
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

// Two tools of any kind go about the organ, which the eye goes round.
Script any_script(std::uint64_t seed) {
  RandomStream random(seed);
  Script script;
  script.name = "seed " + std::to_string(seed);
  script.frames = 90;
  for (const int frame : {0, 45, 89})
    script.camera.push_back({frame,
                             {.azimuth_rad = random.uniform(-0.6, 0.6),
                              .elevation_rad = random.uniform(-0.4, 0.4),
                              .distance = random.uniform(0.6, 1.2)}});
  for (int tool = 0; tool < 2; ++tool) {
    InstrumentPath& path = script.instruments.emplace_back();
    path.name = "tool";
    path.instrument.kind = instrument_kinds()[random.below(5)];
    const bool blunt = path.instrument.is_blunt();
    path.instrument.radius_mm = blunt ? random.uniform(2, 6) : random.uniform(0.4, 0.8);
    // Half of the tips stay before the eye; the others go anywhere.
    const Vector3d about = random.uniform(0, 1) < 0.5 ? Vector3d(0, -1, 0) : any_direction(random);
    if (!blunt) path.instrument.axis_mm = random.uniform(20, 40) * about;
    if (auto* scissors = std::get_if<Scissors>(&path.instrument.kind))
      scissors->opening_mm = about.unitOrthogonal();
    const std::size_t waypoints = 2 + random.below(4);
    for (std::size_t w = 0; w < waypoints; ++w) {
      Waypoint& waypoint = path.path.emplace_back();
      waypoint.time_s = 0.1 + 1.3 * double(w) / double(waypoints - 1);
      waypoint.direction = about + random.uniform(0, 0.6) * any_direction(random);
      waypoint.depth_mm = random.uniform(-12, 10);
      if (path.instrument.is<Scissors>()) waypoint.opening_mm = random.uniform(0, 15);
    }
  }
  return script;
}

double degrees_between(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) * 180 /
         std::numbers::pi;
}

// What was wrong with the tools of a script, in frames.
struct Faults {
  int frames = 0, no_parts = 0, turned = 0, in_tissue = 0, shaft_unseen = 0;

  Faults& operator+=(const Faults& more) {
    frames += more.frames, no_parts += more.no_parts, turned += more.turned;
    in_tissue += more.in_tissue, shaft_unseen += more.shaft_unseen;
    return *this;
  }
};

// How far along the shaft the tissue may be that the tool enters or presses in: with an axis, none.
double own_share(const Instrument& tool, const Solid& shaft) {
  if (!tool.axis_mm.isZero(0)) return 0;
  const Vector3d from_center = tool.position_mm - organ_options().organ.center;
  const double below = organ_options().organ.radius(from_center.normalized()) - from_center.norm();
  constexpr double kDimple = 3;  // times as wide as deep
  const double own_mm = kDimple * std::max(0.0, below) + 2 * tool.radius_mm;
  return std::min(1.0, own_mm / (shaft.to - shaft.from).norm());
}

// Whether the tool beyond its tip, first its axis, then its shaft, is seen in the picture, as far
// as the organ at rest lets it be, or leads out of it at once.
bool shaft_seen(const Instrument& tool, const Solid& shaft, const View& view) {
  const Vector3d eye = view.camera.center_world_mm();
  const Eigen::Vector2d tip_px = project(view.camera, tool.position_mm);
  const double radius_px = tool.radius_mm * view.camera.intrinsics.fx /
                           (view.camera.camera_from_world * tool.position_mm).z();
  std::vector<Vector3d> places;
  constexpr int kTried = 100;
  for (int i = 0; i <= kTried; ++i)
    places.push_back(tool.position_mm + double(i) / kTried * (shaft.from - tool.position_mm));
  for (int i = 1; i <= kTried; ++i)
    places.push_back(shaft.from + double(i) / kTried * (shaft.to - shaft.from));
  for (const Vector3d& at : places) {
    if (!((view.camera.camera_from_world * at).z() > view.near_mm)) continue;
    const Eigen::Vector2d px = project(view.camera, at);
    const bool in_picture =
        px.x() >= 0 && px.y() >= 0 && px.x() < kSeenWidth && px.y() < kSeenHeight;
    if (!in_picture || ((px - tip_px).norm() > 1.5 * radius_px && !inside_between(at, eye)))
      return true;
  }
  return false;
}

bool tip_seen(const Instrument& tool, const View& view) {
  const Eigen::Vector2d px = project(view.camera, tool.position_mm);
  if (!(px.x() >= 0 && px.y() >= 0 && px.x() < kSeenWidth && px.y() < kSeenHeight)) return false;
  const Vector3d eye = view.camera.center_world_mm();
  return !inside_between(tool.position_mm + tool.radius_mm * (eye - tool.position_mm).normalized(),
                         eye);
}

Faults faults_of(const Script& script, const Player& player) {
  const InstrumentMotion motion(script, player.bundle());
  const ScriptTools tools(script, motion, player);
  Faults faults;
  std::vector<std::optional<Vector3d>> before(script.instruments.size());
  for (int frame = 0; frame < script.frames; ++frame) {
    const double time_s = frame * script.time_step_s;
    const std::vector<Instrument> instruments = motion.at(time_s);
    const View view = view_at(script, frame, player.bundle().cameras, kSeenWidth, kSeenHeight);
    const std::vector<Solid> solids = tools.solids(instruments, time_s);
    for (std::size_t i = 0; i < instruments.size(); ++i) {
      if (!instruments[i].active) continue;
      ++faults.frames;
      const auto shaft = std::find_if(solids.rbegin(), solids.rend(),
                                      [&](const Solid& s) { return s.instrument == i; });
      if (shaft == solids.rend() || std::next(shaft) == solids.rend()) {
        ++faults.no_parts;
        continue;
      }
      const Vector3d along = shaft->to - shaft->from;
      faults.turned += before[i] && degrees_between(*before[i], along) > 30;
      before[i] = along;
      faults.in_tissue += inside_between(shaft->from, shaft->to, own_share(instruments[i], *shaft));
      faults.shaft_unseen +=
          tip_seen(instruments[i], view) && !shaft_seen(instruments[i], *shaft, view);
    }
  }
  return faults;
}

TEST(ScriptTools, AreSeenTurnSlowlyAndMeetNoTissueInSeededScripts) {
  const Player player(organ_to_play());
  Faults all;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const Faults faults = faults_of(any_script(seed), player);
    if (faults.no_parts + faults.turned + faults.in_tissue + faults.shaft_unseen > 0)
      std::printf("seed %d: %d frames: %d without parts, %d turned, %d in tissue, %d unseen\n",
                  static_cast<int>(seed), faults.frames, faults.no_parts, faults.turned,
                  faults.in_tissue, faults.shaft_unseen);
    all += faults;
  }
  EXPECT_GT(all.frames, 20000);
  EXPECT_EQ(all.no_parts, 0);
  EXPECT_EQ(all.turned, 0);
  EXPECT_EQ(all.in_tissue, 0);
  EXPECT_EQ(all.shaft_unseen, 0);
}

TEST(ScriptTools, ComeThroughTheTrocarThatTheScriptGives) {
  Script script = short_script(5);
  const Player player(organ_to_play());
  const Vector3d trocar(20, -180, -60);
  script.instruments[0].trocar_mm = trocar;
  const InstrumentMotion motion(script, player.bundle());
  const ScriptTools tools(script, motion, player);
  EXPECT_EQ(tools.trocar_mm(0), trocar);
  const double time_s =
      0.5 * (script.instruments[0].path.front().time_s + script.instruments[0].path.back().time_s);
  const std::vector<Solid> solids = tools.solids(motion.at(time_s), time_s);
  ASSERT_FALSE(solids.empty());
  EXPECT_EQ(solids.back().to, trocar);
}

// Of the pixels in which the tool lies before the tissue each shows it.
TEST(ScriptTools, AreCutByNoTissueBehindThemInPictures) {
  Player player(organ_to_play());
  for (const InstrumentKind& kind : {InstrumentKind(Ball{}), InstrumentKind(Grasper{}),
                                     InstrumentKind(Needle{})}) {  // springs cannot be cut
    Script script = short_script(3);
    InstrumentPath& path = script.instruments[0];
    path.instrument.kind = kind;
    if (path.instrument.is<Needle>())
      path.instrument.radius_mm = 1, path.instrument.axis_mm = Vector3d(0, -25, 0);
    PlayOptions options;
    options.width = kSeenWidth, options.height = kSeenHeight;
    int drawn = 0;
    options.watch = [&](const PlayedScene& scene) {
      if (scene.solids.empty()) return;
      Frame tissue;
      DrawOptions with_depth;
      with_depth.keep_depth = true;
      player.draw(scene.view, with_depth, tissue);
      std::atomic<int> before = 0, missing = 0;
      trace_solids(scene.solids, scene.view, [&](int x, int y, const SolidSeen& seen) {
        const std::size_t at = std::size_t(y) * kSeenWidth + x;
        if (!(seen.depth_mm < tissue.depth_mm[at])) return;
        ++before;
        missing += scene.picture.cover[at] != Cover::solid;
      });
      EXPECT_GT(before, 300) << mode_of(kind) << " in frame " << scene.frame;
      EXPECT_EQ(missing, 0) << mode_of(kind) << " in frame " << scene.frame;
      ++drawn;
    };
    play(player, script, options, {});
    EXPECT_EQ(drawn, script.frames) << mode_of(kind);
  }
}

// How often a segment passes the skin as it lies now, beyond a distance from its beginning.
int crossings(const Player& player, const Vector3d& from, const Vector3d& to, double beyond_mm) {
  const TriangleMesh skin = player.bundle_now().shell().posed(player.proxy_positions());
  const auto side = [](const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
    return (b - a).cross(c - a).dot(d - a) > 0;
  };
  const Vector3d begin = from + beyond_mm * (to - from).normalized();
  return static_cast<int>(std::count_if(skin.faces.begin(), skin.faces.end(), [&](const Face& f) {
    const Vector3d &a = skin.vertices[f[0]], &b = skin.vertices[f[1]], &c = skin.vertices[f[2]];
    if (side(a, b, c, begin) == side(a, b, c, to)) return false;
    const bool first = side(begin, to, a, b);
    return side(begin, to, b, c) == first && side(begin, to, c, a) == first;
  }));
}

constexpr int kFront = 0;  // the camera that sees the open sheet

// Of an organ the skin that faces that camera, a shallow bowl that is open behind, as a clip shows
// tissue; its middle, from which directions are told, lies before it, so that they meet it from
// behind. So many faces that their chords lie within 1 mm of the skin.
Bundle open_sheet() {
  SyntheticOptions options;
  options.map_size = 8, options.proxy_subdivisions = 2, options.base_step_mm = 5;
  static const Bundle whole = make_synthetic_bundle(options);
  const Vector3d front = whole.cameras.manifold.directions[kFront];
  Bundle sheet = whole;
  sheet.proxy.faces.clear();
  sheet.base.height_mm.clear(), sheet.base.color.clear(), sheet.base.seen_by.clear();
  const std::size_t nodes = whole.base.nodes_per_face();
  for (std::size_t f = 0; f < whole.proxy.faces.size(); ++f) {
    const Face& face = whole.proxy.faces[f];
    constexpr double kRimCosine = 0.3;
    if (std::any_of(face.begin(), face.end(), [&](std::uint32_t v) {
          const Vector3d from_center = whole.proxy.vertices[v] - SyntheticOrgan().center;
          return from_center.dot(front) < kRimCosine * from_center.norm();
        }))
      continue;
    sheet.proxy.faces.push_back(face);
    for (std::size_t n = f * nodes; n < (f + 1) * nodes; ++n) {
      sheet.base.height_mm.push_back(whole.base.height_mm[n]);
      sheet.base.color.push_back(whole.base.color[n]);
      sheet.base.seen_by.push_back(whole.base.seen_by[n]);
    }
  }
  sheet.base.face_count = static_cast<std::uint32_t>(sheet.proxy.faces.size());
  for (CameraMaps& maps : sheet.maps) maps = background_maps(maps.width, maps.height);
  sheet.cameras.manifold.center_world_mm += 100 * front;
  return sheet;
}

// A ball of 8 to 14 mm comes near the open sheet, presses it and goes. From the front its places
// are told by direction and depth, from behind by places of the world.
Script press_on_sheet(std::uint64_t seed, bool from_front) {
  RandomStream random(seed);
  const Vector3d front = organ_to_play().cameras.manifold.directions[kFront];
  Script script;
  script.frames = 40;
  script.camera = {{0, {}}};
  InstrumentPath& path = script.instruments.emplace_back();
  path.name = "ball";
  path.instrument.radius_mm = random.uniform(4, 7);
  const double deep_mm = random.uniform(6, 12), radius_mm = path.instrument.radius_mm;
  const Vector3d aside = random.uniform(0, 0.3) * any_direction(random);
  const Vector3d out = (front + aside).normalized();
  const SyntheticOrgan organ;
  // From behind it comes out of the bowl, in which it would lie as in tissue.
  const double away_mm = from_front ? -15 : -35;
  for (const auto& [time_s, depth_mm] : {std::pair(0.1, away_mm), std::pair(0.6, deep_mm),
                                         std::pair(0.9, deep_mm), std::pair(1.3, away_mm)}) {
    Waypoint& waypoint = path.path.emplace_back();
    waypoint.time_s = time_s;
    if (from_front)
      waypoint.direction = aside - front, waypoint.depth_mm = depth_mm;
    else
      waypoint.position_mm = organ.center + (organ.radius(out) + depth_mm - radius_mm) * out;
  }
  return script;
}

TEST(ScriptTools, LeaveOnTheSideOfAnOpenSheetThatTheyPress) {
  Player player(open_sheet());
  for (const bool from_front : {true, false}) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      player.reset();
      const Script script = press_on_sheet(seed, from_front);
      const InstrumentMotion motion(script, player.bundle());
      const ScriptTools tools(script, motion, player);
      const Vector3d front = player.bundle().cameras.manifold.directions[kFront];
      constexpr double kOfTheBall_mm = 1;  // its middle is no nearer to the skin
      double pushed_n = 0;
      int crossed = 0;
      for (int frame = 0; frame < script.frames; ++frame) {
        const double time_s = frame * script.time_step_s;
        const std::vector<Instrument> now = motion.at(time_s);
        const StepReport report = player.step(now);
        if (!now[0].active) continue;
        // The tissue pushes back to where the ball came from.
        pushed_n = std::max(pushed_n, (from_front ? 1 : -1) * front.dot(report.tip_force_n[0]));
        const Solid shaft = tools.solids(now, time_s).back();
        crossed += crossings(player, shaft.from, shaft.to, kOfTheBall_mm) > 0;
      }
      EXPECT_GT(pushed_n, 0.01) << seed << (from_front ? " front" : " behind");
      EXPECT_EQ(crossed, 0) << seed << (from_front ? " front" : " behind");
    }
  }
}

TEST(PokeSites, AreSeenWithTheirDentAndTheShaftStaysOutside) {
  constexpr double kRadius_mm = 5, kLeastDisc = 0.6, kLeastContrast = 3;
  constexpr int kSites = 12;
  Player player(organ_to_play());
  const CameraSet& cameras = player.bundle().cameras;
  double facing = 0;
  for (std::uint64_t seed = 0; seed < kSites; ++seed) {
    RandomStream random(seed);
    const OrbitPose pose{random.uniform(-1, 1), random.uniform(-0.4, 0.4)};
    const View view = orbit_view(cameras, pose, kSeenWidth, kSeenHeight);
    const PokeSite site = poke_site(player.bundle(), view, kRadius_mm);
    const Vector3d to_eye = (view.camera.center_world_mm() - site.skin_mm).normalized();
    EXPECT_GT(site.outward.dot(to_eye), 0.5) << seed;
    facing += site.outward.dot(to_eye) / kSites;
    EXPECT_GT(site.thickness_mm, 20) << seed;  // the organ's least half axis is 45
    const View near =
        orbit_view(cameras, close_up(cameras, pose, site.skin_mm), kSeenWidth, kSeenHeight);
    const Eigen::Vector2d middle = project(near.camera, site.skin_mm);
    EXPECT_LT((middle - Eigen::Vector2d(kSeenWidth / 2., kSeenHeight / 2.)).norm(), 1) << seed;
    Frame rest, poked;
    DrawOptions options;
    options.keep_depth = true;
    player.draw(near, options, rest);
    const HeldPoke poke = hold_poke(player, site, random.uniform(4, 10), kRadius_mm);
    options.solids = HeldTools(player).solids({poke.tip}, near, 0);
    for (const Solid& solid : options.solids)
      EXPECT_EQ(crossings(player, solid.from, solid.to, kRadius_mm), 0) << seed;
    player.draw(near, options, poked);
    const double depth_mm = (near.camera.camera_from_world * poke.tip.position_mm).z();
    const double radius_px = kRadius_mm * near.camera.intrinsics.fx / depth_mm;
    const Eigen::Vector2d ball_px = project(near.camera, poke.tip.position_mm);
    double ball = 0, skin = 0, change = 0;
    for (int y = 0; y < kSeenHeight; ++y) {
      for (int x = 0; x < kSeenWidth; ++x) {
        const double off_px = (Eigen::Vector2d(x + 0.5, y + 0.5) - ball_px).norm();
        const bool tool = poked.cover[std::size_t(y) * kSeenWidth + x] == Cover::solid;
        if (off_px < radius_px) ball += tool;
        if (off_px > 3 * radius_px || tool) continue;
        ++skin;
        for (int c = 0; c < 3; ++c)
          change += std::abs(int(poked.color.at(x, y)[c]) - int(rest.color.at(x, y)[c])) / 3.0;
      }
    }
    EXPECT_GT(ball, kLeastDisc * std::numbers::pi * radius_px * radius_px) << seed;
    EXPECT_GT(change / skin, kLeastContrast) << seed;
    player.reset();
  }
  EXPECT_LT(facing, 0.87);  // from above a dent is but a shade
}

}  // namespace
}  // namespace organbake

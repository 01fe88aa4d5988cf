// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>

#include "measuring/player_bundles.h"
#include "organbake/bundle/bundle_reader.h"
#include "organbake/core/median.h"
#include "organbake/core/temporary_folder.h"
#include "organbake/core/text.h"
#include "organbake/decimate/decimate.h"
#include "organbake/deform/deformer.h"
#include "organbake/evaluation/comparison_table.h"
#include "organbake/image/difference.h"
#include "organbake/mechanics/dead_loads.h"
#include "organbake/mechanics/linear_statics.h"
#include "organbake/mechanics/mechanics.h"
#include "organbake/mechanics/spring_fit.h"
#include "organbake/phantom/phantom.h"
#include "organbake/player/contact_sheet.h"
#include "organbake/player/orbit.h"
#include "organbake/warp/paper_warp.h"
#include "promises.h"
#include "report/error_pictures.h"

namespace organbake {
namespace {

struct Hold {
  int iterations, steps;
};

// Where the player's elements stand after so many steps under a dead load, mm from rest.
Eigen::VectorXd held_shape(const TriangleMesh& proxy, const MechanicsModel& model,
                           const Eigen::VectorXd& load_n, const Hold& hold) {
  DeformOptions options;
  options.solver = TissueSolver::fem;
  options.iterations = hold.iterations;
  Deformer deformer(proxy, model, {}, options);
  std::vector<Eigen::Vector3d> forces;
  for (Eigen::Index v = 0; v < load_n.size() / 3; ++v)
    forces.emplace_back(load_n.segment<3>(3 * v));
  deformer.set_load(forces);
  for (int step = 0; step < hold.steps; ++step) deformer.step({});
  Eigen::VectorXd moved(load_n.size());
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v)
    moved.segment<3>(static_cast<Eigen::Index>(3 * v)) =
        deformer.positions()[v] - proxy.vertices[v];
  return moved;
}

constexpr double kNoMove = 1e-6;  // of the largest: the load's patch hangs on anchors

// Of one shape, or of several side by side.
double largest_move(const Eigen::MatrixXd& shapes) {
  return Eigen::Map<const Eigen::Matrix3Xd>(shapes.data(), 3, shapes.size() / 3)
      .colwise()
      .norm()
      .maxCoeff();
}

// Some loads of all, each as strong as presses the linear solution's skin in by `depth_mm`.
std::vector<Eigen::VectorXd> pressing(const MechanicsModel& model, const Eigen::MatrixXd& loads,
                                      double depth_mm) {
  constexpr Eigen::Index kCount = 8;
  const Eigen::MatrixXd shapes = fem_displacements(model, loads);
  std::vector<Eigen::VectorXd> chosen;
  for (Eigen::Index l = 0; l < loads.cols();
       l += std::max<Eigen::Index>(1, loads.cols() / kCount)) {
    const double move = largest_move(shapes.col(l));
    if (move > kNoMove * largest_move(shapes)) chosen.emplace_back(depth_mm / move * loads.col(l));
  }
  return chosen;
}

void promise_converged(const TriangleMesh& proxy, const MechanicsModel& model,
                       const Eigen::MatrixXd& loads, const std::string& name) {
  std::vector<double> early, linear;
  for (const Eigen::VectorXd& load : pressing(model, loads, 10)) {
    const Eigen::VectorXd converged = held_shape(proxy, model, load, {60, 1200});
    const Eigen::VectorXd soon = held_shape(proxy, model, load, {DeformOptions{}.iterations, 120});
    early.push_back((soon - converged).norm() / converged.norm());
  }
  for (const Eigen::VectorXd& load : pressing(model, loads, 0.1)) {
    const Eigen::VectorXd truth = fem_displacements(model, load);
    linear.push_back((held_shape(proxy, model, load, {60, 1200}) - truth).norm() / truth.norm());
  }
  const std::string what = "finite elements, " + name + ": ";
  expect({what + "shape 2 s after a dead load of 10 mm from the converged one, median", "%",
          100 * median(early), 1});
  expect({what + "shape under a dead load of 0.1 mm from linear FEM's, median", "%",
          100 * median(linear), 1});
}

TEST(Statics, OfElementsAndSpringsAreNearLinearOnes) {
  DecimateOptions decimation;
  decimation.faces = 80;
  const TriangleMesh proxy = decimate(OrganPhantom({}).surface(6), decimation).proxy;
  MechanicsOptions options;
  options.fem = true;
  MechanicsModel model = make_mechanics(proxy, options);
  const std::string name = "proxy of 80 faces, " + std::to_string(model.body->tetrahedra.size()) +
                           " tetrahedra, Poisson's ratio " + to_text(options.poisson_ratio);
  const DeadLoads loads = patch_loads(proxy, model.anchors);
  promise_converged(proxy, model, loads.fitted, name);
  const SpringFitReport fit = fit_springs_to_fem(proxy, model);
  const std::string what = "springs fitted to linear FEM, " + name + ": shape under ";
  expect({what + "the dead loads of the fit, median error", "%", 100 * fit.fitted, 10});
  expect({what + "dead loads held out, median error", "%", 100 * fit.held_out, 25});
}

constexpr double kWhite_levels = 48;  // of 255: most errors are edges of the texture

// The largest of a pixel's three differences, in levels of 8 bits. Both have one size.
Rgb8Image heat_map_of(const Rgb8Image& a, const Rgb8Image& b, double scale_levels) {
  std::vector<double> levels(a.pixels.size() / 3);
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    levels[i / 3] = std::max<double>(levels[i / 3], std::abs(a.pixels[i] - b.pixels[i]));
  return heat_map(levels, a.width, scale_levels);
}

struct PokedView {
  double angle_rad = 0, psnr_db = 0;
  Rgb8Image truth, ours, papers;
};

PokedView look(Player& player, const CarriedSurface& truth, double angle_rad, int side_px) {
  const View view = orbit_view(player.bundle().cameras, {angle_rad}, side_px, side_px);
  DrawOptions options;
  options.background = {0, 0, 0};
  PokedView seen{angle_rad,
                 0,
                 truth.draw(truth.carry(player.proxy_positions()), view, options.background).color,
                 {},
                 {}};
  Frame frame;
  player.draw(view, options, frame);
  seen.ours = frame.color;
  PaperWarp(player.bundle()).draw(player.bundle(), player.proxy_positions(), view, options, frame);
  seen.papers = frame.color;
  seen.psnr_db = compare_images(seen.ours, seen.truth).psnr_db;
  return seen;
}

// Truth, ours, our error and the error of the paper's own warp, black for none, for people to look
// at: the worst of five angles.
TEST(WorstPoke, IsNearerTheTruthThanThePapersWarp) {
  const TemporaryFolder scratch;
  PlayerBundles bundles(scratch.path(), {}, false);
  const CompareOptions table;  // the paper's angles, and how deep it is poked
  const auto folder = bundles.folder({80, "fitted", bundles.map_size()});
  Player player(folder, {}, true);
  const CarriedSurface truth(BundleReader(folder).read_surface(), player.bundle().shell());
  hold_poke(player, player.bundle().cameras.manifold.directions.front(), table.poke_share,
            player.bundle().mechanics.instrument_radius_mm);
  std::optional<PokedView> worst;
  for (const double angle : table.angles_rad) {
    PokedView seen = look(player, truth, angle, 400);
    if (!worst || seen.psnr_db < worst->psnr_db) worst = std::move(seen);
  }
  show(tile_pictures(
           {worst->truth, worst->ours, heat_map_of(worst->ours, worst->truth, kWhite_levels),
            heat_map_of(worst->papers, worst->truth, kWhite_levels)},
           4, 2),
       "truth, ours, its error, the paper's error");
  expect({"poked by " + to_text(100 * table.poke_share) + " %, the worst view, " +
              to_text(worst->angle_rad, 3) + " rad: PSNR beyond the paper's own warp",
          "dB", worst->psnr_db - compare_images(worst->papers, worst->truth).psnr_db, 0,
          Figure::Goal::at_least});
}

}  // namespace
}  // namespace organbake

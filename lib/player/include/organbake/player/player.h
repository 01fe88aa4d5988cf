// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/cutting/blade_sweeps.h"
#include "organbake/cutting/cut_organ.h"
#include "organbake/deform/deformer.h"
#include "organbake/player/state_reader.h"
#include "organbake/warp/organ_source.h"
#include "organbake/warp/warper.h"

namespace organbake {

// The interactive phase of the paper (2.2) in one object: load a baked organ, push it about, draw
// it.
//
//   organbake::Player player("out/liver");
//   organbake::Frame frame;
//   player.step({{.position_mm = tip_mm, .active = true}});
//   player.draw(view, {}, frame);
//
// One thread calls; drawing uses TBB's threads inside and gives the same bytes for any number.
class Player {
 public:
  Player(Player&&) noexcept = default;
  Player& operator=(Player&&) = delete;

  // Binds a bundle's samples; keep_maps holds on to the camera maps for comparisons.
  explicit Player(Bundle bundle, const DeformOptions& options = {}, bool keep_maps = false);
  // Reads the bundle but for its maps: a camera's are read, checked and bound when a view first
  // needs them, and draw() throws what is wrong with them. keep_maps reads all at once. Throws
  // NoInputError or BadDataError naming the file.
  explicit Player(const std::filesystem::path& bundle_folder, const DeformOptions& options = {},
                  bool keep_maps = false);
  // The same from wherever the maps come: `read` may be called from any thread.
  Player(Bundle frame, Warper::ReadMaps read, const DeformOptions& options = {});
  // Several organs in one world, at least one, that push each other: a liver and its gallbladder.
  // Each keeps its own virtual cameras; scripts and orbits go round the first.
  explicit Player(std::vector<Bundle> bundles, const DeformOptions& options = {},
                  bool keep_maps = false);
  explicit Player(const std::vector<std::filesystem::path>& bundle_folders,
                  const DeformOptions& options = {}, bool keep_maps = false);
  // Reads all cameras now, or from a thread of its own while frames are drawn, so that turning the
  // view never waits. Frames are the same either way.
  void load_all();
  void load_ahead();
  // Reads one camera more, for who has no thread to spare; false when all are there.
  bool load_next();

  // Instruments with blades need finite elements, so organs with tetrahedra: else UsageError.
  // What blades sweep parts kCutDelaySteps later: all that hangs on it is worked out meanwhile on a
  // thread of its own. Where that takes longer than these steps last, the step in which a cut grows
  // waits for it, unless cuts part when they are worked out (set_cut_times).
  StepReport step(const std::vector<Instrument>& instruments);
  static constexpr int kCutDelaySteps = 6;
  DrawReport draw(const View& view, DrawOptions options, Frame& frame);
  // From now on draw() leaves to another way of drawing what that can draw; null: nothing. What it
  // refuses, the processor draws; where it fails, it is let go for good. Neither loses anything.
  // PaperWarp (paper_warp.h) is such a way: the paper's own chain.
  void draw_by(std::shared_ptr<OrganDrawing> drawing);
  // Whether draw() leaves frames empty, since its pictures appear elsewhere (OrganDrawing).
  bool shows_pictures() const;
  DrawReport draw_by_processor(const View& view, DrawOptions options, Frame& frame);
  // Why the processor drew the last picture although draw_by() named another way; else empty.
  const std::string& drawing_note() const { return drawing_note_; }
  // The organs as they were baked, at rest and whole, whatever has been done to them since: to be
  // shown beside what draw() shows, by the processor.
  DrawReport draw_at_rest(const View& view, DrawOptions options, Frame& frame);
  // Another warper of an organ, with its samples, for a thread of its own (BatchDrawing).
  // Throws UsageError for one that blades have cut.
  Warper warper_beside(std::size_t organ = 0) const;
  // Whether the skin of any organ can be lit anew: else it is drawn as baked alone.
  bool can_relight() const;
  // The light that is asked for or, where none is, what the organs are meant to be seen in: at the
  // scope when any of them is. It is what draw() takes. Throws UsageError for a light in which no
  // organ can be shown.
  DrawnLight light_for(std::optional<DrawnLight> asked = {}) const;
  // Where another solver has brought an organ: x y z of each vertex of the proxy of bundle_now(),
  // or of each node of its tetrahedra, which carry the vertices, world mm. draw() shows vertices to
  // the byte as after a step that ended there. step() goes on from there: the organ lies still,
  // anchors are back at rest, instruments begin anew with what they touch; of vertices alone the
  // solver fem takes the smoothest inside that fits them. Throws UsageError, and changes nothing,
  // for another count, for what is not finite, and for what cannot be this organ: another one, or
  // another unit. Takes no memory but at the first calls.
  void set_vertices(std::span<const float> xyz_mm, std::size_t organ = 0);
  void set_vertices(std::span<const double> xyz_mm, std::size_t organ = 0);
  void set_nodes(std::span<const float> xyz_mm, std::size_t organ = 0);
  void set_nodes(std::span<const double> xyz_mm, std::size_t organ = 0);
  // What instruments would push each vertex of an organ's proxy with (N, world) to keep it off or
  // to carry it for one time step, as the organ lies now: for solvers that know no contact. All
  // organs lie still where they were afterwards; blades push nothing.
  std::vector<Eigen::Vector3d> contact_force_n(const std::vector<Instrument>& instruments,
                                               std::size_t organ = 0);

  // A moment between two steps, to go back to: how the organs lie and move, what is cut or on its
  // way to be, what instruments hold and what loads there are, the steps from rest. It is kept in
  // memory, for the player that saved it, and copies share what they hold.
  class State {
   public:
    explicit operator bool() const { return data_ != nullptr; }
    std::size_t steps() const;  // from rest
    // Memory that it takes beside another, with which it shares what is the same in both.
    std::size_t bytes_beside(const State& other) const;

   private:
    friend class Player;
    struct Data;
    std::shared_ptr<const Data> data_;
  };
  // earlier: one to share with what has not changed since, or none.
  State save_state(const State& earlier = {}) const;
  // Steps and frames that follow are to the byte those that followed when it was saved. What does
  // not belong to the organs stays as it is: cut times, the drawing. Where the organs hang together
  // otherwise than now, what moves and draws them is made anew, which takes as long as a cut.
  // Throws UsageError for an empty state and for another player's.
  void restore_state(const State& state);

  // When cuts part for whoever plays live: of the first known_steps steps from rest in those that
  // are named; later as soon as they are worked out, kCutDelaySteps after the blade at the
  // earliest, which is then known. So what was played live is repeated to the last bit. Nothing: in
  // kCutDelaySteps each. They outlast reset().
  struct CutTimes {
    std::vector<std::uint32_t> steps = {};  // increasing
    std::size_t known_steps = 0;
  };
  void set_cut_times(std::optional<CutTimes> times) { cut_times_ = std::move(times); }
  const std::optional<CutTimes>& cut_times() const { return cut_times_; }

  // Back to rest, and whole.
  void reset();
  // The same, and from now on played by another solver. Throws UsageError, and changes nothing, for
  // finite elements where an organ was baked without tetrahedra.
  void set_solver(TissueSolver solver) { play_by(solver, options_.stiffness); }
  // The same, and from now on of tissue that is so many times as stiff as the bundles say.
  void set_stiffness(double times) { play_by(solver(), times); }

  std::size_t organ_count() const { return organs_.size(); }
  // Of one organ by its number; each throws UsageError where there is none.
  const Bundle& bundle(std::size_t organ = 0) const { return organ_at(organ).bundle; }
  // The same as blades have cut it, without maps: its proxy is then the skin and the cuts' walls.
  const Bundle& bundle_now(std::size_t organ = 0) const { return organ_at(organ).now(); }
  bool is_cut(std::size_t organ = 0) const { return organ_at(organ).cut_warper.has_value(); }
  // Whether blades can cut the organs: all are played with tetrahedra.
  bool can_cut() const;
  // In how many pieces blades have cut an organ.
  std::size_t piece_count(std::size_t organ = 0) const;
  // Of the proxy of bundle_now(), mm.
  const std::vector<Eigen::Vector3d>& proxy_positions(std::size_t organ = 0) const {
    return organ_at(organ).positions;
  }
  // Where the nodes of the tetrahedra of bundle_now() are, mm; none under the solver springs.
  std::vector<Eigen::Vector3d> node_positions(std::size_t organ = 0) const;
  // How its cuts' lips stand apart when it is drawn; none of an organ that is whole.
  const LipGape* gape(std::size_t organ = 0) const {
    return is_cut(organ) ? &organ_at(organ).cutting->gape() : nullptr;
  }
  // What an organ was last drawn by.
  const Warper& drawn(std::size_t organ = 0) const { return organ_at(organ).shown(); }
  TissueSolver solver() const { return options_.solver.value_or(TissueSolver::springs); }
  // The solver in words, with the number of its tetrahedra: "finite elements (312 tetrahedra)".
  std::string solver_text() const;

 private:
  struct Placed;  // what another solver has set of an organ
  struct Organ {
    Bundle bundle;
    Warper warper;
    std::vector<Eigen::Vector3d> positions;  // of the proxy, mm
    // Once a blade was near, and what blades have swept through it; states share both.
    std::shared_ptr<const CutOrgan> cutting = {};
    std::shared_ptr<BladeSweeps> sweeps = {};
    std::optional<Warper> cut_warper = {};  // once it has cut
    std::shared_ptr<Placed> placed = {};    // once another solver has moved what is shown now

    Warper& shown() { return cut_warper ? *cut_warper : warper; }
    const Warper& shown() const { return cut_warper ? *cut_warper : warper; }
    // As they are drawn: lips of cuts gape.
    std::vector<Eigen::Vector3d> drawn_positions() const;
    const Bundle& now() const { return cut_warper ? cutting->now() : bundle; }
  };
  Player(std::vector<Organ> organs, const DeformOptions& options);
  static std::vector<Organ> one_of(Organ organ);
  static Organ bound(Bundle bundle, bool keep_maps);
  static std::vector<Organ> bound(std::vector<Bundle> bundles, bool keep_maps);
  static Organ streamed(Bundle frame, Warper::ReadMaps read);
  static Organ opened(const std::filesystem::path& bundle_folder, bool keep_maps);
  static std::vector<Organ> opened(const std::vector<std::filesystem::path>& folders,
                                   bool keep_maps);
  const Organ& organ_at(std::size_t organ) const;
  template <class Number>
  void place(std::span<const Number> xyz_mm, StateOf of, std::size_t organ);
  bool go_on_from_placed();  // false when no other solver has moved anything since the last step
  bool make_whole();         // false when nothing was cut
  bool hang_together_as_in(const State::Data& state) const;
  static void save_placed(const Organ& organ, std::optional<OrganState>& state, StateOf& of);
  static void restore_placed(Organ& organ, const std::optional<OrganState>& state, StateOf of);
  void play_by(TissueSolver solver, double stiffness);
  void take_positions();
  Eigen::Vector3d pressed_by(const Solid& tip) const;
  void complete(DrawOptions& options) const;
  static DeformBody deform_body(const Bundle& organ);
  static DeformBodies deform_bodies(const std::vector<Organ>& organs);
  void cut(const std::vector<Instrument>& instruments);
  void sweep(const std::vector<Instrument>& instruments);
  void begin_cutting(Organ& organ);
  void leave_holes(const std::vector<Instrument>& instruments,
                   const std::vector<ContactPoint>& punctures);
  bool cut_is_due(std::size_t step);
  void begin_pending_cut();
  using Sheets = std::vector<std::shared_ptr<const CutSheet>>;  // by organ; null: nothing new
  void begin_pending_cut(Sheets sheets);
  void end_pending_cut();
  template <class Use>
  auto with_drawn_organs(const Use& use);
  DrawReport draw_organs(const View& view, const DrawOptions& options, Frame& frame);
  std::optional<DrawReport> draw_otherwise(const View& view, const DrawOptions& options,
                                           Frame& frame);

  std::vector<Organ> organs_;
  DeformOptions options_;
  Deformer deformer_;
  JointDrawing joint_drawing_;   // of several organs
  std::vector<Warper> resting_;  // made when first asked for, as the next
  JointDrawing resting_drawing_;
  std::shared_ptr<OrganDrawing> drawing_;  // other than the processor's
  std::string drawing_note_;
  CuttingEdges cutting_edges_;
  std::optional<CutTimes> cut_times_;
  std::size_t steps_ = 0;                                        // from rest
  std::shared_ptr<const void> mark_ = std::make_shared<char>();  // of its states
  // Organs on their way to be as blades have cut them. Last: it waits for its thread, which reads
  // the rest.
  struct PendingCut;
  std::shared_ptr<PendingCut> pending_cut_;
};

}  // namespace organbake

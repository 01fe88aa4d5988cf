// SPDX-License-Identifier: Apache-2.0
// The player as one WebAssembly module: what organ.js calls. Bytes go in through the buffer of
// organ_reserve(), numbers come back; what returns −1 has left a sentence in organ_message().
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "live_organ.h"
#include "organbake/bundle/bundle_pack.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"

#define ORGAN_EXPORT(name) extern "C" __attribute__((export_name(#name)))

namespace organbake {
namespace {

constexpr std::uint32_t kMostBytes = 1u << 30;

struct Module {
  std::vector<std::byte> buffer;
  std::vector<PackPart> parts;
  std::unique_ptr<LiveOrgan> organ;
  std::string message;
  std::vector<double> room;  // of states and tools, which come once a step: kept
  std::vector<std::byte> list;
};

// The tools in the room: position, radius and axis, and whether each grabs, are 8 numbers.
constexpr std::size_t kNumbersPerTool = 8;
std::vector<EmbeddedPlayer::Tip> tools_in(const std::vector<double>& room, std::uint32_t count) {
  if (room.size() < kNumbersPerTool * count) throw UsageError("there is no room of so many tools");
  std::vector<EmbeddedPlayer::Tip> tips(count);
  for (std::size_t t = 0; t < count; ++t) {
    const double* n = &room[kNumbersPerTool * t];
    tips[t].position_mm = {n[0], n[1], n[2]};
    tips[t].radius_mm = n[3];
    tips[t].axis_mm = {n[4], n[5], n[6]};
    tips[t].grabs = n[7] != 0;
  }
  return tips;
}

Module& module() {
  static Module one;
  return one;
}

Eigen::Matrix4d matrix_in_room(std::size_t which) {
  constexpr std::size_t kNumbers = 16;
  if (module().room.size() < kNumbers * (which + 1)) throw UsageError("there is no such matrix");
  return Eigen::Map<const Eigen::Matrix4d>(&module().room[kNumbers * which]);
}

template <class Item>
void put_list(const std::vector<Item>& items, Module& m) {
  const auto bytes = std::as_bytes(std::span(items));
  m.list.assign(bytes.begin(), bytes.end());
}

// A list of the mesh by its place in organ.js.
void put_mesh_list(const EmbeddedPlayer::Mesh& mesh, std::uint32_t which, Module& m) {
  std::uint32_t place = 0;
  const auto one = [&](const auto& list) {
    if (place++ == which) put_list(list, m);
  };
  one(mesh.vertices_mm), one(mesh.faces), one(mesh.vertex_mass_kg), one(mesh.vertex_anchors);
  one(mesh.spring_ends), one(mesh.spring_length_mm), one(mesh.spring_stiffness_n_per_mm);
  one(mesh.spring_damping_n_s_per_mm), one(mesh.nodes_mm), one(mesh.tetrahedra), one(mesh.fill);
  one(mesh.node_mass_kg), one(mesh.node_anchors), one(mesh.vertex_tetrahedron);
  one(mesh.vertex_weights), one(mesh.skin_first), one(mesh.skin_carriers), one(mesh.skin_weights);
  one(mesh.skin_faces);
  one(std::vector<double>{mesh.young_modulus_kpa, mesh.density_kg_per_m3, mesh.thickness_mm,
                          mesh.volume_stiffness, mesh.poisson_ratio, mesh.damping_s});
  if (which >= place) throw UsageError("the mesh has no list " + std::to_string(which));
}

// What a function of the module returns: its result, 1 + c when the maps of camera c must be
// supplied first, or −1 with a message.
// One for all of them, which does not know the work by its type: pages carry the module.
using AnyWork = int (*)(const void* work, Module& module);
int guarded(AnyWork run, const void* work) {
  try {
    return run(work, module());
  } catch (const MapsWanted& wanted) {
    return 1 + static_cast<int>(wanted.camera);
  } catch (const std::exception& error) {
    module().message = message_for(error);
    return -1;
  }
}

template <class Work>
int guarded(const Work& work) {
  return guarded([](const void* any, Module& m) { return (*static_cast<const Work*>(any))(m); },
                 &work);
}

LiveOrgan& organ_of(Module& m) {
  if (!m.organ) throw UsageError("no organ is open");
  return *m.organ;
}
template <class Work>
int with_organ(const Work& work) {
  return guarded([&](Module& m) { return work(organ_of(m)); });
}

}  // namespace
}  // namespace organbake

using namespace organbake;

// Where the caller puts the bytes of the next call; 0 when there is no such memory.
ORGAN_EXPORT(organ_reserve) std::byte* organ_reserve(std::uint32_t bytes) {
  std::byte* at = nullptr;
  guarded([&](Module& m) {
    if (bytes > kMostBytes) throw BadDataError("the pack holds more than a page can");
    m.buffer = {};
    m.buffer.resize(bytes);
    at = m.buffer.data();
    return 0;
  });
  return at;
}

// The buffer holds a pack's first bytes. Returns how many parts it has.
ORGAN_EXPORT(organ_contents) int organ_contents(double pack_bytes) {
  return guarded([&](Module& m) {
    m.parts = contents_of_pack(m.buffer, static_cast<std::uint64_t>(pack_bytes));
    return static_cast<int>(m.parts.size());
  });
}

// Of a part: what = 0 its offset, 1 its packed bytes, 2 its bytes inflated.
ORGAN_EXPORT(organ_part) double organ_part(std::uint32_t part, int what) {
  if (part >= module().parts.size()) return 0;
  const PackPart& p = module().parts[part];
  return what == 0 ? double(p.offset) : what == 1 ? p.packed_bytes : p.bytes;
}

// The buffer holds part 0, inflated.
ORGAN_EXPORT(organ_open) int organ_open() {
  return guarded([](Module& m) {
    m.organ = {};
    Bundle frame = unpacked_frame(m.buffer);
    m.buffer = {};
    if (frame.cameras.cameras.size() + 1 != m.parts.size())
      throw BadDataError("the pack holds maps of " + std::to_string(m.parts.size() - 1) +
                         " cameras, its frame names " +
                         std::to_string(frame.cameras.cameras.size()));
    m.organ = std::make_unique<LiveOrgan>(std::move(frame));
    return 0;
  });
}

// The buffer holds the maps of a camera, inflated.
ORGAN_EXPORT(organ_supply) int organ_supply(std::uint32_t camera) {
  return with_organ([&](LiveOrgan& organ) {
    organ.supply(camera, std::exchange(module().buffer, {}));
    return 0;
  });
}

// Binds one camera more of those that were supplied in order; 0 when all are bound.
ORGAN_EXPORT(organ_bind_next) int organ_bind_next() {
  return with_organ([](LiveOrgan& organ) { return organ.bind_next() ? 1 : 0; });
}

// Time goes on by a sixtieth of a second, unless step is 0, then the picture is drawn. 0: it is
// drawn; 1 + c when the maps of camera c must be supplied and it be asked for again with step 0.
ORGAN_EXPORT(organ_advance) int organ_advance(int step, int width, int height) {
  return with_organ([&](LiveOrgan& organ) {
    organ.advance(step != 0, width, height);
    return 0;
  });
}

// For a headset, whose matrices are in the room, column by column, as WebXR has them. A time step
// without a picture.
ORGAN_EXPORT(organ_pass_time) int organ_pass_time() {
  return with_organ([](LiveOrgan& organ) { return organ.pass_time(), 0; });
}
// The viewer's transform in the room: the organ stands before it from now on.
ORGAN_EXPORT(organ_stand_before) int organ_stand_before() {
  return with_organ([](LiveOrgan& organ) { return organ.stand_before(matrix_in_room(0)), 0; });
}
// An eye's inverse transform and its projection are in the room; returns what organ_advance() does.
ORGAN_EXPORT(organ_look) int organ_look(int width, int height) {
  return with_organ([&](LiveOrgan& organ) {
    return organ.look(matrix_in_room(0), matrix_in_room(1), {width, height}), 0;
  });
}

// R G B A of the last picture, top row first.
ORGAN_EXPORT(organ_pixels) const std::uint8_t* organ_pixels() {
  return module().organ ? module().organ->pixels() : nullptr;
}

// The buffer holds an interaction (interaction.schema.json): played from rest as organplay does up
// to a frame, which is then the last picture, of the interaction's size.
ORGAN_EXPORT(organ_script) int organ_script(int frame) {
  return with_organ([&](LiveOrgan& organ) {
    const auto bytes = std::exchange(module().buffer, {});
    return organ.play({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, frame);
  });
}

// Room for a state or for tools; it stays until more is asked for. 0 when there is no such memory.
ORGAN_EXPORT(organ_room) double* organ_room(std::uint32_t bytes) {
  double* at = nullptr;
  guarded([&](Module& m) {
    if (bytes > kMostBytes) throw BadDataError("a state of so many places cannot be an organ's");
    if (m.room.size() * sizeof(double) < bytes) m.room.resize((bytes + 7) / sizeof(double));
    at = m.room.data();
    return 0;
  });
  return at;
}

// The room holds x y z of each point: of vertices, or nodes ≠ 0; as doubles, or floats when single.
ORGAN_EXPORT(organ_set_state) int organ_set_state(std::uint32_t numbers, int nodes, int single) {
  return with_organ([&](LiveOrgan& organ) {
    const std::vector<double>& room = module().room;
    const StateOf of = nodes != 0 ? StateOf::nodes : StateOf::vertices;
    const std::size_t bytes = std::size_t{numbers} * (single != 0 ? sizeof(float) : sizeof(double));
    if (room.size() * sizeof(double) < bytes) throw UsageError("there is no room of such a state");
    if (single != 0) {
      organ.set_state(std::span(reinterpret_cast<const float*>(room.data()), numbers), of);
    } else {
      organ.set_state(std::span(room.data(), numbers), of);
    }
    return 0;
  });
}
// A list of the mesh, as organ.js counts them: its bytes lie at organ_list().
ORGAN_EXPORT(organ_mesh) int organ_mesh_list(std::uint32_t which) {
  return with_organ([&](LiveOrgan& organ) {
    put_mesh_list(organ.mesh(), which, module());
    return static_cast<int>(module().list.size());
  });
}
ORGAN_EXPORT(organ_list) const std::byte* organ_list() { return module().list.data(); }
// The room holds tools, 8 numbers each.
ORGAN_EXPORT(organ_place_tools) int organ_place_tools(std::uint32_t count) {
  return with_organ(
      [&](LiveOrgan& organ) { return organ.place_tools(tools_in(module().room, count)), 0; });
}
ORGAN_EXPORT(organ_contact_forces) int organ_contact_forces(std::uint32_t count, int nodes) {
  return with_organ([&](LiveOrgan& organ) {
    const auto tips = tools_in(module().room, count);
    put_list(points_of(organ.contact_forces(tips, nodes != 0)), module());
    return static_cast<int>(module().list.size());
  });
}

// One of LiveOrgan::figures(); the message becomes the name of the one that is asked for, and is
// empty behind the last.
ORGAN_EXPORT(organ_figure_name) void organ_figure_name(std::uint32_t which) {
  module().message = which < LiveOrgan::figures().size() ? LiveOrgan::figures()[which].name : "";
}
ORGAN_EXPORT(organ_figure) double organ_figure(std::uint32_t which) {
  return module().organ ? LiveOrgan::figures()[which].of(*module().organ) : 0;
}

// A number of a tool's own, by its place in each_number(), whose name and title become the message,
// a line each: into the room its value, the least, the most and the usual one. 0 behind the last.
ORGAN_EXPORT(organ_tool_number) int organ_tool_number(std::uint32_t tool, std::uint32_t which) {
  return with_organ([&](LiveOrgan& organ) {
    std::uint32_t place = 0;
    each_number_of(organ.tools().at(tool), [&](const InstrumentNumber& number, double value) {
      if (place++ != which) return;
      module().message = std::string(number.name) + "\n" + number.title;
      put_list(std::vector{value, number.least, number.most, number.usual}, module());
    });
    return place > which ? 1 : 0;
  });
}
ORGAN_EXPORT(organ_set_tool_number)
int organ_set_tool_number(std::uint32_t tool, std::uint32_t which, double value) {
  return with_organ([&](LiveOrgan& organ) {
    std::uint32_t place = 0;
    each_number_of(organ.tools().at(tool), [&](const InstrumentNumber& number, double& own) {
      if (place++ != which) return;
      if (!(value >= number.least && value <= number.most))
        throw UsageError(std::string(number.name) + " must be " + to_text(number.least) + " to " +
                         to_text(number.most));
      own = value;
    });
    return 0;
  });
}

ORGAN_EXPORT(organ_turn) void organ_turn(double x, double y) {
  with_organ([&](LiveOrgan& organ) { return organ.session().turn({x, y}), 0; });
}
ORGAN_EXPORT(organ_shift) void organ_shift(double x, double y) {
  with_organ([&](LiveOrgan& organ) { return organ.session().shift({x, y}), 0; });
}
ORGAN_EXPORT(organ_zoom) void organ_zoom(double steps) {
  with_organ([&](LiveOrgan& organ) { return organ.session().zoom(steps), 0; });
}
ORGAN_EXPORT(organ_face_front) void organ_face_front() {
  with_organ([](LiveOrgan& organ) { return organ.session().face_front(), 0; });
}
// At a pixel of the last picture; 1 when there is tissue. tool: its place among instrument_kinds().
ORGAN_EXPORT(organ_touch) int organ_touch(double x, double y, std::uint32_t tool) {
  return with_organ([&](LiveOrgan& organ) {
    if (tool >= organ.tools().size()) throw UsageError("there is no tool " + std::to_string(tool));
    return organ.touch({x, y}, organ.tools()[tool]) ? 1 : 0;
  });
}
ORGAN_EXPORT(organ_drag) void organ_drag(double x, double y) {
  with_organ([&](LiveOrgan& organ) { return organ.session().drag({x, y}), 0; });
}
ORGAN_EXPORT(organ_push) void organ_push(double mm) {
  with_organ([&](LiveOrgan& organ) { return organ.session().push(mm), 0; });
}
ORGAN_EXPORT(organ_let_go) void organ_let_go() {
  with_organ([](LiveOrgan& organ) { return organ.session().let_go(), 0; });
}
ORGAN_EXPORT(organ_reset) void organ_reset() {
  with_organ([](LiveOrgan& organ) { return organ.reset(), 0; });
}
// The last touch; pictures then bring the organ there.
ORGAN_EXPORT(organ_undo) void organ_undo() {
  with_organ([](LiveOrgan& organ) { return organ.session().undo(), 0; });
}
ORGAN_EXPORT(organ_redo) void organ_redo() {
  with_organ([](LiveOrgan& organ) { return organ.session().redo(), 0; });
}
// 0 springs, 1 finite elements; −1 where there are no tetrahedra.
ORGAN_EXPORT(organ_set_solver) int organ_set_solver(int solver) {
  return with_organ([&](LiveOrgan& organ) {
    organ.choose_solver(solver == 1 ? TissueSolver::fem : TissueSolver::springs);
    return 0;
  });
}
ORGAN_EXPORT(organ_set_scope) void organ_set_scope(double mm) {
  with_organ([&](LiveOrgan& organ) { return organ.session().set_scope_distance_mm(mm), 0; });
}
ORGAN_EXPORT(organ_set_view_angle) void organ_set_view_angle(double deg) {
  with_organ([&](LiveOrgan& organ) { return organ.session().set_view_angle_deg(deg), 0; });
}
// Of the next touch.
ORGAN_EXPORT(organ_set_radius) void organ_set_radius(double mm) {
  with_organ([&](LiveOrgan& organ) { return organ.session().set_tool_radius_mm(mm), 0; });
}
// A DrawnLight; −1 for one that the organ cannot be shown in. The message of organ_light_title() is
// what one is called, empty behind the last.
ORGAN_EXPORT(organ_set_light) int organ_set_light(std::uint32_t light) {
  return with_organ([&](LiveOrgan& organ) {
    if (light >= kLightNames.size()) throw UsageError("there is no light " + std::to_string(light));
    return organ.set_light(static_cast<DrawnLight>(light)), 0;
  });
}
ORGAN_EXPORT(organ_light_title) void organ_light_title(std::uint32_t light) {
  module().message = light < kLightNames.size() ? kLightNames[light].title : "";
}
// By WebGL into the canvas whose context the page has made current, software 1: also without
// graphics hardware; its name is the message. −1, and as before, where that cannot be.
ORGAN_EXPORT(organ_draw_by_graphics) int organ_draw_by_graphics(int software) {
  return with_organ([&](LiveOrgan& organ) {
    module().message = organ.draw_by_graphics(software != 0);
    return 0;
  });
}
ORGAN_EXPORT(organ_draw_by_processor) void organ_draw_by_processor() {
  with_organ([](LiveOrgan& organ) { return organ.draw_by_processor(), 0; });
}
// The message is then why the processor drew in the graphics hardware's place, or empty.
ORGAN_EXPORT(organ_drawing_note) void organ_drawing_note() {
  with_organ([](LiveOrgan& organ) { return module().message = organ.drawing_note(), 0; });
}
ORGAN_EXPORT(organ_set_background) void organ_set_background(int red, int green, int blue) {
  with_organ([&](LiveOrgan& organ) { return organ.set_background(red, green, blue), 0; });
}

ORGAN_EXPORT(organ_message) const char* organ_message() { return module().message.data(); }
ORGAN_EXPORT(organ_message_bytes) std::uint32_t organ_message_bytes() {
  return static_cast<std::uint32_t>(module().message.size());
}

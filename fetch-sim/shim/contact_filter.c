// The contact filter: skips MuJoCo's collision routine for pairs of geoms that are provably apart.
// Results stay the same to the last bit.
//
// WHERE. MuJoCo calls its routines through the table mjCOLLISIONFUNC, which it exports so that users
// can change it. The filter replaces every entry by `collide`, which calls the original routine
// unless this thread is in a step of a simulation with a filter. Other users of MuJoCo in the
// process therefore see no difference, and mjcb_contactfilter stays theirs. MuJoCo's own tests (bit
// masks, welded bodies, parents, excluded pairs, bounding spheres) come first, with the margin of
// its version. An entry that somebody has already replaced is left alone, because nothing is known
// of what that routine finds. Skipping a routine that finds no contact changes nothing.
//
// WHY IT IS SAFE. Let D be the distance of two convex shapes.
// 1. For every direction of unit length, the gap between the two planes perpendicular to it that
//    touch the shapes is at most D. So any gap was a lower bound of D when it was computed.
// 2. D changes by at most as much as the points of both shapes move. A point at most r from its
//    frame's origin moves by at most |x' - x| + r |R' - R|, and for rotations the spectral norm
//    |R' - R| is the Frobenius norm divided by sqrt(2). `travel` adds this up for each geom from one
//    look at its pose to the next, whatever happened in between: steps, a reset, a restored
//    snapshot. A pair stores `clear_until` = gap + travel of both at that time; D is now at least
//    clear_until - travel of both.
// 3. A routine returns no contact if D exceeds the margin that it is called with; between two boxes
//    if D exceeds sqrt(3) times that. (They are tested along 15 axes, the face normals of their
//    Minkowski difference. The direction of D is a sum, with nonnegative weights, of at most three
//    of them, which lie in one octant and so make no obtuse angles; hence the weights add up to at
//    most sqrt(3), and along one of the axes the gap is at least D / sqrt(3).) A negative margin
//    counts as 0: not every routine subtracts it from the depth of shapes that overlap.
//    Below a cylinder, D is the distance of a thicker shape (see gap_above), which moves like it.
// 4. Computed values are off by rounding, some 1e-15 meters; by FS_SUPPORT_ERROR for each mesh; and
//    MuJoCo's routines for general convex shapes have a tolerance of 1e-6. SLACK is greater than
//    all of these together. `travel` is rounded up, and is set back to 0 before it grows so large
//    that additions would lose digits. NaN never rejects a pair.
//
// WHEN IT PAYS. Comparing two poses is cheap, computing a gap costs more, and finding a new direction
// costs more still, but less than MuJoCo's routines. So a pair whose bound has run out first tries
// its old direction, then looks for a new one. It does neither while its last test found contacts,
// and tries less and less often while it fails.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "internal.h"
#include "shapes.h"

static const double SLACK = 1e-5;        // meters
static const double MAX_TRAVEL = 1000;   // meters
static const double ROUNDING = 1e-12;    // meters
enum { MAX_WAIT = 15 };

typedef struct {
  double pose[12];  // position and rotation when last looked at
  double travel;
} geom_state;

typedef struct {
  double clear_until;
  double best_gap;      // found by the last search for a direction
  double direction[3];  // a unit vector, from the second geom to the first
  int touching;         // whether the last test found contacts
  int wait, last_wait;  // tests before the next attempt
} pair_state;

struct fs_filter {
  const fs_shapes* shapes;
  const mjData* data;
  int check;
  fs_filter_counts counts;
  geom_state* geoms;
  pair_state* pairs;  // numbered by fs_pair
};

// ------------------------------------------------------------------------- creation and deletion

fs_filter* fs_make_filter(const fs_shapes* shapes, const mjData* d) {
  fs_filter* filter = calloc(1, sizeof *filter);
  if (!filter) return NULL;
  filter->shapes = shapes;
  filter->data = d;
  filter->geoms = calloc((size_t)shapes->ngeom + 1, sizeof *filter->geoms);
  filter->pairs = calloc((size_t)shapes->npair + 1, sizeof *filter->pairs);
  if (filter->geoms && filter->pairs) return filter;
  fs_delete_filter(filter);
  return NULL;
}

void fs_delete_filter(fs_filter* filter) {
  if (!filter) return;
  free(filter->geoms);
  free(filter->pairs);
  free(filter);
}

void fs_check_filter(fs_filter* filter, int check) { filter->check = check; }

void fs_get_filter_counts(const fs_filter* filter, fs_filter_counts* counts) {
  *counts = filter->counts;
}

// ----------------------------------------------------------------------------------- the filter

// Discards all bounds, so that the travels can restart from 0.
static void restart(fs_filter* filter) {
  for (int i = 0; i < filter->shapes->ngeom; i++) filter->geoms[i].travel = 0;
  for (int i = 0; i < filter->shapes->npair; i++) filter->pairs[i].clear_until = -HUGE_VAL;
}

void fs_set_filter_shapes(fs_filter* filter, const fs_shapes* shapes) {
  filter->shapes = shapes;
  restart(filter);
}

// Adds to a geom's travel the distance it has moved since the last call. Returns 1 if all travels
// restarted from 0 instead.
static int update_travel(fs_filter* filter, int geom) {
  const double* position = filter->data->geom_xpos + 3 * geom;
  const double* rotation = filter->data->geom_xmat + 9 * geom;
  geom_state* state = filter->geoms + geom;
  if (memcmp(state->pose, position, 3 * sizeof *position) == 0 &&
      memcmp(state->pose + 3, rotation, 9 * sizeof *rotation) == 0) {
    return 0;
  }
  double moved = 0, turned = 0;
  for (int i = 0; i < 3; i++) {
    const double change = position[i] - state->pose[i];
    moved += change * change;
    state->pose[i] = position[i];
  }
  for (int i = 0; i < 9; i++) {
    const double change = rotation[i] - state->pose[3 + i];
    turned += change * change;
    state->pose[3 + i] = rotation[i];
  }
  const double radius = filter->shapes->geoms[geom].radius;
  state->travel += (sqrt(moved) + radius * sqrt(turned / 2)) * (1 + 1e-9) + ROUNDING;
  if (state->travel < MAX_TRAVEL) return 0;
  restart(filter);
  return 1;
}

static fs_placed placed(const fs_filter* filter, int geom) {
  return (fs_placed){
      .shape = filter->shapes->geoms + geom,
      .position = filter->data->geom_xpos + 3 * geom,
      .rotation = filter->data->geom_xmat + 9 * geom,
  };
}

// Sets the first direction to try.
static void direction_between(const fs_placed* first, const fs_placed* second, double direction[3]) {
  double length = 0;
  for (int i = 0; i < 3; i++) {
    direction[i] = first->position[i] - second->position[i];
    length += direction[i] * direction[i];
  }
  if (!(length > 0)) direction[0] = length = 1;
  for (int i = 0; i < 3; i++) direction[i] /= sqrt(length);
}

// Returns the gap between a plane and another shape. MuJoCo may find a cylinder's rim as low as its
// radius below a disk that is level up to rounding, so the cylinder is assumed to be that thick
// around its axis.
static double gap_above(const fs_placed* plane, const fs_placed* other) {
  const double below[3] = {-plane->rotation[2], -plane->rotation[5], -plane->rotation[8]};
  if (other->shape->type != mjGEOM_CYLINDER) return fs_gap(plane, other, below);
  fs_shape axis = {.type = mjGEOM_CAPSULE, .round = other->shape->size[0]};
  axis.size[1] = other->shape->size[1];
  const fs_placed thick = {.shape = &axis, .position = other->position, .rotation = other->rotation};
  return fs_gap(plane, &thick, below);
}

// Searches for a gap greater than `least`, and keeps the direction of the greatest it finds.
static double find_gap(pair_state* pair, const fs_placed* first, const fs_placed* second,
                       double least) {
  if (first->shape->type == mjGEOM_PLANE) return gap_above(first, second);
  if (pair->best_gap > 0) {
    // The old direction gets worse as the shapes move: replace it in time.
    const double gap = fs_gap(first, second, pair->direction);
    if (gap > least && gap > pair->best_gap / 4) return gap;
  } else {
    direction_between(first, second, pair->direction);
  }
  return pair->best_gap = fs_separate(first, second, least, pair->direction);
}

// Returns 1 if two geoms are known, or cheaply found, to be farther apart than `least`.
static int apart(fs_filter* filter, pair_state* pair, int geom1, int geom2, double least) {
  if (update_travel(filter, geom1) | update_travel(filter, geom2)) update_travel(filter, geom1);
  const double travel = filter->geoms[geom1].travel + filter->geoms[geom2].travel;
  if (pair->clear_until > travel + least) return 1;
  if (pair->touching) return 0;
  if (pair->wait > 0) {
    pair->wait--;
    return 0;
  }
  const fs_placed first = placed(filter, geom1), second = placed(filter, geom2);
  pair->clear_until = travel + find_gap(pair, &first, &second, least);
  if (pair->clear_until > travel + least) {
    pair->last_wait = 0;
    return 1;
  }
  pair->wait = pair->last_wait = pair->last_wait < MAX_WAIT ? 2 * pair->last_wait + 1 : MAX_WAIT;
  return 0;
}

// ------------------------------------------------------------------------------------- the table

// The arguments of a collision routine that differ by version.
#if mjVERSION_HEADER >= 3007000
typedef mjData collision_data;
#else
typedef const mjData collision_data;
#endif
#if mjVERSION_HEADER >= 3009000
typedef mjPreContact collision_contact;
#else
typedef mjContact collision_contact;
#endif

static mjfCollision originals[mjNGEOMTYPES][mjNGEOMTYPES];
static _Thread_local fs_filter* in_use;

fs_filter* fs_use_filter(fs_filter* filter) {
  fs_filter* before = in_use;
  in_use = filter;
  return before;
}

// Returns the multiple of the margin beyond which a routine finds no contact; see 3 above.
static double factor(const mjModel* m, int geom1, int geom2) {
  return m->geom_type[geom1] == mjGEOM_BOX && m->geom_type[geom2] == mjGEOM_BOX ? sqrt(3) : 1;
}

// Checks a rejection: MuJoCo must find no contact within the assumed gap.
static void check(fs_filter* filter, mjfCollision original, const mjModel* m, collision_data* d,
                  const pair_state* pair, int geom1, int geom2) {
  collision_contact contacts[mjMAXCONPAIR];
  const double travel = filter->geoms[geom1].travel + filter->geoms[geom2].travel;
  const double margin = (pair->clear_until - travel - SLACK) / factor(m, geom1, geom2);
  filter->counts.checked++;
  filter->counts.refuted += original(m, d, contacts, geom1, geom2, margin) > 0;
}

static int collide(const mjModel* m, collision_data* d, collision_contact* contacts, int geom1,
                   int geom2, mjtNum margin) {
  const mjfCollision original = originals[m->geom_type[geom1]][m->geom_type[geom2]];
  fs_filter* filter = in_use;
  if (!filter || filter->data != d) return original(m, d, contacts, geom1, geom2, margin);
  const int number = fs_pair(filter->shapes, geom1, geom2);
  filter->counts.pairs++;
  if (number < 0) return original(m, d, contacts, geom1, geom2, margin);
  pair_state* pair = filter->pairs + number;
  const double least = factor(m, geom1, geom2) * (margin < 0 ? 0 : margin) + SLACK;
  if (apart(filter, pair, geom1, geom2, least)) {
    filter->counts.rejected++;
    if (filter->check) check(filter, original, m, d, pair, geom1, geom2);
    return 0;
  }
  const int found = original(m, d, contacts, geom1, geom2, margin);
  pair->touching = found > 0;
  return found;
}

// Returns 1 if a routine belongs to the library, and not to somebody who replaced it.
static int is_own(mjfCollision routine, const void* base) {
  void* address;
  memcpy(&address, &routine, sizeof address);
  return fs_base_of(address) == base;
}

void fs_install_filter(void* library) {
  mjfCollision(*table)[mjNGEOMTYPES];
  if (!fs_symbol(library, "mjCOLLISIONFUNC", &table)) return;
  const void* base = fs_base_of(table);
  if (!base) return;
  for (int i = 0; i < mjNGEOMTYPES; i++) {
    for (int j = 0; j < mjNGEOMTYPES; j++) {
      originals[i][j] = table[i][j];
      if (table[i][j] && is_own(table[i][j], base)) {
        __atomic_store_n(&table[i][j], collide, __ATOMIC_RELEASE);
      }
    }
  }
  // The table outlives a plugin that contains this code, so the code must never be unloaded.
  fs_keep(&originals);
}

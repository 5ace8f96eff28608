// Convex shapes of a model's geoms as the contact filter sees them: support functions and gaps.

#pragma once

#include "internal.h"

#pragma GCC visibility push(hidden)

// The greatest error of a support function (meters): a hull omits vertices that protrude by less.
#define FS_SUPPORT_ERROR 1e-6

// The largest component of a direction, and the other two divided by it, select a cell of a hull's
// direction map.
enum { FS_CELLS_PER_EDGE = 8, FS_CELLS = 6 * FS_CELLS_PER_EDGE * FS_CELLS_PER_EDGE };

// The vertices of a mesh that can be the farthest in some direction, by direction.
typedef struct {
  const float* vertices;  // the mesh's, in the model
  int start[FS_CELLS + 1];
  int* candidates;  // those of cell i begin at start[i]
} fs_hull;

enum { FS_NO_SHAPE = -1 };

typedef struct {
  int type;       // mjtGeom, or FS_NO_SHAPE if the filter does not support it
  double radius;  // of a ball around the geom's frame that contains the geom
  double round;   // the shape is its core, widened by this much
  double size[3];
  const fs_hull* hull;
} fs_shape;

struct fs_shapes {
  int ngeom, nmesh, npair;
  fs_shape* geoms;
  fs_hull* hulls;
  int* pairs;  // [ngeom][ngeom], symmetric; see fs_pair
  int owns_tables;  // whether the hulls and the pairs are its own
};

// Returns the number, below npair, of a pair of geoms that may touch and whose shapes are supported;
// -1 for any other pair.
static inline int fs_pair(const fs_shapes* shapes, int geom1, int geom2) {
  return shapes->pairs[(size_t)geom1 * shapes->ngeom + geom2];
}

// Writes the point of a shape's core that is farthest in a direction of unit length, both in the
// geom's frame. The core of a plane is its origin, which is its farthest point only along its normal.
void fs_support(const fs_shape* shape, const double direction[3], double point[3]);

static inline double fs_dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

typedef struct {
  const fs_shape* shape;
  const double* position;  // of the geom's frame in the world
  const double* rotation;  // row-major
} fs_placed;

// Returns the gap between two shapes along a direction of unit length that points from the second to
// the first: between the planes perpendicular to it that touch them. Their distance is at least the
// gap, whatever the direction, except for rounding and the error of the supports (see
// contact_filter.c).
double fs_gap(const fs_placed* first, const fs_placed* second, const double direction[3]);

// Searches for a direction with a gap greater than `least`, starting from `direction`, and returns
// the greatest gap found, with its direction. Stops at a gap that is greater than `least` and half of
// the most that any direction can give; gives up when none can be greater than `least`.
double fs_separate(const fs_placed* first, const fs_placed* second, double least,
                   double direction[3]);

#pragma GCC visibility pop

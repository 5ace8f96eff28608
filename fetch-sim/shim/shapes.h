// Convex shapes of a model's geoms, as the contact filter sees them: support functions.

#ifndef FETCH_SHIM_SHAPES_H_
#define FETCH_SHIM_SHAPES_H_

#include <mujoco/mujoco.h>

// The greatest error of a support function (meters): a hull leaves out vertices that stick out less.
#define FS_SUPPORT_ERROR 1e-6

// A cell of a hull's direction map is found by the largest component of a direction, and by the
// other two divided by it.
enum { FS_CELLS_PER_EDGE = 8, FS_CELLS = 6 * FS_CELLS_PER_EDGE * FS_CELLS_PER_EDGE };

// The vertices of a mesh that can be its farthest in a direction, by direction.
typedef struct {
  const float* vertices;  // the mesh's, in the model
  int start[FS_CELLS + 1];
  int* candidates;  // those of cell i begin at start[i]
} fs_hull;

typedef struct {
  int type;       // mjtGeom; FS_NO_SHAPE if it is none that the filter knows
  double radius;  // of a ball around the geom's frame that holds all of it
  double round;   // the shape is its core, widened by this much
  double size[3];
  const fs_hull* hull;
} fs_shape;

enum { FS_NO_SHAPE = -1 };

typedef struct {
  int ngeom, nmesh, npair;
  fs_shape* geoms;
  fs_hull* hulls;
  int* pairs;  // [ngeom][ngeom], symmetric; see fs_pair
} fs_shapes;

// The shapes of a model, which must outlive them; NULL if there is no memory for them.
fs_shapes* fs_make_shapes(const mjModel* m);
void fs_delete_shapes(fs_shapes* shapes);

// The number of a pair of geoms that may touch and whose shapes are known, below npair; or else -1.
static inline int fs_pair(const fs_shapes* shapes, int geom1, int geom2) {
  return shapes->pairs[geom1 * shapes->ngeom + geom2];
}

// The point of a shape's core that is farthest in a direction of unit length, both in the geom's
// frame. The core of a plane is its origin, which is its farthest point along its normal only.
void fs_support(const fs_shape* shape, const double direction[3], double point[3]);

#endif

// Support functions, and the direction maps of meshes.
//
// A mesh has up to thousands of vertices. MuJoCo walks along the edges of its hull; the direction
// map stores, for each cell of directions, the few vertices that can be the farthest in a direction
// of that cell. A vertex is omitted if another is farther, or at most FS_SUPPORT_ERROR less far, at
// all four corners of the cell: a direction of the cell is a sum of the corners with nonnegative
// weights, and the products are linear in it, so the same holds in the whole cell. A list is never
// empty. The map is computed once for each model.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "shapes.h"

// ---------------------------------------------------------------------------- the direction maps

static int cell_along(double ratio) {
  int cell = (int)((ratio + 1) * (FS_CELLS_PER_EDGE / 2));
  return cell < 0 ? 0 : cell < FS_CELLS_PER_EDGE ? cell : FS_CELLS_PER_EDGE - 1;
}

static int cell_of(const double direction[3]) {
  const double x = fabs(direction[0]), y = fabs(direction[1]), z = fabs(direction[2]);
  const int axis = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  const double scale = 1 / fabs(direction[axis]);
  const int u = cell_along(direction[(axis + 1) % 3] * scale);
  const int v = cell_along(direction[(axis + 2) % 3] * scale);
  const int face = 2 * axis + (direction[axis] < 0);
  return (face * FS_CELLS_PER_EDGE + u) * FS_CELLS_PER_EDGE + v;
}

// Writes the directions at the corners of a square on a face, followed by the one at its center.
// The face's edges have length 2; its center is at 0, 0.
static void corners_of(int face, double u, double v, double width, double corners[5][3]) {
  static const double offsets[5][2] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {0.5, 0.5}};
  for (int i = 0; i < 5; i++) {
    corners[i][face / 2] = face % 2 ? -1 : 1;
    corners[i][(face / 2 + 1) % 3] = u + offsets[i][0] * width;
    corners[i][(face / 2 + 2) % 3] = v + offsets[i][1] * width;
  }
}

// Writes how far a vertex is in five directions.
static void project(const float* vertex, const double directions[5][3], double projections[5]) {
  const double point[3] = {vertex[0], vertex[1], vertex[2]};
  for (int i = 0; i < 5; i++) projections[i] = fs_dot(directions[i], point);
}

// Writes the vertices that can be the farthest in some direction between the corners, and returns
// their number.
static int candidates_of(const double directions[5][3], double error, const float* vertices,
                         const int* ids, int count, int* candidates) {
  double farthest[5][5], projections[5];
  int best[5] = {0};
  for (int j = 0; j < 5; j++) farthest[j][j] = -HUGE_VAL;
  for (int i = 0; i < count; i++) {
    project(vertices + 3 * ids[i], directions, projections);
    for (int j = 0; j < 5; j++) {
      if (projections[j] > farthest[j][j]) {
        farthest[j][j] = projections[j];
        best[j] = ids[i];
      }
    }
  }
  int found = 0;
  for (int j = 0; j < 5; j++) {
    project(vertices + 3 * best[j], directions, farthest[j]);
    int known = 0;
    for (int i = 0; i < found; i++) known |= candidates[i] == best[j];
    if (!known) candidates[found++] = best[j];
  }
  const int kept = found;
  for (int i = 0; i < count; i++) {
    project(vertices + 3 * ids[i], directions, projections);
    int needed = 1;
    for (int j = 0; j < 5 && needed; j++) {
      int beaten = 1;
      for (int k = 0; k < 4; k++) beaten &= projections[k] <= farthest[j][k] + error;
      needed = !beaten;
    }
    for (int j = 0; j < kept && needed; j++) needed = ids[i] != candidates[j];
    if (needed) candidates[found++] = ids[i];
  }
  return found;
}

// Writes the vertices that MuJoCo's collision routines use, and returns their number: those of the
// convex hull, or all if there is no hull or the mesh is so small that some versions ignore it.
static int colliding_vertices(const mjModel* m, int mesh, int* ids) {
  const int vertices = (int)m->mesh_vertnum[mesh];
  if (m->mesh_graphadr[mesh] < 0 || vertices < 64) {
    for (int i = 0; i < vertices; i++) ids[i] = i;
    return vertices;
  }
  // A graph holds the numbers of vertices and faces, the start of each vertex's edges, the ids of
  // the vertices, ...
  const int* graph = m->mesh_graph + m->mesh_graphadr[mesh];
  memcpy(ids, graph + 2 + graph[0], (size_t)graph[0] * sizeof *ids);
  return graph[0];
}

static int append(fs_hull* hull, int cell, const int* candidates, int count) {
  const int start = hull->start[cell], end = start + count;
  int* longer = realloc(hull->candidates, (size_t)end * sizeof *longer);
  if (!longer) return 0;
  memcpy(longer + start, candidates, (size_t)count * sizeof *longer);
  hull->candidates = longer;
  hull->start[cell + 1] = end;
  return 1;
}

static int make_hull(const mjModel* m, int mesh, fs_hull* hull) {
  const int vertices = (int)m->mesh_vertnum[mesh];
  hull->vertices = (const float*)(m->mesh_vert + 3 * m->mesh_vertadr[mesh]);
  int* ids = malloc(3 * (size_t)vertices * sizeof *ids);
  int sound = ids && vertices > 0;
  const int count = sound ? colliding_vertices(m, mesh, ids) : 0;
  int *of_face = ids + vertices, *of_cell = of_face + vertices, in_face = 0;
  for (int cell = 0; cell < FS_CELLS && sound; cell++) {
    const int v = cell % FS_CELLS_PER_EDGE, u = cell / FS_CELLS_PER_EDGE % FS_CELLS_PER_EDGE;
    const int face = cell / (FS_CELLS_PER_EDGE * FS_CELLS_PER_EDGE);
    const double width = 2.0 / FS_CELLS_PER_EDGE;
    double corners[5][3];
    if (u == 0 && v == 0) {
      corners_of(face, -1, -1, 2, corners);
      in_face = candidates_of(corners, 0, hull->vertices, ids, count, of_face);
    }
    corners_of(face, u * width - 1, v * width - 1, width, corners);
    const int found =
        candidates_of(corners, FS_SUPPORT_ERROR, hull->vertices, of_face, in_face, of_cell);
    sound = append(hull, cell, of_cell, found);
  }
  free(ids);
  return sound;
}

static double hull_radius(const fs_hull* hull) {
  double radius = 0;
  for (int i = 0; i < hull->start[FS_CELLS]; i++) {
    const float* vertex = hull->vertices + 3 * hull->candidates[i];
    const double point[3] = {vertex[0], vertex[1], vertex[2]};
    radius = fmax(radius, sqrt(fs_dot(point, point)));
  }
  return radius + FS_SUPPORT_ERROR;
}

// ------------------------------------------------------------------------------------ the shapes

static void make_shape(const mjModel* m, int geom, const fs_hull* hulls, fs_shape* shape) {
  double* size = shape->size;
  memcpy(size, m->geom_size + 3 * geom, sizeof shape->size);
  shape->type = m->geom_type[geom];
  switch (shape->type) {
    case mjGEOM_PLANE:
      shape->radius = 1e300;  // finite: a plane that does not turn does not move
      break;
    case mjGEOM_SPHERE:
      shape->round = shape->radius = size[0];
      break;
    case mjGEOM_CAPSULE:
      shape->round = size[0];
      shape->radius = size[0] + size[1];
      break;
    case mjGEOM_ELLIPSOID:
      shape->radius = fmax(size[0], fmax(size[1], size[2]));
      break;
    case mjGEOM_CYLINDER:
      shape->radius = hypot(size[0], size[1]);
      break;
    case mjGEOM_BOX:
      shape->radius = sqrt(fs_dot(size, size));
      break;
    case mjGEOM_MESH:
      if (m->geom_dataid[geom] >= 0) {
        shape->hull = hulls + m->geom_dataid[geom];
        shape->radius = hull_radius(shape->hull);
        break;
      }  // fall through
    default:
      shape->type = FS_NO_SHAPE;
  }
}

static int collides(const mjModel* m, int geom) {
  return m->geom_contype[geom] || m->geom_conaffinity[geom];
}

static void number_pairs(const mjModel* m, fs_shapes* shapes) {
  const size_t ngeom = (size_t)shapes->ngeom;
  for (size_t i = 0; i < ngeom; i++) {
    for (size_t j = 0; j <= i; j++) {
      const int may_touch = (m->geom_contype[i] & m->geom_conaffinity[j]) ||
                            (m->geom_contype[j] & m->geom_conaffinity[i]);
      const int known =
          shapes->geoms[i].type != FS_NO_SHAPE && shapes->geoms[j].type != FS_NO_SHAPE;
      const int same_body = m->body_weldid[m->geom_bodyid[i]] == m->body_weldid[m->geom_bodyid[j]];
      shapes->pairs[i * ngeom + j] = shapes->pairs[j * ngeom + i] =
          may_touch && known && !same_body ? shapes->npair++ : -1;
    }
  }
}

fs_shapes* fs_make_shapes(const mjModel* m) {
  fs_shapes* shapes = calloc(1, sizeof *shapes);
  if (!shapes) return NULL;
  shapes->owns_tables = 1;
  shapes->ngeom = (int)m->ngeom;
  shapes->nmesh = (int)m->nmesh;
  shapes->geoms = calloc((size_t)shapes->ngeom + 1, sizeof *shapes->geoms);
  shapes->hulls = calloc((size_t)shapes->nmesh + 1, sizeof *shapes->hulls);
  shapes->pairs = calloc((size_t)shapes->ngeom * shapes->ngeom + 1, sizeof *shapes->pairs);
  int sound = shapes->geoms && shapes->hulls && shapes->pairs;
  for (int geom = 0; geom < shapes->ngeom && sound; geom++) {
    if (!collides(m, geom)) {
      shapes->geoms[geom].type = FS_NO_SHAPE;
      continue;
    }
    const int mesh = m->geom_type[geom] == mjGEOM_MESH ? m->geom_dataid[geom] : -1;
    if (mesh >= 0 && !shapes->hulls[mesh].candidates) {
      sound = make_hull(m, mesh, shapes->hulls + mesh);
    }
    if (sound) make_shape(m, geom, shapes->hulls, shapes->geoms + geom);
  }
  if (sound) {
    number_pairs(m, shapes);
    return shapes;
  }
  fs_delete_shapes(shapes);
  return NULL;
}

fs_shapes* fs_copy_shapes(const fs_shapes* shapes) {
  fs_shapes* copy = malloc(sizeof *copy);
  const size_t size = ((size_t)shapes->ngeom + 1) * sizeof *shapes->geoms;
  fs_shape* geoms = malloc(size);
  if (!copy || !geoms) {
    free(copy);
    free(geoms);
    return NULL;
  }
  memcpy(geoms, shapes->geoms, size);
  *copy = *shapes;
  copy->geoms = geoms;
  copy->owns_tables = 0;
  return copy;
}

void fs_resize_shape(fs_shapes* shapes, const mjModel* m, int geom) {
  if (shapes->geoms[geom].type != FS_NO_SHAPE) make_shape(m, geom, shapes->hulls, shapes->geoms + geom);
}

void fs_delete_shapes(fs_shapes* shapes) {
  for (int mesh = 0; shapes->owns_tables && shapes->hulls && mesh < shapes->nmesh; mesh++) {
    free(shapes->hulls[mesh].candidates);
  }
  if (shapes->owns_tables) {
    free(shapes->hulls);
    free(shapes->pairs);
  }
  free(shapes->geoms);
  free(shapes);
}

// ------------------------------------------------------------------------------------- support

static void hull_support(const fs_hull* hull, const double direction[3], double point[3]) {
  const int cell = cell_of(direction);
  double farthest = -HUGE_VAL;
  const float* best = hull->vertices;
  for (int i = hull->start[cell]; i < hull->start[cell + 1]; i++) {
    const float* vertex = hull->vertices + 3 * hull->candidates[i];
    const double distance =
        direction[0] * vertex[0] + direction[1] * vertex[1] + direction[2] * vertex[2];
    if (distance > farthest) {
      farthest = distance;
      best = vertex;
    }
  }
  for (int i = 0; i < 3; i++) point[i] = best[i];
}

void fs_support(const fs_shape* shape, const double direction[3], double point[3]) {
  const double* size = shape->size;
  switch (shape->type) {
    case mjGEOM_CAPSULE:
      point[0] = point[1] = 0;
      point[2] = copysign(size[1], direction[2]);
      return;
    case mjGEOM_ELLIPSOID: {
      double length = 0;
      for (int i = 0; i < 3; i++) length += size[i] * size[i] * direction[i] * direction[i];
      for (int i = 0; i < 3; i++) point[i] = size[i] * size[i] * direction[i] / sqrt(length);
      return;
    }
    case mjGEOM_CYLINDER: {
      const double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1]);
      const double scale = length > 0 ? size[0] / length : 0;
      point[0] = direction[0] * scale;
      point[1] = direction[1] * scale;
      point[2] = copysign(size[1], direction[2]);
      return;
    }
    case mjGEOM_BOX:
      for (int i = 0; i < 3; i++) point[i] = copysign(size[i], direction[i]);
      return;
    case mjGEOM_MESH:
      hull_support(shape->hull, direction, point);
      return;
    default:  // a sphere's core
      point[0] = point[1] = point[2] = 0;
  }
}

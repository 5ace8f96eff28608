// The contract between the shim and Rust: every number, struct and function that
// src/mujoco/binding/ffi.rs mirrors.
//
// Only the shim knows MuJoCo's structs. It is compiled against the installed headers and hands
// plain pointers and numbers to Rust. Numbers and structs are generated from the lists below, and
// so is the table of fs_contract, which Rust compares with its own before it calls anything else.
//
// Rules that the Rust side relies on:
// - fs_load must succeed before any function except fs_contract, fs_header_version,
//   fs_global_library_path, fs_others_library_path and the two texts is called.
// - A function that returns fs_status may fail, and may run MuJoCo code that fails or warns. Its
//   result is a set of FS_FAILED and FS_WARNED. fs_error_text and fs_warning_text return the texts
//   on the same thread until its next such call.
// - No function keeps a pointer beyond the call, except that a contact filter keeps its shapes and
//   data, and shapes keep their model.

#pragma once

#include <mujoco/mujoco.h>
#include <stddef.h>

// ---------------------------------------------------------------------------- numbers and structs

#define FS_STATUSES(X) X(FS_OK) X(FS_FAILED) X(FS_WARNED)

// Kinds of named objects.
#define FS_OBJECT_KINDS(X)                                                                         \
  X(FS_BODY, mjOBJ_BODY) X(FS_JOINT, mjOBJ_JOINT) X(FS_GEOM, mjOBJ_GEOM) X(FS_SITE, mjOBJ_SITE)    \
  X(FS_CAMERA, mjOBJ_CAMERA)

// MuJoCo has trees of boxes since 2.3.3.
#if mjVERSION_HEADER >= 233
#define FS_BVH_ADDRESSES(X) X(FS_BODY_BVHADR, body_bvhadr, m->nbody)
#define FS_BOXES(X)                                                                                \
  X(FS_GEOM_AABB, m->geom_aabb, 6 * m->ngeom) X(FS_BVH_AABB, m->bvh_aabb, 6 * m->nbvh)
#else
#define FS_BVH_ADDRESSES(X) X(FS_BODY_BVHADR, body_jntadr, 0)
#define FS_BOXES(X) X(FS_GEOM_AABB, NULL, 0) X(FS_BVH_AABB, NULL, 0)
#endif

// Integer arrays of a model, and their lengths.
#define FS_MODEL_ARRAYS(X)                                                                         \
  X(FS_JNT_QPOSADR, jnt_qposadr, m->njnt) X(FS_JNT_DOFADR, jnt_dofadr, m->njnt)                    \
  X(FS_BODY_MOCAPID, body_mocapid, m->nbody) X(FS_BODY_PARENTID, body_parentid, m->nbody)          \
  X(FS_BODY_JNTADR, body_jntadr, m->nbody) X(FS_GEOM_BODYID, geom_bodyid, m->ngeom)                \
  X(FS_SITE_BODYID, site_bodyid, m->nsite)                                                          \
  FS_BVH_ADDRESSES(X) X(FS_EQ_OBJ1ID, eq_obj1id, m->neq) X(FS_EQ_OBJ2ID, eq_obj2id, m->neq)                            \
  X(FS_PAIR_GEOM1, pair_geom1, m->npair) X(FS_PAIR_GEOM2, pair_geom2, m->npair)

// Arrays of a model that a copy of it may change, and their lengths.
#define FS_PHYSICS_ARRAYS(X)                                                                       \
  X(FS_GEOM_SIZE, m->geom_size, 3 * m->ngeom) X(FS_GEOM_RBOUND, m->geom_rbound, m->ngeom)          \
  FS_BOXES(X) X(FS_GEOM_FRICTION, m->geom_friction, 3 * m->ngeom)                                  \
  X(FS_PAIR_FRICTION, m->pair_friction, 5 * m->npair) X(FS_BODY_MASS, m->body_mass, m->nbody)      \
  X(FS_BODY_INERTIA, m->body_inertia, 3 * m->nbody)                                                \
  X(FS_BODY_SUBTREEMASS, m->body_subtreemass, m->nbody)                                            \
  X(FS_BODY_INVWEIGHT, m->body_invweight0, 2 * m->nbody)                                           \
  X(FS_DOF_INVWEIGHT, m->dof_invweight0, m->nv) X(FS_DOF_DAMPING, m->dof_damping, m->nv)           \
  X(FS_DOF_M0, m->dof_M0, m->nv) X(FS_EQ_SOLREF, m->eq_solref, mjNREF * m->neq)                    \
  X(FS_ACTUATOR_GAINPRM, m->actuator_gainprm, mjNGAIN * m->nu)                                     \
  X(FS_ACTUATOR_BIASPRM, m->actuator_biasprm, mjNBIAS * m->nu)                                     \
  X(FS_GRAVITY, m->opt.gravity, 3) X(FS_MEANINERTIA, &m->stat.meaninertia, 1)

// Arrays of a simulation's data, and their lengths.
#define FS_DATA_ARRAYS(X)                                                                          \
  X(FS_QPOS, qpos, m->nq) X(FS_QVEL, qvel, m->nv) X(FS_CTRL, ctrl, m->nu)                          \
  X(FS_MOCAP_POS, mocap_pos, 3 * m->nmocap) X(FS_MOCAP_QUAT, mocap_quat, 4 * m->nmocap)            \
  X(FS_QACC_WARMSTART, qacc_warmstart, m->nv) X(FS_XPOS, xpos, 3 * m->nbody)                       \
  X(FS_XQUAT, xquat, 4 * m->nbody) X(FS_XMAT, xmat, 9 * m->nbody)                                  \
  X(FS_SITE_XPOS, site_xpos, 3 * m->nsite) X(FS_SITE_XMAT, site_xmat, 9 * m->nsite)    \
  X(FS_ACT, act, m->na)

// Warnings that MuJoCo counts and that make a simulation useless.
#define FS_FAULTS(X)                                                                               \
  X(FS_BAD_INERTIA, mjWARN_INERTIA) X(FS_CONTACTS_FULL, mjWARN_CONTACTFULL)                        \
  X(FS_CONSTRAINTS_FULL, mjWARN_CNSTRFULL) X(FS_BAD_QPOS, mjWARN_BADQPOS)                          \
  X(FS_BAD_QVEL, mjWARN_BADQVEL) X(FS_BAD_QACC, mjWARN_BADQACC) X(FS_BAD_CTRL, mjWARN_BADCTRL)

// Shapes of visible geoms.
#define FS_KNOWN_SHAPES(X)                                                                         \
  X(FS_PLANE, mjGEOM_PLANE) X(FS_SPHERE, mjGEOM_SPHERE) X(FS_CAPSULE, mjGEOM_CAPSULE)              \
  X(FS_ELLIPSOID, mjGEOM_ELLIPSOID) X(FS_CYLINDER, mjGEOM_CYLINDER) X(FS_BOX, mjGEOM_BOX)          \
  X(FS_MESH, mjGEOM_MESH)
#define FS_SHAPES(X) FS_KNOWN_SHAPES(X) X(FS_OTHER_SHAPE)

// The kind of object that a pixel shows.
#define FS_SEGMENTS(X) X(FS_BACKGROUND) X(FS_SEGMENT_GEOM) X(FS_SEGMENT_SITE) X(FS_SEGMENT_OTHER)

#define FS_ENUMERATOR(name, ...) name,
enum { FS_STATUSES(FS_ENUMERATOR) };
enum { FS_OBJECT_KINDS(FS_ENUMERATOR) };
enum { FS_MODEL_ARRAYS(FS_ENUMERATOR) };
enum { FS_PHYSICS_ARRAYS(FS_ENUMERATOR) FS_NUM_PHYSICS_ARRAYS };
enum { FS_DATA_ARRAYS(FS_ENUMERATOR) FS_NUM_DATA_ARRAYS };
enum { FS_FAULTS(FS_ENUMERATOR) };
enum { FS_SHAPES(FS_ENUMERATOR) };
enum { FS_SEGMENTS(FS_ENUMERATOR) };
#define FS_NUMBERS(X)                                                                              \
  FS_STATUSES(X) FS_OBJECT_KINDS(X) FS_MODEL_ARRAYS(X) FS_PHYSICS_ARRAYS(X)                        \
  X(FS_NUM_PHYSICS_ARRAYS) FS_DATA_ARRAYS(X) X(FS_NUM_DATA_ARRAYS) FS_FAULTS(X) FS_SHAPES(X) FS_SEGMENTS(X)

// Sizes of a model.
#define FS_COUNTS(X, s)                                                                            \
  X(s, int, nq) X(s, int, nv) X(s, int, nu) X(s, int, nbody) X(s, int, njnt) X(s, int, ngeom)      \
  X(s, int, nsite) X(s, int, ncam) X(s, int, nmocap)
#define FS_SIZES(X, s) FS_COUNTS(X, s) X(s, double, timestep)

// A geom as a viewer shows it: its pose is in its body's frame.
#define FS_VISUAL_GEOM(X, s)                                                                       \
  X(s, int, shape) X(s, int, group) X(s, int, body) X(s, int, ntriangle) X(s, float, rgba, [4])    \
  X(s, double, size, [3]) X(s, double, position, [3]) X(s, double, orientation, [4])

// The pairs of geoms that passed MuJoCo's own filters, those of them that the contact filter
// rejected, the rejections that were checked, and those of them that MuJoCo's routine contradicted.
#define FS_FILTER_COUNTS(X, s)                                                                     \
  X(s, unsigned long long, pairs) X(s, unsigned long long, rejected)                               \
  X(s, unsigned long long, checked) X(s, unsigned long long, refuted)

#define FS_ARRAY(X, s) X(s, double*, first) X(s, size_t, len)

#define FS_SEGMENT(X, s) X(s, int, kind) X(s, int, id)

// Positions, 3 numbers each, at which a picture shows copies of a site, or spheres of a color if the
// id is -1.
#define FS_GOALS(X, s)                                                                             \
  X(s, int, site) X(s, int, count) X(s, float, color, [3]) X(s, const double*, positions)

// How a picture shows the object of a segment's kind: its color where that is not NaN, and the scale of
// its size, or 0 to hide it.
#define FS_LOOK(X, s)                                                                              \
  X(s, int, kind) X(s, int, id) X(s, float, color, [3]) X(s, float, scale)

// What a picture shows otherwise than the model: some objects; where the light comes from (azimuth and
// elevation in radians) and its intensity, where they are not NaN; the displacement of the camera to
// its right, up and forward (meters), its turn to the left and up (radians), and the scale of what it
// sees.
#define FS_LOOKS(X, s)                                                                             \
  X(s, const fs_look*, objects) X(s, int, count) X(s, double, light, [3]) X(s, double, moved, [3]) \
  X(s, double, turned, [2]) X(s, double, field)

#define FS_STRUCTS(X)                                                                              \
  X(fs_sizes, FS_SIZES) X(fs_visual_geom, FS_VISUAL_GEOM) X(fs_filter_counts, FS_FILTER_COUNTS)    \
  X(fs_array, FS_ARRAY) X(fs_segment, FS_SEGMENT) X(fs_goals, FS_GOALS) X(fs_look, FS_LOOK)        \
  X(fs_looks, FS_LOOKS)
#define FS_FIELD(s, type, name, ...) type name __VA_ARGS__;
#define FS_STRUCT(s, FIELDS) typedef struct { FIELDS(FS_FIELD, s) } s;
FS_STRUCTS(FS_STRUCT)

typedef int fs_status;
typedef struct fs_shapes fs_shapes;      // see shapes.h
typedef struct fs_filter fs_filter;      // see contact_filter.c
typedef struct fs_renderer fs_renderer;  // see render.c

// --------------------------------------------------------------------------------------- loading

// Describes an item of the contract: a number (its value and size), a struct (0 and its size) or a
// field of one (its offset and size). Returns 0 if the index is past the last item.
int fs_contract(int index, const char** name, long long* value, size_t* size);

// Returns the version of the headers, numbered as mj_version numbers the library's.
int fs_header_version(void);

// Loads MuJoCo from a path. After a failure, nothing of it stays loaded, and another path may be
// tried; after a success, no other may be. *version is the library's, or 0 if the library cannot be
// opened at all.
fs_status fs_load(const char* path, int* version);
// The paths of the next three are valid until the next call of one of them on the same thread.

// Returns the path from which MuJoCo was loaded, or NULL if the system does not know it.
const char* fs_library_path(void);
// Returns the path of the MuJoCo that other code loaded for the whole process, or NULL if none did.
const char* fs_global_library_path(void);
// Returns the path of the MuJoCo of this name that other code loaded for a part of the process
// alone, or NULL if none did.
const char* fs_others_library_path(const char* name);
// Opens a plugin of the loaded library, whose name in the system is `library_name`. It fails, and the
// library stays as it was, if the plugin cannot be opened or registered.
fs_status fs_load_plugin(const char* path, const char* library_name);

const char* fs_error_text(void);
const char* fs_warning_text(void);

// ---------------------------------------------------------------------------------------- models

// Compiles the MJCF file at a path.
fs_status fs_load_path(const char* path, mjModel** model);
// Compiles the first of `count` files held in memory; it may include the others by name.
fs_status fs_load_files(const char* const* names, const char* const* bytes, const int* sizes,
                        int count, mjModel** model);
// Copies a model, which does not change.
fs_status fs_copy_model(const mjModel* m, mjModel** copy);
void fs_delete_model(mjModel* m);
void fs_model_sizes(const mjModel* m, fs_sizes* sizes);

// Writes the id of a named object of a kind, or -1.
fs_status fs_name_to_id(const mjModel* m, int kind, const char* name, int* id);
// Writes the name of an object, or NULL. Valid as long as the model.
fs_status fs_id_to_name(const mjModel* m, int kind, int id, const char** name);
// Returns the joint that an actuator drives, or -1 if it drives something else.
int fs_actuator_joint(const mjModel* m, int actuator);
// Returns an array of the model, and its length. Valid as long as the model.
const int* fs_model_array(const mjModel* m, int array, int* len);

// Writes the arrays of a model that may change, which keep their places as long as it lives. The
// address of an empty array may be NULL.
void fs_physics_arrays(mjModel* m, fs_array arrays[FS_NUM_PHYSICS_ARRAYS]);

// Overwrites the first `count` numbers of the data of every weld of a body.
void fs_set_weld_data(mjModel* m, int body, const double* values, int count);
// Lowers the number of constraints and of stack entries (8 bytes each) for which every mjData of
// 2.x reserves memory. Later versions allocate as needed.
void fs_limit_sizes(mjModel* m, int njmax, int nstack);
// Makes the collision search test each pair of geoms of two bodies that are near each other, as 2.x
// always does, instead of searching trees of boxes. It finds the same contacts; where two bodies
// touch by several pairs of geoms, in the order of 2.x.
void fs_disable_midphase(mjModel* m);

// Returns the shape of the geom of an id below `ngeom`.
int fs_geom_shape(const mjModel* m, int geom);
// Describes the geom of an id below `ngeom`.
void fs_get_visual_geom(const mjModel* m, int geom, fs_visual_geom* out);
// Writes the corners of a triangle of a geom's mesh, in the geom's frame; the number of the
// triangle is below `ntriangle`.
void fs_get_triangle(const mjModel* m, int geom, int triangle, double corners[3][3]);

// ------------------------------------------------------------------------------------------ data

fs_status fs_make_data(const mjModel* m, mjData** data);
void fs_delete_data(mjData* d);
fs_status fs_reset(const mjModel* m, mjData* d);
// Both use a contact filter, or none if it is NULL.
fs_status fs_forward(const mjModel* m, mjData* d, fs_filter* filter);
fs_status fs_step(const mjModel* m, mjData* d, fs_filter* filter, int count);

// Write the Jacobians, 3 x nv each, of a site and of a body's frame, at the positions last computed.
fs_status fs_site_jacobian(const mjModel* m, const mjData* d, int site, double* translation,
                           double* rotation);
fs_status fs_body_jacobian(const mjModel* m, const mjData* d, int body, double* translation,
                           double* rotation);
double fs_time(const mjData* d);
void fs_set_time(mjData* d, double time);
// Writes the arrays of the data, which keep their places as long as it lives. The address of an empty
// array may be NULL.
void fs_data_arrays(const mjModel* m, const mjData* d, fs_array arrays[FS_NUM_DATA_ARRAYS]);
int fs_contact_count(const mjData* d);
void fs_contact_geoms(const mjData* d, int contact, int geoms[2]);
// Returns how often a fault was counted since the last reset.
int fs_fault_count(const mjData* d, int fault);

// ------------------------------------------------------------------------------- contact filters

// Returns the shapes of a model, which must outlive them, or NULL if memory runs out.
fs_shapes* fs_make_shapes(const mjModel* m);
// Returns the shapes of a copy of their model, which must not outlive them, or NULL if memory runs out.
fs_shapes* fs_copy_shapes(const fs_shapes* shapes);
// Computes the shape of a geom again whose sizes in the model have changed.
void fs_resize_shape(fs_shapes* shapes, const mjModel* m, int geom);
void fs_delete_shapes(fs_shapes* shapes);

// Returns a filter for one simulation, or NULL if memory runs out. The shapes must outlive it.
fs_filter* fs_make_filter(const fs_shapes* shapes, const mjData* d);
void fs_delete_filter(fs_filter* filter);
// Gives a filter the shapes of a copy of its model, which must outlive it, or its own ones again after
// they have changed.
void fs_set_filter_shapes(fs_filter* filter, const fs_shapes* shapes);
// Sets whether every rejection is checked against MuJoCo's own collision routine.
void fs_check_filter(fs_filter* filter, int check);
void fs_get_filter_counts(const fs_filter* filter, fs_filter_counts* counts);

// --------------------------------------------------------------------------- rendering (optional)

// These need the feature `render`. Any thread may use and delete a renderer, one at a time. The
// thread's own OpenGL context is current afterwards as it was before. None of these functions changes
// a model or data, except fs_prepare_model and fs_place.

// Returns the name of the OpenGL library chosen for the process, or NULL if none has been.
const char* fs_gl_backend(void);

// Sets what a renderer reads from its model when it is made.
void fs_prepare_model(mjModel* m, int width, int height, int samples);
// Computes what is drawn from the positions in `d`: no velocities, forces or contacts.
fs_status fs_place(const mjModel* m, mjData* d);

// Makes a renderer of a prepared model. *renderer is NULL after FS_FAILED: *has_gl is then 0 if
// there is no OpenGL, and 1 if MuJoCo cannot use it.
fs_status fs_make_renderer(const mjModel* m, fs_renderer** renderer, int* has_gl);
void fs_delete_renderer(fs_renderer* r);

// Selects a free camera, given the point at which it looks and its distance (meters), its azimuth and
// its elevation (degrees).
void fs_set_free_camera(fs_renderer* r, const double numbers[6]);
// Selects a camera of the model.
void fs_set_fixed_camera(fs_renderer* r, int id);

// Draws placed data, which does not change, with more spheres for goals and with looks, which may be
// NULL, and reads the picture: width x height pixels, the bottom row first. `rgb` and `depth` (from 0,
// near, to 1, far) may be NULL. With `segments` a pixel's number, red + 256 green + 65536 blue, is 0 for
// the background, and otherwise 1 + the index of its object in fs_segments.
fs_status fs_draw(fs_renderer* r, const mjModel* m, const mjData* d, const fs_goals* goals,
                  const fs_looks* looks, int segments, unsigned char* rgb, float* depth);
// Writes the distances of the near and the far plane in the last picture (meters), and returns whether
// its camera projects in parallel.
int fs_planes(const fs_renderer* r, float planes[2]);
// Writes the objects of the last picture, by index; returns how many there may be.
int fs_segments(const fs_renderer* r, fs_segment* segments, int size);

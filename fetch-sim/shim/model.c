// Models: compiling, looking up, the few changes made before a model is shared, and what it shows.

#include <string.h>

#include "internal.h"

// ------------------------------------------------------------------------------------- compiling

static fs_status make_vfs(mjVFS** vfs) {
  *vfs = NULL;
  FS_GUARDED(NULL, {
    *vfs = mj->mju_malloc(sizeof **vfs);  // 2 MB in 2.x: too large for a stack
    if (!*vfs) fs_on_error("no memory for the model's files");
    mj->mj_defaultVFS(*vfs);
  });
}

static void delete_vfs(mjVFS* vfs) {
  FS_RELEASE({
    mj->mj_deleteVFS(vfs);
    mj->mju_free(vfs);
  });
}

// Returns 0 if the file system refuses the file.
static int put(const fs_functions* mj, mjVFS* vfs, const char* name, const char* bytes, int size) {
#ifdef mjMAXVFS
  if (mj->mj_makeEmptyFileVFS(vfs, name, size) != 0) return 0;
  const int index = mj->mj_findFileVFS(vfs, name);
  if (index >= 0) memcpy(vfs->filedata[index], bytes, (size_t)size);
  return index >= 0;
#else
  return mj->mj_addBufferVFS(vfs, name, bytes, size) == 0;
#endif
}

static fs_status add_file(mjVFS* vfs, const char* name, const char* bytes, int size) {
  FS_GUARDED(NULL, if (!put(mj, vfs, name, bytes, size)) fs_on_error("a file has no name, or that of another"));
}

static fs_status load(const char* name, const mjVFS* vfs, mjModel** model) {
  // The compiler writes its message, a warning or an error, into this buffer.
  static _Thread_local char message[1024];
  message[0] = '\0';
  *model = NULL;
  FS_GUARDED(NULL, {
    *model = mj->mj_loadXML(name, vfs, message, sizeof message);
    if (!*model) fs_on_error(message);
    if (message[0]) fs_on_warning(message);
  });
}

fs_status fs_load_path(const char* path, mjModel** model) { return load(path, NULL, model); }

fs_status fs_load_files(const char* const* names, const char* const* bytes, const int* sizes,
                        int count, mjModel** model) {
  *model = NULL;
#ifdef mjMAXVFS
  const int most = mjMAXVFS - 1;  // the table is full one short of its size
  if (count > most) return fs_fail("it has %d files, and this version of MuJoCo takes at most %d", count, most);
#endif
  mjVFS* vfs;
  fs_status status = make_vfs(&vfs);
  for (int i = 0; i < count && !(status & FS_FAILED); i++) {
    status = add_file(vfs, names[i], bytes[i], sizes[i]);
  }
  if (!(status & FS_FAILED)) status = load(names[0], vfs, model);
  if (vfs) delete_vfs(vfs);
  return status;
}

fs_status fs_copy_model(const mjModel* m, mjModel** copy) {
  *copy = NULL;
  FS_GUARDED(NULL, {
    *copy = mj->mj_copyModel(NULL, m);
    if (!*copy) fs_on_error("no memory for a copy of the model");
  });
}

void fs_delete_model(mjModel* m) { FS_RELEASE(mj->mj_deleteModel(m)); }

// ------------------------------------------------------------------------------------ looking up

void fs_model_sizes(const mjModel* m, fs_sizes* sizes) {
#define X(s, type, name) sizes->name = (type)m->name;
  FS_COUNTS(X, fs_sizes)
#undef X
  sizes->timestep = m->opt.timestep;
}

#define MUJOCO_NUMBER(number, mujoco_number) mujoco_number,
static const int object_types[] = {FS_OBJECT_KINDS(MUJOCO_NUMBER)};

fs_status fs_name_to_id(const mjModel* m, int kind, const char* name, int* id) {
  *id = -1;
  FS_GUARDED(NULL, *id = mj->mj_name2id(m, object_types[kind], name));
}

fs_status fs_id_to_name(const mjModel* m, int kind, int id, const char** name) {
  *name = NULL;
  FS_GUARDED(NULL, *name = mj->mj_id2name(m, object_types[kind], id));
}

int fs_actuator_joint(const mjModel* m, int actuator) {
  const int kind = m->actuator_trntype[actuator];
  const int drives_joint = kind == mjTRN_JOINT || kind == mjTRN_JOINTINPARENT;
  return drives_joint ? m->actuator_trnid[2 * actuator] : -1;
}

const int* fs_model_array(const mjModel* m, int array, int* len) {
  switch (array) {
#define X(number, field, length) case number: *len = (int)(length); return m->field;
    FS_MODEL_ARRAYS(X)
#undef X
    default: *len = 0; return NULL;
  }
}

// ---------------------------------------------------------------------------------------- changes

void fs_physics_arrays(mjModel* m, fs_array arrays[FS_NUM_PHYSICS_ARRAYS]) {
#define X(number, array, length) arrays[number] = (fs_array){array, (size_t)(length)};
  FS_PHYSICS_ARRAYS(X)
#undef X
}

void fs_set_weld_data(mjModel* m, int body, const double* values, int count) {
  for (int i = 0; i < (int)m->neq; i++) {
    if (m->eq_type[i] != mjEQ_WELD) continue;
    const int welded = m->eq_obj1id[i] == body || m->eq_obj2id[i] == body;
    if (welded) memcpy(m->eq_data + mjNEQDATA * i, values, (size_t)count * sizeof *values);
  }
}

void fs_limit_sizes(mjModel* m, int njmax, int nstack) {
#if mjVERSION_HEADER < 300
  if (m->njmax > njmax) m->njmax = njmax;
  if (m->nstack > nstack) m->nstack = nstack;
#else
  (void)m, (void)njmax, (void)nstack;
#endif
}

void fs_disable_midphase(mjModel* m) {
#if mjVERSION_HEADER >= 300
  m->opt.disableflags |= mjDSBL_MIDPHASE;
#else
  (void)m;
#endif
}

// ----------------------------------------------------------------------------------- what it shows

static int visual_shape(int type) {
  switch (type) {
#define X(number, mujoco_number) case mujoco_number: return number;
    FS_KNOWN_SHAPES(X)
#undef X
    default: return FS_OTHER_SHAPE;
  }
}

int fs_geom_shape(const mjModel* m, int geom) { return visual_shape(m->geom_type[geom]); }

void fs_get_visual_geom(const mjModel* m, int geom, fs_visual_geom* out) {
  static const float unset[4] = {0.5f, 0.5f, 0.5f, 1.0f};
  out->shape = visual_shape(m->geom_type[geom]);
  out->group = m->geom_group[geom];
  out->body = m->geom_bodyid[geom];
  out->ntriangle = out->shape == FS_MESH ? m->mesh_facenum[m->geom_dataid[geom]] : 0;
  memcpy(out->size, m->geom_size + 3 * geom, sizeof out->size);
  memcpy(out->position, m->geom_pos + 3 * geom, sizeof out->position);
  memcpy(out->orientation, m->geom_quat + 4 * geom, sizeof out->orientation);
  // As in MuJoCo's renderer, a geom's own color overrides its material's.
  const float* rgba = m->geom_rgba + 4 * geom;
  const int material = m->geom_matid[geom];
  if (material >= 0 && memcmp(rgba, unset, sizeof unset) == 0) rgba = m->mat_rgba + 4 * material;
  memcpy(out->rgba, rgba, sizeof out->rgba);
}

void fs_get_triangle(const mjModel* m, int geom, int triangle, double corners[3][3]) {
  const int mesh = m->geom_dataid[geom];
  const int* vertices = m->mesh_face + 3 * (m->mesh_faceadr[mesh] + triangle);
  for (int i = 0; i < 3; i++) {
    const float* vertex = m->mesh_vert + 3 * (m->mesh_vertadr[mesh] + vertices[i]);
    for (int axis = 0; axis < 3; axis++) corners[i][axis] = vertex[axis];
  }
}

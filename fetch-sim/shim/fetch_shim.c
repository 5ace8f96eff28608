// The only code that knows the layout of MuJoCo's structs. It is compiled against the installed
// headers, and hands plain pointers and numbers to Rust.
//
// Rules that the Rust side relies on:
// - fs_load must have succeeded before any other function is called.
// - A function that returns int may run MuJoCo code that fails. It returns a set of FS_* flags;
//   the texts stay readable on the same thread, through fs_error_text and fs_warning_text, until
//   its next such call.
// - Nothing here keeps a pointer beyond the call.

#include <dlfcn.h>
#include <mujoco/mujoco.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "contact_filter.h"
#include "fetch_shim.h"

enum { FS_TEXT_SIZE = 1024 };

// ---------------------------------------------------------------- the library, loaded at run time

// MuJoCo's own bindings use these thread-local hooks too: other users of MuJoCo in the process
// keep their handlers. They are exported since 2.2, but are in no public header.
#if mjVERSION_HEADER >= 3010000  // one handler for messages of all levels
#define FS_HOOKS(X) X(mjfLogHandler, exchange_handler, (mjfLogHandler), "_mjPRIVATE_setTlsLogHandler")
#else
typedef void (*fs_handler)(const char*);
#define FS_HOOKS(X)                                                                                \
  X(fs_handler, get_error_handler, (void), "_mjPRIVATE__get_tls_error_fn")                         \
  X(void, set_error_handler, (fs_handler), "_mjPRIVATE__set_tls_error_fn")                         \
  X(fs_handler, get_warning_handler, (void), "_mjPRIVATE__get_tls_warning_fn")                     \
  X(void, set_warning_handler, (fs_handler), "_mjPRIVATE__set_tls_warning_fn")
#endif

#define FS_COMMON_FUNCTIONS(X)                                                                     \
  X(mj_version) X(mj_versionString) X(mj_defaultVFS) X(mj_deleteVFS) X(mj_loadXML)                 \
  X(mj_deleteModel) X(mj_makeData) X(mj_deleteData) X(mj_resetData) X(mj_step) X(mj_forward)       \
  X(mj_jacSite) X(mj_name2id) X(mj_id2name) X(mju_malloc) X(mju_free)

#ifdef mjMAXVFS  // until 3.1: a table of fixed size, filled in by the user
#define FS_VFS_FUNCTIONS(X) X(mj_makeEmptyFileVFS) X(mj_findFileVFS)
#else
#define FS_VFS_FUNCTIONS(X) X(mj_addBufferVFS)
#endif

#define FS_FUNCTIONS(X) FS_COMMON_FUNCTIONS(X) FS_VFS_FUNCTIONS(X)

static struct {
#define X(name) __typeof__(&name) name;
  FS_FUNCTIONS(X)
#undef X
#define X(result, field, arguments, name) result (*field) arguments;
  FS_HOOKS(X)
#undef X
} mj;

void* fs_mujoco;

int fs_symbol(void* library, const char* name, void* target) {
  void* symbol = dlsym(library, name);
  memcpy(target, &symbol, sizeof symbol);
  return symbol != NULL;
}

// The version of the headers, as mj_version gives that of the library.
int fs_header_version(void) { return mjVERSION_HEADER; }

// Loads the library once for the process. On failure writes a reason; *version is 0 if the library
// could not be opened at all, and its version otherwise. `plugins` is NULL or a folder of plugins:
// late 3.x versions read mesh files through them.
int fs_load(const char* path, const char* plugins, int* version, char* reason, size_t reason_size) {
  *version = 0;
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    snprintf(reason, reason_size, "%s", dlerror());
    return FS_FAILED;
  }
  if (!fs_symbol(library, "mj_version", &mj.mj_version)) {
    snprintf(reason, reason_size, "%s has no function mj_version", path);
    return FS_FAILED;
  }
  *version = mj.mj_version();
  if (*version != mjVERSION_HEADER) {
    snprintf(reason, reason_size, "the versions differ");
    return FS_FAILED;
  }
  const char* missing = NULL;
#define X(name) if (!fs_symbol(library, #name, &mj.name)) missing = #name;
  FS_FUNCTIONS(X)
#undef X
#define X(result, field, arguments, name) if (!fs_symbol(library, name, &mj.field)) missing = name;
  FS_HOOKS(X)
#undef X
  if (missing) {
    snprintf(reason, reason_size, "%s has no function %s", path, missing);
    return FS_FAILED;
  }
  void (*load_plugins)(const char*, void*);
  if (plugins && fs_symbol(library, "mj_loadAllPluginLibraries", &load_plugins)) {
    load_plugins(plugins, NULL);
  }
  fs_mujoco = library;
  fs_install_filter(library);
  return FS_OK;
}

// ------------------------------------------------------------------------------ errors, warnings

static _Thread_local jmp_buf fs_after_error;
static _Thread_local char fs_error[FS_TEXT_SIZE];
static _Thread_local char fs_warning[FS_TEXT_SIZE];

const char* fs_error_text(void) { return fs_error; }
const char* fs_warning_text(void) { return fs_warning; }

static void fs_on_error(const char* message) {
  snprintf(fs_error, sizeof fs_error, "%s", message);
  longjmp(fs_after_error, 1);
}

static void fs_on_warning(const char* message) {
  size_t used = strlen(fs_warning);
  snprintf(fs_warning + used, sizeof fs_warning - used, "%s%s", used ? "; " : "", message);
}

#if mjVERSION_HEADER >= 3010000
typedef mjfLogHandler fs_handlers;

static void fs_on_message(const mjLogMessage* message) {
  if (message->level == mjLOG_ERROR) fs_on_error(message->subject);
  if (message->level == mjLOG_WARNING) fs_on_warning(message->subject);
}

static const fs_handlers fs_our_handlers = fs_on_message;

static fs_handlers fs_exchange_handlers(fs_handlers handlers) {
  return mj.exchange_handler(handlers);
}
#else
typedef struct {
  fs_handler error, warning;
} fs_handlers;

static const fs_handlers fs_our_handlers = {fs_on_error, fs_on_warning};

static fs_handlers fs_exchange_handlers(fs_handlers handlers) {
  const fs_handlers before = {mj.get_error_handler(), mj.get_warning_handler()};
  mj.set_error_handler(handlers.error);
  mj.set_warning_handler(handlers.warning);
  return before;
}
#endif

// Runs a statement of MuJoCo calls with this thread's handlers and a contact filter (or NULL) in
// place. mju_error must not return, so its handler jumps back to here; only frames of MuJoCo, and of
// the filter between them, lie in between.
#define FS_GUARDED(filter, statement)                                                              \
  do {                                                                                             \
    fs_filter* const outer_filter = fs_use_filter(filter);                                         \
    const fs_handlers outer_handlers = fs_exchange_handlers(fs_our_handlers);                      \
    volatile int failed = FS_OK;                                                                   \
    fs_error[0] = fs_warning[0] = '\0';                                                            \
    if (setjmp(fs_after_error) == 0) {                                                             \
      statement;                                                                                   \
    } else {                                                                                       \
      failed = FS_FAILED;                                                                          \
    }                                                                                              \
    fs_use_filter(outer_filter);                                                                   \
    fs_exchange_handlers(outer_handlers);                                                          \
    return failed | (fs_warning[0] ? FS_WARNED : FS_OK);                                           \
  } while (0)

int fs_guarded(void (*body)(void*), void* argument) { FS_GUARDED(NULL, body(argument)); }

// ----------------------------------------------------------------------------------------- models

int fs_fail(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(fs_error, sizeof fs_error, format, arguments);
  va_end(arguments);
  return FS_FAILED;
}

static int fs_add_file(mjVFS* vfs, const char* name, const char* bytes, int size) {
#ifdef mjMAXVFS
  int status = mj.mj_makeEmptyFileVFS(vfs, name, size);
  if (status == 0) memcpy(vfs->filedata[mj.mj_findFileVFS(vfs, name)], bytes, (size_t)size);
  return status;
#else
  return mj.mj_addBufferVFS(vfs, name, bytes, size);
#endif
}

static int fs_guarded_load(const char* name, const mjVFS* vfs, mjModel** model) {
  // The compiler's message goes to a buffer of its own: warnings land there as well.
  static _Thread_local char message[FS_TEXT_SIZE];
  message[0] = '\0';
  *model = NULL;
  FS_GUARDED(NULL, {
    *model = mj.mj_loadXML(name, vfs, message, sizeof message);
    if (!*model) fs_on_error(message);
    if (message[0]) fs_on_warning(message);
  });
}

// Compiles the MJCF file at a path.
int fs_load_path(const char* path, mjModel** model) { return fs_guarded_load(path, NULL, model); }

// Compiles the first of `count` files held in memory; it may include the others by name.
int fs_load_files(const char* const* names, const char* const* bytes, const int* sizes, int count,
                  mjModel** model) {
  *model = NULL;
  fs_warning[0] = '\0';
  mjVFS* vfs = mj.mju_malloc(sizeof(mjVFS));  // too large for a stack in 2.x: 2 MB
  if (!vfs) return fs_fail("no memory for the model's files");
  mj.mj_defaultVFS(vfs);
  int status = FS_OK;
  for (int i = 0; i < count && status == FS_OK; i++) {
    if (fs_add_file(vfs, names[i], bytes[i], sizes[i]) != 0) {
      status = fs_fail("the file %s could not be added", names[i]);
    }
  }
  if (status == FS_OK) status = fs_guarded_load(names[0], vfs, model);
  mj.mj_deleteVFS(vfs);
  mj.mju_free(vfs);
  return status;
}

void fs_delete_model(mjModel* model) { mj.mj_deleteModel(model); }

typedef struct {
  int nq, nv, nu, nbody, njnt, ngeom, nsite, nmocap;
  double timestep;
} fs_sizes;

void fs_model_sizes(const mjModel* m, fs_sizes* sizes) {
  *sizes = (fs_sizes){
      .nq = (int)m->nq, .nv = (int)m->nv, .nu = (int)m->nu, .nbody = (int)m->nbody,
      .njnt = (int)m->njnt, .ngeom = (int)m->ngeom, .nsite = (int)m->nsite,
      .nmocap = (int)m->nmocap, .timestep = m->opt.timestep,
  };
}

static const int fs_object_types[] = {mjOBJ_BODY, mjOBJ_JOINT, mjOBJ_GEOM, mjOBJ_SITE};

// The id of a named object, or -1. `kind` indexes fs_object_types.
int fs_name_to_id(const mjModel* m, int kind, const char* name) {
  return mj.mj_name2id(m, fs_object_types[kind], name);
}

// The name of an object, or NULL. Valid as long as the model.
const char* fs_id_to_name(const mjModel* m, int kind, int id) {
  return mj.mj_id2name(m, fs_object_types[kind], id);
}

enum {
  FS_JNT_QPOSADR, FS_JNT_DOFADR, FS_BODY_MOCAPID, FS_BODY_PARENTID, FS_GEOM_BODYID,
  FS_ACTUATOR_TRNID
};

// An array of the model. Valid as long as the model.
const int* fs_model_field(const mjModel* m, int field) {
  switch (field) {
    case FS_JNT_QPOSADR: return m->jnt_qposadr;
    case FS_JNT_DOFADR: return m->jnt_dofadr;
    case FS_BODY_MOCAPID: return m->body_mocapid;
    case FS_BODY_PARENTID: return m->body_parentid;
    case FS_GEOM_BODYID: return m->geom_bodyid;
    case FS_ACTUATOR_TRNID: return m->actuator_trnid;
    default: return NULL;
  }
}

// ------------------------------------------------------------------------------------------- data

int fs_make_data(const mjModel* m, mjData** data) {
  *data = NULL;
  FS_GUARDED(NULL, {
    *data = mj.mj_makeData(m);
    if (!*data) fs_on_error("no memory for the simulation's data");
  });
}

void fs_delete_data(mjData* d) { mj.mj_deleteData(d); }

int fs_reset(const mjModel* m, mjData* d) { FS_GUARDED(NULL, mj.mj_resetData(m, d)); }
int fs_forward(const mjModel* m, mjData* d, fs_filter* filter) {
  FS_GUARDED(filter, mj.mj_forward(m, d));
}
int fs_step(const mjModel* m, mjData* d, fs_filter* filter, int count) {
  FS_GUARDED(filter, for (int i = 0; i < count; i++) mj.mj_step(m, d));
}

// Site Jacobians, 3 x nv each, at the positions last computed.
void fs_site_jacobian(const mjModel* m, const mjData* d, int site, double* translation,
                      double* rotation) {
  mj.mj_jacSite(m, d, translation, rotation, site);
}

double fs_time(const mjData* d) { return d->time; }
void fs_set_time(mjData* d, double time) { d->time = time; }

enum {
  FS_QPOS, FS_QVEL, FS_CTRL, FS_MOCAP_POS, FS_MOCAP_QUAT, FS_QACC_WARMSTART, FS_XPOS, FS_XQUAT,
  FS_SITE_XPOS, FS_SITE_XMAT
};

// The array of a field. Valid as long as the data.
double* fs_data_field(const mjData* d, int field) {
  switch (field) {
    case FS_QPOS: return d->qpos;
    case FS_QVEL: return d->qvel;
    case FS_CTRL: return d->ctrl;
    case FS_MOCAP_POS: return d->mocap_pos;
    case FS_MOCAP_QUAT: return d->mocap_quat;
    case FS_QACC_WARMSTART: return d->qacc_warmstart;
    case FS_XPOS: return d->xpos;
    case FS_XQUAT: return d->xquat;
    case FS_SITE_XPOS: return d->site_xpos;
    case FS_SITE_XMAT: return d->site_xmat;
    default: return NULL;
  }
}

int fs_constraint_count(const mjData* d) { return d->nefc; }
int fs_contact_count(const mjData* d) { return d->ncon; }
void fs_contact_geoms(const mjData* d, int contact, int* geom1, int* geom2) {
  *geom1 = d->contact[contact].geom1;
  *geom2 = d->contact[contact].geom2;
}

static const int fs_warning_types[] = {
    mjWARN_INERTIA, mjWARN_CONTACTFULL, mjWARN_CNSTRFULL,
    mjWARN_BADQPOS, mjWARN_BADQVEL,     mjWARN_BADQACC,   mjWARN_BADCTRL,
};

// How often a warning was counted since the last reset. `kind` indexes fs_warning_types.
int fs_warning_count(const mjData* d, int kind) { return d->warning[fs_warning_types[kind]].number; }

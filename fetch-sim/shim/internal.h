// Declarations that the files of the shim share and Rust does not see.

#pragma once

#include <setjmp.h>

#include "fetch_shim.h"

#pragma GCC visibility push(hidden)

// ------------------------------------------------------- loader_dlopen.c or loader_windows.c

// Paths and names are in the system's encoding, and on Windows in UTF-8.

// Opens the library at a path for this crate alone; returns NULL, with the text of fs_error_text, if
// that fails.
void* fs_open(const char* path);

// Returns an opened library by its name, or NULL if the process has none. The caller closes it.
void* fs_find_opened(const char* name);

void fs_close(void* library);

// Looks up a symbol of a library; returns 0 if the library has none of this name.
int fs_symbol(void* library, const char* name, void* target);

// Returns a symbol of the whole process, or NULL if there is none.
void* fs_global_symbol(const char* name);

// Returns the path of the library at an address, or NULL if the system does not know it. Valid until
// the next call on the same thread, and as long as the library is open.
const char* fs_path_of(const void* address);

// Returns where the library at an address begins in memory, or NULL if no library is there.
const void* fs_base_of(const void* address);

// Keeps the library at an address, which may be the program itself, from ever being unloaded.
void fs_keep(const void* address);

// ---------------------------------------------------------------------- library.c: the functions

// MuJoCo's own bindings use these thread-local hooks, too, so that other users of MuJoCo in the
// process keep their handlers. They are exported since 2.2, but declared in no public header.
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

#ifdef mjMAXVFS  // until 3.1: a table of fixed size, filled in by the user
#define FS_VFS_FUNCTIONS(X) X(mj_makeEmptyFileVFS) X(mj_findFileVFS)
#else
#define FS_VFS_FUNCTIONS(X) X(mj_addBufferVFS)
#endif

#define FS_FUNCTIONS(X)                                                                            \
  FS_VFS_FUNCTIONS(X)                                                                              \
  X(mj_version) X(mj_defaultVFS) X(mj_deleteVFS) X(mj_loadXML) X(mj_copyModel) X(mj_deleteModel) X(mj_makeData)    \
  X(mj_deleteData) X(mj_resetData) X(mj_step) X(mj_forward) X(mj_jacSite) X(mj_jacBody)            \
  X(mj_name2id) X(mj_id2name) X(mj_kinematics) X(mj_comPos) X(mj_camlight) X(mju_malloc) X(mju_free)             \
  X(mjv_defaultCamera) X(mjv_defaultOption) X(mjv_defaultPerturb) X(mjv_defaultScene)              \
  X(mjv_makeScene) X(mjv_freeScene) X(mjv_updateScene) X(mjv_initGeom) X(mjr_defaultContext) X(mjr_makeContext)    \
  X(mjr_freeContext) X(mjr_setBuffer) X(mjr_render) X(mjr_readPixels)

// MuJoCo's functions. Any of them may call mju_error, which ends the process unless its handler jumps
// away: so only a guarded statement reaches them.
typedef struct {
#define X(name) __typeof__(&name) name;
  FS_FUNCTIONS(X)
#undef X
#define X(result, field, arguments, name) result (*field) arguments;
  FS_HOOKS(X)
#undef X
} fs_functions;

// ----------------------------------------------------------- library.c: errors and warnings

#if mjVERSION_HEADER >= 3010000
typedef mjfLogHandler fs_handlers;
#else
typedef struct {
  fs_handler error, warning;
} fs_handlers;
#endif

// Sets the text of fs_error_text and returns FS_FAILED.
__attribute__((format(printf, 1, 2))) fs_status fs_fail(const char* format, ...);

// Do the work of MuJoCo's handlers; a guarded statement may call them, too. fs_on_error does not
// return.
__attribute__((noreturn)) void fs_on_error(const char* message);
void fs_on_warning(const char* message);

// The filter and the handlers that a guarded statement replaces.
typedef struct {
  fs_filter* filter;
  fs_handlers handlers;
} fs_outer;
const fs_functions* fs_enter(fs_outer* outer, fs_filter* filter);
fs_status fs_leave(const fs_outer* outer, fs_status status);
void fs_clear_texts(void);
extern _Thread_local jmp_buf fs_after_error;

// Saves where to jump back to. Windows would unwind the frames in between, and call their handlers: a
// jump without a frame does not, as elsewhere.
#ifdef __MINGW32__
#define FS_SETJMP(buffer) _setjmp(buffer, NULL)
#else
#define FS_SETJMP(buffer) setjmp(buffer)
#endif

// Runs a statement, which calls MuJoCo's functions through `mj`, with this thread's handlers and a
// contact filter (or NULL) in place, and sets `status`. mju_error must not return, so its handler jumps
// back to here; only frames of MuJoCo, and of the filter between them, lie in between. The statement
// must not hold anything that a failure would have to release, must not change a local variable of its
// function, and must not contain another guarded statement.
#define FS_TRY(status, filter, statement)                                                          \
  do {                                                                                             \
    fs_outer outer;                                                                                \
    const fs_functions* const mj = fs_enter(&outer, filter);                                       \
    if (FS_SETJMP(fs_after_error)) {                                                                  \
      status = fs_leave(&outer, FS_FAILED);                                                        \
    } else {                                                                                       \
      statement;                                                                                   \
      status = fs_leave(&outer, FS_OK);                                                            \
    }                                                                                              \
  } while (0)

// The body of a function that returns the status of a guarded statement.
#define FS_GUARDED(filter, statement)                                                              \
  do {                                                                                             \
    fs_status status;                                                                              \
    fs_clear_texts();                                                                              \
    FS_TRY(status, filter, statement);                                                             \
    return status;                                                                                 \
  } while (0)

// A guarded statement that releases something. MuJoCo's objections are dropped, because nobody
// could act on them.
#define FS_RELEASE(statement)                                                                      \
  do {                                                                                             \
    fs_status ignored;                                                                             \
    FS_TRY(ignored, NULL, statement);                                                              \
    (void)ignored;                                                                                 \
  } while (0)

// ------------------------------------------------------------------------------ contact_filter.c

// Installs the filter in front of a library's collision routines, once.
void fs_install_filter(void* library);

// Makes a filter (or NULL for none) active on this thread; returns the one that was active before.
fs_filter* fs_use_filter(fs_filter* filter);

// ---------------------------------------------------------------- gl_context.c or gl_missing.c

// A desktop OpenGL context (compatibility profile) without a surface, so that drawing needs a
// framebuffer object. It is current only between entering and leaving it, so that any thread may do
// so. One context of the process is entered at a time: others wait.
typedef struct fs_gl fs_gl;

// The caller's own context, which is current before and after.
typedef struct {
  const struct fs_gl_library* library;  // NULL if there is none
  void *context, *display, *draw, *read;  // OSMesa: `draw` is the color buffer
  unsigned type;                          // EGL: the context's API; OSMesa: the type of its elements
  int width, height;                      // only OSMesa
  unsigned egl_api;                       // the thread's, which is restored with any context
} fs_gl_outer;

// Makes a context and enters it; returns NULL, with the text of fs_error_text, if there is no
// OpenGL.
fs_gl* fs_gl_make(fs_gl_outer* outer);

// Waits until no context is entered, and makes this one current on this thread.
fs_status fs_gl_enter(fs_gl* gl, fs_gl_outer* outer);

// Restores the context that was current before.
void fs_gl_leave(const fs_gl_outer* outer);

// Deletes a context that has been left.
void fs_gl_delete(fs_gl* gl);

#pragma GCC visibility pop

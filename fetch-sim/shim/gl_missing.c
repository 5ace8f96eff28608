// For systems without EGL and OSMesa: every renderer is refused.

#include "internal.h"

fs_gl* fs_gl_make(fs_gl_outer* outer) {
  (void)outer;
  fs_fail("this system has no EGL, which draws without a window");
  return NULL;
}

// There is no context to pass to these.

fs_status fs_gl_enter(fs_gl* gl, fs_gl_outer* outer) {
  (void)gl;
  (void)outer;
  return FS_FAILED;
}

void fs_gl_leave(const fs_gl_outer* outer) { (void)outer; }

void fs_gl_delete(fs_gl* gl) { (void)gl; }

const char* fs_gl_backend(void) { return NULL; }

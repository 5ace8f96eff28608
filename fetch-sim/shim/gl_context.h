// OpenGL without a window, from libraries that are loaded at run time.

#ifndef GL_CONTEXT_H
#define GL_CONTEXT_H

// A desktop OpenGL context (compatibility profile) without a surface: whoever draws brings a
// framebuffer object. It belongs to the thread that made it.
typedef struct fs_gl fs_gl;

// Makes a context and makes it current; NULL with the text of fs_error_text if there is no OpenGL.
fs_gl* fs_gl_make(void);

// Makes the context current on this thread, whatever was current before. FS_OK or FS_FAILED.
int fs_gl_make_current(fs_gl* gl);

// Leaves no context current, and deletes this one.
void fs_gl_delete(fs_gl* gl);

// The name of the library that was chosen for the process, or NULL if none has been.
const char* fs_gl_backend(void);

#endif

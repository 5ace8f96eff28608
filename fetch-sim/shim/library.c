// Loads MuJoCo's library at run time, describes the contract, and turns what MuJoCo reports during a
// guarded statement into a status and a text.

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "internal.h"

// --------------------------------------------------------------------------------------- loading

static fs_functions functions;
static void* loaded;

int fs_contract(int index, const char** name, long long* value, size_t* size) {
  static const struct {
    const char* name;
    long long value;
    size_t size;
  } items[] = {
#define NUMBER(number, ...) {#number, number, sizeof(int)},
#define FIELD(s, type, field, ...) {#s "." #field, offsetof(s, field), sizeof((s*)0)->field},
#define STRUCT(s, FIELDS) {#s, 0, sizeof(s)}, FIELDS(FIELD, s)
      FS_NUMBERS(NUMBER) FS_STRUCTS(STRUCT)
  };
  if (index < 0 || (size_t)index >= sizeof items / sizeof *items) return 0;
  *name = items[index].name;
  *value = items[index].value;
  *size = items[index].size;
  return 1;
}

int fs_header_version(void) { return mjVERSION_HEADER; }

// Finds all functions in a library of the headers' version.
static fs_status find_functions(void* library, fs_functions* found, int* version) {
  if (!fs_symbol(library, "mj_version", &found->mj_version)) return fs_fail("it has no function mj_version");
  *version = found->mj_version();
  if (*version != mjVERSION_HEADER) return fs_fail("the versions differ");
#define X(name) if (!fs_symbol(library, #name, &found->name)) return fs_fail("it has no function " #name);
  FS_FUNCTIONS(X)
#undef X
#define X(result, field, arguments, name)                                                          \
  if (!fs_symbol(library, name, &found->field)) return fs_fail("it has no function " name);
  FS_HOOKS(X)
#undef X
  return FS_OK;
}

const char* fs_global_library_path(void) { return fs_path_of(fs_global_symbol("mj_version")); }

const char* fs_others_library_path(const char* name) {
  void* there = fs_find_opened(name);
  if (!there) return NULL;
  void* symbol;
  const char* path = fs_symbol(there, "mj_version", &symbol) ? fs_path_of(symbol) : NULL;
  fs_close(there);
  return path;
}

fs_status fs_load(const char* path, int* version) {
  *version = 0;
  void* library = fs_open(path);
  if (!library) return FS_FAILED;
  fs_functions found = {0};
  if (find_functions(library, &found, version) != FS_OK) {
    // If it stayed, the system would return it for its name, whatever its version.
    fs_close(library);
    return FS_FAILED;
  }
  functions = found;
  loaded = library;
  fs_install_filter(library);
  return FS_OK;
}

const char* fs_library_path(void) {
  void* address;
  memcpy(&address, &functions.mj_version, sizeof address);
  return fs_path_of(address);
}

// ---------------------------------------------------------------------------- errors and warnings

enum { TEXT_SIZE = 1024 };

_Thread_local jmp_buf fs_after_error;
static _Thread_local char error_text[TEXT_SIZE];
static _Thread_local char warning_text[TEXT_SIZE];

const char* fs_error_text(void) { return error_text; }
const char* fs_warning_text(void) { return warning_text; }

fs_status fs_fail(const char* format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(error_text, sizeof error_text, format, arguments);
  va_end(arguments);
  return FS_FAILED;
}

void fs_on_error(const char* message) {
  fs_fail("%s", message);
  longjmp(fs_after_error, 1);
}

void fs_on_warning(const char* message) {
  const size_t used = strlen(warning_text), room = sizeof warning_text - used;
  const int length = snprintf(warning_text + used, room, "%s%s", used ? "; " : "", message);
  if (length >= (int)room) strcpy(warning_text + sizeof warning_text - 4, "...");
}

// Set while a plugin is opened: jumping out of the loader would leave its locks held, and MuJoCo may go on
// after refusing a plugin.
static _Thread_local int opening_plugin;

static void on_error(const char* message) {
  if (!opening_plugin) fs_on_error(message);
  fs_fail("%s", message);
}

#if mjVERSION_HEADER >= 3010000
static void on_message(const mjLogMessage* message) {
  if (message->level == mjLOG_ERROR) on_error(message->subject);
  if (message->level == mjLOG_WARNING) fs_on_warning(message->subject);
}

static const fs_handlers our_handlers = on_message;

static fs_handlers exchange_handlers(fs_handlers handlers) {
  return functions.exchange_handler(handlers);
}
#else
static const fs_handlers our_handlers = {on_error, fs_on_warning};

static fs_handlers exchange_handlers(fs_handlers handlers) {
  const fs_handlers before = {functions.get_error_handler(), functions.get_warning_handler()};
  functions.set_error_handler(handlers.error);
  functions.set_warning_handler(handlers.warning);
  return before;
}
#endif

void fs_clear_texts(void) { error_text[0] = warning_text[0] = '\0'; }

const fs_functions* fs_enter(fs_outer* outer, fs_filter* filter) {
  outer->filter = fs_use_filter(filter);
  outer->handlers = exchange_handlers(our_handlers);
  return &functions;
}

fs_status fs_leave(const fs_outer* outer, fs_status status) {
  fs_use_filter(outer->filter);
  exchange_handlers(outer->handlers);
  return status | (warning_text[0] ? FS_WARNED : FS_OK);
}

// --------------------------------------------------------------------------------------- plugins

fs_status fs_load_plugin(const char* path, const char* library_name) {
  fs_clear_texts();
  // A plugin registers itself with the library that the system has under this name.
  void* theirs = fs_find_opened(library_name);
  if (theirs) fs_close(theirs);
  if (theirs != loaded) {
    return fs_fail("it would go to another copy of %s in this process: set MUJOCO_DIR to that copy", library_name);
  }
  fs_outer outer;
  fs_enter(&outer, NULL);
  opening_plugin = 1;
  const void* plugin = fs_open(path);
  opening_plugin = 0;
  const fs_status status = fs_leave(&outer, FS_OK);
  if (!plugin) return FS_FAILED;
  return error_text[0] ? status | FS_FAILED : status;
}

// Simulations: an mjData's life, its steps, and access to its contents.

#include "internal.h"

// ------------------------------------------------------------------------------- life and stepping

fs_status fs_make_data(const mjModel* m, mjData** data) {
  *data = NULL;
  FS_GUARDED(NULL, {
    *data = mj->mj_makeData(m);
    if (!*data) fs_on_error("no memory for the simulation's data");
  });
}

void fs_delete_data(mjData* d) { FS_RELEASE(mj->mj_deleteData(d)); }

fs_status fs_reset(const mjModel* m, mjData* d) { FS_GUARDED(NULL, mj->mj_resetData(m, d)); }

fs_status fs_forward(const mjModel* m, mjData* d, fs_filter* filter) {
  FS_GUARDED(filter, mj->mj_forward(m, d));
}

fs_status fs_step(const mjModel* m, mjData* d, fs_filter* filter, int count) {
  FS_GUARDED(filter, for (int i = 0; i < count; i++) mj->mj_step(m, d));
}

// ------------------------------------------------------------------------------------------ access

fs_status fs_site_jacobian(const mjModel* m, const mjData* d, int site, double* translation,
                           double* rotation) {
  FS_GUARDED(NULL, mj->mj_jacSite(m, d, translation, rotation, site));
}

fs_status fs_body_jacobian(const mjModel* m, const mjData* d, int body, double* translation,
                           double* rotation) {
  FS_GUARDED(NULL, mj->mj_jacBody(m, d, translation, rotation, body));
}

double fs_time(const mjData* d) { return d->time; }
void fs_set_time(mjData* d, double time) { d->time = time; }

void fs_data_arrays(const mjModel* m, const mjData* d, fs_array arrays[FS_NUM_DATA_ARRAYS]) {
#define X(number, field, length) arrays[number] = (fs_array){d->field, (size_t)(length)};
  FS_DATA_ARRAYS(X)
#undef X
}

int fs_contact_count(const mjData* d) { return d->ncon; }
void fs_contact_geoms(const mjData* d, int contact, int geoms[2]) {
  geoms[0] = d->contact[contact].geom1;
  geoms[1] = d->contact[contact].geom2;
}

int fs_fault_count(const mjData* d, int fault) {
#define MUJOCO_NUMBER(number, mujoco_number) mujoco_number,
  static const int warnings[] = {FS_FAULTS(MUJOCO_NUMBER)};
  return d->warning[warnings[fault]].number;
}
